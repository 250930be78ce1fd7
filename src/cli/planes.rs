//! `isoforge extract` of a volume that is larger than the memory budget: from file to file, a part at a time.

use super::Failure;
use super::args::{Backend, ExtractArgs};
use super::extract::{Finished, summary};
use super::progress::Progress;
use super::source;
use super::stats::{Seconds, Stats};
use crate::extract::{Options, extract_planes};
use crate::mesh::write;
use crate::volume::{self, Planes};
use serde_json::Value;
use std::path::Path;
use std::time::Instant;

/// Extracts the volume if it is too large to be held, and says whether it was; else nothing has happened.
pub fn run(
    args: &ExtractArgs,
    memory_budget: u64,
    progress: &Progress,
    remark: &dyn Fn(&str),
) -> Result<bool, Failure> {
    let start = Instant::now();
    let path = Path::new(&args.source.source);
    let is_raw = volume::is_raw_ending(path);
    if !volume::is_volume_ending(path)
        || args.raw.dims.is_some() && !is_raw
        || args.source.blobs.given().is_some()
    {
        return Ok(false);
    }
    let options = source::open_options(&args.source, &args.raw, memory_budget)?;
    // What is wrong with the file is said by those who read it whole.
    let Ok(mut planes) = Planes::open(path, &options) else { return Ok(false) };
    // Beside the volume there must be room for the mesh.
    if planes.bytes() <= memory_budget / 4 * 3 {
        return Ok(false);
    }
    let is_held = planes.bytes() <= memory_budget;
    if let Some(obstacle) = obstacle(args) {
        if is_held {
            return Ok(false);
        }
        return Err(Failure::run(format!(
            "{}: the volume's {} bytes do not fit the memory budget of {memory_budget}, and {obstacle}: raise the budget \
             (--memory-budget), or extract by --method mc, mc33 or mt to one .ply or .stl file alone, which holds a part of the \
             volume at a time",
            path.display(),
            planes.bytes()
        )));
    }
    let Some(iso) = args.source.iso else {
        return Err(Failure::usage(
            "a volume needs an iso value, -I VALUE; its values were not looked at, since they do not fit the memory budget",
        ));
    };
    if !iso.is_finite() {
        return Err(Failure::usage(format!("-I {iso}: give a finite number")));
    }
    let Some(output) = &args.output else { return Ok(false) };
    remark(&format!(
        "the volume's {} bytes hardly fit the memory budget of {memory_budget}, or not at all: it is read a part at a time, by the CPU",
        planes.bytes()
    ));
    if let Some(text) = source::precision_remark(planes.grid()) {
        remark(&text);
    }
    let sense = args.source.inside.map(Into::into);
    let method = args.method.method.of_cells().unwrap_or_default();
    let placement = args.method.placement();
    let settings = Options { sense, method, placement, memory_budget, ..Options::new(iso) };
    progress.phase("extracting");
    let report =
        extract_planes(&mut planes, &settings, output, &|part| progress.set(part)).map_err(Failure::run)?;
    planes.notes().iter().for_each(|note| remark(note));
    if report.non_finite > 0 {
        remark(&format!("{} samples are NaN or infinite and count as outside", report.non_finite));
    }
    if report.triangles == 0 {
        remark(&format!("the mesh is empty: no sample crosses iso {iso}"));
    }
    let finished = Finished { open_edges: report.open_edges, ..Finished::default() };
    let seconds = Seconds { total: start.elapsed().as_secs_f64(), ..Seconds::of(&report) };
    remark(&summary(args, &report, &finished, None, seconds.total));
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
    Ok(true)
}

/// What asks for the whole volume, or the whole mesh, at once.
fn obstacle(args: &ExtractArgs) -> Option<&'static str> {
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
        (args.output.is_none(), "no file is named for the mesh"),
        (
            args.output.as_deref().is_some_and(|path| !in_parts(path)),
            "only .ply and .stl files are written in parts",
        ),
    ];
    obstacles.into_iter().find_map(|(is_there, what)| is_there.then_some(what))
}
