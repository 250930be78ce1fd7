//! The methods beside the sweep by marching cubes: which flags go together, and how they are called.

use super::args::{Backend, ExtractArgs, MethodArg, MethodArgs, NormalsArg};
use super::extract::{Done, Job, Made, takes_main_memory};
use super::source::Loaded;
use super::values::RefineArg;
use super::watchdog::{EXTRACTING, Watchdog};
use super::{Failure, OverBudget, backend};
use crate::extract::{ExtractError, Extractor, Method, Options, Placement, Report};
use crate::field::{Field, Sense, Surface};
use crate::gpu::{Gpu, GpuMesh};
use crate::grid::Grid;
use crate::mesh::Mesh;
use crate::octree::{self, OctreeError, OctreeReport};
use crate::refine::{self, RefineError, RefineReport};
use crate::scene;
use crate::sharp::{self, SharpError};
use crate::stage::params::Params;
use crate::track::{self, Seeds, TrackError, TrackReport};
use clap::ValueEnum;
use serde_json::{Value, json};

/// The most seeds without surface that are told one by one.
const TOLD: usize = 5;

/// Bytes that a triangle takes while a mesh is refined, about: the mesh before and after, edges, marks, searches.
const REFINED_BYTES: u64 = 300;

/// Bytes that a node of the octree takes with its part of the mesh, about: measured of gyroids and spheres, 380 by [`octree::polygonize`] and 560
/// by [`octree::extract`].
const NODE_BYTES: u64 = 600;

impl MethodArg {
    /// How the cells of the uniform grid become triangles, of the methods that go over it.
    pub fn of_cells(self) -> Option<Method> {
        match self {
            Self::Mc => Some(Method::MarchingCubes),
            Self::Mc33 => Some(Method::Mc33),
            Self::Mt => Some(Method::Tetrahedra),
            Self::Octree | Self::Dmc => None,
        }
    }
}

impl MethodArgs {
    /// Where vertices lie on their edges.
    pub fn placement(&self) -> Placement {
        match self.snap {
            Some(epsilon) => Placement::Snapped { epsilon },
            None if self.midpoint => Placement::Midpoint,
            None => Placement::Linear,
        }
    }

    /// Whether the stages of the uniform grid do it.
    fn is_sweep(&self) -> bool {
        !self.sharp && self.method.of_cells().is_some()
    }

    /// For `--stats`: the name of the method, and what it told beside.
    pub fn named(&self, told: Value) -> Value {
        let method = self.method.to_possible_value();
        let name = method.as_ref().map(|value| value.get_name()).filter(|_| !self.sharp).unwrap_or("sharp");
        let mut named = json!({ "name": name });
        if let (Value::Object(named), Value::Object(mut told)) = (&mut named, told) {
            named.append(&mut told);
        }
        named
    }

    /// The flag that asks for what only the CPU does.
    pub fn cpu_alone(&self) -> Option<&'static str> {
        match self.method {
            MethodArg::Dmc => Some("--method dmc"),
            MethodArg::Octree => Some("--method octree"),
            MethodArg::Mc | MethodArg::Mc33 | MethodArg::Mt => self.sharp.then_some("--sharp"),
        }
    }
}

