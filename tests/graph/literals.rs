//! Constants that the compiler of WGSL may not fold: 0 as a divisor, and those whose squares or reciprocals are infinite.

use crate::{common, field, on_gpu};
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::Field;
use isoforge::graph::interval::Interval;
use isoforge::graph::{Expr, formula, x, y, z};
use isoforge::grid::Grid;

/// A field with its name. Where the wild part is not finite, `min` leaves the plain one.
fn fields() -> Vec<(String, Expr)> {
    let texts = [
        "max(x - 0.1, min(z, 0)) + min(0, y / 1e-45)",
        "x / 1e-45",
        "mod(x, 0) + y",
        "min(z, mod(y, 0))",
        "smoothstep(0, 0, x) - 0.5",
        "atan2(y, 1e38) + 0.5",
        "atan2(y, 1e38) + 1e-39 * x",
        "atan2(3e38, x) - 1.5",
        "x / 1e-30 / 1e-30 - y / 1e38",
        "x * 3e38 + y * 1e-38",
        "pow(1e38, x) - pow(y, 1e30)",
        "step(0, x) / 1e-45 + z",
    ];
    let parse = |text: &str| (text.to_string(), formula::parse(text, &[]).unwrap());
    let mut all: Vec<_> = texts.iter().map(|text| parse(text)).collect();
    all.push(("x() / 0.0".into(), x() / 0.0));
    all.push(("beside a quotient by -0".into(), (x() + 0.1).min(y() / -0.0)));
    // So many operations that its bounds are a loop.
    let waves = (1..40).map(|i| (x() * f64::from(i) + y()).sin() * 0.01).reduce(|a, b| a + b).unwrap();
    all.push(("a long one".into(), (waves + z()).min((x() + 0.5) / 0.0).min(y().atan2(1e38) + 0.5)));
    all
}

/// Goes red when any of these constants is a literal of the text: naga refuses `1.0 / 0.0f`.
#[test]
fn same_mesh_on_both() {
    let Some(extractor) = common::extractor() else { return };
    let grid = Grid::from_bounds([19, 12, 15], Vec3::splat(-1.4), Vec3::new(1.5, 1.3, 1.4)).unwrap();
    let mut filled = 0;
    for (name, expr) in fields() {
        let field = field(&expr);
        let source = Source::Field(&field, grid);
        for cull in [true, false] {
            let options = Options { cull, ..Options::new(0.0) };
            let (mesh, report) = extract_on_cpu(&source, &options, &|_| {}).unwrap();
            let found = extractor.extract(&source, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
            let on_gpu = found.mesh.read(extractor.gpu()).unwrap();
            assert_eq!(on_gpu.triangles, mesh.triangles, "{name}, cull {cull}");
            assert!(!extractor.gpu().is_software() || on_gpu == mesh, "{name}, cull {cull}");
            if !cull {
                assert_eq!(found.report.non_finite, report.non_finite, "{name}");
            }
            filled += u32::from(!mesh.triangles.is_empty());
        }
    }
    assert!(filled >= 12, "only {filled} meshes have triangles");
}

/// Values, gradients and bounds themselves, on a software GPU bit for bit.
#[test]
fn same_bits_on_both() {
    let Some(gpu) = common::gpu().filter(|gpu| gpu.is_software()) else { return };
    let points = [[0.3, -0.4, 0.2], [-0.7, 0.5, 0.9], [0.0, 0.0, 0.0], [1.0, 0.25, -1.0]];
    let boxes = [[-0.3, 0.4, 0.1, 0.5, -1.0, 1.0], [0.2, 0.3, -0.5, -0.4, 0.0, 0.0]];
    let bits = |values: &[f32]| -> Vec<u32> {
        // The sign of 0 is nobody's.
        values.iter().map(|v| if v.is_nan() { f32::NAN.to_bits() } else { (v + 0.0).to_bits() }).collect()
    };
    for (name, expr) in fields() {
        let field = field(&expr);
        let (own, there) = (crate::values(&field, &points), on_gpu::values(gpu, &field, &points));
        assert_eq!(bits(&own), bits(&there), "{name}: {own:?}, {there:?}");
        let (own, there) = (crate::gradients(&field, &points), on_gpu::gradients(gpu, &field, &points));
        assert_eq!(bits(own.as_flattened()), bits(there.as_flattened()), "{name}: {own:?}, {there:?}");
        let own = boxes.map(|[a, b, c, d, e, f]| {
            let range = field.range([Interval::new(a, b), Interval::new(c, d), Interval::new(e, f)]);
            [range.lo, range.hi]
        });
        let there = on_gpu::intervals(gpu, &field, &boxes);
        assert_eq!(bits(own.as_flattened()), bits(there.as_flattened()), "{name}: {own:?}, {there:?}");
    }
}

/// What is no danger stays a literal: nothing of such a field is read.
#[test]
fn others_are_literals() {
    let expr = ((x() * 2.0).max(0.0) + y() / 3.0 - z() * 1e-17).min(1e17 + x());
    assert!(field(&expr).wgsl().unwrap().parameters.is_empty());
    assert_eq!(field(&(expr / 0.0).min(x() * 1e19)).wgsl().unwrap().parameters.len(), 2);
}
