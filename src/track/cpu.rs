//! Continuation on the CPU; twin of `shaders/track.wgsl`.

use super::seeds::{brick_of, from_lattice, from_points};
use super::{Edge, Probe, Seeds, Starts, TrackError, TrackReport, components, search};
use crate::extract::stage_index as at;
use crate::extract::{Clock, Job, KEPT_BYTES, Kept, Method, Options, RECORDS, Report, Source};
use crate::field::{NoForm, Points};
use crate::mesh::Mesh;
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use glam::{UVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bricks that one task takes, at most.
const TASK: usize = 32;
/// Points that one task looks at.
const POINTS: usize = 1 << 12;
/// Bytes that a brick takes in the set of those reached, about.
const REACHED_BYTES: u64 = 16;

/// Tracks the surface from `seeds` by the CPU twins. `progress` hears how much is done, from 0 to 1, in a few steps: how
/// far the surface goes is not known before.
///
/// The triangles are those that [`crate::extract::extract_on_cpu`] gives, in its order, of the components that the
/// seeds lie on; with a coarse step or a search, of all components that were met. If that is all of them, the
/// mesh is byte for byte the same.
///
/// The first report's `active_bricks` are those reached, and `non_finite` counts the samples of these alone.
///
/// # Errors
/// [`TrackError`]; among [`TrackError::Extract`]: [`Iso`](crate::extract::ExtractError::Iso), [`Epsilon`](crate::extract::ExtractError::Epsilon), [`Delta`](crate::extract::ExtractError::Delta),
/// [`Budget`](crate::extract::ExtractError::Budget), [`TooLarge`](crate::extract::ExtractError::TooLarge), [`TooManyBricks`](crate::extract::ExtractError::TooManyBricks), [`NoForm`](crate::extract::ExtractError::NoForm).
pub fn track(
    source: &Source<'_>,
    options: &Options,
    seeds: &Seeds,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, Report, TrackReport), TrackError> {
    let mut job = Job::new(source, options)?;
    let mut clock = Clock::start();
    if let Source::Volume(volume) = source {
        job.held_bytes = volume.bytes();
    }
    let (starts, mut told) = starts(&job, seeds, options.memory_budget)?;
    progress(0.1);

    let (reached, mut kept) = follow(&mut job, &starts, options.cull, &mut told)?;
    if let Some(search) = told.search.as_mut().filter(|search| search.by_intervals) {
        search.undecided = search::undecided(&job.params, search.cells, &starts.open, &reached);
    }
    job.held_bytes += reached.len() as u64 * REACHED_BYTES;
    clock.lap(at::CLASSIFY);
    progress(0.5);

    let (mut mesh, peak_bytes) = job.emit(&mut kept, &mut clock)?;
    if seeds.coarse.is_none() && seeds.search.is_none() {
        let vertices: Vec<u32> =
            starts.edges.iter().filter_map(|&edge| vertex_on(source, &kept, edge)).collect();
        let [components, dropped] = components::keep_reached(&mut mesh, &vertices);
        (told.components, told.dropped) = (Some(components), Some(dropped));
    }
    let report = Report {
        vertices: mesh.vertices.len() as u64,
        triangles: mesh.triangles.len() as u64,
        bricks: job.params.slab_bricks.into(),
        active_bricks: reached.len() as u64,
        non_finite: kept.non_finite,
        open_edges: None,
        slabs: 1,
        peak_bytes,
        scratch_bytes: kept.bytes(),
        seconds: clock.seconds,
    };
    progress(1.0);
    Ok((mesh, report, told))
}

/// What the seeds lead to.
pub(super) fn starts(job: &Job<'_>, seeds: &Seeds, budget: u64) -> Result<(Starts, TrackReport), TrackError> {
    if job.params.method == Method::Tetrahedra {
        return Err(TrackError::Method);
    }
    let (source, params) = (&job.source, &job.params);
    let probes = AtomicU64::new(0);
    let probe: Probe<'_> = &|points| {
        probes.fetch_add(points.len() as u64, Ordering::Relaxed);
        Ok(are_inside(source, params, job.inside, points)?)
    };
    let is_all = seeds.coarse.is_some() || seeds.search.is_some();
    if seeds.points.is_empty() && !is_all {
        return Err(TrackError::NoSeeds);
    }
    if seeds.coarse == Some(0) {
        return Err(TrackError::CoarseStep);
    }
    if seeds.search == Some(0) {
        return Err(TrackError::SearchSize);
    }
    let (mut starts, mut told) = (Starts::default(), TrackReport::default());
    told.missed = from_points(source.grid(), &seeds.points, probe, &mut starts)?;
    if starts.edges.is_empty() && !is_all {
        return Err(TrackError::NothingReached { missed: told.missed });
    }
    if let Some(step) = seeds.coarse {
        from_lattice(source.grid(), step, budget, probe, &mut starts)?;
    }
    if let Some(cells) = seeds.search {
        told.search = Some(search::search(source, params, cells, budget, probe, &mut starts)?);
    }
    let of_edges = starts.edges.iter().map(|edge| brick_of(source.grid(), edge.point));
    starts.bricks.extend(of_edges);
    starts.bricks.sort_unstable();
    starts.bricks.dedup();
    told.probes = probes.into_inner();
    Ok((starts, told))
}