/// Refuses flags that say nothing together, before the long work.
pub fn check(args: &ExtractArgs) -> Result<(), Failure> {
    let of = &args.method;
    let pairs = [
        (
            of.sharp && of.method != MethodArg::Mc,
            "--sharp",
            "is of the uniform grid: leave it or --method out (dmc keeps edges by itself)",
        ),
        (
            of.track && !(of.is_sweep() && of.method != MethodArg::Mt),
            "--track",
            "follows cubes of the uniform grid (--method mc or mc33): leave it or the other method out",
        ),
        (
            of.cap && !(of.is_sweep() && of.refine.is_none()),
            "--cap",
            "closes the meshes of --method mc, mc33 and mt, not refined: leave it or the other flag out",
        ),
        (
            of.placement() != Placement::Linear && !of.is_sweep(),
            "--snap or --midpoint",
            "is of --method mc, mc33 and mt: leave it or the other flag out",
        ),
        (of.error.is_some() && of.method.of_cells().is_some(), "--error", "is of --method dmc and octree"),
        (
            of.most_cells.is_some() && of.method.of_cells().is_some(),
            "--most-cells",
            "is of --method dmc and octree",
        ),
    ];
    if let Some((_, flag, why)) = pairs.into_iter().find(|(wrong, ..)| *wrong) {
        return Err(Failure::usage(format!("{flag} {why}")));
    }
    if of.cap && matches!(args.source.normals, Some(NormalsArg::Forward | NormalsArg::Central)) {
        return Err(Failure::usage(
            "--normals: with --cap normals are exact, out of the domain on caps: leave it out",
        ));
    }
    if let Some(epsilon) = of.snap.filter(|e| !(e.is_finite() && *e > 0.0)) {
        return Err(Failure::usage(format!("--snap {epsilon}: give a finite number over 0, in world units")));
    }
    if let (Some(flag), Backend::Gpu) = (of.cpu_alone(), args.run.backend) {
        return Err(Failure::usage(format!("{flag} is done by the CPU: leave out --backend gpu")));
    }
    let differences = matches!(args.source.normals, Some(NormalsArg::Forward | NormalsArg::Central));
    if differences && !(of.is_sweep() && of.refine.is_none()) {
        return Err(Failure::usage(
            "--normals: with --refine, --sharp and --method normals are exact, or central differences where a field has no gradient: leave it out",
        ));
    }
    Ok(())
}

/// The surface and the grid of what was loaded, as the methods beside marching cubes take them.
pub fn surface<'a>(loaded: &'a Loaded, options: &Options) -> Result<(Surface<'a>, Grid), Failure> {
    let (field, grid, sense, delta) = parts(loaded, options)?;
    Ok((Surface::new(field, options.iso, sense, delta).map_err(Failure::run)?, grid))
}

/// What a surface is made of, with the grid of it.
fn parts<'a>(loaded: &'a Loaded, options: &Options) -> Result<(&'a dyn Field, Grid, Sense, f32), Failure> {
    let source = loaded.source();
    let grid = *source.grid();
    let sense = options.sense.unwrap_or(source.sense());
    let delta = Params::new(&grid, options.iso, sense).delta;
    Ok((loaded.field().map_err(Failure::run)?, grid, sense, delta))
}

/// Where a track starts: the user's words, or the centres that the source knows, or all of it.
fn seeds(args: &MethodArgs, loaded: &Loaded) -> Seeds {
    let mut seeds = Seeds {
        points: args.seeds.iter().map(|t| t.0.into()).collect(),
        coarse: args.coarse,
        search: args.search,
    };
    if seeds == Seeds::default() {
        match loaded {
            Loaded::Field { centres, .. } if !centres.is_empty() => seeds.points.clone_from(centres),
            _ => seeds.search = Some(1),
        }
    }
    seeds
}

