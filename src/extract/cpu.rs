//! What the CPU path is made of: the twins of every stage on all cores, bricks by tasks.

use super::kept::{KEPT_BYTES, Kept, TASK, Task, mesh_bytes, resize, tasks};
use super::{ExtractError, Options, STAGES, Source, check, stage_index as at};
use crate::field::differences::Normals;
use crate::field::{Field, NoForm, Sense};
use crate::mesh::{Mesh, Vertex};
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::classify;
use crate::stage::cull::bounds::{BlockFields, FieldIn};
use crate::stage::cull::cpu::{range_and, straddles};
use crate::stage::emit::cpu::{Beside, Gradients, Nearby, NormalsOf, Work, count, emit, ends};
use crate::stage::inside::Inside;
use crate::stage::normals::cpu::{add_neighbours, average};
use crate::stage::params::Params;
use crate::stage::sample::row::Sampler;
use crate::stage::samples::Samples;
use crate::volume::{BrickRanges, Values, Volume};
use bytemuck::Zeroable;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// What [`Kept`] is called where it does not fit.
pub(crate) const RECORDS: &str = "the records of the bricks with surface";
/// What they are called together.
pub(crate) const MESH: &str = "the mesh with its records";
/// What the lists of bricks are called.
pub(crate) const BRICKS: &str = "the table of the grid's bricks";

/// What every part of a run on the CPU reads.
pub(crate) struct Job<'a> {
    pub(crate) source: Source<'a>,
    pub(crate) params: Params,
    pub(crate) inside: Inside,
    normals: Normals,
    memory_budget: u64,
    /// Bytes that the caller holds beside the records and the mesh.
    pub(crate) held_bytes: u64,
    /// The pruned fields of blocks, those of them that have one.
    pub(crate) fields: BlockFields,
}

impl<'a> Job<'a> {
    /// A run over the whole grid of `source`.
    pub(crate) fn new(source: &Source<'a>, options: &Options) -> Result<Self, ExtractError> {
        check(source, options)?;
        let sense = options.sense.unwrap_or(source.sense());
        Ok(Self {
            source: *source,
            params: Params::new(source.grid(), options.iso, sense)
                .with_normals(options.normals)
                .with_method(options.method, options.placement),
            inside: Inside::new(options.iso, sense),
            normals: options.normals,
            memory_budget: options.memory_budget,
            held_bytes: 0,
            fields: BlockFields::default(),
        })
    }

    /// A run over a part of a volume, which `window` holds and `params` name.
    pub(super) fn in_window(window: &'a Volume, options: &Options, params: Params) -> Self {
        let sense = options.sense.unwrap_or(Sense::Above);
        Self {
            source: Source::Volume(window),
            params,
            inside: Inside::new(options.iso, sense),
            normals: options.normals,
            memory_budget: options.memory_budget,
            held_bytes: 0,
            fields: BlockFields::default(),
        }
    }

    /// Whether so many bytes fit beside those that are held.
    pub(crate) fn budget(&self, what: &'static str, bytes: u64) -> Result<(), ExtractError> {
        let (needed, budget) = (self.held_bytes + bytes, self.memory_budget);
        if needed > budget { Err(ExtractError::Budget { what, needed, budget }) } else { Ok(()) }
    }

    #[inline(always)]
    fn classify_brick(&self, samples: &Samples<'_>, record: &mut BrickRecord) -> [u32; 2] {
        classify(&self.params, self.inside, samples, record)
    }

