//! The surface tracker against the sweep.

#[path = "track/bad_input.rs"]
mod bad_input;
mod common;
#[path = "track/gpu.rs"]
mod gpu;
#[path = "track/huge.rs"]
mod huge;
#[path = "track/search.rs"]
mod search;
#[path = "track/sweep.rs"]
mod sweep;

use common::Random;
use glam::{Mat3, Vec3};
use isoforge::field::Sense;
use isoforge::graph::{Expr, GraphField, shapes::*};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use std::collections::BTreeSet;

/// Balls with centres in the unit cube, their radii up to `most`.
fn balls(random: &mut Random, count: usize, most: f32) -> (Vec<(Vec3, f32)>, GraphField) {
    let place = |random: &mut Random| Vec3::new(random.unit(), random.unit(), random.unit());
    let all: Vec<(Vec3, f32)> =
        (0..count).map(|_| (place(random), most * (0.2 + 0.8 * random.unit()))).collect();
    let expr: Vec<Expr> =
        all.iter().map(|(c, r)| sphere(f64::from(*r)).translate([c.x, c.y, c.z].map(f64::from))).collect();
    (all, GraphField::new(&union(expr), Sense::Below))
}

/// A grid around the unit cube, a little sheared, mirrored for odd `i`.
fn grid(i: u64, cells: [u32; 3]) -> Grid {
    let size = Mat3::from_diagonal(1.0 / Vec3::from(cells.map(|n| n as f32)));
    let skew = Mat3::from_cols(Vec3::X, Vec3::new(0.05, 1.0, 0.0), Vec3::new(0.0, -0.03, 1.0));
    if i.is_multiple_of(2) {
        Grid::new(cells, Vec3::ZERO, size).expect("a grid")
    } else {
        let mirror = Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
        Grid::new(cells, Vec3::X, skew * mirror * size).expect("a grid")
    }
}

/// The component of each vertex, numbered in the order of their first vertices. Written without the crate's own union–find.
fn components(mesh: &Mesh) -> Vec<usize> {
    let mut of_vertex: Vec<Vec<usize>> = vec![Vec::new(); mesh.vertices.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        triangle.iter().for_each(|&v| of_vertex[v as usize].push(t));
    }
    let mut labels = vec![usize::MAX; mesh.vertices.len()];
    let mut next = 0;
    for v in 0..labels.len() {
        if labels[v] != usize::MAX {
            continue;
        }
        let mut stack = vec![v];
        labels[v] = next;
        while let Some(v) = stack.pop() {
            for w in of_vertex[v].iter().flat_map(|&t| mesh.triangles[t]) {
                if labels[w as usize] == usize::MAX {
                    labels[w as usize] = next;
                    stack.push(w as usize);
                }
            }
        }
        next += 1;
    }
    labels
}

/// What is left of a mesh with some of its components, in its order.
fn only(mesh: &Mesh, labels: &[usize], kept: &BTreeSet<usize>) -> Mesh {
    let mut numbers = vec![0; labels.len()];
    let mut left = Mesh::default();
    for (v, vertex) in mesh.vertices.iter().enumerate() {
        if kept.contains(&labels[v]) {
            numbers[v] = left.vertices.len() as u32;
            left.vertices.push(*vertex);
        }
    }
    for triangle in &mesh.triangles {
        if kept.contains(&labels[triangle[0] as usize]) {
            left.triangles.push(triangle.map(|v| numbers[v as usize]));
        }
    }
    left
}

/// Whether two meshes have the same bytes; says what differs.
fn assert_same(name: &str, found: &Mesh, wanted: &Mesh) {
    let sizes = |m: &Mesh| [m.vertices.len(), m.triangles.len()];
    assert_eq!(sizes(found), sizes(wanted), "{name}: vertices and triangles");
    let vertex = found
        .vertices
        .iter()
        .zip(&wanted.vertices)
        .position(|(a, b)| bytemuck::bytes_of(a) != bytemuck::bytes_of(b));
    assert_eq!(vertex, None, "{name}: the first vertex that differs");
    let triangle = found.triangles.iter().zip(&wanted.triangles).position(|(a, b)| a != b);
    assert_eq!(triangle, None, "{name}: the first triangle that differs");
}