impl Job<'_> {
    /// Follows the surface on the GPU.
    pub fn track_on_gpu(&self, gpu: &Gpu) -> Result<Done, TrackError> {
        let watchdog = Watchdog::new(self.args.run.time_limit, EXTRACTING);
        let extractor = Extractor::new(gpu.clone())?;
        watchdog.alive();
        let seeds = seeds(&self.args.method, self.loaded);
        let (extraction, told) = extractor.track(&self.source, self.options, &seeds, &|part| {
            watchdog.alive();
            self.progress.set(part);
        })?;
        drop(watchdog);
        let [vertices, triangles] =
            [extraction.report.vertices, extraction.report.triangles].map(|n| n as u32);
        let (needed, budget) = (
            GpuMesh::bytes_for(vertices, triangles) + GpuMesh::read_bytes_for(vertices, triangles),
            self.options.memory_budget,
        );
        if takes_main_memory(self.args) && needed > budget {
            let what = "the mesh on the GPU and in main memory";
            return Err(ExtractError::Budget { what, needed, budget }.into());
        }
        track_notes(&told).iter().for_each(|note| (self.remark)(note));
        let made = Made::Gpu(Box::new((extractor, extraction.mesh)));
        Ok(Done { made, report: extraction.report, told: track_stats(&told) })
    }

    /// Follows the surface on the CPU.
    pub fn track_on_cpu(&self) -> Result<Done, Failure> {
        let seeds = seeds(&self.args.method, self.loaded);
        let tell = |part| self.progress.set(part);
        let (mesh, report, told) =
            track::track(&self.source, self.options, &seeds, &tell).map_err(track_failure)?;
        track_notes(&told).iter().for_each(|note| (self.remark)(note));
        Ok(Done { made: Made::Cpu(mesh), report, told: track_stats(&told) })
    }

    /// Dual contouring of the uniform grid.
    pub fn sharp(&self) -> Result<Done, Failure> {
        let (surface, grid) = surface(self.loaded, self.options)?;
        let tell = |part| self.progress.set(part);
        let (budget, held) = (self.options.memory_budget, self.loaded.bytes());
        let made = sharp::extract(&surface, &grid, budget.saturating_sub(held), &tell);
        let (mesh, told) = made.map_err(|error| match error {
            SharpError::Budget { what, needed, .. } => {
                Failure::Budget(OverBudget { what, needed: needed + held, budget })
            }
            error => Failure::run(error),
        })?;
        (self.remark)(&format!("{} cells with an edge, {} with a corner", told.edges, told.corners));
        if told.flipped > 0 {
            (self.remark)(&format!(
                "{} polygons have a triangle that looks against the surface's normal: a finer grid helps",
                told.flipped
            ));
        }
        let told_json = serde_json::to_value(&told).map_err(Failure::run)?;
        let report = Report {
            vertices: told.vertices,
            triangles: told.triangles,
            non_finite: told.non_finite,
            bricks: grid.brick_count(),
            peak_bytes: told.peak_bytes + held,
            ..Report::default()
        };
        Ok(Done { made: Made::Cpu(mesh), report, told: told_json })
    }
}

/// Whether the user's words or the run are at fault.
pub fn track_failure(error: TrackError) -> Failure {
    match error {
        TrackError::NoSeeds
        | TrackError::SeedNotFinite { .. }
        | TrackError::CoarseStep
        | TrackError::SearchSize => Failure::usage(error),
        TrackError::Extract(error) => Failure::extract(error),
        _ => Failure::run(error),
    }
}

fn track_notes(told: &TrackReport) -> Vec<String> {
    let mut notes = Vec::new();
    for missed in told.missed.iter().take(TOLD) {
        notes.push(format!("seed {} {}", missed.point, missed.why));
    }
    if told.missed.len() > TOLD {
        notes.push(format!("and {} seeds more led to no surface", told.missed.len() - TOLD));
    }
    if let Some(search) = &told.search {
        let certain = if search.is_complete() {
            "every component of the sampled grid is found".into()
        } else if search.by_intervals {
            format!(
                "{} boxes of {} cells are undecided: a component that fits into one may be missing",
                search.undecided, search.cells
            )
        } else {
            format!("what fits into {} cells may be missing", search.cells)
        };
        notes.push(if search.by_intervals {
            format!("{} boxes are proven to hold no surface; {certain}", search.empty)
        } else {
            format!("the source has no intervals, its samples were looked at: {certain}")
        });
    }
    notes
}

fn track_stats(told: &TrackReport) -> Value {
    let search = told.search.as_ref().map(|s| {
        json!({"cells": s.cells, "empty": s.empty, "crossed": s.crossed, "undecided": s.undecided, "by_intervals": s.by_intervals})
    });
    json!({"seeds_missed": told.missed.len(), "rounds": told.rounds, "components": told.components, "dropped": told.dropped, "search": search})
}

/// [`octree::extract`] or [`octree::polygonize`].
type OctreeMethod = fn(
    &Surface<'_>,
    &Grid,
    &octree::Settings,
    &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, OctreeReport), OctreeError>;

