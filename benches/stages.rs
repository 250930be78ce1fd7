//! Each stage and the whole extraction, on the CPU and on the adapter, at 64³, 128³ and 256³.
//!
//! `cargo bench --bench stages [-- FILTER]`, a few minutes on two cores. Throughput is in cells of the grid
//! per second, for emit in triangles; the whole prints triangles per second as well. The brain atlas is the volume
//! where it is there; `ISOFORGE_BENCH_VOLUME` and `ISOFORGE_BENCH_ISO` name another file and iso value. A
//! software adapter's stages are left out at 256³: the whole shows enough, and they take minutes.

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use isoforge::extract::{ExtractError, Extractor, Options, Report, STAGES, Source, extract_on_cpu};
use isoforge::field::named::Named;
use isoforge::gpu::{AdapterChoice, Gpu};
use isoforge::grid::Grid;
use isoforge::volume::{OpenOptions, open};
use std::path::Path;
use std::time::{Duration, Instant};

const SIZES: [u32; 3] = [64, 128, 256];

fn stages(criterion: &mut Criterion) {
    let extractor = match Gpu::open(AdapterChoice::Best).map_err(ExtractError::from).and_then(Extractor::new)
    {
        Ok(extractor) => Some(extractor),
        Err(error) => {
            eprintln!("GPU rows are left out: {error}");
            None
        }
    };
    let extractor = extractor.as_ref();
    for name in ["sphere", "torus", "gyroid"] {
        let field = Named::new(name).expect("a named field");
        let half = Vec3::splat(field.definition().half_edge);
        for n in SIZES {
            let grid = Grid::from_bounds([n; 3], -half, half).expect("a grid");
            let options = Options::new(field.definition().iso);
            rows(criterion, &format!("{name}/{n}"), &Source::Field(&field, grid), &options, extractor);
        }
    }
    let brain = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/volumes/ct_brain_atlas_1mm.nii.gz");
    let (file, iso) = match std::env::var("ISOFORGE_BENCH_VOLUME") {
        Ok(file) => (file, std::env::var("ISOFORGE_BENCH_ISO").ok().and_then(|iso| iso.parse().ok())),
        Err(_) if Path::new(brain).exists() => (brain.into(), Some(10.0)),
        Err(_) => {
            return eprintln!("the volume is left out: set ISOFORGE_BENCH_VOLUME and ISOFORGE_BENCH_ISO");
        }
    };
    match (open(Path::new(&file), &OpenOptions::default()), iso) {
        (Ok(opened), Some(iso)) => {
            rows(criterion, "volume", &Source::Volume(&opened.volume), &Options::new(iso), extractor);
        }
        (Ok(_), None) => eprintln!("the volume is left out: set ISOFORGE_BENCH_ISO to a number"),
        (Err(error), _) => eprintln!("the volume is left out: {error}"),
    }
}

fn rows(
    criterion: &mut Criterion,
    case: &str,
    source: &Source<'_>,
    options: &Options,
    extractor: Option<&Extractor>,
) {
    let on_cpu = || extract_on_cpu(source, options, &|_| {}).map(|(_, report)| report);
    backend(criterion, case, "cpu", source.grid(), true, on_cpu);
    let Some(extractor) = extractor else { return };
    let space = match extractor.prepare(source, options.memory_budget) {
        Ok(space) => space,
        Err(error) => return eprintln!("{case} on the GPU is left out: {error}"),
    };
    let each = !extractor.gpu().is_software() || source.grid().cells().max_element() <= 128;
    let on_gpu = || extractor.extract_in(&space, source, options, &|_| {}).map(|e| e.report);
    backend(criterion, case, "gpu", source.grid(), each, on_gpu);
}

/// The rows of one backend: `extract` does the whole and reports on it.
fn backend(
    criterion: &mut Criterion,
    case: &str,
    name: &str,
    grid: &Grid,
    each_stage: bool,
    extract: impl Fn() -> Result<Report, ExtractError>,
) {
    // Compiles the pipelines, and tells which stages there are.
    let report = match extract() {
        Ok(report) => report,
        Err(error) => return eprintln!("{case} on the {name} is left out: {error}"),
    };
    let extract = || extract().expect("it did so before");
    let cells = grid.cells().as_u64vec3().element_product();
    let mut group = criterion.benchmark_group(case);
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(100)).measurement_time(Duration::from_millis(500));

    let mut best = f64::INFINITY;
    group.throughput(Throughput::Elements(cells));
    group.bench_function(BenchmarkId::new(name, "whole"), |bencher| {
        bencher.iter_custom(|runs| {
            let start = Instant::now();
            for _ in 0..runs {
                std::hint::black_box(extract());
            }
            best = best.min(start.elapsed().as_secs_f64() / runs as f64);
            start.elapsed()
        });
    });
    if best.is_finite() {
        println!(
            "{case} {name}: {} triangles, {:.3e} a second",
            report.triangles,
            report.triangles as f64 / best
        );
    }
    for (i, stage) in STAGES.iter().enumerate().filter(|(i, _)| each_stage && report.seconds[*i].is_some()) {
        let items = if *stage == "emit" { report.triangles } else { cells };
        group.throughput(Throughput::Elements(items));
        group.bench_function(BenchmarkId::new(name, stage), |bencher| {
            bencher.iter_custom(|runs| {
                let seconds: f64 = (0..runs).filter_map(|_| extract().seconds[i]).sum();
                Duration::from_secs_f64(seconds).max(Duration::from_nanos(1))
            });
        });
    }
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
