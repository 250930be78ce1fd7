//! Points from a file as a field: molecules, particles.

use super::Failure;
use super::args::{KernelArg, SourceArgs};
use super::source::{CELLS, Loaded, even_cells};
use crate::components::{self, OpenOptions};
use crate::field::Sense;
use crate::graph::GraphField;
use crate::graph::blobs::{BLOBBY, Blobs, Kernel};
use crate::grid::{Grid, GridError};
use glam::Vec3;
use std::path::Path;

/// The iso value unless the user says.
const ISO: f32 = 0.5;

/// Reads the points of `path`; the second value is remarks.
pub(super) fn load_components(
    args: &SourceArgs,
    path: &Path,
    memory_budget: u64,
) -> Result<(Loaded, Vec<String>), Failure> {
    if let Some((name, _)) = args.parameters.first() {
        return Err(Failure::usage(format!("--param {name}: points have no parameters")));
    }
    if args.half_edge.is_some() {
        return Err(Failure::usage(
            "-L is for fields; points have a box of their own, which --bounds changes",
        ));
    }
    let iso = args.iso.unwrap_or(ISO);
    let kernel = match args.blobs.kernel.unwrap_or_default() {
        KernelArg::Soft => Kernel::SoftObject,
        KernelArg::Metaball => Kernel::Metaball,
        KernelArg::Blobby => BLOBBY,
        KernelArg::InverseSquare => Kernel::InverseSquare,
    };
    if kernel == Kernel::InverseSquare && iso <= 0.0 {
        return Err(Failure::usage(format!("-I {iso}: the inverse square needs a value over 0")));
    }
    let support = support(args, kernel, iso)?;
    let radius = args.blobs.radius.unwrap_or(OpenOptions::default().radius);
    if !(radius.is_finite() && radius > 0.0) {
        return Err(Failure::usage(format!("--radius {radius}: give a number over zero")));
    }
    // The lists that points are sorted by take as much again, and half of that.
    let options = OpenOptions { radius, max_bytes: Some(memory_budget / 5 * 2) };
    let loaded = components::open(path, &options).map_err(Failure::run)?;
    let centres = loaded.components.iter().map(|c| c.position.into()).collect();
    let blobs = Blobs::of_points(kernel, loaded.components, iso, support)
        .map_err(|error| Failure::run(format!("{}: {error}", path.display())))?;
    let grid = grid(args, blobs.support())?;
    let field = GraphField::new(&blobs.expr(), Sense::Above);
    Ok((Loaded::Field { field: Box::new(field), grid, iso: ISO, centres }, loaded.notes))
}

/// How many of its radii a point reaches.
fn support(args: &SourceArgs, kernel: Kernel, iso: f32) -> Result<f32, Failure> {
    match args.blobs.support {
        Some(support) if support.is_finite() && support > 0.0 => Ok(support),
        Some(support) => Err(Failure::usage(format!("--support {support}: give a number over zero"))),
        // The message on an iso value that is no number comes later, with all sources'.
        None => kernel.support_for(iso).or(iso.is_nan().then_some(1.0)).ok_or_else(|| {
            Failure::usage(format!(
                "-I {iso}: a lone point's blob has no surface there, so none can be put at its radius: give a value \
                 between 0 (0.001 for blobby) and 1, or say with --support how many radii blobs reach"
            ))
        }),
    }
}

/// The grid around what the points reach.
fn grid(args: &SourceArgs, support: [[f32; 3]; 2]) -> Result<Grid, Failure> {
    let [low, high] = args.bounds.unwrap_or_else(|| {
        let [low, high] = support.map(Vec3::from);
        // The surface lies within the support: a little more keeps it off the border.
        let margin = 0.01 * (high - low).max_element();
        [low - margin, high + margin]
    });
    let cells = match args.cells {
        Some(cells) if cells != [cells[0]; 3] || args.bounds.is_some() => cells,
        given => even_cells(given.map_or(CELLS, |[n, ..]| n), low, high),
    };
    let cells = if args.cells.is_some_and(|cells| cells.contains(&0)) { [0; 3] } else { cells };
    Grid::from_bounds(cells, low, high).map_err(|error| match error {
        GridError::Cells { .. } => Failure::usage(format!("-n: {error}")),
        _ if args.bounds.is_some() => Failure::usage(format!("--bounds: {error}")),
        _ => Failure::run(error),
    })
}
