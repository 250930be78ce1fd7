//! Culling by intervals changes no byte of any mesh.

use crate::{common, field};
use glam::Vec3;
use isoforge::extract::{Extractor, Options, Source, extract_on_cpu};
use isoforge::field::Field;
use isoforge::graph::blobs::skeleton::polyline_square;
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::graph::{Expr, x, y, z};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;

fn sphere(r: f64) -> Expr {
    (x().square() + y().square() + z().square()).sqrt() - r
}

fn at(shape: &Expr, p: [f64; 3]) -> Expr {
    shape.at([x() - p[0], y() - p[1], z() - p[2]])
}

/// A part with many operations: a ball with holes and bumps.
fn part() -> Expr {
    let mut part = sphere(1.0);
    for i in 0..40 {
        let turn = f64::from(i) * 0.13;
        let (s, c) = (turn * std::f64::consts::TAU).sin_cos();
        let small =
            at(&sphere(0.12 + 0.003 * f64::from(i)), [0.9 * c, 0.9 * s, (f64::from(i) - 20.0) * 0.04]);
        part = if i % 2 == 0 { part.min(small) } else { part.max(-small) };
    }
    part
}

/// Leaves with and without data, a parameter and a choice beside the part.
fn mixed() -> Expr {
    let drop = |x| Component { position: [x, 0.0, 0.3], radius: 0.8, weight: 1.0 };
    let drops = Blobs::new(Kernel::SoftObject, vec![drop(-0.9), drop(0.8)]).unwrap().expr();
    let rough = Expr::noise(3) * Expr::parameter("height", 0.05);
    let solid = part().min(0.4 - drops) + rough;
    z().less(0.9).select(solid, z() - 0.9)
}

fn fields() -> Vec<(&'static str, Expr)> {
    vec![
        ("part", part()),
        ("mixed", mixed()),
        ("poles", 1.0 / (x() * y()) + z()),
        ("roots", (x() * 3.0).sqrt() - y().abs() * z()),
        ("steps", (x() * 4.0).floor() * 0.25 - z()),
        ("nothing", sphere(0.5).abs() + 1.0),
        ("everything", sphere(0.5) * 0.0 - 1.0),
    ]
}

fn on_cpu(source: &Source<'_>, options: &Options) -> (Mesh, u64, u64) {
    let (mesh, report) = extract_on_cpu(source, options, &|_| {}).unwrap();
    (mesh, report.active_bricks, report.non_finite)
}

fn on_gpu(extractor: &Extractor, source: &Source<'_>, options: &Options) -> (Mesh, u64, u64) {
    let found = extractor.extract(source, options).unwrap();
    let mesh = found.mesh.read(extractor.gpu()).unwrap();
    (mesh, found.report.active_bricks, found.report.non_finite)
}

/// Goes red when `bounds` takes the box of a brick one brick too small, on either backend.
#[test]
fn changes_no_mesh() {
    for (name, expr) in fields() {
        let field = field(&expr);
        for (cells, low, high) in [
            ([41, 70, 33], Vec3::new(-1.4, -1.3, -1.35), Vec3::new(1.3, 1.45, 1.4)),
            ([7, 9, 130], Vec3::splat(-1.5), Vec3::splat(1.5)),
        ] {
            let grid = Grid::from_bounds(cells, low, high).unwrap();
            let source = Source::Field(&field as &dyn Field, grid);
            for iso in [0.0, 0.05] {
                let with = Options::new(iso);
                let without = Options { cull: false, ..with };
                let all = on_cpu(&source, &without);
                let culled = on_cpu(&source, &with);
                assert!(all.0 == culled.0, "{name} {cells:?} on the CPU");
                assert_eq!(all.2, culled.2, "{name}: samples that are not finite");
                assert!(culled.1 <= all.1);
                if let Some(extractor) = common::extractor() {
                    let on_gpu_culled = on_gpu(extractor, &source, &with);
                    assert!(on_gpu(extractor, &source, &without).0 == on_gpu_culled.0, "{name} on the GPU");
                    assert_eq!(on_gpu_culled.2, culled.2, "{name}: samples that are not finite on the GPU");
                    if extractor.gpu().is_software() {
                        assert!(on_gpu_culled.0 == culled.0, "{name}: GPU and CPU");
                        assert_eq!(on_gpu_culled.1, culled.1, "{name}: active bricks");
                    }
                }
            }
        }
    }
}

#[test]
fn most_bricks_are_left_out() {
    let field = field(&part());
    let grid = Grid::from_bounds([200; 3], Vec3::splat(-1.5), Vec3::splat(1.5)).unwrap();
    let source = Source::Field(&field as &dyn Field, grid);
    let (mesh, active, _) = on_cpu(&source, &Options::new(0.0));
    let surface = mesh.triangles.len() as u64 / 128;
    assert!(active < grid.brick_count() / 4 && active < 8 * surface, "{active} of {}", grid.brick_count());
}

/// Bounds of long fields are a loop over the operations on a GPU, with the same bits. Goes red when it takes a
/// parameter for a constant, or an operation's second operand for its first.
#[test]
fn long_fields_have_the_same_bounds_on_the_adapter() {
    let Some(extractor) = common::extractor() else { return };
    for expr in [part(), mixed()] {
        let mut field = field(&expr);
        assert!(field.operations() > 200);
        let grid = Grid::from_bounds([40, 50, 60], Vec3::splat(-1.4), Vec3::splat(1.4)).unwrap();
        for height in [0.05, 0.1] {
            let _ = field.set("height", height);
            let source = Source::Field(&field as &dyn Field, grid);
            let compared = isoforge::compare::compare(extractor, &source, &Options::new(0.0)).unwrap();
            for row in &compared.rows {
                assert!(row.agrees() && row.differing == 0, "{row:?}");
            }
        }
    }
}

/// The points of a line that winds up around the z axis, closer together than any box that is pruned is large.
fn helix(count: usize) -> impl Iterator<Item = [f32; 3]> {
    (0..count).map(move |i| {
        let (part, turn) = (i as f32 / count as f32, i as f32 * 0.15);
        [turn.cos() * (0.3 + 0.6 * part), turn.sin() * (0.3 + 0.6 * part), 2.0 * part - 1.0]
    })
}

/// Fields of many parts are pruned for each brick, too. Goes red when a brick gets the field of the one before, and when its box is
/// taken a cell too small.
#[test]
fn long_fields_brick_by_brick() {
    let line = polyline_square(helix(400)).unwrap() - 0.01;
    let field = field(&line);
    let grid = Grid::from_bounds([60, 70, 80], Vec3::splat(-1.2), Vec3::splat(1.2)).unwrap();
    let source = Source::Field(&field as &dyn Field, grid);
    let with = Options::new(0.0);
    let (culled, active, _) = on_cpu(&source, &with);
    let (all, bricks, _) = on_cpu(&source, &Options { cull: false, ..with });
    assert!(culled == all && culled.triangles.len() > 5000, "{} triangles", culled.triangles.len());
    assert!(2 * active < bricks, "{active} of {bricks}");
}
