//! The methods beside the sweep by marching cubes: which flags go together, and how they are called.

use super::Failure;
use super::args::{Backend, ExtractArgs, MethodArg, MethodArgs, NormalsArg};
use super::progress::Progress;
use super::source::Loaded;
use super::watchdog::{EXTRACTING, Watchdog};
use crate::extract::{Extractor, Options, Report, Source};
use crate::field::Surface;
use crate::gpu::{Gpu, GpuMesh};
use crate::grid::Grid;
use crate::mesh::Mesh;
use crate::octree;
use crate::sharp;
use crate::stage::params::Params;
use crate::track::{self, Seeds, TrackReport};
use serde_json::{Value, json};

/// The most seeds without surface that are told one by one.
const TOLD: usize = 5;

impl MethodArgs {
    /// Whether vertices are marching cubes', on edges of the grid.
    fn is_mc(&self) -> bool {
        !self.sharp && self.method == MethodArg::Mc
    }

    /// The flag that asks for what only the CPU does.
    pub fn cpu_alone(&self) -> Option<&'static str> {
        match self.method {
            MethodArg::Octree => Some("--method octree"),
            MethodArg::Dmc => Some("--method dmc"),
            MethodArg::Mc => self.sharp.then_some("--sharp"),
        }
    }
}

/// Refuses flags that say nothing together, before the long work.
pub fn check(args: &ExtractArgs) -> Result<(), Failure> {
    let of = &args.method;
    let pairs = [
        (of.sharp && of.method != MethodArg::Mc, "--sharp", "is of the uniform grid: leave it or --method out (dmc keeps edges by itself)"),
        (of.track && !of.is_mc(), "--track", "follows marching cubes alone: leave it or the other method out"),
        (of.error.is_some() && of.method == MethodArg::Mc, "--error", "is of --method dmc and octree"),
        (of.most_cells.is_some() && of.method == MethodArg::Mc, "--most-cells", "is of --method dmc and octree"),
    ];
    if let Some((_, flag, why)) = pairs.into_iter().find(|(wrong, ..)| *wrong) {
        return Err(Failure::usage(format!("{flag} {why}")));
    }
    if let (Some(flag), Backend::Gpu) = (of.cpu_alone(), args.run.backend) {
        return Err(Failure::usage(format!("{flag} is done by the CPU: leave out --backend gpu")));
    }
    let differences = matches!(args.source.normals, Some(NormalsArg::Forward | NormalsArg::Central));
    if differences && !(of.is_mc() && of.refine.is_none()) {
        return Err(Failure::usage("--normals: with --refine, --sharp and --method normals are exact, or central differences where a field has no gradient: leave it out"));
    }
    Ok(())
}

/// What a method made, in numbers that the extraction has too, and what it has to tell beside.
pub struct Done {
    pub mesh: Mesh,
    pub report: Report,
    /// Remarks for the user.
    pub notes: Vec<String>,
    /// For `--stats`.
    pub stats: Value,
}

/// The surface and the grid of what was loaded, as the methods beside marching cubes take them.
pub fn surface<'a>(loaded: &'a Loaded, options: &Options) -> Result<(Surface<'a>, Grid), Failure> {
    let source = loaded.source();
    let grid = *source.grid();
    let sense = options.sense.unwrap_or(source.sense());
    let delta = Params::new(&grid, options.iso, sense).delta;
    let surface = Surface::new(loaded.field().map_err(Failure::run)?, options.iso, sense, delta);
    Ok((surface.map_err(Failure::run)?, grid))
}

/// Where a track starts: the user's words, or the centres that the source knows, or all of it.
fn seeds(args: &MethodArgs, loaded: &Loaded) -> Seeds {
    let mut seeds = Seeds { points: args.seeds.iter().map(|t| t.0.into()).collect(), coarse: args.coarse, search: args.search };
    if seeds == Seeds::default() {
        match loaded {
            Loaded::Field { centres, .. } if !centres.is_empty() => seeds.points.clone_from(centres),
            _ => seeds.search = Some(1),
        }
    }
    seeds
}

/// Follows the surface on the CPU.
pub fn track_on_cpu(args: &ExtractArgs, loaded: &Loaded, options: &Options, progress: &Progress) -> Result<Done, Failure> {
    let seeds = seeds(&args.method, loaded);
    let (mesh, report, told) =
        track::track(&loaded.source(), options, &seeds, &|part| progress.set(part)).map_err(Failure::run)?;
    let (notes, stats) = (track_notes(&told), track_stats(&told));
    Ok(Done { mesh, report, notes, stats })
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
            format!("{} boxes of {} cells are undecided: a component that fits into one may be missing", search.undecided, search.cells)
        } else {
            format!("the source has no intervals, so boxes of {} cells were looked at by their corners alone: what fits into one may be missing", search.cells)
        };
        notes.push(format!("{} boxes are proven to hold no surface; {certain}", search.empty));
    }
    notes
}

fn track_stats(told: &TrackReport) -> Value {
    let search = told.search.as_ref().map(|s| {
        json!({"cells": s.cells, "empty": s.empty, "crossed": s.crossed, "undecided": s.undecided, "by_intervals": s.by_intervals})
    });
    json!({"seeds_missed": told.missed.len(), "rounds": told.rounds, "components": told.components, "dropped": told.dropped, "search": search})
}

/// Dual contouring of the uniform grid.
pub fn sharp(loaded: &Loaded, options: &Options, progress: &Progress) -> Result<Done, Failure> {
    let (surface, grid) = surface(loaded, options)?;
    let (mesh, told) = sharp::extract(&surface, &grid, &|part| progress.set(part)).map_err(Failure::run)?;
    let report = Report { vertices: told.vertices, triangles: told.triangles, non_finite: told.non_finite, ..Report::default() };
    let mut notes = vec![format!("{} cells with an edge, {} with a corner", told.edges, told.corners)];
    if told.fallbacks + told.flipped > 0 {
        notes.push(format!("{} vertices lie at the mean of their crossings; {} triangles look against the surface's normal", told.fallbacks, told.flipped));
    }
    let stats = serde_json::to_value(&told).map_err(Failure::run)?;
    Ok(Done { mesh, report, notes, stats })
}
