//! The methods that keep edges, beside the sweep on the same grid: a drilled block that is turned, and a ball.
//!
//! `cargo bench --bench sharp [-- FILTER]`.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Sense, Surface};
use isoforge::graph::GraphField;
use isoforge::graph::shapes::{box_, cylinder, sphere};
use isoforge::grid::Grid;
use isoforge::{octree, sharp};

fn edges(criterion: &mut Criterion) {
    let block = box_([-0.8; 3], [0.8; 3]).difference(cylinder(0.4, 3.0)).rotate([1.0, 2.0, 0.5], 0.07);
    for (name, solid) in [("block", block.expect("an axis")), ("ball", sphere(0.9))] {
        let field = GraphField::new(&solid, Sense::Below);
        for cells in [64, 128, 256] {
            let grid = Grid::from_bounds([cells; 3], Vec3::splat(-1.27), Vec3::splat(1.27)).expect("a grid");
            let surface = Surface::new(&field, 0.0, Sense::Below, 1e-3).expect("a field of the CPU");
            let settings = octree::Settings::new(&grid);
            let source = Source::Field(&field, grid);
            let mut group = criterion.benchmark_group(format!("{name}/{cells}"));
            group.sample_size(10);
            group
                .bench_function("sweep", |b| b.iter(|| extract_on_cpu(&source, &Options::new(0.0), &|_| {})));
            group.bench_function("sharp", |b| b.iter(|| sharp::extract(&surface, &grid, u64::MAX, &|_| {})));
            group.bench_function("dmc", |b| b.iter(|| octree::extract(&surface, &grid, &settings, &|_| {})));
        }
    }
}

criterion_group!(benches, edges);
criterion_main!(benches);
