//! Distances between meshes, fields and known edges.

use glam::{DVec3, Vec3};
use isoforge::field::{Field, Points};
use isoforge::mesh::Mesh;

/// The largest value, without its sign, at points spread over every triangle; of fields that are distances near their
/// surface, how far the mesh lies off it.
pub fn off_surface(mesh: &Mesh, field: &dyn Field) -> f32 {
    let mut points = Vec::new();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize].at());
        for (i, j) in (0..=4).flat_map(|i| (0..=4 - i).map(move |j| (i, j))) {
            let (u, v) = (i as f32 / 4.0, j as f32 / 4.0);
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    values(field, &points).into_iter().fold(0.0, |most, v| most.max(v.abs()))
}

/// The largest value, without its sign, at the vertices.
pub fn vertices_off_surface(mesh: &Mesh, field: &dyn Field) -> f32 {
    let points: Vec<Vec3> = mesh.vertices.iter().map(|v| v.at()).collect();
    values(field, &points).into_iter().fold(0.0, |most, v| most.max(v.abs()))
}

fn values(field: &dyn Field, points: &[Vec3]) -> Vec<f32> {
    let axis = |k: usize| points.iter().map(|p| p[k]).collect::<Vec<f32>>();
    let (x, y, z, mut out) = (axis(0), axis(1), axis(2), vec![0.0; points.len()]);
    field.values(Points { x: &x, y: &y, z: &z }, &mut out).expect("the CPU evaluates it");
    out
}

/// How far the farthest of `points` lies from the mesh.
pub fn off_mesh(mesh: &Mesh, points: &[DVec3]) -> f64 {
    let triangles: Vec<[DVec3; 3]> =
        mesh.triangles.iter().map(|t| t.map(|v| mesh.vertices[v as usize].at().as_dvec3())).collect();
    let distance = |p: DVec3| triangles.iter().map(|t| to_triangle(p, t)).fold(f64::INFINITY, f64::min);
    points.iter().map(|&p| distance(p)).fold(0.0, f64::max)
}

fn to_triangle(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let is_beside = [[a, b], [b, c], [c, a]].iter().any(|[u, v]| (v - u).cross(p - u).dot(normal) < 0.0);
    if !is_beside && normal != DVec3::ZERO {
        return (p - a).dot(normal.normalize()).abs();
    }
    let to_side = |u: DVec3, v: DVec3| {
        let t = ((p - u).dot(v - u) / (v - u).length_squared().max(1e-300)).clamp(0.0, 1.0);
        p.distance(u + (v - u) * t)
    };
    to_side(a, b).min(to_side(b, c)).min(to_side(c, a))
}

/// Points along a segment, its ends among them.
pub fn segment(a: DVec3, b: DVec3, count: usize) -> impl Iterator<Item = DVec3> {
    (0..=count).map(move |i| a + (b - a) * (i as f64 / count as f64))
}
