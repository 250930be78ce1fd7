//! An edit of one parameter, extracted again in full and incrementally, on all cores.
//!
//! `cargo bench --bench incremental [-- FILTER]`. The value goes to and fro, so that each update follows an edit; what
//! is dirty is printed first.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::Vec3;
use isoforge::extract::{Incremental, Options, Source, extract_on_cpu};
use isoforge::field::{Field, Sense};
use isoforge::graph::GraphField;
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::grid::Grid;
use isoforge::scene::{OpenOptions, Scene};
use std::hint::black_box;
use std::path::Path;

/// A field before and after an edit, in turns.
fn edits(criterion: &mut Criterion, name: &str, fields: &[GraphField; 2], grid: Grid, iso: f32) {
    let options = Options::new(iso);
    let mut scene = Incremental::new(grid);
    let mut turn = 0;
    let mut next = || {
        turn = 1 - turn;
        &fields[turn]
    };
    for _ in 0..2 {
        let update = scene.update(next(), &options).expect("a mesh");
        println!("{name}: {update:?}");
    }
    let mut group = criterion.benchmark_group(name);
    group.sample_size(20);
    let full = |field: &GraphField| {
        let source = Source::Field(field as &dyn Field, grid);
        black_box(extract_on_cpu(&source, &options, &|_| {}).expect("a mesh"));
    };
    group.bench_function("full", |b| b.iter(|| full(next())));
    group.bench_function("incremental", |b| {
        b.iter(|| black_box(scene.update(next(), &options).expect("a mesh")));
    });
    group.finish();
}

fn part(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/part.toml");
    let scene = Scene::open(&path, &OpenOptions::default()).expect("the scene is there");
    let [low, high] = scene.bounds.expect("it names its bounds");
    for part in [1, 2, 4] {
        let cells = scene.cells.expect("and its cells").map(|n| n * part);
        let grid = Grid::from_bounds(cells, low, high).expect("a grid");
        for (parameter, value) in [("bore", 0.41), ("screw", 0.14), ("edge", 0.13)] {
            let mut fields = [scene.field(), scene.field()];
            fields[1].set(parameter, value).expect("a parameter");
            edits(criterion, &format!("part x{part}/{parameter}"), &fields, grid, 0.0);
        }
    }
}

fn blobs(criterion: &mut Criterion) {
    for count in [1000u32, 100_000] {
        let radius = 2.0 / (count as f32).cbrt();
        let place = |i: u32, k: f32| (i as f32 * k).fract();
        let mut components: Vec<Component> = (0..count)
            .map(|i| [place(i, 0.618_034), place(i, 0.754_877_7), place(i, 0.569_840_3)])
            .map(|position| Component { position, radius, weight: 0.5 })
            .collect();
        let field = |components: &[Component]| {
            let blobs = Blobs::new(Kernel::SoftObject, components.to_vec()).expect("blobs");
            GraphField::new(&blobs.expr(), Sense::Above)
        };
        let before = field(&components);
        components[count as usize / 2].position[0] += 0.1 * radius;
        let fields = [before, field(&components)];
        let grid = Grid::from_bounds([192; 3], Vec3::ZERO, Vec3::ONE).expect("a grid");
        edits(criterion, &format!("blobs {count}/one moved"), &fields, grid, 0.5);
    }
}

criterion_group!(benches, part, blobs);
criterion_main!(benches);
