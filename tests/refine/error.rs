//! How near the surface the mesh is.

use crate::common::named;
use crate::tools::*;
use glam::Vec3;
use isoforge::field::{Field, Sense, Surface};
use isoforge::graph::{Expr, GraphField, shapes::*};
use isoforge::mesh::Mesh;

/// A solid turned out of the grid's axes.
fn turned(solid: Expr) -> GraphField {
    graph(&solid.rotate([0.3, 1.0, 0.2], 0.11).unwrap())
}

/// Each vertex lies within ε: the field's bounds in the box of ± ε around it hold 0, and the sign changes between points
/// of that box. Goes red when a bracket of any length counts as converged, and when midpoints stay at the middle.
fn assert_near(surface: &Surface<'_>, mesh: &Mesh, epsilon: f32, most_off: u64, name: &str) {
    let mut off = 0;
    for vertex in &mesh.vertices {
        let p = vertex.at();
        // Positions are rounded to floats.
        let reach = Vec3::splat(epsilon + 1e-6);
        let bounds = surface.range(p - reach, p + reach);
        let out = Vec3::from(vertex.normal) * reach.x;
        let near: Vec<Vec3> = [p, p + out, p - out]
            .into_iter()
            .chain((0..8).map(|i| {
                p + reach
                    * Vec3::new((i & 1) as f32 * 2.0 - 1.0, (i & 2) as f32 - 1.0, (i & 4) as f32 * 0.5 - 1.0)
            }))
            .collect();
        let mut values = vec![0.0; near.len()];
        surface.values(&near, &mut values).unwrap();
        let sides = [values.iter().any(|v| *v < 0.0), values.iter().any(|v| *v > 0.0)];
        let proven = bounds.lo <= 0.0 && bounds.hi >= 0.0 && (sides == [true; 2] || values[0] == 0.0);
        off += u64::from(!proven);
    }
    assert!(off <= most_off, "{name}: {off} of {} are not proven near, {most_off} may", mesh.vertices.len());
}

#[test]
fn vertices_are_near() {
    let shapes: [(&str, GraphField); 4] = [
        ("ball", turned(sphere(1.0))),
        ("stretched", turned(ellipsoid([1.2, 0.5, 0.3]).unwrap())),
        ("torus", turned(torus_distance(0.8, 0.3))),
        ("kugeldiff", turned(kugeldiff())),
    ];
    for (name, field) in &shapes {
        for epsilon in [1e-2, 1e-4, 1e-5] {
            let s = start(field, 0.0, cube(16, 1.5));
            let (mesh, report) = s.refined(|s| (s.epsilon, s.depth) = (epsilon, 3));
            assert_near(&s.surface, &mesh, epsilon, report.not_converged + report.taken_back, name);
            let smooth = *name != "kugeldiff";
            assert!(!smooth || report.not_converged + report.taken_back == 0, "{name}: {report:?}");
        }
    }
}

/// On smooth solids the error falls with each level and with each stricter setting. Goes red when midpoints are
/// left at the middle.
#[test]
fn stricter_is_nearer() {
    let shapes: [(&str, GraphField); 3] = [
        ("ball", turned(sphere(1.0))),
        ("stretched", turned(ellipsoid([1.2, 0.7, 0.5]).unwrap())),
        ("torus", turned(torus_distance(0.8, 0.4))),
    ];
    for (name, field) in &shapes {
        let s = start(field, 0.0, cube(12, 1.5));
        let steps = |changes: &[&dyn Fn(&mut isoforge::refine::Settings)]| {
            let mut last = f32::INFINITY;
            for (i, change) in changes.iter().enumerate() {
                let [_, rms] = error(&s.surface, &s.refined(*change).0);
                assert!(rms <= last * 1.001 + 1e-6, "{name}, change {i}: {rms} after {last}");
                last = rms;
            }
            last
        };
        let first = steps(&[&|s| s.depth = 0]);
        let deep = steps(&[
            &|s| (s.depth, s.flatness) = (0, 0.999),
            &|s| (s.depth, s.flatness) = (1, 0.999),
            &|s| (s.depth, s.flatness) = (2, 0.999),
            &|s| (s.depth, s.flatness) = (3, 0.999),
        ]);
        assert!(deep < first * 0.1, "{name}: {first} to {deep}");
        steps(&[&|s| s.flatness = 0.5, &|s| s.flatness = 0.9, &|s| s.flatness = 0.99, &|s| {
            s.flatness = 0.999
        }]);
        steps(&[&|s| s.epsilon = 1e-2, &|s| s.epsilon = 1e-3, &|s| s.epsilon = 1e-4, &|s| s.epsilon = 1e-5]);
    }
}

/// At the sharp edges of solids, too; there by a half at least. Goes red without `towards_crease`.
#[test]
fn creases_come_out() {
    let [small, large] = [[-0.7; 3], [0.7; 3]];
    let shapes = [("kugeldiff", graph(&kugeldiff())), ("cube", turned(box_(small, large)))];
    for (name, field) in &shapes {
        let s = start(field, 0.0, cube(40, 1.4));
        let errors: Vec<f32> =
            (0..=4).map(|depth| error(&s.surface, &s.refined(|s| s.depth = depth).0)[1]).collect();
        assert!(errors.windows(2).all(|w| w[1] <= w[0] * 1.02), "{name}: {errors:?}");
        assert!(errors[4] < errors[0] * 0.5, "{name}: {errors:?}");
    }
}

/// No triangle of a smooth surface is flipped, and shapes do not degrade: over five levels the smallest angles stay
/// above a half of those at the start. Goes red when one of three parts is wound the other way round, and when midpoints
/// stay at the middle.
#[test]
fn triangles_keep_their_shape() {
    let field = turned(ellipsoid([1.3, 0.3, 0.2]).unwrap());
    let s = start(&field, 0.0, cube(20, 1.5));
    let before = angles(&s.refined(|s| s.depth = 0).0);
    let (mesh, _) = s.refined(|s| s.flatness = 0.99);
    let after = angles(&mesh);
    assert!(after[1] >= before[1] * 0.5, "{before:?} to {after:?}");
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
        let area = (b.at() - a.at()).cross(c.at() - a.at());
        let normal = Vec3::from(a.normal) + Vec3::from(b.normal) + Vec3::from(c.normal);
        assert!(area.dot(normal) >= 0.0, "{t:?}");
    }
}

/// Fewer triangles than a finer grid of equal error.
#[test]
fn fewer_triangles_than_a_finer_grid() {
    let (field, coarse) = named("torus", 16);
    let iso = field.definition().iso;
    let s = start(&field, iso, coarse);
    let (mesh, _) = s.refined(|s| s.flatness = 0.98);
    let [_, reached] = error(&s.surface, &mesh);
    let uniform = [24, 32, 48, 64, 96].into_iter().map(|n| start(&field, iso, named("torus", n).1));
    let equal = uniform.into_iter().find(|fine| error(&fine.surface, &fine.mesh)[1] <= reached).unwrap();
    let (own, other) = (mesh.triangles.len(), equal.mesh.triangles.len());
    assert!(own * 10 < other * 9, "{own} against {other}");
    assert_eq!(field.sense(), Sense::Below);
}
