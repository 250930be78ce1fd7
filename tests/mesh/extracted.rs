//! Meshes as extraction makes them, and noise.

use crate::common::Random;
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::named::Named;
use isoforge::grid::Grid;
use isoforge::mesh::{Mesh, Vertex};
use isoforge::volume::Volume;

/// The surface of a named field, with n cells along each axis.
pub fn named(name: &str, n: u32) -> Mesh {
    let field = Named::new(name).unwrap();
    let half = Vec3::splat(field.definition().half_edge);
    let grid = Grid::from_bounds([n; 3], -half, half).unwrap();
    let options = Options::new(field.definition().iso);
    extract_on_cpu(&Source::Field(&field, grid), &options, &|_| {}).unwrap().0
}

/// The surface of random samples on n³ cells, closed by samples outside all around it: many components and handles.
pub fn noise(n: u32, seed: u64, closed: bool) -> Mesh {
    surface(n, seed, closed, |random| random.unit() - 0.5)
}

/// As [`noise`], closed, of samples that are often equal to iso.
pub fn ties(n: u32, seed: u64) -> Mesh {
    surface(n, seed, true, |random| [-1.0, 0.0, 0.0, 1.0, 1.0][random.below(5)])
}

fn surface(n: u32, seed: u64, closed: bool, sample: impl Fn(&mut Random) -> f32) -> Mesh {
    let grid = Grid::from_bounds([n; 3], Vec3::ZERO, Vec3::ONE).unwrap();
    let points = grid.points();
    let mut random = Random(seed);
    let values = (0..grid.point_count() as u32).map(|i| {
        let p = [i % points.x, i / points.x % points.y, i / (points.x * points.y)];
        let rim = closed && p.iter().any(|&x| x == 0 || x == n);
        if rim { -1.0 } else { sample(&mut random) }
    });
    let volume = Volume::new(grid, values.collect()).unwrap();
    extract_on_cpu(&Source::Volume(&volume), &Options::new(0.0), &|_| {}).unwrap().0
}

/// Every triangle with vertices of its own, each moved by at most `shake`.
pub fn soup(mesh: &Mesh, shake: f32, random: &mut Random) -> Mesh {
    let mut vertices = Vec::new();
    for &v in mesh.triangles.as_flattened() {
        let vertex = mesh.vertices[v as usize];
        vertices.push(Vertex { position: (vertex.at() + shake * random.in_ball()).to_array(), ..vertex });
    }
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Mesh { vertices, triangles }
}