    /// Samples and classifies bricks, and keeps those with surface. `look` sees the samples of each.
    pub(crate) fn classify(
        &self,
        bricks: &[u32],
        mut look: impl FnMut(u32, &Samples<'_>),
    ) -> Result<Kept, NoForm> {
        let mut sampler = Sampler::default();
        let mut kept = Kept::default();
        for (i, &brick) in bricks.iter().enumerate() {
            let samples = self.samples(&bricks[i..], self.field_in(brick).as_ref(), &mut sampler)?;
            look(brick, &samples);
            let mut record = BrickRecord::zeroed();
            let count = self.classify_brick(&samples, &mut record);
            if matches!(self.source, Source::Field(..)) {
                kept.non_finite += samples.owned_non_finite();
            }
            kept.push(brick, &record, count, self.inside.test(samples.at(0, 0, 0)));
        }
        Ok(kept)
    }

    /// Samples and classifies bricks, those of a field: many may turn out to have no surface, and get no record.
    pub(super) fn classify_all(
        &self,
        active: &[u32],
        kept: &mut Kept,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<(), ExtractError> {
        let done = Progress::new(progress, active.len());
        let found = AtomicUsize::new(0);
        let classified = active.par_chunks(TASK).map(|bricks| {
            let kept = self.classify(bricks, |_, _| {})?;
            let all = found.fetch_add(kept.bricks.len(), Ordering::Relaxed) + kept.bricks.len();
            self.budget(RECORDS, 2 * all as u64 * KEPT_BYTES)?;
            done.add(bricks.len());
            Ok(kept)
        });
        let classified: Vec<Kept> = classified.collect::<Result<_, ExtractError>>()?;
        // From here on only bricks with surface have a slot: what they are costs nothing.
        kept.gather(found.into_inner(), classified);
        Ok(())
    }

    /// Makes the table of ranges of a volume, and classifies its bricks meanwhile, while their samples are at hand. Tells how many of them
    /// were active; `None` where the records do not fit twice, as they are gathered: nothing is classified then.
    pub(super) fn classify_fresh(
        &self,
        values: &Values,
        kept: &mut Kept,
        progress: &(dyn Fn(f64) + Sync),
    ) -> (BrickRanges, Option<usize>) {
        let done = Progress::new(progress, self.params.slab_bricks as usize);
        let active = AtomicUsize::new(0);
        let fits = |bricks: usize| self.budget(RECORDS, 2 * bricks as u64 * KEPT_BYTES).is_ok();
        let (ranges, odd, parts) = range_and(&self.params, values, |kept: &mut Kept, first, ranges| {
            let straddles = |range: &&[u32; 2]| straddles(&self.params, **range);
            let here = ranges.iter().filter(straddles).count();
            if !fits(here + active.fetch_add(here, Ordering::Relaxed)) {
                return;
            }
            kept.reserve(here);
            for (brick, _) in (first..).zip(ranges).filter(|(_, range)| straddles(range)) {
                let samples = Samples::of_source(values, &self.params, self.params.brick_origin(brick));
                let mut record = BrickRecord::zeroed();
                let count = self.classify_brick(&samples, &mut record);
                kept.push(brick, &record, count, self.inside.test(samples.at(0, 0, 0)));
            }
            done.add(ranges.len());
        });
        let active = active.into_inner();
        if !fits(active) {
            return ((ranges, odd), None);
        }
        kept.gather(parts.iter().map(|part| part.bricks.len()).sum(), parts);
        ((ranges, odd), Some(active))
    }

    /// Classifies the bricks in `kept`, those of a volume: nearly all of them have surface, so that their records are made where
    /// they are to stay.
    pub(super) fn classify_in_place(
        &self,
        kept: &mut Kept,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<(), ExtractError> {
        let count = kept.bricks.len();
        if self.budget(RECORDS, count as u64 * KEPT_BYTES).is_err() {
            // Bricks with NaN may be many, and have no surface.
            let active = std::mem::take(&mut kept.bricks);
            return self.classify_all(&active, kept, progress);
        }
        let done = Progress::new(progress, count);
        resize(&mut kept.records, count);
        kept.counts.resize(count, [0; 2]);
        kept.first_inside.resize(count, false);
        let counts = kept.counts.par_chunks_mut(TASK).zip(kept.first_inside.par_chunks_mut(TASK));
        let results = kept.records.par_chunks_mut(TASK).zip(counts);
        kept.bricks.par_chunks(TASK).zip(results).try_for_each_init(
            Sampler::default,
            |sampler, (bricks, (records, (counts, first_inside)))| {
                for (i, record) in records.iter_mut().enumerate() {
                    let next = &bricks[i..];
                    self.load_ahead(next);
                    let samples = self.samples(next, None, sampler)?;
                    counts[i] = self.classify_brick(&samples, record);
                    first_inside[i] = self.inside.test(samples.at(0, 0, 0));
                }
                done.add(bricks.len());
                Ok::<(), NoForm>(())
            },
        )?;
        kept.drop_empty();
        Ok(())
    }

    /// As [`emit_into`](Self::emit_into), to a mesh of its own.
    pub(crate) fn emit(&self, kept: &mut Kept, clock: &mut Clock) -> Result<(Mesh, u64), ExtractError> {
        let mut mesh = Mesh::default();
        let peak_bytes = self.emit_into(kept, &mut mesh, clock)?;
        Ok((mesh, peak_bytes))
    }

    /// scan, emit and normals: the mesh of the bricks in `kept`, in order; returns the most bytes that were held at
    /// one time. The counts become offsets, the totals behind the last. Of each crossed edge of a brick's cells the owner must be
    /// among the bricks.
    pub(super) fn emit_into(
        &self,
        kept: &mut Kept,
        mesh: &mut Mesh,
        clock: &mut Clock,
    ) -> Result<u64, ExtractError> {
        let [vertices, triangles] = kept.totals()?;
        let peak_bytes = (kept.bytes() + mesh_bytes(vertices, triangles)).max(kept.gathered_bytes);
        self.budget(MESH, peak_bytes)?;
        kept.scan();
        clock.lap(at::SCAN);

        resize(&mut mesh.vertices, vertices);
        resize(&mut mesh.triangles, triangles);
        let slots = 0..kept.bricks.len();
        let is_marked = self.fill(kept, slots, &mut mesh.vertices, &mut mesh.triangles)?;
        clock.lap(at::EMIT);
        if is_marked {
            add_neighbours(&mut mesh.vertices, &mesh.triangles);
            average(&self.params, &mut mesh.vertices);
            clock.lap(at::NORMALS);
        }
        Ok(self.held_bytes + peak_bytes)
    }

    /// emit for some of the slots of `kept`, whose counts have become offsets, into vertices and triangles that are as many as
    /// theirs. Tells whether any vertex had to be marked for the normals stage.
    pub(crate) fn fill(
        &self,
        kept: &Kept,
        slots: Range<usize>,
        vertices: &mut [Vertex],
        triangles: &mut [[u32; 3]],
    ) -> Result<bool, NoForm> {
        let is_marked = AtomicBool::new(false);
        let fill = |scratch: &mut Scratch, task: Task<'_>| {
            scratch.begin(&self.params, kept, task.slots.start);
            let (mut vertices, mut triangles) = (task.vertices, task.triangles);
            let end = task.slots.end;
            for slot in task.slots {
                let own = kept.take_own(slot, &mut vertices, &mut triangles);
                if self.emit_brick(kept, slot, &kept.bricks[slot..end], scratch, own)? {
                    is_marked.store(true, Ordering::Relaxed);
                }
            }
            Ok(())
        };
        let tasks = tasks(&kept.counts, slots, vertices, triangles).into_par_iter();
        let begin = || Scratch::new(&self.params, kept, 0);
        tasks.try_for_each_init(begin, fill)?;
        Ok(is_marked.into_inner())
    }

    /// The vertices and triangles of the brick in a slot; `next` are the bricks that will be asked for, from this one on. Tells
    /// whether a vertex was marked for the normals stage.
    #[inline(always)]
    pub(crate) fn emit_brick(
        &self,
        kept: &Kept,
        slot: usize,
        next: &[u32],
        scratch: &mut Scratch,
        mesh: (&mut [Vertex], &mut [[u32; 3]]),
    ) -> Result<bool, NoForm> {
        let Kept { bricks, records, counts, first_inside, .. } = kept;
        let Scratch { sampler, work, nearby } = scratch;
        let (params, inside, brick) = (&self.params, self.inside, bricks[slot]);
        let beside = Beside::new(nearby, bricks, records, counts, first_inside[slot], slot);
        let field = self.field_in(brick);
        let samples = match &field {
            None => self.samples(next, None, sampler)?,
            Some(here) => {
                // How many points by themselves are less work than the brick.
                let most = sampler.most_points(params, here.get(), brick);
                let ends = || ends(params.method, params.extent(brick), &records[slot], &beside);
                let points = if most == 0 { None } else { ends() };
                match points.filter(|points| count(points) <= most) {
                    Some(points) => sampler.some(params, here.get(), brick, &points)?,
                    None => self.samples(next, Some(here), sampler)?,
                }
            }
        };
        let here = (params.brick_origin(brick), &samples);
        let normals = match self.source {
            Source::Field(whole, _) => {
                let here = field.as_ref().map_or(whole, FieldIn::get);
                NormalsOf::Field(Gradients { normals: self.normals, here, whole })
            }
            Source::Volume(volume) => NormalsOf::Volume(volume.values()),
        };
        emit(params, inside, normals, here, &beside, work, mesh)
    }

    /// The field in a brick, if the source is one.
    #[inline(always)]
    fn field_in(&self, brick: u32) -> Option<FieldIn<'_>> {
        match self.source {
            Source::Volume(_) => None,
            Source::Field(whole, _) => Some(self.fields.field_in(&self.params, brick, whole)),
        }
    }

    /// The samples of the first of `bricks`, in which the field is `here`: where they lie in a volume, or evaluated.
    #[inline(always)]
    fn samples<'s>(
        &'s self,
        bricks: &[u32],
        here: Option<&FieldIn<'_>>,
        sampler: &'s mut Sampler,
    ) -> Result<Samples<'s>, NoForm> {
        let (params, brick) = (&self.params, bricks[0]);
        match self.source {
            Source::Volume(volume) => {
                Ok(Samples::of_source(volume.values(), params, params.brick_origin(brick)))
            }
            Source::Field(whole, _) => {
                let here = here.map_or(whole, FieldIn::get);
                sampler.brick(params, here, brick, || self.row_of(whole, bricks))
            }
        }
    }

    /// Has the samples of the second of `bricks` on their way while the first is worked on, where they lie in a volume.
    #[inline(always)]
    fn load_ahead(&self, bricks: &[u32]) {
        if let (Source::Volume(volume), Some(&next)) = (self.source, bricks.get(1)) {
            let origin = self.params.brick_origin(next);
            Samples::of_source(volume.values(), &self.params, origin).load_ahead();
        }
    }

    /// How many of `bricks`, from the first on, follow each other along x and have the same field.
    fn row_of(&self, whole: &dyn Field, bricks: &[u32]) -> u32 {
        let of_block = |brick: u32| self.fields.of_block(&self.params, brick, whole);
        if self.fields.prunes_bricks(of_block(bricks[0])) {
            return 1;
        }
        let field = |brick: u32| std::ptr::from_ref(of_block(brick)).cast::<()>();
        let extent = self.params.slab_extent[0];
        let (first, row) = (field(bricks[0]), bricks[0] / extent);
        let follows = |(brick, at): &(&u32, u32)| {
            **brick == *at && at / extent == row && std::ptr::eq(field(*at), first)
        };
        bricks.iter().zip(bricks[0]..).take_while(follows).count() as u32
    }
}

