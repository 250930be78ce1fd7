//! Whole meshes: culled and not, pruned and not, on the CPU and on the adapter.

use crate::common;
use crate::reference::{KERNELS, some};
use glam::Vec3;
use isoforge::compare::compare;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::graph::blobs::{Blobs, Kernel};
use isoforge::graph::{Expr, GraphField, x};
use isoforge::grid::Grid;

fn field(of: Kernel, count: usize, seed: u64) -> GraphField {
    let near = some(count, seed).into_iter().filter(|c| c.position[0] < 20.0);
    GraphField::new(&Blobs::new(of, near.collect()).unwrap().expr(), Sense::Above)
}

fn grid(n: u32) -> Grid {
    Grid::from_bounds([n, n + 3, n - 1], Vec3::splat(-2.6), Vec3::splat(2.6)).unwrap()
}

#[test]
fn culling_changes_no_mesh() {
    for (n, of) in KERNELS.into_iter().enumerate() {
        for count in [20, 80, 4000] {
            let field = field(of, count, n as u64);
            let source = Source::Field(&field, grid(60));
            let iso = if of == Kernel::InverseSquare { 40.0 } else { 0.5 };
            let (culled, report) = extract_on_cpu(&source, &Options::new(iso), &|_| {}).unwrap();
            let all = Options { cull: false, ..Options::new(iso) };
            let (whole, all) = extract_on_cpu(&source, &all, &|_| {}).unwrap();
            assert!(culled.triangles.len() > 100, "{of:?} {count}");
            assert!(culled == whole, "{of:?} {count}: {} {}", culled.triangles.len(), whole.triangles.len());
            assert!(report.active_bricks < all.active_bricks, "{of:?} {count}");
        }
    }
}

/// Stage by stage. Goes red when a sum in the shader starts at 1e-7, or its farthest distance is its nearest.
#[test]
fn is_the_same_on_the_adapter() {
    let Some(extractor) = common::extractor() else { return };
    for (n, of) in KERNELS.into_iter().enumerate() {
        let field = field(of, 2000, n as u64);
        let source = Source::Field(&field, grid(40));
        let iso = if of == Kernel::InverseSquare { 40.0 } else { 0.5 };
        let compared = compare(extractor, &source, &Options::new(iso)).unwrap();
        assert!(compared.rows.len() > 5);
        for row in &compared.rows {
            assert!(row.agrees() && row.differing == 0, "{of:?}: {row:?}");
        }
        let mesh = extractor
            .extract(&source, &Options::new(iso))
            .unwrap()
            .mesh
            .read(common::gpu().unwrap())
            .unwrap();
        let (cpu, _) = extract_on_cpu(&source, &Options::new(iso), &|_| {}).unwrap();
        assert!(mesh == cpu, "{of:?}");
    }
}

/// Two leaves in one field, cut by a plane and used twice.
#[test]
fn as_operands() {
    let leaf = |seed| Blobs::new(Kernel::SoftObject, some(300, seed)).unwrap().expr();
    let (a, b): (Expr, Expr) = (leaf(1), leaf(2));
    let expr = (a.clone() - 0.5).min(x() + 0.2).max(b - a * 0.5 - 0.5);
    let field = GraphField::new(&expr, Sense::Above);
    let source = Source::Field(&field, grid(40));
    let (mesh, _) = extract_on_cpu(&source, &Options::new(0.0), &|_| {}).unwrap();
    let all = Options { cull: false, ..Options::new(0.0) };
    assert!(mesh == extract_on_cpu(&source, &all, &|_| {}).unwrap().0);
    let Some(extractor) = common::extractor() else { return };
    let on_gpu = extractor.extract(&source, &Options::new(0.0)).unwrap().mesh;
    assert!(on_gpu.read(common::gpu().unwrap()).unwrap() == mesh);
}
