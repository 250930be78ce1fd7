//! The CPU path: the twins of every stage, end to end, on all cores.

use super::{ExtractError, Options, Report, STAGES, Source, check, stage_index as at};
use crate::field::{Field, NoForm};
use crate::mesh::{Mesh, Vertex};
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::classify;
use crate::stage::cull::bounds::{Culled, cull_field};
use crate::stage::cull::cpu::{NO_SLOT, compact, cull, range};
use crate::stage::emit::cpu::{
    Beside, EdgeNumbers, Gradients, emit_field_vertices, emit_indices, emit_volume_vertices,
};
use crate::stage::inside::Inside;
use crate::stage::normals::cpu::{add_neighbours, average};
use crate::stage::params::Params;
use crate::stage::sample::row::Sampler;
use crate::stage::samples::Samples;
use crate::stage::scan::cpu::scan;
use crate::table::MARCHING_CUBES;
use bytemuck::Zeroable;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// Bricks that one task takes.
const TASK: usize = 32;

/// Extracts the mesh by the CPU twins. `progress` hears how much of the work is done, from 0 to 1.
///
/// The mesh is the GPU's: same vertices in the same order, positions and normals equal where the GPU
/// rounds as IEEE 754 says.
///
/// # Errors
/// [`ExtractError::Iso`], [`ExtractError::Delta`], [`ExtractError::Budget`], [`ExtractError::TooLarge`],
/// [`ExtractError::TooManyBricks`], [`ExtractError::NoForm`].
pub fn extract_on_cpu(
    source: &Source<'_>,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, Report), ExtractError> {
    check(source, options)?;
    let sense = options.sense.unwrap_or(source.sense());
    let params = Params::new(source.grid(), options.iso, sense).with_normals(options.normals);
    let inside = Inside::new(options.iso, sense);
    let mut clock = Clock { since: Instant::now(), seconds: [None; STAGES.len()] };

    let bricks = params.slab_bricks as usize;
    let budget = |what, needed: usize| {
        let (needed, budget) = (needed as u64, options.memory_budget);
        if needed > budget { Err(ExtractError::Budget { what, needed, budget }) } else { Ok(()) }
    };
    let volume_bytes = if let Source::Volume(volume) = source { 4 * volume.values().len() } else { 0 };
    let brick_bytes = volume_bytes + bricks * (8 + 8 + 4);
    budget("the table of the grid's bricks", brick_bytes)?;

    let mut slots = vec![NO_SLOT; bricks];
    let mut non_finite = 0;
    let culled = match source {
        Source::Volume(volume) => {
            let (ranges, odd) = volume.ranges(|values| range(&params, values));
            non_finite = *odd;
            let mut marks = vec![[0; 2]; bricks + 1];
            cull(&params, ranges, &mut marks[..bricks]);
            scan(&mut marks);
            Culled { active: compact(&params, &marks, &mut slots), ..Culled::default() }
        }
        Source::Field(field, _) if options.cull => cull_field(&params, *field),
        Source::Field(..) => Culled { active: (0..bricks as u32).collect(), ..Culled::default() },
    };
    let active = &culled.active;
    clock.lap(at::CULL);

    let done = Progress::new(progress, active.len());
    let found = AtomicUsize::new(0);
    let classified = active.par_chunks(TASK).map(|bricks| {
        let kept = classify_bricks(source, &culled, &params, inside, bricks)?;
        let all = found.fetch_add(kept.bricks.len(), Ordering::Relaxed) + kept.bricks.len();
        budget("the records of the bricks with surface", brick_bytes + all * KEPT_BYTES)?;
        done.add(bricks.len());
        Ok(kept)
    });
    let active_bricks = active.len() as u64;
    let classified: Vec<Kept> = classified.collect::<Result<_, ExtractError>>()?;
    // From here on only bricks with surface have a slot: what they are costs nothing but the map.
    slots.fill(NO_SLOT);
    let mut kept = Kept::default();
    kept.reserve(found.into_inner());
    for mut task in classified {
        for (slot, &brick) in (kept.bricks.len() as u32..).zip(&task.bricks) {
            slots[brick as usize] = slot;
        }
        kept.append(&mut task);
    }
    non_finite += kept.non_finite;
    let Kept { bricks: active, records, mut counts, .. } = kept;
    counts.push([0; 2]);
    let record_bytes = brick_bytes + active.len() * KEPT_BYTES;
    clock.lap(at::CLASSIFY);

    let totals = counts.iter().fold([0u64; 2], |t, c| [t[0] + u64::from(c[0]), t[1] + u64::from(c[1])]);
    let [vertices, triangles] = totals;
    if vertices > u64::from(u32::MAX) || 3 * triangles > u64::from(u32::MAX) {
        return Err(ExtractError::TooLarge { vertices, triangles });
    }
    let peak_bytes = record_bytes + vertices as usize * size_of::<Vertex>() + triangles as usize * 12;
    budget("the mesh with its records", peak_bytes)?;
    scan(&mut counts);
    clock.lap(at::SCAN);

    let mut mesh = Mesh {
        vertices: bytemuck::zeroed_vec(vertices as usize),
        triangles: bytemuck::zeroed_vec(triangles as usize),
    };
    let is_marked = AtomicBool::new(false);
    tasks(&counts, &mut mesh)
        .into_par_iter()
        .map(|task| {
            let mut sampler = Sampler::default();
            let mut numbers = EdgeNumbers::new();
            let (mut vertices, mut triangles) = (task.vertices, task.triangles);
            let end = task.slots.end;
            for slot in task.slots {
                let size = [0, 1].map(|i| (counts[slot + 1][i] - counts[slot][i]) as usize);
                let (own_vertices, own_triangles);
                (own_vertices, vertices) = vertices.split_at_mut(size[0]);
                (own_triangles, triangles) = triangles.split_at_mut(size[1]);
                let samples = brick_samples(source, &culled, &params, &active[slot..end], &mut sampler)?;
                let origin = params.brick_origin(active[slot]);
                let here = &pruned(source, &culled, &params, active[slot]);
                let record = &records[slot];
                let beside = Beside::new(&params, &slots, &records, &counts, active[slot]);
                emit_indices(
                    &params,
                    &MARCHING_CUBES,
                    inside,
                    &samples,
                    &beside,
                    &mut numbers,
                    own_triangles,
                );
                let marked = match (here, source) {
                    (Source::Field(here, _), Source::Field(whole, _)) => {
                        let field = Gradients { normals: options.normals, here: *here, whole: *whole };
                        emit_field_vertices(&params, inside, &field, origin, &samples, record, own_vertices)?
                    }
                    (Source::Volume(volume), _) | (_, Source::Volume(volume)) => {
                        emit_volume_vertices(&params, inside, volume.values(), origin, record, own_vertices)
                    }
                };
                if marked {
                    is_marked.store(true, Ordering::Relaxed);
                }
            }
            Ok(())
        })
        .collect::<Result<(), NoForm>>()?;
    clock.lap(at::EMIT);
    if is_marked.into_inner() {
        add_neighbours(&mut mesh.vertices, &mesh.triangles);
        average(&params, &mut mesh.vertices);
        clock.lap(at::NORMALS);
    }

    let report = Report {
        vertices,
        triangles,
        bricks: bricks as u64,
        active_bricks,
        non_finite,
        slabs: 1,
        peak_bytes: peak_bytes as u64,
        seconds: clock.seconds,
    };
    Ok((mesh, report))
}

