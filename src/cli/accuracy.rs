//! `isoforge accuracy`: how far meshes of several methods lie from the surface, and at what cost.

use super::args::SourceArgs;
use super::extract::uncrossed;
use super::source::{self, Opened};
use super::values::{RefineArg, cells, parameter, refine as refine_arg};
use super::{Failure, backend, method, say, tell};
use crate::accuracy::{Accuracy, measure};
use crate::extract::{Options, Source, extract_on_cpu};
use crate::field::Surface;
use crate::grid::Grid;
use crate::mesh::Mesh;
use crate::octree;
use crate::refine::{self, refine};
use crate::sharp;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

#[derive(Debug, Args)]
pub struct AccuracyArgs {
    /// What is meshed: one or more sources as of `extract`, scenes for example
    #[arg(required = true, value_name = "SOURCE")]
    pub sources: Vec<String>,

    /// The iso value [default: the source's own]
    #[arg(short = 'I', long, value_name = "VALUE", allow_negative_numbers = true)]
    pub iso: Option<f32>,

    /// Cells along each axis: one number, or x,y,z [default: the scene's, or 128]
    #[arg(short = 'n', long, value_name = "N", value_parser = cells, allow_hyphen_values = true)]
    pub cells: Option<[u32; 3]>,

    /// A parameter of every source; may be repeated
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parameter)]
    pub parameters: Vec<(String, f64)>,

    /// How triangles are split, as of `extract` [default: the scene's words]
    #[arg(long, value_name = "flatness=0.95,epsilon=1e-4,depth=5,step=L", value_parser = refine_arg)]
    pub refine: Option<RefineArg>,

    /// Write one JSON array instead of tables; - for standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// Cells along the longest axis from which on a finer uniform grid is not tried.
const FINEST: u32 = 1024;
/// How much finer the next grid is that is tried, before the interval is halved so often.
const GROWTH: f64 = 1.4;
const HALVINGS: u32 = 4;
/// Runs of which the fastest counts.
const RUNS: u32 = 5;
/// Samples of the surface of a mesh.
const SAMPLES: usize = 200_000;

/// A mesh of one method.
#[derive(Debug, Serialize)]
struct Row {
    method: String,
    triangles: usize,
    /// Corners of all triangles, as a triangle soup stores them.
    points: usize,
    /// Vertices.
    welded_points: usize,
    milliseconds: f64,
    #[serde(flatten)]
    error: Accuracy,
}

/// What is measured of one source.
#[derive(Debug, Serialize)]
struct Table {
    source: String,
    cells: [u32; 3],
    rows: Vec<Row>,
    /// Triangles of the refined mesh beside those of the uniform grid that has its error, if one has.
    triangles_ratio: Option<f64>,
}

/// Measures and prints.
pub fn run(args: &AccuracyArgs) -> Result<(), Failure> {
    let mut tables = Vec::new();
    for name in &args.sources {
        let table = measure_source(name, args)?;
        if args.json.is_none() {
            print(&table)?;
        }
        tables.push(table);
    }
    let Some(path) = &args.json else { return Ok(()) };
    super::write_text(&serde_json::to_string(&tables).map_err(Failure::run)?, path)
}

fn measure_source(name: &str, args: &AccuracyArgs) -> Result<Table, Failure> {
    let source = SourceArgs {
        source: name.into(),
        iso: args.iso,
        cells: args.cells,
        parameters: args.parameters.clone(),
        ..SourceArgs::default()
    };
    let memory_budget = backend::memory_budget(None);
    let Opened { loaded, notes, refine: wanted, .. } =
        source::load(&source, &Default::default(), memory_budget)?;
    notes.iter().for_each(tell);
    let options = loaded.options(&source, memory_budget)?;
    let (surface, grid) = method::surface(&loaded, &options)?;
    let settings = method::refine_settings(&args.refine.unwrap_or_default(), &wanted, &grid)?;
    let contest = Contest { surface, options, settings };

    let mut rows = vec![contest.row("uniform", || contest.uniform(&grid))?];
    if rows[0].triangles == 0 {
        let range = loaded.source().value_range();
        let why = uncrossed(contest.options.iso, range, "");
        return Err(Failure::run(format!("{name}: there is no surface to measure from: {why}")));
    }
    let refined = contest.row("refined", || {
        let mesh = contest.uniform(&grid)?;
        Ok(refine(&surface, &mesh, &contest.settings, &|_| {}).map_err(Failure::run)?.0)
    })?;
    rows.push(refined);
    rows.push(contest.row("sharp", || {
        Ok(sharp::extract(&surface, &grid, memory_budget, &|_| {}).map_err(Failure::run)?.0)
    })?);
    let of_octree = octree::Settings::new(&grid);
    rows.push(
        contest.row("dmc", || {
            Ok(octree::extract(&surface, &grid, &of_octree, &|_| {}).map_err(Failure::run)?.0)
        })?,
    );
    rows.push(contest.row("octree", || {
        Ok(octree::polygonize(&surface, &grid, &of_octree, &|_| {}).map_err(Failure::run)?.0)
    })?);
    let equal = contest.uniform_with_error(&grid, rows[1].error.distance_rms)?;
    let triangles_ratio = equal.as_ref().map(|row| rows[1].triangles as f64 / row.triangles as f64);
    rows.extend(equal);
    Ok(Table { source: name.into(), cells: grid.cells().to_array(), rows, triangles_ratio })
}

