//! Extraction again after an edit: only bricks that it can have touched are sampled, and the others' vertices and
//! triangles are taken over.

use super::cpu::{BRICKS, Clock, Job, MESH, RECORDS, Scratch};
use super::kept::{KEPT_BYTES, Kept, TASK, mesh_bytes, tasks};
use super::{ExtractError, Method, Options, Placement, STAGES, Source, stage_index as at};
use crate::field::differences::Normals;
use crate::field::{Field, NoForm, Sense};
use crate::graph::GraphField;
use crate::grid::Grid;
use crate::memory;
use crate::mesh::Mesh;
use crate::stage::cull::bounds::{Culled, cull_changed};
use crate::stage::emit::cpu::Renumber;
use crate::stage::normals::cpu::{add_neighbours, average};
use crate::stage::params::Params;
use glam::UVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The mesh of a field that is edited, on the CPU: after each edit that of a full extraction
/// ([`extract_on_cpu`](super::extract_on_cpu)), byte for byte.
///
/// What an edit touched is found by bounds, in boxes of bricks from large to small: where the field as it was and the
/// field as it is are pruned to the same operations on the same numbers (and of blobs, where the same components reach),
/// nothing changed. So fields are compared that are expressions ([`Field::as_graph`]); of others every brick that may
/// hold surface is sampled at each update.
///
/// ```
/// use glam::Vec3;
/// use isoforge::{extract::*, field::Sense, graph::{Expr, GraphField, shapes::*}, grid::Grid};
///
/// let ball = |name, x| sphere(Expr::parameter(name, 0.5)).translate([x, 0.0, 0.0]);
/// let mut field = GraphField::new(&ball("left", -1.0).union(ball("right", 1.0)), Sense::Below);
/// let grid = Grid::from_bounds([128, 64, 64], Vec3::new(-2.0, -1.0, -1.0), Vec3::new(2.0, 1.0, 1.0))?;
/// let mut scene = Incremental::new(grid);
/// scene.update(&field, &Options::new(0.0))?; // all of it
///
/// field.set("left", 0.52)?;
/// let update = scene.update(&field, &Options::new(0.0))?;
/// assert!(update.kept_bricks > 0 && update.dirty_bricks < update.bricks / 8); // the right ball was kept
/// let (mesh, _) = extract_on_cpu(&Source::Field(&field, grid), &Options::new(0.0), &|_| {})?;
/// assert!(*scene.mesh() == mesh);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Incremental {
    grid: Grid,
    last: Option<Last>,
}

/// What an update did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Update {
    /// Bricks of the grid.
    pub bricks: u64,
    /// Bricks that were sampled again: those that may hold surface, and in which something may have changed.
    pub dirty_bricks: u64,
    /// Bricks with surface that were taken over as they were.
    pub kept_bricks: u64,
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Samples of the whole field that are NaN or infinite; they count as outside.
    pub non_finite: u64,
    /// The most bytes that were held at one time, the meshes before and after included.
    pub peak_bytes: u64,
    /// Seconds of each of [`STAGES`]; none where it was not done.
    pub seconds: [Option<f64>; STAGES.len()],
}

/// An extraction, and what the next one asks of it.
#[derive(Debug)]
struct Last {
    graph: Option<GraphField>,
    settings: Settings,
    /// Its counts are offsets.
    kept: Kept,
    mesh: Mesh,
    /// Bricks with NaN and infinite samples, and how many.
    non_finite: Vec<[u32; 2]>,
    /// Bricks with singular vertices: their normals depend on neighbours, which may be in other bricks.
    singular: Vec<u32>,
}

/// What decides about the mesh beside the field and the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Settings {
    iso: f32,
    sense: Sense,
    normals: Normals,
    method: Method,
    placement: Placement,
}

impl Incremental {
    /// For fields over a grid; nothing is extracted yet.
    pub fn new(grid: Grid) -> Self {
        Self { grid, last: None }
    }

    /// The mesh of the last update; empty before the first, and after one that failed.
    pub fn mesh(&self) -> &Mesh {
        static EMPTY: Mesh = Mesh { vertices: Vec::new(), triangles: Vec::new() };
        self.last.as_ref().map_or(&EMPTY, |last| &last.mesh)
    }

    /// The mesh of the last update, by value.
    pub fn into_mesh(self) -> Mesh {
        self.last.map_or_else(Mesh::default, |last| last.mesh)
    }

