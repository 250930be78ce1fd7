//! Deformations: where each takes a point, found by deforming the coordinates themselves, against the forward map.

use crate::{bounds, field, points, values};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use isoforge::graph::shapes::{Axis, Lattice, box_};
use isoforge::graph::{Expr, x, y, z};
use std::f64::consts::TAU;

/// What the deformation puts in place of each point.
fn sources(deform: impl Fn(Expr) -> Expr, points: &[[f32; 3]]) -> Vec<DVec3> {
    let [x, y, z] = [x(), y(), z()].map(|c| values(&field(&deform(c)), points));
    x.iter().zip(y).zip(z).map(|((x, y), z)| DVec3::new((*x).into(), y.into(), z.into())).collect()
}

/// Checks that `forward` leads from what is put in a point's place to the point, and the bounds.
fn leads_back(name: &str, deform: impl Fn(Expr) -> Expr, forward: impl Fn(DVec3) -> DVec3) {
    let points = points(2000, 1.5, 41);
    for (p, source) in points.iter().zip(sources(&deform, &points)) {
        let p = DVec3::from(p.map(f64::from));
        let back = forward(source);
        assert!(back.distance(p) < 3e-6, "{name}: {p} comes from {source}, which goes to {back}");
    }
    bounds(name, &field(&deform(box_([-0.5, -0.4, -0.3], [0.6, 0.5, 0.7]))), 1.5);
}

fn parameter(value: f64) -> Expr {
    Expr::parameter("p", value)
}

/// Goes red when the angle's sign is turned, or the axis not brought to length 1.
#[test]
fn rigid() {
    leads_back("translate", |e| e.translate((0.3, parameter(-0.2), 0.1)), |q| q + DVec3::new(0.3, -0.2, 0.1));
    for (axis, turns) in [([1.0, 2.0, -2.0], 0.15), ([0.0, 0.0, 3.0], 0.25), ([0.0, 1.0, 0.0], -0.4)] {
        let turn = DQuat::from_axis_angle(DVec3::from(axis).normalize(), turns * TAU);
        leads_back("rotate", |e| e.rotate(axis, turns).unwrap(), |q| turn * q);
        leads_back("rotate", |e| e.rotate(axis, parameter(turns)).unwrap(), |q| turn * q);
        let by_parameter = [parameter(axis[0]), Expr::parameter("y", axis[1]), Expr::parameter("z", axis[2])];
        leads_back("rotate", |e| e.rotate(by_parameter.clone(), turns).unwrap(), |q| turn * q);
    }
    let n = DVec3::new(2.0, -1.0, 2.0) / 3.0;
    leads_back("mirror", |e| e.mirror([2.0, -1.0, 2.0], 0.2).unwrap(), |q| q - 2.0 * (n.dot(q) - 0.2) * n);
    // Both halves come from the one in front of the plane.
    let points = points(500, 1.5, 7);
    for (p, q) in points.iter().zip(sources(|e| e.symmetric([2.0, -1.0, 2.0], 0.2).unwrap(), &points)) {
        let p = DVec3::from(p.map(f64::from));
        let mirrored = p - 2.0 * (n.dot(p) - 0.2) * n;
        assert!(n.dot(q) > 0.2 - 1e-6 && (q.distance(p) < 2e-6 || q.distance(mirrored) < 2e-6), "{p}: {q}");
    }
}

#[test]
fn scaled_and_affine() {
    // Values are scaled, too: by the factor, and by the smallest one.
    leads_back("scale", |e| e.scale(1.7).unwrap() / 1.7, |q| q * 1.7);
    leads_back("scale", |e| e.scale(parameter(0.6)).unwrap() / 0.6, |q| q * 0.6);
    let factors = DVec3::new(0.5, 1.5, 2.0);
    leads_back("scale along axes", |e| e.scale_axes(factors).unwrap() / 0.5, |q| q * factors);
    let columns = DMat3::from_cols_array(&[1.0, 0.2, 0.0, -0.4, 0.8, 0.3, 0.1, 0.0, -1.2]);
    let map = DAffine3 { matrix3: columns, translation: DVec3::new(0.1, -0.2, 0.3) };
    leads_back("affine", |e| e.affine(map).unwrap(), |q| map.transform_point3(q));
}