/// Bytes of a brick in [`Kept`].
const KEPT_BYTES: usize = size_of::<BrickRecord>() + 8 + 4;

/// The bricks that hold surface, with what classify says of them.
#[derive(Default)]
struct Kept {
    bricks: Vec<u32>,
    records: Vec<BrickRecord>,
    counts: Vec<[u32; 2]>,
    /// NaN and infinite samples of a field, of bricks without surface too.
    non_finite: u64,
}

impl Kept {
    fn reserve(&mut self, bricks: usize) {
        self.bricks.reserve_exact(bricks);
        self.records.reserve_exact(bricks);
        self.counts.reserve_exact(bricks + 1);
    }

    fn append(&mut self, other: &mut Self) {
        self.bricks.append(&mut other.bricks);
        self.records.append(&mut other.records);
        self.counts.append(&mut other.counts);
        self.non_finite += other.non_finite;
    }
}

/// The source with its field pruned to what matters in a brick.
#[inline(always)]
fn pruned<'a>(source: &Source<'a>, culled: &'a Culled, params: &Params, brick: u32) -> Source<'a> {
    match *source {
        Source::Field(field, grid) => Source::Field(culled.field_in(params, brick, field), grid),
        volume @ Source::Volume(_) => volume,
    }
}

fn classify_bricks(
    source: &Source<'_>,
    culled: &Culled,
    params: &Params,
    inside: Inside,
    bricks: &[u32],
) -> Result<Kept, NoForm> {
    let mut sampler = Sampler::default();
    let mut kept = Kept::default();
    for (i, &brick) in bricks.iter().enumerate() {
        let samples = brick_samples(source, culled, params, &bricks[i..], &mut sampler)?;
        let mut record = BrickRecord::zeroed();
        let count = classify(&MARCHING_CUBES, inside, &samples, &mut record);
        if matches!(source, Source::Field(..)) {
            kept.non_finite += owned_non_finite(&samples);
        }
        if count != [0; 2] {
            kept.bricks.push(brick);
            kept.records.push(record);
            kept.counts.push(count);
        }
    }
    Ok(kept)
}

