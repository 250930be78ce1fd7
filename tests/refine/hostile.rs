//! Fields with gradients of any length, none, or NaN.

use crate::tools::*;
use glam::Vec3;
use isoforge::field::user::UserField;
use isoforge::field::{Closure, Field, Sense};
use isoforge::graph::shapes::*;
use isoforge::graph::{GraphField, x, y, z};

fn assert_sound(field: &dyn Field, iso: f32, name: &str) {
    let s = start(field, iso, cube(20, 1.5));
    assert!(!s.mesh.triangles.is_empty(), "{name}");
    let (mesh, report) = s.refined(|s| s.depth = 3);
    let (before, after) = (s.mesh.check(), mesh.check());
    assert_eq!(
        after.non_finite_vertices + after.non_manifold_edges + after.misoriented_edges,
        0,
        "{name}: {after}"
    );
    assert_eq!(before.boundary_edges == 0, after.boundary_edges == 0, "{name}");
    assert!(mesh.vertices.iter().all(|v| Vec3::from(v.normal).is_normalized()), "{name}");
    assert!(report.projected * 2 > mesh.vertices.len() as u64, "{name}: {report:?}");
}

/// The mesh is the same, whatever the scale of the field. Goes red when a gradient's length has a limit.
#[test]
fn scaled() {
    let plain = graph(&kugeldiff());
    let s = start(&plain, 0.0, cube(20, 1.3));
    let (expected, _) = s.refined(|s| s.depth = 2);
    for scale in [-98, 98] {
        let field = graph(&(kugeldiff() * f64::exp2(f64::from(scale))));
        let s = start(&field, 0.0, cube(20, 1.3));
        let (mesh, _) = s.refined(|s| s.depth = 2);
        assert!(mesh.triangles == expected.triangles, "2^{scale}");
        let far = mesh.vertices.iter().zip(&expected.vertices).map(|(a, b)| a.at().distance(b.at()));
        assert!(far.fold(0.0, f32::max) < 1e-5, "2^{scale}");
    }
}

#[test]
fn odd_gradients() {
    let formula =
        |text: &str| GraphField::new(&isoforge::graph::formula::parse(text, &[]).unwrap(), Sense::Below);
    assert_sound(&formula("abs(x) + abs(y) + abs(z) - 1"), 0.0, "octahedron");
    assert_sound(&formula("sqrt(x*x + y*y) + z - 0.5 + max(-z - 0.5, 0) * 100"), 0.0, "tip");
    assert_sound(&formula("sqrt(abs(x)) + sqrt(abs(y)) + sqrt(abs(z)) - 1.1"), 0.0, "astroid");
    assert_sound(&graph(&(x().square() + y().square() + z().square() - 1.0).pow(3.0)), 0.0, "cubed");
    let steiner = x().square() * y().square()
        + y().square() * z().square()
        + z().square() * x().square()
        + x() * y() * z();
    assert_sound(&graph(&steiner), 0.0, "steiner");
    let holes = Closure::new(Sense::Below, |p: Vec3| if p.x > 0.7 { f32::NAN } else { p.length() - 1.0 });
    assert_sound(&holes, 0.0, "NaN");
    let steps = Closure::new(Sense::Below, |p: Vec3| if p.length() < 1.0 { -1.0 } else { 1.0 });
    let s = start(&steps, 0.0, cube(20, 1.5));
    let (mesh, _) = s.refined(|s| s.depth = 3);
    assert!(mesh.check().boundary_edges == 0);
}

/// A sheet thinner than a cell: neither side jumps to the other.
#[test]
fn thin_surfaces() {
    let shell = graph(&sphere(1.0).difference(sphere(0.97)));
    let s = start(&shell, 0.0, cube(40, 1.3));
    let (mesh, _) = s.refined(|s| s.depth = 3);
    let (before, after) = (s.mesh.check(), mesh.check());
    assert_eq!(before.non_manifold_edges + after.non_manifold_edges, 0);
    assert_eq!(before.boundary_edges + after.boundary_edges, 0);
    assert_eq!(before.components, after.components);
}

/// A WGSL function is refined on the CPU, too, where it has that form.
#[test]
fn a_users_function() {
    let wgsl = "fn density(p: vec3<f32>) -> f32 { return length(p) - 1.0; }";
    assert_sound(&UserField::new(wgsl, "ball", Sense::Below).unwrap(), 0.0, "user");
}