/// Which grid points are inside.
fn are_inside(
    source: &Source<'_>,
    params: &Params,
    inside: Inside,
    points: &[UVec3],
) -> Result<Vec<bool>, NoForm> {
    let mut bits = vec![false; points.len()];
    let each = bits.par_chunks_mut(POINTS).zip(points.par_chunks(POINTS));
    match source {
        Source::Volume(volume) => {
            let [nx, ny, _] = params.points.map(|n| n as usize);
            each.for_each(|(bits, points)| {
                for (bit, point) in bits.iter_mut().zip(points) {
                    let [x, y, z] = point.to_array().map(|n| n as usize);
                    *bit = inside.test(volume.values().get(x + nx * (y + ny * z)));
                }
            });
        }
        Source::Field(field, _) => each.try_for_each(|(bits, points)| {
            let places = points.iter().map(|p| params.grid_position(p.as_vec3(), Vec3::ZERO));
            let mut values = vec![0.0; points.len()];
            let [mut x, mut y, mut z] = [(); 3].map(|()| Vec::with_capacity(points.len()));
            for place in places {
                x.push(place.x);
                y.push(place.y);
                z.push(place.z);
            }
            field.values(Points { x: &x, y: &y, z: &z }, &mut values)?;
            for (bit, value) in bits.iter_mut().zip(values) {
                *bit = inside.test(value);
            }
            Ok(())
        })?,
    }
    Ok(bits)
}

/// Follows the surface from brick to brick: the bricks reached, and those of them that own part of the mesh, in order.
fn follow(
    job: &mut Job<'_>,
    starts: &Starts,
    prune: bool,
    told: &mut TrackReport,
) -> Result<(HashSet<u32>, Kept), TrackError> {
    let mut frontier = starts.bricks.clone();
    let mut reached: HashSet<u32> = frontier.iter().copied().collect();
    let mut pruned = HashSet::new();
    let mut all: Vec<Kept> = Vec::new();
    let mut kept_bricks = 0;
    while !frontier.is_empty() {
        told.rounds += 1;
        if let Source::Field(whole, _) = job.source
            && prune
        {
            job.fields.reach(&job.params, whole, &frontier, &mut pruned);
        }
        let task = frontier.len().div_ceil(4 * rayon::current_num_threads()).clamp(1, TASK);
        let found = frontier.par_chunks(task).map(|bricks| {
            let mut next = Vec::new();
            let kept = job.classify(bricks, |brick, samples| {
                spread(&job.params, job.inside, brick, samples, &mut next)
            })?;
            Ok((kept, next))
        });
        let found: Vec<(Kept, Vec<u32>)> = found.collect::<Result<_, NoForm>>()?;
        frontier = Vec::new();
        for (kept, next) in found {
            kept_bricks += kept.bricks.len();
            all.push(kept);
            frontier.extend(next.into_iter().filter(|&brick| reached.insert(brick)));
        }
        job.budget(RECORDS, 2 * kept_bricks as u64 * KEPT_BYTES + reached.len() as u64 * REACHED_BYTES)?;
        // In order, rows of bricks can be sampled together.
        frontier.sort_unstable();
    }
    Ok((reached, sorted(all, kept_bricks)))
}

