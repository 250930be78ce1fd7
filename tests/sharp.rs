//! Dual contouring on the uniform grid: sharp edges and corners, sound meshes.

mod common;
#[path = "sharp/features.rs"]
mod features;
#[path = "sharp/measure.rs"]
mod measure;
#[path = "sharp/soundness.rs"]
mod soundness;

use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Field, Sense, Surface};
use isoforge::graph::{Expr, GraphField};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::sharp::{SharpReport, extract};

fn graph(solid: &Expr) -> GraphField {
    GraphField::new(solid, Sense::Below)
}

fn cube(n: u32, half: f32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::splat(-half), Vec3::splat(half)).expect("a good grid")
}

/// The sharp mesh at iso 0.
fn sharp(field: &dyn Field, grid: &Grid) -> (Mesh, SharpReport) {
    let delta = grid.shortest_step() as f32 * 0.01;
    let surface = Surface::new(field, 0.0, field.sense(), delta).expect("the CPU evaluates it");
    extract(&surface, grid, u64::MAX, &|_| {}).expect("it can be extracted")
}

/// The marching cubes mesh at iso 0.
fn uniform(field: &dyn Field, grid: &Grid) -> Mesh {
    extract_on_cpu(&Source::Field(field, *grid), &Options::new(0.0), &|_| {}).expect("it can be extracted").0
}