    /// Makes the mesh that of `field`. Everything is extracted at the first time, when iso, sense, normals, method or placement are not those
    /// of the time before, without [`Options::cull`], and where the mesh before does not fit in the budget beside the new
    /// one.
    ///
    /// # Errors
    /// Those of [`extract_on_cpu`](super::extract_on_cpu). The mesh is empty then, and the next update extracts everything.
    pub fn update(&mut self, field: &dyn Field, options: &Options) -> Result<Update, ExtractError> {
        let settings = Settings {
            iso: options.iso,
            sense: options.sense.unwrap_or(field.sense()),
            normals: options.normals,
            method: options.method,
            placement: options.placement,
        };
        let last = self.last.take().filter(|last| last.settings == settings && options.cull);
        let had_last = last.is_some();
        let run = |last| Run::new(&self.grid, field, options, settings)?.update(last);
        let (last, update) = match run(last) {
            Err(ExtractError::Budget { .. }) if had_last => run(None)?,
            result => result?,
        };
        self.last = Some(last);
        Ok(update)
    }
}

struct Run<'a> {
    job: Job<'a>,
    field: &'a dyn Field,
    settings: Settings,
    cull: bool,
    clock: Clock,
}

impl<'a> Run<'a> {
    fn new(
        grid: &Grid,
        field: &'a dyn Field,
        options: &Options,
        settings: Settings,
    ) -> Result<Self, ExtractError> {
        let job = Job::new(&Source::Field(field, *grid), options)?;
        Ok(Self { job, field, settings, cull: options.cull, clock: Clock::start() })
    }

    fn update(mut self, last: Option<Last>) -> Result<(Last, Update), ExtractError> {
        let params = self.job.params;
        let bricks = u64::from(params.slab_bricks);
        self.job.held_bytes =
            bricks * (8 + 8 + 4) + bricks.div_ceil(8) + last.as_ref().map_or(0, Last::bytes);
        self.job.budget(BRICKS, 0)?;
        let (dirty, same) = self.changed(last.as_ref());
        self.clock.lap(at::CULL);
        let fresh = self.classify(&dirty)?;
        self.clock.lap(at::CLASSIFY);

        let last = last.unwrap_or_else(|| Last::nothing(self.settings));
        let kept_slots = || (0..last.kept.bricks.len()).filter(|&slot| same.has(last.kept.bricks[slot]));
        let kept_bricks = kept_slots().count();
        let mut update = Update {
            bricks,
            dirty_bricks: dirty.len() as u64,
            kept_bricks: kept_bricks as u64,
            ..Update::default()
        };
        let graph = self.field.as_graph().cloned();
        let mut non_finite = fresh.non_finite;
        non_finite.extend(last.non_finite.iter().filter(|[brick, _]| same.has(*brick)));
        let last = if dirty.is_empty() && kept_bricks == last.kept.bricks.len() {
            update.peak_bytes = self.job.held_bytes;
            Last { graph, non_finite, ..last }
        } else {
            let (kept, from) = joined(&last.kept, kept_slots(), fresh.kept);
            let (mesh, kept, singular) = self.emit(kept, &from, &last, &mut update.peak_bytes)?;
            Last { graph, settings: self.settings, kept, mesh, non_finite, singular }
        };
        update.vertices = last.mesh.vertices.len() as u64;
        update.triangles = last.mesh.triangles.len() as u64;
        update.non_finite = last.non_finite.iter().map(|&[_, count]| u64::from(count)).sum();
        update.seconds = self.clock.seconds;
        Ok((last, update))
    }

    /// The bricks to be sampled, in order, and those in which nothing changed.
    fn changed(&mut self, last: Option<&Last>) -> (Vec<u32>, Bricks) {
        let params = &self.job.params;
        let mut same = Bricks::none(params);
        if !self.cull {
            return ((0..params.slab_bricks).collect(), same);
        }
        // Differences leave the brick; that an expression has no gradient does not happen.
        let reach = if self.settings.normals == Normals::Exact { 0.0 } else { params.delta };
        let before = last.and_then(|last| last.graph.as_ref());
        let Culled { mut active, fields, same: boxes } = cull_changed(params, self.field, before, reach);
        self.job.fields = fields;
        for [first, end] in boxes {
            same.add(first, end);
        }
        for &brick in last.iter().flat_map(|last| &last.singular) {
            if same.remove(brick) {
                active.push(brick);
            }
        }
        active.par_sort_unstable();
        (active, same)
    }

