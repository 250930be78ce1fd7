//! Fields that a user writes: as the named ones where they are the same, and stopped where they run away.

use super::read;
use crate::common;
use glam::{Mat3, Vec3};
use isoforge::extract::{ExtractError, Options, Source, extract_on_cpu};
use isoforge::field::user::UserField;
use isoforge::field::{NoForm, Sense};
use isoforge::gpu::GpuMesh;
use isoforge::grid::Grid;

fn user(body: &str) -> UserField {
    let source = format!("fn density(p: vec3<f32>) -> f32 {{ {body} }}");
    UserField::new(&source, "user.wgsl", Sense::Below).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn as_the_named_field() {
    let Some(extractor) = common::extractor() else { return };
    for (name, body) in [
        ("sphere", "return sqrt((p.x * p.x + p.y * p.y) + p.z * p.z);"),
        ("torus", "let f = p.x * p.x + p.y * p.y; let k = (f + p.z * p.z) + 0.375; return k * k - 2.0 * f;"),
        ("cube", "var m = 0.0; for (var i = 0; i < 3; i++) { m = max(m, abs(p[i])); } return m;"),
    ] {
        let (field, grid) = common::named(name, 29);
        let options = Options::new(field.definition().iso);
        let named = read(extractor, &extractor.extract(&Source::Field(&field, grid), &options).unwrap());
        // As an expression it has the same bytes, as it is written differences for a gradient.
        let graph = user(body);
        let lowered = read(extractor, &extractor.extract(&Source::Field(&graph, grid), &options).unwrap());
        assert!(named.vertices == lowered.vertices && named.triangles == lowered.triangles, "{name}");
        let own = graph.as_written();
        let own = read(extractor, &extractor.extract(&Source::Field(&own, grid), &options).unwrap());
        assert_eq!(named.triangles.len(), own.triangles.len(), "{name}");
        let same_place =
            |(a, b): (&isoforge::mesh::Vertex, &isoforge::mesh::Vertex)| a.at().distance(b.at()) < 1e-4;
        assert!(named.vertices.iter().zip(&own.vertices).all(same_place), "{name}");
        // Differences instead of the gradient: the same but for where the field has an edge.
        let agree = named.vertices.iter().zip(&own.vertices);
        let agree = agree.filter(|(a, b)| Vec3::from(a.normal).dot(Vec3::from(b.normal)) > 0.999).count();
        assert!(agree * 100 > 97 * named.vertices.len(), "{name}: {agree} of {}", named.vertices.len());
    }
}

#[test]
fn only_a_gpu_evaluates_them() {
    let field = user("var t = p.x; while t < 0.0 { t += 1.0; } return t;");
    let grid = common::named("cube", 4).1;
    let found = extract_on_cpu(&Source::Field(&field, grid), &Options::new(0.0), &|_| {});
    assert!(matches!(found, Err(ExtractError::NoForm(NoForm::Cpu))));
}

fn is_runaway(field: &UserField, grid: Grid) -> bool {
    let Some(extractor) = common::extractor() else { return true };
    let source = Source::Field(field, grid);
    let found = extractor.extract(&source, &Options::new(0.0)).map(|e| e.report);
    // Recorded into the caller's encoder, the header tells.
    let gpu = extractor.gpu();
    let space = extractor.prepare(&source, u64::MAX).unwrap();
    let mesh = GpuMesh::with_capacity(gpu, 3000, 6000).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    extractor.encode(&space, &mut encoder, &Options::new(0.0), &mesh).unwrap();
    gpu.queue.submit([encoder.finish()]);
    assert_ne!(mesh.read_header(gpu).unwrap().runaway, 0);
    assert!(mesh.read(gpu).unwrap().triangles.is_empty(), "it is not the field's mesh");
    match found {
        Err(ExtractError::Runaway { .. }) => true,
        other => panic!("{other:?}"),
    }
}

#[test]
fn endless_loops_are_stopped() {
    let grid = Grid::new([10, 3, 9], Vec3::splat(-1.5), Mat3::IDENTITY).unwrap();
    assert!(is_runaway(&user("var t = p.x; loop { t += 1.0; if t < -1e9 { break; } } return t;"), grid));
    assert!(is_runaway(&user("var t = p.x; while true { t += 1.0; } return t;"), grid));
    let nested = "var t = p.x;
        for (var i = 0; i < 2000; i++) { for (var j = 0; j < 2000; j++) { t += 1e-6; } } return t;";
    assert!(is_runaway(&user(nested), grid));
    // In one place only.
    let rare =
        "var t = p.x; if p.x > 7.0 && p.z > 6.0 { loop { t *= 1.0; if t == 0.0 { break; } } } return t;";
    assert!(is_runaway(&user(rare), grid));
}

/// At the grid's points, which are whole numbers, the function ends at once; beside them never. So only
/// the differences at the vertices run away.
#[test]
fn endless_loops_in_the_gradient_alone() {
    let grid = Grid::new([9, 4, 4], Vec3::splat(-2.0), Mat3::IDENTITY).unwrap();
    let body = "var t = p.x - 0.5; let w = fract(p.x) + fract(p.y) + fract(p.z);
        loop { if w == 0.0 { break; } t += w; if t > 1e30 { break; } } return t;";
    assert!(is_runaway(&user(body), grid));
}

#[test]
fn many_iterations_that_end_are_fine() {
    let Some(extractor) = common::extractor() else { return };
    let field =
        user("var t = p.x; for (var i = 0; i < 300; i++) { t += 0.001; } return t - 0.3;").as_written();
    let grid = Grid::from_bounds([12; 3], Vec3::splat(-1.0), Vec3::splat(1.1)).unwrap();
    let found = extractor.extract(&Source::Field(&field, grid), &Options::new(0.0)).unwrap();
    assert_eq!(found.report.triangles, 2 * 12 * 12);
}
