//! One volume or workspace for several extractions, one after another and at the same time.

use crate::common;
use crate::{on_cpu, read};
use glam::Vec3;
use isoforge::extract::{ExtractError, Extractor, Options, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::gpu::GpuMesh;
use isoforge::graph::{GraphField, shapes::sphere};
use isoforge::grid::Grid;
use isoforge::volume::Volume;
use rayon::prelude::*;
use std::cell::Cell;
use std::sync::mpsc;
use std::time::{Duration, Instant};

fn cube(n: u32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::NEG_ONE, Vec3::ONE).unwrap()
}

fn ball(radius: f32) -> Volume {
    common::sampled(cube(30), |p| radius - p.length())
}

/// Tasks of one pool that extract one volume: the table of its bricks' ranges is built by tasks of that pool, too.
///
/// Goes red, by and by, when `Volume::ranges` builds the table in `get_or_init`: a thread that waits there for other tasks begins an
/// extraction, which waits for the thread.
#[test]
fn a_volume_in_many_tasks() {
    let (done, all) = mpsc::channel();
    std::thread::spawn(move || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
        let grid = Grid::from_bounds([16, 16, 1000], Vec3::ZERO, Vec3::ONE).unwrap();
        let empty = common::sampled(grid, |p| p.x);
        let since = Instant::now();
        while since.elapsed() < Duration::from_secs(3) {
            let volume = Volume::of(grid, empty.values().clone()).unwrap();
            let triangles = pool.install(|| {
                let isos = (0..32).into_par_iter().map(|i| 5.0 + i as f32);
                let extract = |iso| {
                    let source = Source::Volume(&volume);
                    extract_on_cpu(&source, &Options::new(iso), &|_| {}).unwrap().0.triangles.len()
                };
                isos.map(extract).sum::<usize>()
            });
            assert_eq!(triangles, 0);
        }
        done.send(()).unwrap();
    });
    assert!(all.recv_timeout(Duration::from_secs(60)).is_ok(), "a task waits for itself, or failed");
}

/// Goes red when `run` (src/extract/run.rs) does not wait for its turn.
#[test]
fn a_workspace_on_many_threads() {
    let Some(extractor) = common::extractor() else { return };
    let (gyroid, grid) = common::named("gyroid", 30);
    let source = Source::Field(&gyroid, grid);
    let space = extractor.prepare(&source, u64::MAX).unwrap();
    let isos: Vec<f32> = (0..12).map(|i| i as f32 * 0.1 - 0.6).collect();
    let expected: Vec<_> = isos.iter().map(|iso| on_cpu(&source, &Options::new(*iso)).triangles).collect();
    std::thread::scope(|scope| {
        for first in 0..4 {
            let (isos, expected, space) = (&isos, &expected, &space);
            scope.spawn(move || {
                for i in (0..12).map(|i| (i + 3 * first) % 12) {
                    let options = Options::new(isos[i]);
                    let found = extractor.extract_in(space, &source, &options, &|_| {}).unwrap();
                    assert!(read(extractor, &found).triangles == expected[i], "{}", isos[i]);
                }
            });
        }
    });
}

/// Of another volume with the same grid the samples are uploaded, whole or in slabs, for `extract_in` and for `encode`.
///
/// Goes red when `take_source` (src/extract/gpu.rs) does not look at which volume it is.
#[test]
fn another_volume() {
    let Some(extractor) = common::extractor() else { return };
    let gpu = extractor.gpu();
    let (small, large) = (ball(0.3), ball(0.7));
    let sources = [&small, &large, &small].map(Source::Volume);
    let options = Options::new(0.0);
    let expected = sources.map(|source| on_cpu(&source, &options));
    let needed = extractor.extract(&sources[1], &options).unwrap().report.peak_bytes;
    for budget in [u64::MAX, needed / 2] {
        let space = extractor.prepare(&sources[0], budget).unwrap();
        assert_eq!(space.plan().slab_count() > 1, budget < u64::MAX);
        for (source, expected) in sources.iter().zip(&expected) {
            let found = extractor.extract_in(&space, source, &options, &|_| {}).unwrap();
            assert_eq!(read(extractor, &found).triangles, expected.triangles);
        }
    }
    let space = extractor.prepare(&sources[0], u64::MAX).unwrap();
    let mesh = GpuMesh::with_capacity(gpu, 20_000, 40_000).unwrap();
    for (source, expected) in sources.iter().zip(&expected) {
        extractor.set_source(&space, source).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        extractor.encode(&space, &mut encoder, &options, &mesh).unwrap();
        gpu.queue.submit([encoder.finish()]);
        assert!(mesh.read_header(gpu).unwrap().is_whole());
        assert_eq!(mesh.read(gpu).unwrap().triangles, expected.triangles);
    }
}

/// Goes red when `take_source` (src/extract/gpu.rs) leaves the sense.
#[test]
fn another_sense() {
    let Some(gpu) = common::gpu() else { return };
    let extractor = Extractor::new(gpu.clone()).unwrap();
    let fields = [Sense::Below, Sense::Above].map(|sense| GraphField::new(&sphere(0.8), sense));
    let sources = fields.each_ref().map(|field| Source::Field(field, cube(20)));
    let space = extractor.prepare(&sources[0], u64::MAX).unwrap();
    for source in [sources[0], sources[1], sources[0]] {
        let found = extractor.extract_in(&space, &source, &Options::new(0.0), &|_| {}).unwrap();
        assert_eq!(read(&extractor, &found).triangles, on_cpu(&source, &Options::new(0.0)).triangles);
    }
}

/// Calls on a workspace from within an extraction in it are refused, and do not wait for its end, which waits for them.
///
/// Goes red, by never ending, when `Turn::take` (src/extract/workspace.rs) does not ask who holds it.
#[test]
fn a_workspace_from_within() {
    let Some(extractor) = common::extractor() else { return };
    let (gyroid, grid) = common::named("gyroid", 20);
    let source = Source::Field(&gyroid, grid);
    let space = extractor.prepare(&source, u64::MAX).unwrap();
    let told = Cell::new(0);
    let within = |_| {
        told.set(told.get() + 1);
        assert!(matches!(extractor.set_source(&space, &source), Err(ExtractError::Busy)));
        let again = extractor.extract_in(&space, &source, &Options::new(0.1), &|_| {});
        assert!(matches!(again, Err(ExtractError::Busy)));
    };
    let found = extractor.extract_in(&space, &source, &Options::new(0.0), &within).unwrap();
    assert!(told.get() > 0);
    assert_eq!(read(extractor, &found).triangles, on_cpu(&source, &Options::new(0.0)).triangles);
    extractor.set_source(&space, &source).unwrap();
}
