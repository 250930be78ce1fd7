//! The CPU path: the twins of every stage, end to end, on all cores.

use super::{ExtractError, Options, Report, STAGES, Source, check, stage_index as at};
use crate::field::NoForm;
use crate::grid::SAMPLES_PER_BRICK;
use crate::mesh::{Mesh, Vertex};
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::classify;
use crate::stage::cull::cpu::{compact, cull, keep_all, range};
use crate::stage::emit::cpu::{Beside, EdgeNumbers, emit_field_vertices, emit_indices, emit_volume_vertices};
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::stage::sample::cpu::sample;
use crate::stage::samples::Samples;
use crate::stage::scan::cpu::scan;
use crate::table::MARCHING_CUBES;
use glam::UVec3;
use rayon::prelude::*;
use std::time::Instant;

/// Bricks that one task takes.
const TASK: usize = 32;

/// Extracts the mesh by the CPU twins. `progress` hears how much of the work is done, from 0 to 1.
///
/// The mesh is the GPU's: same vertices in the same order, positions and normals equal where the GPU
/// rounds as IEEE 754 says.
///
/// # Errors
/// [`ExtractError::Iso`], [`ExtractError::Budget`], [`ExtractError::TooLarge`],
/// [`ExtractError::TooManyBricks`], [`ExtractError::NoForm`].
pub fn extract_on_cpu(
    source: &Source<'_>,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, Report), ExtractError> {
    check(source, options)?;
    let sense = options.sense.unwrap_or(source.sense());
    let params = Params::new(source.grid(), options.iso, sense);
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

    let mut marks = vec![[0; 2]; bricks + 1];
    let mut non_finite = 0;
    match source {
        Source::Volume(volume) => {
            let (ranges, odd) = volume.ranges(|values| range(&params, values));
            cull(&params, ranges, &mut marks[..bricks]);
            non_finite = *odd;
        }
        Source::Field(..) => keep_all(&mut marks[..bricks]),
    }
    scan(&mut marks);
    let mut slots = vec![0; bricks];
    let active = compact(&params, &marks, &mut slots);
    drop(marks);
    clock.lap(at::CULL);

    let record_bytes = brick_bytes + active.len() * (size_of::<BrickRecord>() + 8 + 4);
    budget("the records of the active bricks", record_bytes)?;
    let done = Progress::new(progress, active.len());
    let mut records: Vec<BrickRecord> = bytemuck::zeroed_vec(active.len());
    let mut counts = vec![[0; 2]; active.len() + 1];
    let classified = records
        .par_chunks_mut(TASK)
        .zip(counts[..active.len()].par_chunks_mut(TASK))
        .zip(active.par_chunks(TASK));
    non_finite += classified
        .map(|((records, counts), bricks)| {
            let mut scratch = [0.0; SAMPLES_PER_BRICK];
            let mut odd = 0;
            for ((record, count), &brick) in records.iter_mut().zip(counts).zip(bricks) {
                let origin = params.brick_origin(brick);
                let samples = brick_samples(source, &params, origin, &mut scratch)?;
                *count = classify(&MARCHING_CUBES, inside, &samples, record);
                if matches!(source, Source::Field(..)) {
                    odd += owned_non_finite(&samples);
                }
            }
            done.add(bricks.len());
            Ok(odd)
        })
        .try_reduce(|| 0, |a, b| Ok::<_, NoForm>(a + b))?;
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
    tasks(&counts, &mut mesh)
        .into_par_iter()
        .map(|task| {
            let mut scratch = [0.0; SAMPLES_PER_BRICK];
            let mut numbers = EdgeNumbers::new();
            let (mut vertices, mut triangles) = (task.vertices, task.triangles);
            for slot in task.slots {
                let size = [0, 1].map(|i| (counts[slot + 1][i] - counts[slot][i]) as usize);
                if size == [0; 2] {
                    continue;
                }
                let (own_vertices, own_triangles);
                (own_vertices, vertices) = vertices.split_at_mut(size[0]);
                (own_triangles, triangles) = triangles.split_at_mut(size[1]);
                let origin = params.brick_origin(active[slot]);
                let samples = brick_samples(source, &params, origin, &mut scratch)?;
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
                match source {
                    Source::Volume(volume) => {
                        emit_volume_vertices(&params, inside, volume.values(), origin, record, own_vertices);
                    }
                    Source::Field(field, _) => {
                        emit_field_vertices(&params, inside, *field, origin, &samples, record, own_vertices)?;
                    }
                }
            }
            Ok(())
        })
        .collect::<Result<(), NoForm>>()?;
    clock.lap(at::EMIT);

    let report = Report {
        vertices,
        triangles,
        bricks: bricks as u64,
        active_bricks: active.len() as u64,
        non_finite,
        slabs: 1,
        peak_bytes: peak_bytes as u64,
        seconds: clock.seconds,
    };
    Ok((mesh, report))
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
    done: std::sync::atomic::AtomicUsize,
    all: usize,
}

impl<'a> Progress<'a> {
    fn new(tell: &'a (dyn Fn(f64) + Sync), all: usize) -> Self {
        Self { tell, done: 0.into(), all }
    }

    fn add(&self, count: usize) {
        let done = self.done.fetch_add(count, std::sync::atomic::Ordering::Relaxed) + count;
        (self.tell)(done as f64 / self.all as f64);
    }
}

/// A brick's samples: where they lie in a volume, or evaluated into `scratch`.
#[inline(always)]
fn brick_samples<'a>(
    source: &'a Source<'_>,
    params: &Params,
    origin: UVec3,
    scratch: &'a mut [f32; SAMPLES_PER_BRICK],
) -> Result<Samples<'a>, NoForm> {
    Ok(match source {
        Source::Volume(volume) => Samples::of_volume(volume.values(), params.points, origin),
        Source::Field(field, _) => {
            sample(params, *field, origin, scratch)?;
            Samples::of_brick(scratch, params.points, origin)
        }
    })
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
