//! The tracker against the sweep, culled and not: a ball of fixed relative size, and one of 24 cells in radius, from 64³
//! to 2048³ cells.
//!
//! `cargo bench --bench track [-- FILTER]`, a few minutes on two cores. The sweep of every point is left out above 512³.
//! Rows: `point` tracks from the ball's centre, `search` looks through the whole grid by intervals first, and
//! `cells` is a tracker of single cells (of a distance function written here, without normals), to compare with.

use criterion::{BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::graph::{GraphField, shapes::*};
use isoforge::grid::Grid;
use isoforge::track::{Seeds, track};
use std::collections::{HashMap, HashSet};
use std::hint::black_box;
use std::time::Duration;

fn tracker(criterion: &mut Criterion) {
    for (kind, radius) in [("relative", None), ("absolute", Some(24.0))] {
        for n in [64u32, 128, 256, 512, 1024, 2048] {
            // In cells; off the grid's points.
            let centre = f64::from(n) / 2.0 + 0.3;
            let radius = radius.unwrap_or(f64::from(n) * 0.375);
            let field = GraphField::new(&sphere(radius).translate([centre; 3]), Sense::Below);
            let grid = Grid::from_bounds([n; 3], Vec3::ZERO, Vec3::splat(n as f32)).expect("a grid");
            let source = Source::Field(&field, grid);
            let options = Options::new(0.0);
            let every = Options { cull: false, ..options };
            let point = Seeds { points: vec![Vec3::splat(centre as f32)], ..Seeds::default() };
            let search = Seeds { search: Some(8), ..Seeds::default() };

            let mut group = criterion.benchmark_group(format!("{kind}/{n}"));
            group.sampling_mode(SamplingMode::Flat).sample_size(10);
            group.warm_up_time(Duration::from_millis(100)).measurement_time(Duration::from_millis(500));
            let mut row = |name: &str, run: &dyn Fn()| {
                group.bench_function(BenchmarkId::from_parameter(name), |b| b.iter(run));
            };
            row("point", &|| {
                black_box(track(&source, &options, &point, &|_| {}).expect("a mesh"));
            });
            row("search", &|| {
                black_box(track(&source, &options, &search, &|_| {}).expect("a mesh"));
            });
            row("culled sweep", &|| {
                black_box(extract_on_cpu(&source, &options, &|_| {}).expect("a mesh"));
            });
            if n <= 512 {
                row("whole sweep", &|| {
                    black_box(extract_on_cpu(&source, &every, &|_| {}).expect("a mesh"));
                });
            }
            if n <= 1024 {
                row("cells", &|| {
                    black_box(cells(centre as f32, radius as f32));
                });
            }
            group.finish();
        }
    }
}

/// The cells that the ball's surface crosses, one by one from a stack, each corner evaluated once; how many there are.
fn cells(centre: f32, radius: f32) -> usize {
    let centre = Vec3::splat(centre);
    let mut values = HashMap::new();
    let mut inside = |p: [i32; 3]| {
        *values.entry(p).or_insert_with(|| (Vec3::from(p.map(|c| c as f32)) - centre).length() < radius)
    };
    let c = centre.x as i32;
    let mut stack = vec![[c, c, (centre.z + radius) as i32]];
    let mut seen: HashSet<[i32; 3]> = stack.iter().copied().collect();
    while let Some(cell) = stack.pop() {
        let corners = std::array::from_fn::<bool, 8, _>(|k| {
            let up = [k & 1, k >> 1 & 1, k >> 2];
            inside([0, 1, 2].map(|a| cell[a] + up[a] as i32))
        });
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            // The four corners of a face, on both sides?
            let of_face = (0..8).filter(|k| k >> axis & 1 == side).map(|k: usize| corners[k]);
            let count = of_face.filter(|&inside| inside).count();
            let mut next = cell;
            next[axis] += if side == 1 { 1 } else { -1 };
            if !matches!(count, 0 | 4) && seen.insert(next) {
                stack.push(next);
            }
        }
    }
    seen.len()
}

criterion_group!(benches, tracker);
criterion_main!(benches);
