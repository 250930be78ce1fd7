//! Normals by differences: as good as they should be, the same on both backends, and refused where they make no
//! sense.

use super::{on_cpu, read, same_everywhere};
use crate::common;
use glam::{DVec3, Vec3};
use isoforge::extract::{ExtractError, Normals, Options, Source, extract_on_cpu};
use isoforge::field::user::UserField;
use isoforge::field::{Field, Sense};
use isoforge::graph::shapes::*;
use isoforge::graph::{Expr, GraphField};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;

fn forward(delta: f32) -> Normals {
    Normals::Forward { delta: Some(delta) }
}

fn central(delta: f32) -> Normals {
    Normals::Central { delta: Some(delta) }
}

fn with(normals: Normals, iso: f32) -> Options {
    Options { normals, ..Options::new(iso) }
}

/// The mean length of what two meshes' normals differ by.
fn apart(a: &Mesh, b: &Mesh) -> f64 {
    assert!(a.triangles == b.triangles && !a.triangles.is_empty());
    let each = a.vertices.iter().zip(&b.vertices);
    let sum: f64 = each.map(|(a, b)| f64::from(Vec3::from(a.normal).distance(b.normal.into()))).sum();
    sum / a.vertices.len() as f64
}

/// Differences of the distance from the origin, in `f64`.
///
/// Goes red when `forward` (`src/field/differences.rs`) moves by half a step, and when `values_beside` moves along x
/// alone.
#[test]
fn differences_are_over_the_step() {
    let (field, grid) = common::named("sphere", 11);
    let delta = 0.25;
    for (normals, low) in [(forward(0.25), 0.0), (central(0.25), -delta)] {
        let mesh = on_cpu(&Source::Field(&field, grid), &with(normals, 1.0));
        for vertex in &mesh.vertices {
            let p = vertex.at().as_dvec3();
            let along = |axis: DVec3| (p + axis * delta).length() - (p + axis * low).length();
            let expected = DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)).normalize();
            let found = Vec3::from(vertex.normal).as_dvec3();
            assert!(found.distance(expected) < 1e-5, "{normals:?}: {found} for {expected}");
        }
    }
}

/// Halving the step halves the error of forward differences, and quarters that of central ones.
#[test]
fn the_error_follows_the_step() {
    for name in ["sphere", "torus"] {
        let (field, grid) = common::named(name, 37);
        let source = Source::Field(&field, grid);
        let iso = field.definition().iso;
        let exact = on_cpu(&source, &Options::new(iso));
        let error = |normals| apart(&exact, &on_cpu(&source, &with(normals, iso)));
        let ratio = error(forward(0.04)) / error(forward(0.02));
        assert!((1.8..2.2).contains(&ratio), "{name}: forward {ratio}");
        let ratio = error(central(0.08)) / error(central(0.04));
        assert!((3.6..4.4).contains(&ratio), "{name}: central {ratio}");
        assert!(error(forward(0.04)) > 3.0 * error(central(0.04)), "{name}");
        let step = (grid.shortest_step() / 100.0) as f32;
        for (default, given) in [
            (Normals::Forward { delta: None }, forward(step)),
            (Normals::Central { delta: None }, central(step)),
        ] {
            assert!(apart(&on_cpu(&source, &with(default, iso)), &on_cpu(&source, &with(given, iso))) < 1e-6);
        }
    }
}

/// Steps reach out of the boxes that fields are pruned for on the CPU.
///
/// Goes red when the CPU takes differences of the pruned field, and when `central.wgsl` moves x along with y.
#[test]
fn both_backends_agree() {
    let ball = |x: f64| sphere(0.4).translate([x, 0.1 * x, -0.2]);
    let many = (1..9).fold(ball(-1.0), |all, i| all.smooth_union(ball(-1.0 + 0.27 * f64::from(i)), 0.1));
    let many = many.union(box_([-0.3; 3], [0.9; 3]));
    let field = GraphField::new(&many, Sense::Below);
    let grid = Grid::from_bounds([70, 61, 50], Vec3::splat(-1.51), Vec3::splat(1.47)).unwrap();
    for normals in [forward(0.3), central(0.3), forward(1e-3), Normals::Central { delta: None }] {
        same_everywhere("balls", &Source::Field(&field, grid), &with(normals, 0.0));
    }
    for name in ["torus", "gyroid", "steiner", "elliptic_cone", "superellipsoid"] {
        let (field, grid) = common::named(name, 22);
        let iso = field.definition().iso;
        for normals in
            [forward(0.01), central(0.01), Normals::Forward { delta: None }, forward(1e-38), central(1e38)]
        {
            same_everywhere(name, &Source::Field(&field, grid), &with(normals, iso));
        }
    }
}

/// What has no expression has no gradient: exact normals are central differences there.
#[test]
fn a_function_that_stays_on_the_gpu() {
    let Some(extractor) = common::extractor() else { return };
    let source = "fn density(p: vec3<f32>) -> f32 { return length(p) + 0.1 * p.x * p.y; }";
    let field = UserField::new(source, "user.wgsl", Sense::Below).unwrap();
    let black_box = field.clone().as_written();
    let grid = Grid::from_bounds([25; 3], Vec3::splat(-1.5), Vec3::splat(1.6)).unwrap();
    let run = |field: &UserField, normals| {
        let source = Source::Field(field, grid);
        read(extractor, &extractor.extract(&source, &with(normals, 1.0)).unwrap())
    };
    for normals in [forward(0.05), central(0.05)] {
        assert!(apart(&run(&field, normals), &run(&black_box, normals)) < 1e-4, "{normals:?}");
    }
    let default = run(&black_box, Normals::Central { delta: None });
    assert!(default == run(&black_box, Normals::Exact));
    assert!(apart(&run(&field, Normals::Exact), &run(&black_box, forward(0.05))) > 1e-3);
    // One workspace serves them all.
    let source = Source::Field(&black_box, grid);
    let space = extractor.prepare(&source, u64::MAX).unwrap();
    for normals in [forward(0.05), central(0.05), forward(0.1), Normals::Exact] {
        let found = extractor.extract_in(&space, &source, &with(normals, 1.0), &|_| {}).unwrap();
        assert!(read(extractor, &found) == run(&black_box, normals), "{normals:?}");
    }
}

#[test]
fn steps_that_make_no_sense() {
    let field = GraphField::new(&(sphere(Expr::from(1.0))), Sense::Below);
    let grid = common::named("sphere", 8).1;
    let source = Source::Field(&field as &dyn Field, grid);
    for delta in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        for normals in [forward(delta), central(delta)] {
            let found = extract_on_cpu(&source, &with(normals, 0.0), &|_| {});
            assert!(matches!(found, Err(ExtractError::Delta(_))), "{found:?}");
            if let Some(extractor) = common::extractor() {
                let found = extractor.extract(&source, &with(normals, 0.0));
                assert!(matches!(found, Err(ExtractError::Delta(_))), "{found:?}");
            }
        }
    }
}