    fn classify(&self, dirty: &[u32]) -> Result<Fresh, ExtractError> {
        let found = AtomicUsize::new(0);
        let tasks = dirty.par_chunks(TASK).map(|bricks| {
            let mut fresh = Fresh::default();
            let non_finite = &mut fresh.non_finite;
            fresh.kept = self.job.classify(bricks, |brick, samples| {
                let count = samples.owned_non_finite();
                if count > 0 {
                    non_finite.push([brick, count as u32]);
                }
            })?;
            let all = found.fetch_add(fresh.kept.bricks.len(), Ordering::Relaxed) + fresh.kept.bricks.len();
            self.job.budget(RECORDS, all as u64 * KEPT_BYTES)?;
            Ok(fresh)
        });
        let tasks: Vec<Fresh> = tasks.collect::<Result<_, ExtractError>>()?;
        let mut all = Fresh::default();
        for mut task in tasks {
            all.kept.append(&mut task.kept);
            all.non_finite.append(&mut task.non_finite);
        }
        Ok(all)
    }

    /// The mesh of the bricks in `kept`, of which each is new or has been in the slot `from` before; with their
    /// offsets, and the bricks with singular vertices.
    fn emit(
        &mut self,
        mut kept: Kept,
        from: &[u32],
        last: &Last,
        peak_bytes: &mut u64,
    ) -> Result<(Mesh, Kept, Vec<u32>), ExtractError> {
        let job = &self.job;
        let [vertices, triangles] = kept.totals()?;
        let numbers = 4 * (kept.bricks.len() as u64 + last.mesh.vertices.len() as u64);
        let needed = kept.bytes() + mesh_bytes(vertices, triangles) + numbers;
        job.budget(MESH, needed)?;
        *peak_bytes = job.held_bytes + needed;
        kept.scan();
        let numbers = new_numbers(job, last, &kept, from);
        self.clock.lap(at::SCAN);

        let kept = kept;
        let mut mesh = Mesh { vertices: memory::zeroed(vertices), triangles: memory::zeroed(triangles) };
        let singular = tasks(&kept.counts, 0..kept.bricks.len(), &mut mesh.vertices, &mut mesh.triangles)
            .into_par_iter()
            .map(|task| {
                let is_new = |slot: &usize| from[*slot] == NEW;
                let new: Vec<u32> = task.slots.clone().filter(is_new).map(|slot| kept.bricks[slot]).collect();
                let mut new = &new[..];
                let mut scratch =
                    (!new.is_empty()).then(|| Scratch::new(&job.params, &kept, task.slots.start));
                let (mut vertices, mut triangles) = (task.vertices, task.triangles);
                let mut singular = Vec::new();
                for slot in task.slots {
                    let (own_vertices, own_triangles) = kept.take_own(slot, &mut vertices, &mut triangles);
                    if let (NEW, Some(scratch)) = (from[slot], &mut scratch) {
                        if job.emit_brick(&kept, slot, new, scratch, (own_vertices, own_triangles))? {
                            singular.push(kept.bricks[slot]);
                        }
                        new = &new[1..];
                    } else {
                        let [old_vertices, old_triangles] = last.kept.own(from[slot] as usize);
                        own_vertices.copy_from_slice(&last.mesh.vertices[old_vertices]);
                        for (to, old) in own_triangles.iter_mut().zip(&last.mesh.triangles[old_triangles]) {
                            *to = old.map(|vertex| numbers[vertex as usize]);
                        }
                    }
                }
                Ok(singular)
            });
        let singular: Vec<u32> = singular.collect::<Result<Vec<_>, NoForm>>()?.concat();
        self.clock.lap(at::EMIT);
        if !singular.is_empty() {
            add_neighbours(&mut mesh.vertices, &mesh.triangles);
            average(&job.params, &mut mesh.vertices);
            self.clock.lap(at::NORMALS);
        }
        Ok((mesh, kept, singular))
    }
}

/// What classify finds in dirty bricks.
#[derive(Default)]
struct Fresh {
    kept: Kept,
    non_finite: Vec<[u32; 2]>,
}

impl Last {
    fn nothing(settings: Settings) -> Self {
        let kept = Kept { counts: vec![[0; 2]], ..Kept::default() };
        let (non_finite, singular) = (Vec::new(), Vec::new());
        Self { graph: None, settings, kept, mesh: Mesh::default(), non_finite, singular }
    }