impl Job<'_> {
    /// Dual contouring of an octree.
    pub fn dual_marching_cubes(&self) -> Result<Done, Failure> {
        self.on_octree(octree::extract)
    }

    /// Polygons in the leaves of an octree.
    pub fn octree(&self) -> Result<Done, Failure> {
        self.on_octree(octree::polygonize)
    }

    fn on_octree(&self, extract: OctreeMethod) -> Result<Done, Failure> {
        let (surface, grid) = surface(self.loaded, self.options)?;
        let plain = octree::Settings::new(&grid);
        let args = &self.args.method;
        let held = self.loaded.bytes();
        let in_memory = self.options.memory_budget.saturating_sub(held) / NODE_BYTES;
        let most_cells = args.most_cells.unwrap_or(plain.budget);
        let settings = octree::Settings {
            error: args.error.unwrap_or(plain.error),
            // Of an explicit 0 the library tells.
            budget: most_cells.min(in_memory.max(1)),
            ..plain
        };
        let tell = |part| self.progress.set(part);
        let (mesh, told) = extract(&surface, &grid, &settings, &tell).map_err(octree_failure)?;
        let flag = if in_memory < most_cells { "--memory-budget" } else { "--most-cells" };
        self.remark_on_octree(&told, settings.error, flag);
        let mut done = octree_done(mesh, &told, &grid);
        done.report.peak_bytes = held + told.nodes * NODE_BYTES;
        // Nodes across the grid's border are split whatever there is.
        let (needed, budget) = (done.report.peak_bytes, self.options.memory_budget);
        if needed > budget {
            let what = "the octree with its mesh";
            return Err(Failure::Budget(OverBudget { what, needed, budget }));
        }
        Ok(done)
    }

    /// `flag` is the one that allows more cells.
    fn remark_on_octree(&self, told: &OctreeReport, error: f32, flag: &str) {
        if told.unsplit > 0 {
            (self.remark)(&format!(
                "the octree's budget of cells ran out: {} cells of up to {} grid cells along an edge are left unsplit: \
                 raise it ({flag})",
                told.unsplit, told.unsplit_size
            ));
        }
        if told.over > 0 {
            let why = if told.unsplit > 0 {
                "for want of cells"
            } else {
                match self.loaded {
                    Loaded::Field { .. } => "where cells have the grid's size: a finer grid (-n) allows less",
                    Loaded::Volume { .. } => "where cells have the grid's size",
                }
            };
            (self.remark)(&format!(
                "{} triangles lie farther than {error} from the surface, the farthest {:.3e}, {why}",
                told.over, told.largest_error
            ));
        }
        if told.flipped > 0 {
            (self.remark)(&format!(
                "{} triangles look against the surface's normal, where the surface folds within a cell",
                told.flipped
            ));
        }
        if told.thin > 0 {
            (self.remark)(&format!(
                "bounds leave {} of the smallest cells in doubt: a part thinner than a cell could be missing there",
                told.thin
            ));
        }
    }
}

fn octree_failure(error: OctreeError) -> Failure {
    match error {
        OctreeError::Error(_) => Failure::usage(format!("--error: {error}")),
        OctreeError::Budget => Failure::usage(format!("--most-cells: {error}")),
        _ => Failure::run(error),
    }
}

fn octree_done(mesh: Mesh, told: &OctreeReport, grid: &Grid) -> Done {
    let report = Report {
        vertices: mesh.vertices.len() as u64,
        triangles: mesh.triangles.len() as u64,
        bricks: grid.brick_count(),
        ..Report::default()
    };
    let told = json!({
        "nodes": told.nodes, "leaves": told.leaves, "rounds": told.rounds, "largest_error": told.largest_error,
        "over": told.over, "stopped": told.stopped, "unsplit": told.unsplit, "unsplit_size": told.unsplit_size,
        "thin": told.thin, "flattened": told.flattened, "flipped": told.flipped,
    });
    Done { made: Made::Cpu(mesh), report, told }
}

