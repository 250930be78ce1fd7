//! The field graph on the CPU: points a second of each evaluator, and whole extractions with culling and without.
//!
//! `cargo bench --bench fields [-- FILTER]`, some three minutes on two cores. Evaluators run on one thread, 729 points
//! (a brick's) at a time. The fields' GPU stages are in `stages`; evaluators alone have no kernel to time.

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Field, Points, Sense};
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::graph::interval::Interval;
use isoforge::graph::{Expr, GraphField, shapes::*, z};
use isoforge::grid::Grid;
use std::hint::black_box;
use std::time::Duration;

#[path = "../examples/part/solid.rs"]
mod solid;

/// Points of a brick.
const BRICK: usize = 729;
/// Bricks that one measurement runs through.
const BRICKS: usize = 32;

/// A number from 0 to 1, of the i-th of some sequences.
fn spread(i: usize, axis: usize) -> f64 {
    (i as f64 * [0.618_034, 0.754_878, 0.569_84, 0.341_15][axis]).fract()
}

/// Solids of all kinds in the unit cube, joined and cut, until there are so many operations.
fn csg(operations: usize) -> GraphField {
    let solid = |i: usize| -> Result<Expr, ShapeError> {
        let size = 0.08 + 0.06 * spread(i, 3);
        let shape = match i % 6 {
            0 => sphere(size),
            1 => box_([-size; 3], [size; 3]),
            2 => cylinder(size, 3.0 * size).rotate([1.0, 0.0, 0.5], spread(i, 1))?,
            3 => torus_distance(size, 0.3 * size),
            4 => cone(size, 2.0 * size)?,
            _ => capsule([-size, 0.0, 0.0], [size, size, 0.0], 0.4 * size),
        };
        Ok(shape.translate([0, 1, 2].map(|axis| spread(i, axis))))
    };
    // A ball with one side cut off.
    let mut whole = sphere(0.4).translate([0.5; 3]).difference(z() - 0.3);
    for i in 1.. {
        let field = GraphField::new(&whole, Sense::Below);
        if field.operations() >= operations {
            return field;
        }
        let next = solid(i).expect("sizes above 0");
        whole = if i % 3 == 2 { whole.difference(next) } else { whole.union(next) };
    }
    unreachable!()
}

/// Soft objects in the unit cube, each of which overlaps some neighbours.
fn soft_objects(count: usize) -> GraphField {
    let one = |i| {
        let position = [0, 1, 2].map(|axis| spread(i, axis) as f32);
        Component { position, radius: 1.3 / (count as f32).cbrt(), weight: 1.0 }
    };
    let blobs = Blobs::new(Kernel::SoftObject, (0..count).map(one).collect()).expect("good components");
    GraphField::new(&blobs.expr(), Sense::Above)
}

fn fields() -> Vec<(String, GraphField)> {
    let trees = [10, 1000].map(csg).map(|field| (format!("CSG of {} operations", field.operations()), field));
    let sums = [100, 10_000, 1_000_000].map(|count| (format!("{count} soft objects"), soft_objects(count)));
    trees.into_iter().chain(sums).collect()
}

fn evaluators(criterion: &mut Criterion) {
    // Bricks of 256³ cells, here and there.
    const STEP: f32 = 1.0 / 256.0;
    let corners: Vec<[f32; 3]> =
        (0..BRICKS).map(|i| [0, 1, 2].map(|axis| 0.96 * spread(7 * i + 3, axis) as f32)).collect();
    let axis = |k: usize, period: usize| -> Vec<f32> {
        let of_brick = |c: &[f32; 3]| c[k];
        let at = |corner: f32| (0..BRICK).map(move |i| corner + STEP * (i / period % 9) as f32);
        corners.iter().map(of_brick).flat_map(at).collect()
    };
    let [x, y, z] = [axis(0, 1), axis(1, 9), axis(2, 81)];
    let brick = |i: usize| {
        let own = i * BRICK..(i + 1) * BRICK;
        Points { x: &x[own.clone()], y: &y[own.clone()], z: &z[own] }
    };
    for (name, field) in &fields() {
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        group.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(600));
        group.throughput(Throughput::Elements((BRICKS * BRICK) as u64));
        let (mut values, mut gradients) = ([0.0; BRICK], [[0.0; 3]; BRICK]);
        group.bench_function("values at points", |bencher| {
            bencher.iter(|| {
                for i in 0..BRICKS {
                    field.values(brick(i), &mut values).expect("it has a CPU form");
                    black_box(&values);
                }
            });
        });
        group.bench_function("gradients at points", |bencher| {
            bencher.iter(|| {
                for i in 0..BRICKS {
                    field.gradients(brick(i), &mut gradients).expect("it has a CPU form");
                    black_box(&gradients);
                }
            });
        });
        if let Some(lattice) = field.lattice() {
            group.bench_function("values at a lattice's points", |bencher| {
                bencher.iter(|| {
                    for corner in &corners {
                        let axes = corner.map(|c| [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|i| c + STEP * i as f32));
                        let [x, y, z] = &axes;
                        assert!(lattice.lattice_values([x, y, z], &mut values));
                        black_box(&values);
                    }
                });
            });
        }
        group.throughput(Throughput::Elements(BRICKS as u64));
        group.bench_function("bounds over bricks", |bencher| {
            bencher.iter(|| {
                for corner in &corners {
                    black_box(field.range(corner.map(|c| Interval::new(c, c + 8.0 * STEP))));
                }
            });
        });
        group.finish();
    }
}

fn extractions(criterion: &mut Criterion) {
    let part = GraphField::new(&solid::part().expect("sizes above 0"), Sense::Below);
    let half = Vec3::splat(1.05 * solid::HALF[0]);
    let cases = fields().into_iter().map(|(name, field)| (name, field, Vec3::ZERO, Vec3::ONE));
    for (name, field, low, high) in cases.chain([("machined part".into(), part, -half, half)]) {
        let grid = Grid::from_bounds([256; 3], low, high).expect("a grid");
        let iso = if field.sense() == Sense::Above { 0.5 } else { 0.0 };
        let mut group = criterion.benchmark_group(format!("extraction at 256³: {name}"));
        group.sampling_mode(SamplingMode::Flat).sample_size(10);
        group.warm_up_time(Duration::from_millis(100)).measurement_time(Duration::from_millis(500));
        group.throughput(Throughput::Elements(grid.point_count()));
        for (culling, cull) in [("culled", true), ("every point sampled", false)] {
            let options = Options { cull, ..Options::new(iso) };
            group.bench_function(BenchmarkId::from_parameter(culling), |bencher| {
                bencher.iter(|| {
                    let source = Source::Field(&field, grid);
                    extract_on_cpu(&source, &options, &|_| {}).expect("it has a CPU form").0.triangles.len()
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, evaluators, extractions);
criterion_main!(benches);