    fn bytes(&self) -> u64 {
        self.kept.bytes()
            + mesh_bytes(self.mesh.vertices.len(), self.mesh.triangles.len())
            + self.non_finite.len() as u64 * 8
            + self.singular.len() as u64 * 4
    }
}

/// In place of the slot of a brick that is not taken over.
const NEW: u32 = u32::MAX;

/// The slots `slots` of `old` and all of `fresh`, in the order of the bricks, and where each has been before.
fn joined(old: &Kept, slots: impl Iterator<Item = usize>, fresh: Kept) -> (Kept, Vec<u32>) {
    let mut all = Kept::default();
    let mut from = Vec::new();
    let mut push = |of: &Kept, slot: usize, count, place| {
        all.bricks.push(of.bricks[slot]);
        all.records.push(of.records[slot]);
        all.counts.push(count);
        all.first_inside.push(of.first_inside[slot]);
        from.push(place);
    };
    let mut next = 0;
    for slot in slots {
        while next < fresh.bricks.len() && fresh.bricks[next] < old.bricks[slot] {
            push(&fresh, next, fresh.counts[next], NEW);
            next += 1;
        }
        push(old, slot, old.own(slot).map(|own| own.len() as u32), slot as u32);
    }
    (next..fresh.bricks.len()).for_each(|next| push(&fresh, next, fresh.counts[next], NEW));
    (all, from)
}

/// Of each vertex before, the number that it has now. In a brick that was emitted again that is the number of the vertex
/// on the same edge: where a brick that is taken over names it, there is one.
fn new_numbers(job: &Job<'_>, last: &Last, kept: &Kept, from: &[u32]) -> Vec<u32> {
    let mut numbers: Vec<u32> = bytemuck::zeroed_vec(last.mesh.vertices.len());
    let mut left = &mut numbers[..];
    let slots = last.kept.bricks.len();
    let mut parts = Vec::with_capacity(slots.div_ceil(TASK));
    for first in (0..slots).step_by(TASK) {
        let end = (first + TASK).min(slots);
        let size = (last.kept.counts[end][0] - last.kept.counts[first][0]) as usize;
        let own;
        (own, left) = left.split_at_mut(size);
        parts.push((first..end, own));
    }
    parts.into_par_iter().for_each_init(Renumber::default, |renumber, (slots, mut left)| {
        let mut now = kept.bricks.partition_point(|&brick| brick < last.kept.bricks[slots.start]);
        for slot in slots {
            let own;
            (own, left) = std::mem::take(&mut left).split_at_mut(last.kept.own(slot)[0].len());
            let brick = last.kept.bricks[slot];
            while kept.bricks.get(now).is_some_and(|&other| other < brick) {
                now += 1;
            }
            if kept.bricks.get(now) != Some(&brick) {
                continue;
            }
            let first = kept.counts[now][0];
            if from[now] == NEW {
                let origin = job.params.brick_origin(brick).to_array();
                let extent = [0, 1, 2].map(|k| (job.params.points[k] - origin[k]).min(9) as usize);
                let records = [&last.kept.records[slot], &kept.records[now]];
                renumber.brick(job.params.method, extent, records, first, own);
            } else {
                own.iter_mut().zip(first..).for_each(|(to, number)| *to = number);
            }
        }
    });
    numbers
}

/// A set of bricks, a bit each.
struct Bricks {
    words: Vec<u64>,
    extent: UVec3,
}

impl Bricks {
    fn none(params: &Params) -> Self {
        let words = vec![0; params.slab_bricks.div_ceil(64) as usize];
        Self { words, extent: params.slab_extent.into() }
    }

    /// The bricks of a box.
    fn add(&mut self, first: UVec3, end: UVec3) {
        for z in first.z..end.z {
            for y in first.y..end.y {
                let row = self.extent.x * (y + self.extent.y * z);
                for brick in row + first.x..row + end.x {
                    self.words[brick as usize / 64] |= 1 << (brick % 64);
                }
            }
        }
    }

    fn has(&self, brick: u32) -> bool {
        self.words[brick as usize / 64] >> (brick % 64) & 1 == 1
    }

    /// Takes a brick out; whether it was there.
    fn remove(&mut self, brick: u32) -> bool {
        let had = self.has(brick);
        self.words[brick as usize / 64] &= !(1 << (brick % 64));
        had
    }
}
