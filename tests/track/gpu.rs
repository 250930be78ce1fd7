//! On the GPU: the bytes of the CPU's tracker.

use crate::common::{self, Random, noise};
use crate::{assert_same, balls, grid};
use glam::Vec3;
use isoforge::extract::{ExtractError, Options, Source};
use isoforge::field::Sense;
use isoforge::field::user::UserField;
use isoforge::graph::{GraphField, shapes::*};
use isoforge::grid::Grid;
use isoforge::track::{Seeds, TrackError, TrackReport, track};

/// Both, if there is a GPU: what is told must agree, on a software adapter all bytes.
fn both(name: &str, source: &Source<'_>, options: &Options, seeds: &Seeds) -> Option<TrackReport> {
    let extractor = common::extractor()?;
    let (mesh, report, told) = track(source, options, seeds, &|_| {}).expect("a mesh");
    let (extraction, of_gpu) = extractor.track(source, options, seeds, &|_| {}).expect("a mesh");
    let found = extraction.mesh.read(extractor.gpu()).expect("a mesh");
    if !extractor.gpu().is_software() {
        // Samples may differ in the last bits.
        let apart = mesh.triangles.len().abs_diff(found.triangles.len());
        assert!(apart <= 4 + mesh.triangles.len() / 1000, "{name}: {apart} triangles apart");
        return Some(told);
    }
    assert_same(name, &found, &mesh);
    assert_eq!(told, of_gpu, "{name}");
    let counts = |r: &isoforge::extract::Report| [r.vertices, r.triangles, r.bricks, r.active_bricks];
    assert_eq!(counts(&extraction.report), counts(&report), "{name}");
    Some(told)
}

fn seeds(i: u64, random: &mut Random) -> Seeds {
    let mut point = || Vec3::new(random.unit(), random.unit(), random.unit());
    let points = vec![point(), point(), point()];
    match i % 4 {
        0 => Seeds { coarse: Some(6), ..Seeds::default() },
        1 => Seeds { points, search: Some(4), ..Seeds::default() },
        _ => Seeds { points, ..Seeds::default() },
    }
}

/// Goes red when `spread` (shaders/track.wgsl) takes the low planes for the high ones, and when `gather`
/// (shaders/components.wgsl) forgets to renumber.
#[test]
fn as_on_the_cpu() {
    let mut dropped = 0;
    for i in 0..10 {
        let mut random = Random(40 + i);
        let cells = [[40, 40, 40], [64, 17, 33], [9, 70, 16]][i as usize % 3];
        let (_, field) = balls(&mut random, 12, 0.13);
        let source = Source::Field(&field, grid(i, cells));
        let found = both(&format!("balls {i}"), &source, &Options::new(0.0), &seeds(i, &mut random));
        dropped += found.and_then(|told| told.dropped).unwrap_or(0);
    }
    for i in 0..9 {
        let mut random = Random(70 + i);
        let cells = [[12, 9, 17], [8, 8, 8], [30, 5, 9]][i as usize % 3];
        let volume = noise(grid(i, cells), i);
        let seeds = Seeds { points: vec![Vec3::splat(0.5)], ..seeds(2, &mut random) };
        let options = Options::new([0.0, 0.45, -0.3][i as usize / 3]);
        let found = both(&format!("volume {i}"), &Source::Volume(&volume), &options, &seeds);
        dropped += found.and_then(|told| told.dropped).unwrap_or(0);
    }
    assert!(dropped > 5 || common::extractor().is_none(), "components leave the mesh: {dropped}");
}

/// A frontier of more bricks than a batch holds waits its turn.
/// Goes red when `advance` (shaders/track.wgsl) takes more than a batch.
#[test]
fn in_batches() {
    let Some(extractor) = common::extractor() else { return };
    // Specks at the bricks' corners: little surface in every brick, all of it met at once.
    let text = "fn density(p: vec3<f32>) -> f32 {
        let q = p - 8.0 * floor(p / 8.0 + vec3<f32>(0.5));
        return dot(q, q) - 0.6;
    }";
    let field = UserField::new(text, "specks", Sense::Below).expect("a field");
    let grid = Grid::from_bounds([100, 100, 20], Vec3::ZERO, Vec3::new(100.0, 100.0, 20.0)).expect("a grid");
    let source = Source::Field(&field, grid);
    let seeds = Seeds { coarse: Some(1), ..Seeds::default() };
    let budgets = (1..60).map(|n| n << 18);
    let in_batches = budgets.filter(|&budget| {
        let space = extractor.prepare(&source, budget);
        space.is_ok_and(|space| space.plan().slab_count() == 1 && space.plan().batches > 3)
    });
    let memory_budget = in_batches.last().expect("a budget that takes batches");
    let options = Options { memory_budget, ..Options::new(0.0) };
    let (mesh, _, of_cpu) = track(&source, &Options::new(0.0), &seeds, &|_| {}).expect("a mesh");
    let (extraction, told) = extractor.track(&source, &options, &seeds, &|_| {}).expect("a mesh");
    assert!(told.rounds > of_cpu.rounds, "{told:?}, {of_cpu:?}");
    assert_same("batches", &extraction.mesh.read(extractor.gpu()).expect("a mesh"), &mesh);
}

/// What does not fit is refused, with what to do instead.
#[test]
fn too_large_a_grid() {
    let Some(extractor) = common::extractor() else { return };
    let field = GraphField::new(&sphere(0.3), Sense::Below);
    let grid = Grid::from_bounds([4000; 3], -Vec3::ONE, Vec3::ONE).expect("a grid");
    let seeds = Seeds { points: vec![Vec3::ZERO], ..Seeds::default() };
    let found = extractor.track(&Source::Field(&field, grid), &Options::new(0.0), &seeds, &|_| {});
    let error = found.expect_err("too large");
    assert!(matches!(error, TrackError::Slabs { bricks: 125_751_501, .. }), "{error}");
    assert!(error.to_string().contains("track on the CPU"));
}

/// A budget that is too small beside the mesh is told as what it is, in the end with a figure that suffices.
#[test]
fn budgets_that_the_mesh_is_over() {
    let Some(extractor) = common::extractor() else { return };
    let field = GraphField::new(&sphere(0.7), Sense::Below);
    let grid = Grid::from_bounds([100; 3], -Vec3::ONE, Vec3::ONE).expect("a grid");
    let seeds = Seeds { points: vec![Vec3::ZERO], ..Seeds::default() };
    let track = |memory_budget| {
        let options = Options { memory_budget, ..Options::new(0.0) };
        extractor.track(&Source::Field(&field, grid), &options, &seeds, &|_| {}).map(drop)
    };
    let (mut asked, mut told) = (100_000, 0);
    while let Err(error) = track(asked) {
        if let TrackError::Extract(ExtractError::Budget { what, needed, budget }) = error {
            assert!(budget == asked && needed > asked, "{what}: {needed}, {budget}, {asked}");
            // The labels come last.
            if what.contains("labels") {
                assert!(track(needed).is_ok(), "{what}: {needed}, {budget}");
                told += 1;
            }
        } else {
            assert!(matches!(error, TrackError::Slabs { .. }), "{error}");
        }
        asked += asked / 8;
    }
    assert!(told > 0);
}