struct Clock {
    since: Instant,
    seconds: [Option<f64>; STAGES.len()],
}

impl Clock {
    fn lap(&mut self, stage: usize) {
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

/// The samples of the first of `bricks`: where they lie in a volume, or evaluated.
#[inline(always)]
fn brick_samples<'a>(
    source: &Source<'a>,
    culled: &Culled,
    params: &Params,
    bricks: &[u32],
    sampler: &'a mut Sampler,
) -> Result<Samples<'a>, NoForm> {
    let brick = bricks[0];
    match *source {
        Source::Volume(volume) => {
            Ok(Samples::of_volume(volume.values(), params.points, params.brick_origin(brick)))
        }
        Source::Field(whole, _) => {
            let field = culled.field_in(params, brick, whole);
            sampler.brick(params, field, brick, || row_of(culled, params, whole, bricks))
        }
    }
}

/// How many of `bricks`, from the first on, follow each other along x and have the same field.
fn row_of(culled: &Culled, params: &Params, whole: &dyn Field, bricks: &[u32]) -> u32 {
    let field = |brick: u32| std::ptr::from_ref(culled.field_in(params, brick, whole)).cast::<()>();
    let (first, row) = (field(bricks[0]), bricks[0] / params.slab_extent[0]);
    let follows = |(brick, at): &(&u32, u32)| {
        **brick == *at && at / params.slab_extent[0] == row && std::ptr::eq(field(*at), first)
    };
    bricks.iter().zip(bricks[0]..).take_while(follows).count() as u32
}

/// NaN and infinite samples at the brick's own points.
fn owned_non_finite(samples: &Samples<'_>) -> u64 {
    let [nx, ny, nz] = samples.extent.map(|n| n.min(8));
    let rows = (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z)));
    rows.map(|(y, z)| samples.row(y, z)[..nx].iter().filter(|v| !v.is_finite()).count() as u64).sum()
}

/// A run of slots and the part of the mesh that is theirs.
struct Task<'a> {
    slots: std::ops::Range<usize>,
    vertices: &'a mut [Vertex],
    triangles: &'a mut [[u32; 3]],
}

fn tasks<'a>(offsets: &[[u32; 2]], mesh: &'a mut Mesh) -> Vec<Task<'a>> {
    let (mut vertices, mut triangles) = (&mut mesh.vertices[..], &mut mesh.triangles[..]);
    let slots = offsets.len() - 1;
    let mut tasks = Vec::with_capacity(slots.div_ceil(TASK));
    for first in (0..slots).step_by(TASK) {
        let end = (first + TASK).min(slots);
        let size = [0, 1].map(|i| (offsets[end][i] - offsets[first][i]) as usize);
        let (own_vertices, own_triangles);
        (own_vertices, vertices) = vertices.split_at_mut(size[0]);
        (own_triangles, triangles) = triangles.split_at_mut(size[1]);
        tasks.push(Task { slots: first..end, vertices: own_vertices, triangles: own_triangles });
    }
    tasks
}
