//! Volumes that are larger than memory: slabs of brick layers, one at a time, from the file to the file.

use super::border::Faces;
use super::cpu::{Clock, Job};
use super::kept::{KEPT_BYTES, Kept, TASK, mesh_bytes};
use super::{ExtractError, Method, Options, Report, stage_index as at};
use crate::mesh::Vertex;
use crate::mesh::write::WriteError;
use crate::mesh::write::parts::{Normals, Parts};
use crate::stage::cull::cpu::range;
use crate::stage::cull::map::BrickMap;
use crate::stage::inside::Inside;
use crate::stage::normals::cpu::{add_neighbours, average};
use crate::stage::params::Params;
use crate::stage::scan::cpu::scan;
use crate::volume::{OpenError, Planes, Values, Volume};
use rayon::prelude::*;
use std::ops::Range;
use std::path::Path;
use std::time::Instant;

/// Why a volume was not extracted from file to file. No half file is left behind.
#[derive(Debug, thiserror::Error)]
pub enum PlanesError {
    /// The extraction failed.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// The volume was not read.
    #[error(transparent)]
    Read(#[from] OpenError),
    /// The mesh was not written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// The most samples of a slab, in bytes: larger ones gain nothing.
const SLAB_BYTES: u64 = 128 << 20;
/// The least and the most bytes of mesh that are held at one time, if the budget allows: an eighth of it otherwise.
const MESH_BYTES: [u64; 2] = [4 << 20, 32 << 20];
/// Bytes a brick of the tables of cull.
const TABLE_BYTES: u64 = 8 + 8 + 4 + 4;
/// Buffers of files, on their way in and out.
const FILE_BYTES: u64 = 8 << 20;

/// Extracts the mesh of a volume by the CPU twins, and writes it to `path`, a `.ply` or `.stl` file. Of the volume, two slabs of brick layers are in
/// memory, one being read while the other is worked on; of the mesh what one batch of bricks makes, and in STL or with normals that
/// others complete the vertices of about a layer of bricks. The file is byte for byte
/// the one that [`extract_on_cpu`](super::extract_on_cpu) and [`write`](crate::mesh::write::write()) make.
///
/// Beside the file asked for, the disk needs as much room again while it is made (for STL less). `progress` hears how much of
/// the work is done, from 0 to 1.
///
/// # Errors
/// [`PlanesError`]; [`ExtractError::Budget`] where a slab of one layer is too much, or in the end what the triangles of a layer
/// name of the next.
pub fn extract_planes(
    planes: &mut Planes,
    options: &Options,
    path: &Path,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Report, PlanesError> {
    options.check()?;
    let mut run = Run::new(planes, options, path)?;
    let slabs = run.plan.slabs();
    let grid = *planes.grid();
    let [mut window, mut next] = [(); 2].map(|()| Volume::window(grid, Values::F32(Vec::new())));
    let read = |planes: &mut Planes, slab: &Slab, into: &mut Volume| {
        let since = Instant::now();
        planes.read(slab.planes.clone(), into.values_mut()).map(|()| since.elapsed().as_secs_f64())
    };
    let mut reading = read(planes, &slabs[0], &mut window)?;
    for (i, slab) in slabs.iter().enumerate() {
        // One thread more than cores: the reader waits for the disk.
        let read_next = std::thread::scope(|scope| -> Result<_, PlanesError> {
            let reader = slabs.get(i + 1).map(|slab| scope.spawn(|| read(planes, slab, &mut next)));
            run.slab(slab, &window, &|part| progress(0.9 * ((i as f64 + part) / slabs.len() as f64)))?;
            let Some(reader) = reader else { return Ok(0.0) };
            Ok(reader.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?)
        })?;
        reading += read_next;
        std::mem::swap(&mut window, &mut next);
    }
    drop((window, next));
    run.finish(slabs.len(), reading, &|part| progress(0.9 + 0.1 * part))
}

/// What of the volume is worked on at a time.
#[derive(Debug, Clone)]
struct Slab {
    /// Its layers of bricks. The one behind them is in memory, too: triangles end at its vertices.
    layers: Range<u32>,
    /// The planes that are in memory.
    planes: Range<u32>,
}

/// How the volume is cut.
struct Plan {
    points: [u32; 3],
    bricks: [u32; 3],
    layers_a_slab: u32,
    /// The most bytes that are held at one time.
    bytes: u64,
    mesh_bytes: u64,
}

impl Plan {
    fn new(planes: &Planes, budget: u64) -> Result<Self, ExtractError> {
        let grid = planes.grid();
        let (points, bricks) = (grid.points().to_array(), grid.bricks().to_array());
        let plane = planes.bytes() / u64::from(points[2]);
        let layer_bricks = u64::from(bricks[0]) * u64::from(bricks[1]);
        let of_mesh = |budget: u64| (budget / 8).clamp(MESH_BYTES[0], MESH_BYTES[1]);
        let mesh_bytes = of_mesh(budget);
        let samples = |layers: u32| plane * u64::from(points[2].min(8 * layers + 10));
        // Records are gathered by tasks and then put together.
        let held = |layers: u32| {
            2 * samples(layers)
                + layer_bricks * u64::from(layers + 1) * (TABLE_BYTES + 2 * KEPT_BYTES)
                + mesh_bytes
                + FILE_BYTES
        };
        let least = held(1);
        if least > budget {
            let what = "the smallest slab of the volume, a layer of bricks with the one behind it, twice,";
            // A larger budget leaves more to the mesh, and must suffice for that, too.
            let rest = least - mesh_bytes;
            let enough = [rest + MESH_BYTES[0], (8 * rest).div_ceil(7), rest + MESH_BYTES[1]];
            let needed = enough.into_iter().find(|&needed| rest + of_mesh(needed) <= needed);
            return Err(ExtractError::Budget { what, needed: needed.unwrap_or(least), budget });
        }
        let fits = |&layers: &u32| held(layers) <= budget && samples(layers) <= SLAB_BYTES;
        let layers_a_slab = (1..=bricks[2]).take_while(fits).last().unwrap_or(1);
        Ok(Self { points, bricks, layers_a_slab, bytes: held(layers_a_slab), mesh_bytes })
    }

    fn slabs(&self) -> Vec<Slab> {
        let (layers, points) = (self.bricks[2], self.points[2]);
        let slab = |first: u32| {
            let end = (first + self.layers_a_slab).min(layers);
            // Slopes at the lowest plane reach one below it.
            let planes = (8 * first).saturating_sub(1)..(8 * end + 9).min(points);
            Slab { layers: first..end, planes }
        };
        (0..layers).step_by(self.layers_a_slab as usize).map(slab).collect()
    }
}

/// What goes on from slab to slab.
struct Run<'a> {
    options: &'a Options,
    plan: Plan,
    /// Of the whole grid.
    params: Params,
    faces: Faces,
    parts: Parts,
    /// What classify said of the layer behind the last slab, with the bricks' numbers in it.
    carried: Kept,
    is_marked: bool,
    report: Report,
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> Run<'a> {
    fn new(planes: &Planes, options: &'a Options, path: &Path) -> Result<Self, PlanesError> {
        let grid = planes.grid();
        let plan = Plan::new(planes, options.memory_budget)?;
        let sense = options.sense.unwrap_or(crate::field::Sense::Above);
        Ok(Self {
            options,
            params: Params::new(grid, options.iso, sense).with_method(options.method, options.placement),
            faces: Faces {
                inside: Inside::new(options.iso, sense),
                points: plan.points,
                is_cut: options.method == Method::Tetrahedra,
            },
            parts: Parts::new(path)?,
            carried: Kept::default(),
            is_marked: false,
            report: Report {
                bricks: grid.brick_count(),
                peak_bytes: plan.bytes,
                open_edges: Some(0),
                ..Report::default()
            },
            vertices: Vec::new(),
            triangles: Vec::new(),
            plan,
        })
    }

    /// The settings for some layers of a slab.
    fn params(&self, slab: &Slab, layers: Range<u32>) -> Params {
        let [bx, by, _] = self.plan.bricks;
        let [nx, ny, _] = self.plan.points;
        let bricks = bx * by * layers.len() as u32;
        Params {
            slab_first: [0, 0, layers.start],
            slab_extent: [bx, by, layers.len() as u32],
            slab_bricks: bricks,
            own_bricks: bx * by * slab.layers.len() as u32,
            source_first: [0, 0, slab.planes.start],
            source_extent: [nx, ny, slab.planes.len() as u32],
            ..self.params
        }
    }

    /// Extracts a slab from its part of the volume.
    fn slab(
        &mut self,
        slab: &Slab,
        window: &Volume,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<(), PlanesError> {
        let mut clock = Clock::start();
        let [bx, by, bz] = self.plan.bricks;
        let all = slab.layers.start..(slab.layers.end + 1).min(bz);
        let mut job = Job::in_window(window, self.options, self.params(slab, all.clone()));
        let mut kept = std::mem::take(&mut self.carried);
        // The first layer was the one behind the slab before.
        let fresh = if slab.layers.start > 0 { all.start + 1 } else { 0 }..all.end;
        if !fresh.is_empty() {
            let params = self.params(slab, fresh.clone());
            let (ranges, odd) = range(&params, window.values());
            let mut active = BrickMap::of_ranges(&params, &ranges).list();
            let below = bx * by * (fresh.start - all.start);
            active.iter_mut().for_each(|brick| *brick += below);
            clock.lap(at::CULL);
            let tasks = active.par_chunks(TASK).map(|bricks| job.classify(bricks, |_, _| {}));
            let classified: Vec<Kept> = tasks.collect::<Result<_, _>>().map_err(ExtractError::from)?;
            classified.into_iter().for_each(|mut task| kept.append(&mut task));
            self.report.non_finite += odd;
            self.report.active_bricks += active.len() as u64;
            clock.lap(at::CLASSIFY);
        }
        let [.., nz] = self.plan.points;
        let cells = 8 * slab.layers.start..(8 * slab.layers.end).min(nz - 1);
        let open = self.faces.open_edges(window.values(), slab.planes.start, cells);
        self.report.open_edges = self.report.open_edges.map(|before| before + open);
        progress(0.5);
        let own = kept.bricks.partition_point(|&brick| brick < job.params.own_bricks);
        self.carried = kept.tail(own, job.params.own_bricks);
        self.offsets(&mut kept)?;
        clock.lap(at::SCAN);
        self.emit(&mut job, &kept, own)?;
        clock.lap(at::EMIT);
        for (sum, seconds) in self.report.seconds.iter_mut().zip(clock.seconds) {
            *sum = seconds.map_or(*sum, |seconds| Some(sum.unwrap_or(0.0) + seconds));
        }
        progress(1.0);
        Ok(())
    }

    /// Counts become offsets: of vertices in the whole mesh, of triangles in the slab.
    fn offsets(&self, kept: &mut Kept) -> Result<(), ExtractError> {
        kept.counts.push([0; 2]);
        let totals =
            kept.counts.iter().fold([0u64; 2], |t, c| [t[0] + u64::from(c[0]), t[1] + u64::from(c[1])]);
        let before = self.parts.vertices();
        let [vertices, triangles] = [before + totals[0], totals[1]];
        if vertices > u64::from(u32::MAX) || triangles > u64::from(u32::MAX) {
            let triangles = self.parts.triangles() + triangles;
            return Err(ExtractError::TooLarge { vertices, triangles });
        }
        scan(&mut kept.counts);
        kept.counts.iter_mut().for_each(|offset| offset[0] += before as u32);
        Ok(())
    }

    /// Makes the mesh of the first `own` slots, a batch of them at a time.
    fn emit(&mut self, job: &mut Job<'_>, kept: &Kept, own: usize) -> Result<(), PlanesError> {
        let offsets = &kept.counts;
        let mut first = 0;
        while first < own {
            let size = |end: usize| [0, 1].map(|i| (offsets[end][i] - offsets[first][i]) as usize);
            let fits = |&end: &usize| {
                let [vertices, triangles] = size(end);
                mesh_bytes(vertices, triangles) <= self.plan.mesh_bytes
            };
            // One brick at least.
            let end = (first + 1..=own).take_while(fits).last().unwrap_or(first + 1);
            let [vertices, triangles] = size(end);
            self.vertices.resize(vertices, Vertex::default());
            self.triangles.resize(triangles, [0; 3]);
            let marked = job.fill(kept, first..end, &mut self.vertices, &mut self.triangles);
            self.is_marked |= marked.map_err(ExtractError::from)?;
            self.parts.add(&self.vertices, &self.triangles)?;
            first = end;
        }
        Ok(())
    }

    fn finish(self, slabs: usize, reading: f64, progress: &dyn Fn(f64)) -> Result<Report, PlanesError> {
        let Self { options, params, parts, is_marked, mut report, vertices, triangles, .. } = self;
        drop((vertices, triangles));
        report.vertices = parts.vertices();
        report.triangles = parts.triangles();
        report.slabs = slabs as u64;
        report.seconds[at::READ] = Some(reading);
        let budget = options.memory_budget;
        let held = parts.bytes_to_finish(is_marked);
        if held > budget {
            let what = "the window of vertices that a layer's triangles name";
            // A larger budget has larger runs: with those it must suffice, too.
            let needed = held + (held / 3).clamp(2 * MESH_BYTES[0], 2 * MESH_BYTES[1]);
            return Err(ExtractError::Budget { what, needed, budget }.into());
        }
        report.peak_bytes = report.peak_bytes.max(held);
        let marks = Marks(params);
        parts.finish(is_marked.then_some(&marks), progress)?;
        Ok(report)
    }
}

/// The normals stage.
struct Marks(Params);

impl Normals for Marks {
    fn add(&self, vertices: &mut [Vertex], triangles: &[[u32; 3]]) {
        add_neighbours(vertices, triangles);
    }

    fn finish(&self, vertices: &mut [Vertex]) {
        average(&self.0, vertices);
    }
}
