//! Edges and corners are where they are.

use crate::measure::{off_mesh, off_surface, segment, vertices_off_surface};
use crate::{cube, graph, sharp, uniform};
use glam::{DVec3, Vec3};
use isoforge::graph::Expr;
use isoforge::graph::shapes::*;
use std::f64::consts::TAU;

/// The twelve edges of a box.
fn box_edges(low: DVec3, high: DVec3) -> Vec<DVec3> {
    let mut points = Vec::new();
    for axis in 0..3 {
        for k in 0..4 {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut from = low;
            if k & 1 == 1 {
                from[b] = high[b];
            }
            if k & 2 == 2 {
                from[c] = high[c];
            }
            let mut to = from;
            to[axis] = high[axis];
            points.extend(segment(from, to, 60));
        }
    }
    points
}

fn circle(centre: DVec3, u: DVec3, v: DVec3) -> impl Iterator<Item = DVec3> {
    (0..300).map(move |i| {
        let turn = f64::from(i) / 300.0 * TAU;
        centre + u * turn.cos() + v * turn.sin()
    })
}

/// The turn by `turns` around `axis`, as [`Expr::rotate`] moves a solid.
fn turned(points: Vec<DVec3>, axis: DVec3, turns: f64) -> Vec<DVec3> {
    let turn = glam::DQuat::from_axis_angle(axis.normalize(), turns * TAU);
    points.into_iter().map(|p| turn * p).collect()
}

/// Solids are turned around it.
const AXIS: [f64; 3] = [0.3, 1.0, 0.5];
/// By so much: 0 has its walls along the grid's.
const TURNS: [f64; 5] = [0.0, 0.07, 0.11, 0.19, 0.31];
const LOW: DVec3 = DVec3::new(-0.8, -0.7, -0.5);
const HIGH: DVec3 = DVec3::new(0.8, 0.7, 0.5);
/// Of the solids: their longest side. What is measured is measured in parts of it.
const SIZE: f64 = 1.6;
/// What edges and corners keep to, at grid 64.
const SHARP: f64 = 1e-4;

fn block() -> Expr {
    box_(LOW.to_array(), HIGH.to_array())
}

/// The solid turned, on a grid of 64³: the mesh is sound and has the uniform mesh's topology, nothing was given up, and all
/// its vertices are on the surface and the true edges on the mesh. How far its triangles are off the surface, in sizes.
fn measure(name: &str, solid: &Expr, turns: f64, edges: Vec<DVec3>) -> f64 {
    let field = graph(&solid.rotate(AXIS, turns).expect("an axis"));
    let grid = cube(64, 1.27);
    let (mesh, report) = sharp(&field, &grid);
    let check = mesh.check();
    let what = format!("{name} turned by {turns}: {report:?}");
    assert!(check.is_closed_manifold(), "{what}: {check}");
    assert_eq!(check.euler, uniform(&field, &grid).check().euler, "{what}");
    assert_eq!([report.fallbacks, report.clamped, report.flipped], [0; 3], "{what}");
    let vertices = f64::from(vertices_off_surface(&mesh, &field)) / SIZE;
    assert!(vertices < SHARP, "{what}: a vertex is {vertices:.1e} off");
    let off = off_mesh(&mesh, &turned(edges, AXIS.into(), turns)) / SIZE;
    assert!(off < SHARP, "{what}: an edge is {off:.1e} off");
    f64::from(off_surface(&mesh, &field)) / SIZE
}

/// Flat walls, straight edges, corners that stick out and go in: exact to rounding. Goes red without the planes that are
/// taken again, and without the projection.
#[test]
fn boxes() {
    let cut = [-0.3, -0.2, -0.1];
    let notch = block().difference(box_(cut, [0.35, 0.9, 0.9]));
    let corner = DVec3::from(cut);
    let inner = [DVec3::new(-0.3, 0.7, -0.1), DVec3::new(-0.3, -0.2, 0.5), DVec3::new(0.35, -0.2, -0.1)];
    let inner: Vec<DVec3> = inner.into_iter().flat_map(|to| segment(corner, to, 50)).collect();
    for turns in TURNS {
        for (name, solid, edges) in
            [("box", block(), box_edges(LOW, HIGH)), ("notch", notch.clone(), inner.clone())]
        {
            let off = measure(name, &solid, turns, edges);
            assert!(off < 1e-6, "{name} turned by {turns}: the mesh is {off:.1e} off");
        }
    }
}

/// Curved seams: each vertex is on the seam, and the seam within 1e-4 of the mesh. A triangle's own flatness (a chord's
/// height, c²/8r, where c is up to two cells) is what the mesh is off elsewhere. Goes red without the planes that are
/// taken again.
#[test]
fn drilled_and_hollowed_blocks() {
    let rims = |r: f64| -> Vec<DVec3> {
        [-0.5, 0.5].into_iter().flat_map(|z| circle(DVec3::Z * z, DVec3::X * r, DVec3::Y * r)).collect()
    };
    let bitten = block().difference(sphere(0.5).translate((0.8, 0.7, 0.5)));
    let arc = |u: DVec3, v: DVec3| {
        (0..=60).map(move |i| {
            let turn = f64::from(i) / 240.0 * TAU;
            HIGH - (u * turn.cos() + v * turn.sin()) * 0.5
        })
    };
    let bite: Vec<DVec3> =
        arc(DVec3::X, DVec3::Y).chain(arc(DVec3::Y, DVec3::Z)).chain(arc(DVec3::Z, DVec3::X)).collect();
    for turns in TURNS {
        let drilled = block().difference(cylinder(0.4, 3.0));
        let edges = [box_edges(LOW, HIGH), rims(0.4)].concat();
        for (name, solid, edges) in [("drilled", drilled, edges), ("bitten", bitten.clone(), bite.clone())] {
            let off = measure(name, &solid, turns, edges);
            assert!(off < 1e-3, "{name} turned by {turns}: the mesh is {off:.1e} off");
        }
    }
}

/// The tip of a cone is in the mesh, upright.
#[test]
fn cone_tip() {
    let field = graph(&cone(0.6, 1.4).expect("a height"));
    let (mesh, report) = sharp(&field, &cube(64, 1.27));
    let off = off_mesh(&mesh, &[DVec3::new(0.0, 0.0, 0.7)]);
    assert!(
        off < SHARP * 1.4 && report.corners >= 1 && mesh.check().is_closed_manifold(),
        "{off:.1e} {report:?}"
    );
}

/// On a ball there is no feature, and its vertices and normals are exact. Goes red where vertices are not projected.
#[test]
fn smooth_is_smooth() {
    let field = graph(&sphere(0.9));
    let (mesh, report) = sharp(&field, &cube(40, 1.0));
    assert_eq!([report.edges, report.corners, report.fallbacks, report.flipped], [0; 4], "{report:?}");
    for v in &mesh.vertices {
        let outwards = v.at().normalize();
        assert!(
            (v.at().length() - 0.9).abs() < 1e-6 && Vec3::from(v.normal).distance(outwards) < 1e-5,
            "{v:?}"
        );
    }
}
