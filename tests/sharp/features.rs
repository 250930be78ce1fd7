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

#[test]
fn explore() {
    let axis = [0.3, 1.0, 0.5];
    let rotate = |e: Expr, t: f64| e.rotate(axis, t).unwrap();
    let block = || box_([-0.8, -0.7, -0.5], [0.8, 0.7, 0.5]);
    let (low, high) = (DVec3::new(-0.8, -0.7, -0.5), DVec3::new(0.8, 0.7, 0.5));
    let rims = |r: f64| -> Vec<DVec3> {
        [-0.5, 0.5].into_iter().flat_map(|z| circle(DVec3::Z * z, DVec3::X * r, DVec3::Y * r)).collect()
    };
    let mut shapes: Vec<(String, Expr, Vec<DVec3>)> = vec![];
    for turns in [0.0, 0.03, 0.07, 0.11, 0.19, 0.31] {
        let t = |p| turned(p, DVec3::from(axis), turns);
        shapes.push((format!("box {turns}"), rotate(block(), turns), t(box_edges(low, high))));
        shapes.push((
            format!("drilled {turns}"),
            rotate(block().difference(cylinder(0.4, 3.0)), turns),
            t([box_edges(low, high), rims(0.4)].concat()),
        ));
        shapes.push((
            format!("box-box {turns}"),
            rotate(block().difference(box_([-0.3, -0.2, -0.1], [0.35, 0.9, 0.9])), turns),
            t(segment(DVec3::new(-0.3, -0.2, -0.1), DVec3::new(-0.3, 0.7, -0.1), 50)
                .chain(segment(DVec3::new(-0.3, -0.2, -0.1), DVec3::new(-0.3, -0.2, 0.5), 50))
                .collect()),
        ));
        shapes.push((
            format!("box-sphere {turns}"),
            rotate(block().difference(sphere(0.6)), turns),
            t(rims((0.36f64 - 0.25).sqrt())),
        ));
        shapes.push((
            format!("cone {turns}"),
            rotate(cone(0.6, 1.4).unwrap(), turns),
            t([
                vec![DVec3::new(0.0, 0.0, 0.7)],
                circle(DVec3::Z * -0.7, DVec3::X * 0.6, DVec3::Y * 0.6).collect(),
            ]
            .concat()),
        ));
    }
    for (name, solid, edges) in shapes {
        if std::env::var("ONLY").is_ok_and(|o| o != name) {
            continue;
        }
        let field = graph(&solid);
        let grid = cube(64, 1.27);
        let (mesh, report) = sharp(&field, &grid);
        let check = mesh.check();
        let other = uniform(&field, &grid).check();
        eprintln!(
            "{name}: off surface {:.2e} vertices {:.2e} edges off mesh {:.2e}; edges {} corners {} clamped {} fall {} flip {} | {} euler {} {}",
            off_surface(&mesh, &field),
            vertices_off_surface(&mesh, &field),
            off_mesh(&mesh, &edges),
            report.edges,
            report.corners,
            report.clamped,
            report.fallbacks,
            report.flipped,
            check.is_closed_manifold(),
            check.euler,
            other.euler
        );
        if std::env::var("WRITE").is_ok() {
            isoforge::mesh::write::write(
                &mesh,
                format!("/tmp/sharp-{}.ply", name.replace(' ', "_")).as_ref(),
            )
            .unwrap();
        }
    }
    let _ = Vec3::ZERO;
}
