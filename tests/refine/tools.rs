//! Fields to refine on, and how far a mesh is from a surface.

#![allow(dead_code, reason = "the bench uses a part, the tests another")]

use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Field, Sense, Surface, project};
use isoforge::graph::{Expr, GraphField, shapes::*};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::refine::{RefineReport, Settings, refine};

/// A field's mesh on a grid, the surface, and settings that keep a border where it is.
pub struct Start<'a> {
    pub mesh: Mesh,
    pub surface: Surface<'a>,
    pub settings: Settings,
}

pub fn start<'a>(field: &'a dyn Field, iso: f32, grid: Grid) -> Start<'a> {
    let (mesh, _) = extract_on_cpu(&Source::Field(field, grid), &Options::new(iso), &|_| {}).unwrap();
    let delta = grid.shortest_step() as f32 * 0.01;
    let surface = Surface::new(field, iso, field.sense(), delta).unwrap();
    Start { mesh, surface, settings: Settings::default().on(&grid) }
}

impl Start<'_> {
    pub fn refined(&self, change: impl FnOnce(&mut Settings)) -> (Mesh, RefineReport) {
        let mut settings = self.settings;
        change(&mut settings);
        refine(&self.surface, &self.mesh, &settings, &|_| {}).unwrap()
    }
}

pub fn cube(n: u32, half: f32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::splat(-half), Vec3::splat(half)).unwrap()
}

pub fn graph(expr: &Expr) -> GraphField {
    GraphField::new(expr, Sense::Below)
}

/// The scene of 2003: a sphere minus a sphere.
pub fn kugeldiff() -> Expr {
    sphere(1.0).difference(sphere(0.8).translate([0.55, 0.35, 0.4]))
}

/// A figure of ten stretched, turned spheres, melted together.
pub fn figure() -> Expr {
    let part = |size: [f64; 3], at: [f64; 3], angle: f64| {
        let turned = ellipsoid(size).unwrap().rotate([0.3, 1.0, 0.2], angle).unwrap();
        turned.translate(at)
    };
    let parts = [
        part([0.55, 0.25, 0.2], [0.0, 0.0, 0.0], 0.0),
        part([0.2, 0.18, 0.18], [0.62, 0.1, 0.0], 0.2),
        part([0.35, 0.05, 0.12], [0.1, 0.1, 0.4], 0.9),
        part([0.35, 0.05, 0.12], [0.1, 0.1, -0.4], -0.9),
        part([0.3, 0.06, 0.06], [-0.65, 0.1, 0.0], 0.1),
        part([0.08, 0.25, 0.08], [0.25, -0.3, 0.12], 0.4),
        part([0.08, 0.25, 0.08], [0.25, -0.3, -0.12], -0.4),
        part([0.08, 0.25, 0.08], [-0.3, -0.3, 0.12], 0.3),
        part([0.08, 0.25, 0.08], [-0.3, -0.3, -0.12], -0.3),
        part([0.06, 0.15, 0.05], [0.6, 0.32, 0.0], 0.0),
    ];
    parts.into_iter().reduce(|a, b| a.union(b)).unwrap()
}

/// Largest and RMS distance of points of the triangles to the surface.
///
/// A point's distance is that of its projection, so for the largest one it is the distance along the gradient.
pub fn error(surface: &Surface<'_>, mesh: &Mesh) -> [f32; 2] {
    let mut from = Vec::new();
    let mut weights = Vec::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize].at());
        let area = (b - a).cross(c - a).length();
        for [u, v] in
            [[1.0 / 3.0, 1.0 / 3.0], [0.5, 0.5], [0.0, 0.5], [0.5, 0.0], [0.6, 0.2], [0.2, 0.6], [0.2, 0.2]]
        {
            from.push(a + (b - a) * u + (c - a) * v);
            weights.push(area);
        }
    }
    let mut to = from.clone();
    let found = project(surface, &mut to, &vec![0.3; from.len()], 1e-7).unwrap();
    assert!(found.failed() * 100 <= from.len(), "{} of {}", found.failed(), from.len());
    let (mut most, mut sum) = (0.0f32, 0.0f64);
    for (i, (a, b)) in from.iter().zip(&to).enumerate() {
        most = most.max(a.distance(*b));
        sum += f64::from(weights[i] * a.distance_squared(*b));
    }
    let all: f64 = weights.iter().map(|w| f64::from(*w)).sum();
    [most, (sum / all).sqrt() as f32]
}

/// The smallest angle of the triangles, in degrees, and that which one in a hundred is below.
pub fn angles(mesh: &Mesh) -> [f32; 2] {
    let mut smallest: Vec<f32> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize].at());
            let angle = |a: Vec3, b: Vec3, c: Vec3| (b - a).angle_between(c - a).to_degrees();
            angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
        })
        .collect();
    smallest.sort_by(f32::total_cmp);
    [smallest[0], smallest[smallest.len() / 100]]
}