/// One surface, meshed in several ways.
struct Contest<'a> {
    surface: Surface<'a>,
    options: Options,
    settings: refine::Settings,
}

impl Contest<'_> {
    fn uniform(&self, grid: &Grid) -> Result<Mesh, Failure> {
        let source = Source::Field(self.surface.field(), *grid);
        Ok(extract_on_cpu(&source, &self.options, &|_| {}).map_err(Failure::run)?.0)
    }

    /// Times and measures what `make` makes.
    fn row(&self, method: &str, make: impl Fn() -> Result<Mesh, Failure>) -> Result<Row, Failure> {
        let mut best = f64::INFINITY;
        let mut mesh = Mesh::default();
        for _ in 0..RUNS {
            let since = Instant::now();
            mesh = make()?;
            best = best.min(since.elapsed().as_secs_f64() * 1e3);
        }
        Ok(Row {
            method: method.into(),
            triangles: mesh.triangles.len(),
            points: 3 * mesh.triangles.len(),
            welded_points: mesh.vertices.len(),
            milliseconds: best,
            error: measure(&self.surface, &mesh, SAMPLES).map_err(Failure::run)?,
        })
    }

    /// The coarsest uniform grid, up to [`FINEST`], whose mesh has at most that error (root of the mean square).
    fn uniform_with_error(&self, grid: &Grid, error: f64) -> Result<Option<Row>, Failure> {
        let finer = |factor: f64| {
            let cells = grid.cells().to_array().map(|n| (f64::from(n) * factor).round().max(1.0) as u32);
            let far = grid.position(grid.cells().as_vec3());
            (cells, Grid::from_bounds(cells, grid.origin(), far))
        };
        let reaches = |factor: f64| -> Result<bool, Failure> {
            let mesh = self.uniform(&finer(factor).1.map_err(Failure::run)?)?;
            Ok(measure(&self.surface, &mesh, SAMPLES).map_err(Failure::run)?.distance_rms <= error)
        };
        let longest = f64::from(grid.cells().max_element());
        let (mut low, mut high) = (1.0, 1.0);
        while !reaches(high)? {
            if high * longest >= f64::from(FINEST) {
                return Ok(None);
            }
            (low, high) = (high, (high * GROWTH).min(f64::from(FINEST) / longest));
        }
        for _ in 0..HALVINGS {
            let middle = (low + high) / 2.0;
            if reaches(middle)? { high = middle } else { low = middle }
        }
        let ([x, y, z], grid) = finer(high);
        let grid = grid.map_err(Failure::run)?;
        let cells = if x == y && y == z { format!("{x}³") } else { format!("{x}x{y}x{z}") };
        self.row(&format!("uniform, {cells}"), || self.uniform(&grid)).map(Some)
    }
}

fn print(table: &Table) -> Result<(), Failure> {
    let [x, y, z] = table.cells;
    say(format_args!("{}, {x}x{y}x{z} cells", table.source))?;
    say(format_args!(
        "{:<20}{:>11}{:>11}{:>11}{:>9}{:>11}{:>11}{:>9}{:>9}",
        "", "triangles", "points", "welded", "ms", "max error", "RMS error", "normal", "max"
    ))?;
    for row in &table.rows {
        let error = &row.error;
        say(format_args!(
            "{:<20}{:>11}{:>11}{:>11}{:>9.1}{:>11.2e}{:>11.2e}{:>8.2}°{:>8.1}°",
            row.method,
            row.triangles,
            row.points,
            row.welded_points,
            row.milliseconds,
            error.distance_max,
            error.distance_rms,
            error.normal_rms,
            error.normal_max
        ))?;
        if error.lost > 0 {
            say(format_args!(
                "{:<20}{} of {} samples found no way to the surface",
                "", error.lost, error.samples
            ))?;
        }
    }
    match table.triangles_ratio {
        Some(ratio) => say(format_args!(
            "refined: {:.1} % of the triangles of the uniform grid that has its RMS error\n",
            100.0 * ratio
        )),
        None => say(format_args!(
            "no uniform grid of up to {FINEST} cells an axis has the refined mesh's RMS error\n"
        )),
    }
}