/// All of them, in the order of their bricks.
fn sorted(all: Vec<Kept>, count: usize) -> Kept {
    let mut order: Vec<(u32, u32, u32)> = Vec::with_capacity(count);
    for (i, kept) in (0..).zip(&all) {
        order.extend(kept.bricks.iter().zip(0..).map(|(&brick, j)| (brick, i, j)));
    }
    order.par_sort_unstable();
    let mut kept = Kept { non_finite: all.iter().map(|kept| kept.non_finite).sum(), ..Kept::default() };
    kept.reserve(count);
    for (brick, i, j) in order {
        let (from, j) = (&all[i as usize], j as usize);
        kept.bricks.push(brick);
        kept.records.push(from.records[j]);
        kept.counts.push(from.counts[j]);
        kept.first_inside.push(from.first_inside[j]);
    }
    kept.gathered_bytes = 2 * kept.bytes();
    kept
}

/// Adds to `next` the bricks beside `brick` that the surface leads to: those with which it shares points on both sides.
///
/// Two bricks with a face in common share a plane of points. Points of it on both sides have a crossed edge between
/// two of them. An edge whose cells and owner lie in four bricks lies in the planes between each two of them, so all
/// four are reached, the one across by two steps. So bricks that are reached hold all of every component that they
/// hold a part of.
pub(super) fn spread(
    params: &Params,
    inside: Inside,
    brick: u32,
    samples: &Samples<'_>,
    next: &mut Vec<u32>,
) {
    let [nx, ny, nz] = samples.extent;
    let mut rows = [0u32; 81];
    for z in 0..nz {
        for y in 0..ny {
            rows[y + 9 * z] = samples.row_inside(inside, y, z);
        }
    }
    let [bx, by, _] = params.slab_extent;
    let strides = [1, bx, bx * by];
    let place = (params.brick_origin(brick) / 8).to_array();
    for axis in 0..3 {
        // The shared points, first and last along each axis.
        let is_mixed = |plane: usize| {
            let (mut first, mut last) = ([0; 3], [nx - 1, ny - 1, nz - 1]);
            (first[axis], last[axis]) = (plane, plane);
            let mask = (2 << last[0]) - (1 << first[0]);
            let (mut any, mut every) = (0, mask);
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    any |= rows[y + 9 * z] & mask;
                    every &= rows[y + 9 * z];
                }
            }
            any != 0 && every != mask
        };
        if place[axis] > 0 && is_mixed(0) {
            next.push(brick - strides[axis]);
        }
        if place[axis] + 1 < params.slab_extent[axis] && is_mixed(8) {
            next.push(brick + strides[axis]);
        }
    }
}

/// The number of the vertex on an edge, if there is one.
fn vertex_on(source: &Source<'_>, kept: &Kept, edge: Edge) -> Option<u32> {
    let slot = kept.bricks.binary_search(&brick_of(source.grid(), edge.point)).ok()?;
    let [x, y, z] = (edge.point % 8).to_array();
    let record = &kept.records[slot];
    let row = record.rows[(y + 8 * z) as usize];
    let bit = 1 << (8 * edge.axis as u32 + x);
    let before = (record.planes[z as usize] & 0xffff) + (row >> 24) + (row & (bit - 1)).count_ones();
    (row & bit != 0).then(|| kept.counts[slot][0] + before)
}
