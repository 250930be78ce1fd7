//! `isoforge extract` of a volume that is larger than the memory budget, or whose mesh is: from file to file, a part at a time.

use super::args::{Backend, ExtractArgs};
use super::extract::{Finished, summary};
use super::progress::Progress;
use super::source;
use super::stats::{Seconds, Stats};
use super::{Failure, OverBudget, tell};
use crate::extract::{ExtractError, Options, PlanesError, Report, extract_planes};
use crate::mesh::write;
use crate::volume::{self, Planes};
use serde_json::Value;
use std::path::Path;
use std::time::Instant;

/// What else helps where a volume cannot be extracted a part at a time.
const REMEDY: &str = "raise the budget (--memory-budget), or extract by --method mc, mc33 or mt to one .ply or .stl file alone, which \
    holds a part of the volume at a time";

/// An extraction from file to file.
pub struct Job<'a> {
    pub args: &'a ExtractArgs,
    pub memory_budget: u64,
    /// When the program began.
    pub start: Instant,
    pub progress: &'a Progress,
    pub remark: &'a dyn Fn(&str),
}

impl Job<'_> {
    /// Extracts the volume if it is too large to be held, and says whether it was; else nothing has happened.
    pub fn run(&self) -> Result<bool, Failure> {
        let Self { args, memory_budget, .. } = *self;
        let path = Path::new(&args.source.source);
        let is_volume = match args.raw.dims {
            Some(_) => source::is_raw(&args.source.source),
            None => volume::is_volume_ending(path),
        };
        if !is_volume || args.source.blobs.given().is_some() {
            return Ok(false);
        }
        let options = source::open_options(&args.source, &args.raw, memory_budget)?;
        // What is wrong with the file is said by those who read it whole.
        let Ok(mut planes) = Planes::open(path, &options) else { return Ok(false) };
        let bytes = planes.bytes();
        // Beside the volume there must be room for the mesh.
        if bytes <= memory_budget / 4 * 3 {
            return Ok(false);
        }
        let output = match target(args) {
            Ok(output) => output,
            Err(_) if bytes <= memory_budget => return Ok(false),
            Err(obstacle) => {
                return Err(Failure::run(format!(
                    "{}: the volume's {bytes} bytes do not fit the memory budget of {memory_budget}, and {obstacle}: {REMEDY}",
                    path.display()
                )));
            }
        };
        (self.remark)(&format!(
            "the volume's {bytes} bytes hardly fit the memory budget of {memory_budget}, or not at all: it is read a part at a time, by the CPU"
        ));
        if let Some(text) = source::precision_remark(planes.grid()) {
            (self.remark)(&text);
        }
        let report = self.extract(&mut planes, output)?;
        planes.notes().iter().for_each(|note| (self.remark)(note));
        self.report(&report)?;
        Ok(true)
    }

    /// Extracts a volume that can be held, but not beside its mesh. What the file is like has been told.
    pub fn run_for_mesh(&self, over: &OverBudget) -> Result<(), Failure> {
        let args = self.args;
        let output =
            target(args).map_err(|obstacle| Failure::run(format!("{over}, and {obstacle}: {REMEDY}")))?;
        let options = source::open_options(&args.source, &args.raw, self.memory_budget)?;
        let mut planes = Planes::open(Path::new(&args.source.source), &options)
            .map_err(|error| Failure::run(format!("{over}: raise it (--memory-budget). {error}")))?;
        (self.remark)(&format!("{over}: the volume is read a part at a time, by the CPU"));
        let report = self.extract(&mut planes, output)?;
        self.report(&report)
    }

    fn extract(&self, planes: &mut Planes, output: &Path) -> Result<Report, Failure> {
        let Self { args, memory_budget, progress, .. } = *self;
        let Some(iso) = args.source.iso else {
            return Err(Failure::usage(
                "a volume needs an iso value, -I VALUE; its values were not looked at, since they do not fit the memory budget",
            ));
        };
        if !iso.is_finite() {
            return Err(Failure::usage(format!("-I {iso}: give a finite number")));
        }
        let sense = args.source.inside.map(Into::into);
        let method = args.method.method.of_cells().unwrap_or_default();
        let placement = args.method.placement();
        let settings = Options { sense, method, placement, memory_budget, ..Options::new(iso) };
        progress.phase("extracting");
        let report = extract_planes(planes, &settings, output, &|part| progress.set(part));
        report.map_err(|error| match error {
            PlanesError::Extract(ExtractError::Budget { what, needed, budget }) => {
                let over = OverBudget { what, needed, budget };
                Failure::run(format!("{over}: raise the budget (--memory-budget)"))
            }
            error => Failure::run(error),
        })
    }

    /// Says what became of it.
    fn report(&self, report: &Report) -> Result<(), Failure> {
        let Self { args, .. } = *self;
        if report.non_finite > 0 {
            (self.remark)(&format!("{} samples are NaN or infinite and count as outside", report.non_finite));
        }
        if report.triangles == 0 {
            tell("the mesh is empty: no sample crosses the iso value");
        }
        let finished = Finished { open_edges: report.open_edges, ..Finished::default() };
        let seconds = Seconds { total: self.start.elapsed().as_secs_f64(), ..Seconds::of(report) };
        (self.remark)(&summary(args, report, &finished, None, seconds.total));
        if let Some(path) = &args.stats {
            let stats = Stats {
                vertices: report.vertices,
                triangles: report.triangles,
                degenerate_triangles: None,
                removed_triangles: 0,
                flipped_triangles: 0,
                open_edges: report.open_edges,
                bricks: report.bricks,
                active_bricks: report.active_bricks,
                slabs: report.slabs,
                non_finite_samples: report.non_finite,
                backend: "cpu",
                adapter: None,
                peak_bytes: report.peak_bytes,
                scratch_bytes: report.scratch_bytes,
                method: args.method.named(Value::Null),
                refined: None,
                coloured: None,
                seconds,
            };
            super::write_text(&serde_json::to_string(&stats).map_err(Failure::run)?, path)?;
        }
        Ok(())
    }
}

/// The file that the mesh goes to in parts, or what asks for the whole volume, or the whole mesh, at once.
fn target(args: &ExtractArgs) -> Result<&Path, &'static str> {
    let of = &args.method;
    let in_parts = |path: &Path| write::ending(path).is_some_and(|ending| ["ply", "stl"].contains(&ending));
    let obstacles = [
        (args.png.is_some(), "--png needs the whole mesh"),
        (args.no_degenerate, "--no-degenerate needs the whole mesh"),
        (args.colour.color_by.is_some(), "--color-by needs the whole mesh"),
        (of.refine.is_some(), "--refine needs the whole mesh"),
        (of.cap, "--cap needs the whole volume"),
        (of.sharp, "--sharp needs the whole volume"),
        (of.track, "--track needs the whole volume"),
        (of.method.of_cells().is_none(), "--method dmc and octree need the whole volume"),
        (args.run.backend == Backend::Gpu, "--backend gpu needs the whole volume"),
    ];
    if let Some((_, obstacle)) = obstacles.into_iter().find(|(is_there, _)| *is_there) {
        return Err(obstacle);
    }
    let output = args.output.as_deref().ok_or("no file is named for the mesh")?;
    if in_parts(output) { Ok(output) } else { Err("only .ply and .stl files are written in parts") }
}