/// Goes red when the twist goes on above its box, and when it begins elsewhere than at z0.
#[test]
fn twisted_bent_and_tapered() {
    let (z0, z1) = (-0.4, 0.9);
    let twist = |e: Expr| e.twist(parameter(0.3), z0, z1).unwrap();
    leads_back("twist", twist, |q| DQuat::from_rotation_z(0.3 * TAU * (q.z.clamp(z0, z1) - z0)) * q);
    let on_axis: Vec<[f32; 3]> = (-10..=10).map(|i| [0.0, 0.0, i as f32 * 0.15]).collect();
    for (p, q) in on_axis.iter().zip(sources(twist, &on_axis)) {
        assert_eq!(DVec3::from(p.map(f64::from)), q, "twist");
    }

    for turns in [0.1, -0.2, 0.0, 1e-4] {
        let (x0, x1) = (-1.0, 0.8);
        let radius = 1.0 / (TAU * turns);
        let forward = |q: DVec3| {
            if turns == 0.0 {
                return q;
            }
            // On the circle as far as the range goes, then along its tangent.
            let s = q.x.clamp(x0, x1);
            let (sine, cosine) = (s / radius).sin_cos();
            let (out, rest) = (radius - q.z, q.x - s);
            DVec3::new(out * sine + rest * cosine, q.y, radius - out * cosine + rest * sine)
        };
        leads_back("bend", |e| e.bend(parameter(turns), x0, x1).unwrap(), forward);
    }
    let bend = |e: Expr| e.bend(0.1, -1.0, parameter(1.2)).unwrap();
    let bar = field(&bend(box_([-1.0, -0.1, -0.1], [1.0, 0.1, 0.1])));
    assert!(values(&bar, &[[0.7, 0.0, 0.16], [-0.7, 0.0, 0.16]]).iter().all(|v| *v < 0.0), "both arms rise");
    let on_axis: Vec<[f32; 3]> = (-10..=10).map(|i| [0.0, i as f32 * 0.15, 0.0]).collect();
    for (p, q) in on_axis.iter().zip(sources(bend, &on_axis)) {
        assert_eq!(DVec3::from(p.map(f64::from)), q, "bend");
    }
    bounds("bend", &bar, 1.5);

    leads_back(
        "taper",
        |e| e.taper(1.5, parameter(0.4), z0, z1).unwrap(),
        |q| {
            let s = 1.5 + (0.4 - 1.5) * (q.z.clamp(z0, z1) - z0) / (z1 - z0);
            DVec3::new(q.x * s, q.y * s, q.z)
        },
    );
}

#[test]
fn repeated() {
    let points = points(2000, 1.5, 47);
    for (limit, most) in [(None, 1000.0), (Some(2), 2.0), (Some(0), 0.0)] {
        let deform = |e: Expr| e.repeat(Axis::Y, parameter(0.4), limit).unwrap();
        for (p, q) in points.iter().zip(sources(deform, &points)) {
            let p = DVec3::from(p.map(f64::from));
            let cell = (p.y / 0.4).round().clamp(-most, most);
            let expected = DVec3::new(p.x, p.y - 0.4 * cell, p.z);
            // Between cells either will do.
            let shifted = DVec3::new(0.0, 0.4, 0.0);
            let near =
                [expected, expected + shifted, expected - shifted].iter().any(|e| e.distance(q) < 2e-6);
            assert!(near && (most < 1000.0 || q.y.abs() < 0.2001), "{p}: {q}, not {expected}");
        }
        bounds("repeat", &field(&deform(box_([-0.1; 3], [0.1; 3]))), 1.5);
    }
}

/// Bernstein polynomials reproduce what is linear: any affine displacement is met exactly inside the box.
///
/// Goes red when x and y of the control points are exchanged.
#[test]
fn free_form() {
    let (low, high) = (DVec3::new(-1.0, -0.8, -0.9), DVec3::new(1.1, 1.2, 0.7));
    let map = DMat3::from_cols_array(&[0.1, 0.2, -0.1, 0.05, -0.1, 0.3, 0.0, 0.1, 0.2]);
    for counts in [[2, 2, 2], [3, 4, 2], [2, 3, 5]] {
        let at =
            |i: usize, axis: usize| low[axis] + (high - low)[axis] * i as f64 / (counts[axis] - 1) as f64;
        let mut control = Vec::new();
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    control.push(map * DVec3::new(at(i, 0), at(j, 1), at(k, 2)) + DVec3::splat(0.05));
                }
            }
        }
        let lattice = Lattice::new(low, high, counts, control).unwrap();
        let points = points(500, 1.5, 53);
        for (p, q) in points.iter().zip(sources(|e| e.free_form(&lattice), &points)) {
            let p = DVec3::from(p.map(f64::from));
            let expected = p + map * p.clamp(low, high) + DVec3::splat(0.05);
            assert!(q.distance(expected) < 3e-6, "{counts:?} at {p}: {q}, not {expected}");
        }
        bounds("free form", &field(&box_([-0.5; 3], [0.5; 3]).free_form(&lattice)), 1.5);
    }
    // One control point in the middle of 3³: its weight in the box's centre is ½³.
    let control = (0..27).map(|i| if i == 13 { [0.8, 0.4, 0.0] } else { [0.0; 3] });
    let lattice = Lattice::new([-1.0; 3], [1.0; 3], [3; 3], control).unwrap();
    let q = sources(|e| e.free_form(&lattice), &[[0.0; 3]])[0];
    assert!(q.distance(DVec3::new(0.1, 0.05, 0.0)) < 1e-7, "{q}");
}
