//! Times extraction of one raw `f32` volume, for `benches/peers/peers.py`.
//!
//! `cargo run --release --example bench_volume -- FILE NX NY NZ ISO [--repeats N] [--gpu]`
//!
//! The file is read once. Each CPU repeat makes a fresh volume of it, in the same memory (so that the table of brick ranges
//! is built again, as the first extraction of a volume must, of an array that others, too, have in the caches), and then extracts
//! once more with the table at hand, as a new iso value does: both once into new memory, and once by a `CpuExtractor` that has
//! been used before. One JSON object on standard output.

use glam::Vec3;
use isoforge::extract::{CpuExtractor, Extractor, Options, Report, STAGES, Source, extract_on_cpu};
use isoforge::gpu::{AdapterChoice, Gpu};
use isoforge::grid::Grid;
use isoforge::volume::Volume;
use serde_json::{Map, Value, json};
use std::error::Error;
use std::time::Instant;

const USAGE: &str = "usage: bench_volume FILE NX NY NZ ISO [--repeats N] [--gpu]";

fn main() -> Result<(), Box<dyn Error>> {
    let mut positional = Vec::new();
    let (mut repeats, mut on_gpu) = (3, false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--repeats" => repeats = arguments.next().ok_or(USAGE)?.parse()?,
            "--gpu" => on_gpu = true,
            _ => positional.push(argument),
        }
    }
    let [file, nx, ny, nz, iso] = &positional[..] else { return Err(USAGE.into()) };
    let points: [u32; 3] = [nx.parse()?, ny.parse()?, nz.parse()?];
    let options = Options::new(iso.parse()?);
    let values: Vec<f32> = bytemuck::pod_collect_to_vec(&std::fs::read(file)?);
    let far = Vec3::from(points.map(|n| (n - 1) as f32));
    let grid = Grid::from_bounds(points.map(|n| n - 1), Vec3::ZERO, far)?;
    let result =
        if on_gpu { gpu(grid, values, &options, repeats)? } else { cpu(grid, values, &options, repeats)? };
    println!("{result}");
    Ok(())
}

fn cpu(grid: Grid, values: Vec<f32>, options: &Options, repeats: usize) -> Result<Value, Box<dyn Error>> {
    let mut times = [(); 4].map(|()| Times::default());
    let [fresh, cached, fresh_reused, cached_reused] = &mut times;
    let mut extractor = CpuExtractor::default();
    let mut volume = Volume::new(grid, values)?;
    extractor.extract(&Source::Volume(&volume), options, &|_| {})?;
    for _ in 0..repeats {
        volume = Volume::of(grid, volume.into_values())?;
        for times in [&mut *fresh, &mut *cached] {
            let start = Instant::now();
            let (_mesh, report) = extract_on_cpu(&Source::Volume(&volume), options, &|_| {})?;
            times.add(start, report);
        }
        volume = Volume::of(grid, volume.into_values())?;
        for times in [&mut *fresh_reused, &mut *cached_reused] {
            let start = Instant::now();
            let report = extractor.extract(&Source::Volume(&volume), options, &|_| {})?;
            times.add(start, report);
        }
    }
    Ok(json!({
        "fresh": fresh.value(),
        "cached": cached.value(),
        "fresh reused": fresh_reused.value(),
        "cached reused": cached_reused.value(),
        "triangles": fresh.report.triangles,
    }))
}

fn gpu(grid: Grid, values: Vec<f32>, options: &Options, repeats: usize) -> Result<Value, Box<dyn Error>> {
    let extractor = Extractor::new(Gpu::open(AdapterChoice::Best)?)?;
    let volume = Volume::new(grid, values)?;
    let source = Source::Volume(&volume);
    // The first dispatch of a pipeline compiles it.
    extractor.extract(&source, options)?;
    let (mut fresh, mut cached) = (Times::default(), Times::default());
    for _ in 0..repeats {
        let start = Instant::now();
        let extraction = extractor.extract(&source, options)?;
        fresh.add(start, extraction.report.clone());
        drop(extraction.mesh);
        let space = extractor.prepare(&source, options.memory_budget)?;
        extractor.gpu().wait()?;
        let start = Instant::now();
        // A mesh that needs thinner slabs than one workspace has: only `extract` finds them.
        if let Ok(extraction) = extractor.extract_in(&space, &source, options, &|_| {}) {
            cached.add(start, extraction.report);
        }
    }
    Ok(json!({
        "adapter": extractor.gpu().info.name,
        "fresh": fresh.value(),
        "cached": if cached.totals.is_empty() { Value::Null } else { cached.value() },
        "triangles": fresh.report.triangles,
    }))
}

#[derive(Default)]
struct Times {
    totals: Vec<f64>,
    stages: [Vec<f64>; STAGES.len()],
    report: Report,
}

impl Times {
    fn add(&mut self, start: Instant, report: Report) {
        self.totals.push(start.elapsed().as_secs_f64());
        for (list, seconds) in self.stages.iter_mut().zip(report.seconds) {
            list.extend(seconds);
        }
        self.report = report;
    }

    fn value(&self) -> Value {
        let mut stages = Map::new();
        for (name, list) in STAGES.iter().zip(&self.stages).filter(|(_, list)| !list.is_empty()) {
            stages.insert((*name).into(), least(list).into());
        }
        json!({ "best": least(&self.totals), "median": median(&self.totals), "stages": stages })
    }
}

fn least(seconds: &[f64]) -> f64 {
    seconds.iter().copied().fold(f64::INFINITY, f64::min)
}

fn median(seconds: &[f64]) -> f64 {
    let mut sorted = seconds.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