/// The settings of the refiner: the user's words first, then the scene's.
pub fn refine_settings(
    args: &RefineArg,
    scene: &scene::Refine,
    grid: &Grid,
) -> Result<refine::Settings, Failure> {
    let (given, plain) = (args.0, refine::Settings::default().on(grid));
    let settings = refine::Settings {
        flatness: given.flatness.or(scene.flatness).unwrap_or(plain.flatness),
        epsilon: given.epsilon.or(scene.epsilon).unwrap_or(plain.epsilon),
        depth: given.depth.or(scene.depth).unwrap_or(plain.depth),
        step: given.step.or(scene.step).or(plain.step),
        ..plain
    };
    settings.check().map_err(|error| Failure::usage(format!("--refine: {error}")))?;
    Ok(settings)
}

impl Job<'_> {
    /// Refines a mesh where it lies, if the GPU can.
    pub fn refine(&self, made: Made, settings: &refine::Settings) -> Result<Done, Failure> {
        let most_triangles = settings.most_triangles.min(self.options.memory_budget / REFINED_BYTES);
        let settings = &refine::Settings { most_triangles, ..*settings };
        let mesh = match made {
            Made::Cpu(mesh) => mesh,
            Made::Gpu(made) => match self.refine_on_gpu(&made, settings)? {
                Ok((mesh, told)) => return self.refined(Made::Gpu(Box::new((made.0, mesh))), &told),
                // What only a GPU evaluates the CPU does not refine.
                Err(error) if !error.is_of_gpu() || backend::gpu_alone(&self.loaded.source()) => {
                    return Err(Failure::run(error));
                }
                Err(error) => {
                    (self.remark)(&format!("not refined on the GPU: {error}; the CPU does it"));
                    made.1.read(made.0.gpu()).map_err(Failure::run)?
                }
            },
        };
        let (surface, _) = surface(self.loaded, self.options)?;
        let tell = |part| self.progress.set(part);
        let (mesh, told) = refine::refine(&surface, &mesh, settings, &tell).map_err(Failure::run)?;
        self.refined(Made::Cpu(mesh), &told)
    }

    /// What the GPU made of it, or why it did not.
    fn refine_on_gpu(
        &self,
        (extractor, mesh): &(Extractor, GpuMesh),
        settings: &refine::Settings,
    ) -> Result<Result<(GpuMesh, RefineReport), RefineError>, Failure> {
        let (field, _, sense, delta) = parts(self.loaded, self.options)?;
        let surface = Surface::on_gpu(field, self.options.iso, sense, delta);
        let watchdog = Watchdog::new(self.args.run.time_limit, EXTRACTING);
        Ok(extractor.refine(&surface, mesh, settings, &|part| {
            watchdog.alive();
            self.progress.set(part);
        }))
    }

    fn refined(&self, made: Made, told: &RefineReport) -> Result<Done, Failure> {
        self.remark_on_refining(told);
        let [vertices, triangles] =
            told.levels.last().map_or([0; 2], |level| [level.vertices, level.triangles]);
        let report = Report { vertices, triangles, ..Report::default() };
        Ok(Done { made, report, told: refine_stats(told) })
    }

    fn remark_on_refining(&self, told: &RefineReport) {
        if told.not_converged > 0 {
            (self.remark)(&format!(
                "{} vertices are not on the surface: none was found near them, and they stayed in the middle of their edges",
                told.not_converged
            ));
        }
        if told.taken_back > 0 {
            (self.remark)(&format!(
                "{} vertices were taken back, so that no triangle turns over",
                told.taken_back
            ));
        }
    }
}

fn refine_stats(told: &RefineReport) -> Value {
    let level = |l: &refine::Level| json!({"vertices": l.vertices, "triangles": l.triangles, "bent": l.bent, "for_shape": l.for_shape});
    json!({
        "levels": told.levels.iter().map(level).collect::<Vec<_>>(),
        "projected": told.projected,
        "not_converged": told.not_converged,
        "taken_back": told.taken_back,
        "singular": told.singular,
    })
}
