//! What the CPU path is made of: the twins of every stage on all cores, bricks by tasks.

use super::{ExtractError, Options, STAGES, Source, check, stage_index as at};
use crate::field::differences::Normals;
use crate::field::{Field, NoForm, Sense};
use crate::mesh::{Mesh, Vertex};
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::classify;
use crate::stage::cull::bounds::BlockFields;
use crate::stage::emit::cpu::{
    Beside, EdgeNumbers, Gradients, Nearby, NormalsOf, emit_indices, emit_vertices, ends,
};
use crate::stage::inside::Inside;
use crate::stage::normals::cpu::{add_neighbours, average};
use crate::stage::params::Params;
use crate::stage::sample::row::Sampler;
use crate::stage::samples::Samples;
use crate::stage::scan::cpu::scan;
use crate::volume::Volume;
use bytemuck::Zeroable;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// Bricks that one task takes.
pub(crate) const TASK: usize = 32;

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
    pub(crate) held_bytes: usize,
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
    pub(crate) fn budget(&self, what: &'static str, bytes: usize) -> Result<(), ExtractError> {
        let (needed, budget) = ((self.held_bytes + bytes) as u64, self.memory_budget);
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
            let samples = self.samples(&bricks[i..], &mut sampler)?;
            look(brick, &samples);
            let mut record = BrickRecord::zeroed();
            let count = self.classify_brick(&samples, &mut record);
            if matches!(self.source, Source::Field(..)) {
                kept.non_finite += samples.owned_non_finite();
            }
            if count != [0; 2] {
                kept.bricks.push(brick);
                kept.records.push(record);
                kept.counts.push(count);
                kept.first_inside.push(self.inside.test(samples.at(0, 0, 0)));
            }
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
            self.budget(RECORDS, all * KEPT_BYTES)?;
            done.add(bricks.len());
            Ok(kept)
        });
        let classified: Vec<Kept> = classified.collect::<Result<_, ExtractError>>()?;
        // From here on only bricks with surface have a slot: what they are costs nothing.
        kept.reserve(found.into_inner());
        for mut task in classified {
            kept.append(&mut task);
        }
        Ok(())
    }

    /// Classifies the bricks in `kept`, those of a volume: nearly all of them have surface, so that their records are made where
    /// they are to stay.
    pub(super) fn classify_in_place(
        &self,
        kept: &mut Kept,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<(), ExtractError> {
        let count = kept.bricks.len();
        if self.budget(RECORDS, count * KEPT_BYTES).is_err() {
            // Bricks with NaN may be many, and have no surface.
            let active = std::mem::take(&mut kept.bricks);
            return self.classify_all(&active, kept, progress);
        }
        let done = Progress::new(progress, count);
        resize(&mut kept.records, count);
        kept.counts.resize(count, [0; 2]);
        // Volumes' samples are all at hand; nobody asks.
        kept.first_inside.resize(count, false);
        let records = kept.records.par_chunks_mut(TASK).zip(kept.counts.par_chunks_mut(TASK));
        kept.bricks.par_chunks(TASK).zip(records).try_for_each_init(
            Sampler::default,
            |sampler, (bricks, (records, counts))| {
                for ((brick, record), count) in bricks.iter().zip(records).zip(counts) {
                    let samples = self.samples(std::slice::from_ref(brick), sampler)?;
                    *count = self.classify_brick(&samples, record);
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
        let mesh_bytes = vertices * size_of::<Vertex>() + triangles * 12;
        let peak_bytes = kept.bricks.len() * KEPT_BYTES + mesh_bytes;
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
        Ok((self.held_bytes + peak_bytes) as u64)
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
        (vertices, triangles): (&mut [Vertex], &mut [[u32; 3]]),
    ) -> Result<bool, NoForm> {
        let Kept { bricks, records, counts, first_inside, .. } = kept;
        let Scratch { sampler, numbers, nearby } = scratch;
        let (params, inside, brick) = (&self.params, self.inside, bricks[slot]);
        let beside = Beside::new(nearby, bricks, records, counts, slot);
        let samples = match self.source {
            Source::Volume(volume) => Samples::of_source(volume.values(), params, params.brick_origin(brick)),
            Source::Field(whole, _) => {
                let here = self.fields.field_in(params, brick, whole);
                let most = sampler.most_points(params, here, brick);
                let few = |points: &[u16; 81]| {
                    points.iter().map(|row| row.count_ones() as usize).sum::<usize>() <= most
                };
                let points =
                    (most > 0).then(|| ends(params.method, params.extent(brick), &records[slot], &beside));
                match points.flatten().filter(few) {
                    Some(points) => sampler.some(params, here, brick, &points, first_inside[slot])?,
                    None => sampler.brick(params, here, brick, || self.row_of(whole, next))?,
                }
            }
        };
        let here = (params.brick_origin(brick), &samples);
        let end = counts[slot + 1][0];
        emit_indices(params, inside, here, &beside, numbers, end, triangles);
        let normals = match self.source {
            Source::Field(whole, _) => {
                let here = self.fields.field_in(params, brick, whole);
                NormalsOf::Field(Gradients { normals: self.normals, here, whole })
            }
            Source::Volume(volume) => NormalsOf::Volume(volume.values()),
        };
        emit_vertices(params, inside, normals, here, &records[slot], vertices)
    }

    /// The samples of the first of `bricks`: where they lie in a volume, or evaluated.
    #[inline(always)]
    fn samples<'s>(&'s self, bricks: &[u32], sampler: &'s mut Sampler) -> Result<Samples<'s>, NoForm> {
        let (params, brick) = (&self.params, bricks[0]);
        match self.source {
            Source::Volume(volume) => {
                Ok(Samples::of_source(volume.values(), params, params.brick_origin(brick)))
            }
            Source::Field(whole, _) => {
                let field = self.fields.field_in(params, brick, whole);
                sampler.brick(params, field, brick, || self.row_of(whole, bricks))
            }
        }
    }

    /// How many of `bricks`, from the first on, follow each other along x and have the same field.
    fn row_of(&self, whole: &dyn Field, bricks: &[u32]) -> u32 {
        let field =
            |brick: u32| std::ptr::from_ref(self.fields.field_in(&self.params, brick, whole)).cast::<()>();
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
    numbers: EdgeNumbers,
    nearby: Nearby,
}

impl Scratch {
    /// For the bricks from slot `first` on.
    pub(crate) fn new(params: &Params, kept: &Kept, first: usize) -> Self {
        let nearby = Nearby::new(params, &kept.bricks, first);
        Self { sampler: Sampler::default(), numbers: EdgeNumbers::new(), nearby }
    }

    /// Goes on with the bricks from slot `first` on.
    fn begin(&mut self, params: &Params, kept: &Kept, first: usize) {
        self.nearby = Nearby::new(params, &kept.bricks, first);
    }
}

/// Bytes of a brick in [`Kept`].
pub(crate) const KEPT_BYTES: usize = size_of::<BrickRecord>() + 8 + 4 + 1;

/// Gives a vector a length, and new memory only where that is more than it had: zeroed pages, which cost nothing until they
/// are written.
fn resize<T: bytemuck::Zeroable + Copy>(items: &mut Vec<T>, length: usize) {
    if length > items.capacity() {
        // The old memory first: both together may be too much.
        *items = Vec::new();
        *items = bytemuck::zeroed_vec(length);
    } else {
        items.resize(length, T::zeroed());
    }
}

/// The bricks that hold surface, with what classify says of them.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    pub(crate) bricks: Vec<u32>,
    pub(crate) records: Vec<BrickRecord>,
    /// Vertices and triangles of each; once emitted, those before it, and the totals behind the last.
    pub(crate) counts: Vec<[u32; 2]>,
    /// Whether the first point of each is inside, where the source is a field.
    pub(crate) first_inside: Vec<bool>,
    /// NaN and infinite samples of a field, of bricks without surface too.
    pub(crate) non_finite: u64,
}

impl Kept {
    pub(super) fn clear(&mut self) {
        self.bricks.clear();
        self.records.clear();
        self.counts.clear();
        self.first_inside.clear();
        self.non_finite = 0;
    }

    /// Drops the bricks without triangles and vertices.
    fn drop_empty(&mut self) {
        let mut to = 0;
        for from in 0..self.counts.len() {
            if self.counts[from] != [0; 2] {
                if to < from {
                    (self.bricks[to], self.records[to], self.counts[to]) =
                        (self.bricks[from], self.records[from], self.counts[from]);
                    self.first_inside[to] = self.first_inside[from];
                }
                to += 1;
            }
        }
        self.bricks.truncate(to);
        self.records.truncate(to);
        self.counts.truncate(to);
        self.first_inside.truncate(to);
    }

    /// Vertices and triangles of all bricks.
    pub(crate) fn totals(&self) -> Result<[usize; 2], ExtractError> {
        let add = |t: [u64; 2], c: &[u32; 2]| [t[0] + u64::from(c[0]), t[1] + u64::from(c[1])];
        let [vertices, triangles] = self.counts.iter().fold([0; 2], add);
        if vertices > u64::from(u32::MAX) || 3 * triangles > u64::from(u32::MAX) {
            return Err(ExtractError::TooLarge { vertices, triangles });
        }
        Ok([vertices as usize, triangles as usize])
    }

    /// From counts to offsets.
    pub(crate) fn scan(&mut self) {
        self.counts.push([0; 2]);
        scan(&mut self.counts);
    }

    /// Vertices and triangles of a slot, once there are offsets.
    #[inline(always)]
    pub(crate) fn own(&self, slot: usize) -> [Range<usize>; 2] {
        [0, 1].map(|i| self.counts[slot][i] as usize..self.counts[slot + 1][i] as usize)
    }

    /// The room for a slot's vertices and triangles, off the front of what is left.
    #[inline(always)]
    pub(crate) fn take_own<'a>(
        &self,
        slot: usize,
        vertices: &mut &'a mut [Vertex],
        triangles: &mut &'a mut [[u32; 3]],
    ) -> (&'a mut [Vertex], &'a mut [[u32; 3]]) {
        let [own_vertices, own_triangles] = self.own(slot).map(|own| own.len());
        let (first_vertices, rest) = std::mem::take(vertices).split_at_mut(own_vertices);
        *vertices = rest;
        let (first_triangles, rest) = std::mem::take(triangles).split_at_mut(own_triangles);
        *triangles = rest;
        (first_vertices, first_triangles)
    }

    pub(crate) fn reserve(&mut self, bricks: usize) {
        self.bricks.reserve_exact(bricks);
        self.records.reserve_exact(bricks);
        self.counts.reserve_exact(bricks + 1);
        self.first_inside.reserve_exact(bricks);
    }

    /// A copy of the bricks from slot `first` on, with `less` taken off their numbers.
    pub(super) fn tail(&self, first: usize, less: u32) -> Self {
        Self {
            bricks: self.bricks[first..].iter().map(|brick| brick - less).collect(),
            records: self.records[first..].to_vec(),
            counts: self.counts[first..].to_vec(),
            first_inside: self.first_inside[first..].to_vec(),
            non_finite: 0,
        }
    }

    pub(crate) fn append(&mut self, other: &mut Self) {
        self.bricks.append(&mut other.bricks);
        self.records.append(&mut other.records);
        self.counts.append(&mut other.counts);
        self.first_inside.append(&mut other.first_inside);
        self.non_finite += other.non_finite;
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

/// A run of slots and the part of the mesh that is theirs.
pub(crate) struct Task<'a> {
    pub(crate) slots: Range<usize>,
    pub(crate) vertices: &'a mut [Vertex],
    pub(crate) triangles: &'a mut [[u32; 3]],
}

pub(crate) fn tasks<'a>(
    offsets: &[[u32; 2]],
    slots: Range<usize>,
    mut vertices: &'a mut [Vertex],
    mut triangles: &'a mut [[u32; 3]],
) -> Vec<Task<'a>> {
    let mut tasks = Vec::with_capacity(slots.len().div_ceil(TASK));
    for first in slots.clone().step_by(TASK) {
        let end = (first + TASK).min(slots.end);
        let size = [0, 1].map(|i| (offsets[end][i] - offsets[first][i]) as usize);
        let (own_vertices, own_triangles);
        (own_vertices, vertices) = vertices.split_at_mut(size[0]);
        (own_triangles, triangles) = triangles.split_at_mut(size[1]);
        tasks.push(Task { slots: first..end, vertices: own_vertices, triangles: own_triangles });
    }
    tasks
}