/// What a task needs to emit bricks one after another.
pub(crate) struct Scratch {
    sampler: Sampler,
    work: Work,
    nearby: Nearby,
}

impl Scratch {
    /// For the bricks from slot `first` on.
    pub(crate) fn new(params: &Params, kept: &Kept, first: usize) -> Self {
        let nearby = Nearby::new(params, &kept.bricks, first);
        Self { sampler: Sampler::default(), work: Work::default(), nearby }
    }

    /// Goes on with the bricks from slot `first` on.
    fn begin(&mut self, params: &Params, kept: &Kept, first: usize) {
        self.nearby = Nearby::new(params, &kept.bricks, first);
    }
}
/// Measures the stages, each from the end of the one before.
pub(crate) struct Clock {
    since: Instant,
    pub(crate) seconds: [Option<f64>; STAGES.len()],
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self { since: Instant::now(), seconds: [None; STAGES.len()] }
    }

    pub(crate) fn lap(&mut self, stage: usize) {
        self.seconds[stage] = Some(self.since.elapsed().as_secs_f64());
        self.since = Instant::now();
    }
}

struct Progress<'a> {
    tell: &'a (dyn Fn(f64) + Sync),
    done: AtomicUsize,
    all: usize,
}

impl<'a> Progress<'a> {
    fn new(tell: &'a (dyn Fn(f64) + Sync), all: usize) -> Self {
        Self { tell, done: 0.into(), all }
    }

    fn add(&self, count: usize) {
        let done = self.done.fetch_add(count, Ordering::Relaxed) + count;
        (self.tell)(done as f64 / self.all as f64);
    }
}
