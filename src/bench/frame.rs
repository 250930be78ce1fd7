//! Frames: extractions recorded by [`Extractor::encode`] as a renderer does it, with buffers and mesh at hand and
//! nothing read back.

use super::Seconds;
use crate::extract::{ExtractError, Extractor, Options, Report, STAGES, Source, Workspace};
use crate::gpu::{GpuMesh, Timer};
use crate::volume::Volume;
use std::collections::BTreeMap;
use std::time::Instant;

/// Frames that are submitted before they are waited for.
const IN_FLIGHT: u32 = 8;
/// Rounds of them.
const ROUNDS: usize = 7;

/// What frames of one input took.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Frame {
    /// From the recording of a frame to that of the next, several in flight: what the CPU and the GPU take, whichever is
    /// more.
    pub seconds: Seconds,
    /// The GPU's time, the sum of the stages' medians; none where the adapter does not tell.
    pub gpu: Option<f64>,
    /// Medians of each stage's seconds on the GPU, by its name.
    pub stages: BTreeMap<&'static str, f64>,
}

/// What a sweep of iso values over a volume that lies on the GPU took.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Sweep {
    /// Iso values, evenly between the lowest and the highest sample.
    pub values: u32,
    /// The mesh of each, by how long its frame took.
    pub seconds: Seconds,
    /// The longest frame.
    pub longest: f64,
    /// All frames.
    pub total: f64,
    /// Triangles of all meshes.
    pub triangles: u64,
}

/// Measures frames of what `report` tells the size of.
pub(super) fn frames(
    extractor: &Extractor,
    source: &Source<'_>,
    options: &Options,
    report: &Report,
) -> Result<Frame, ExtractError> {
    let gpu = extractor.gpu();
    let space = extractor.prepare_for(source, options.memory_budget, report.active_bricks as u32)?;
    let mesh = GpuMesh::with_capacity(gpu, report.vertices as u32, report.triangles as u32)?;
    let mut rounds = Vec::new();
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for _ in 0..IN_FLIGHT {
            frame(extractor, &space, options, &mesh, &mut Timer::off())?;
        }
        gpu.wait()?;
        rounds.push(start.elapsed().as_secs_f64() / f64::from(IN_FLIGHT));
    }
    // After the others: a GPU that was idle while its buffers were made runs slowly at first.
    let mut timer = Timer::new(gpu)?;
    let mut stages = vec![Vec::new(); STAGES.len()];
    for _ in 0..ROUNDS {
        let mut seconds = [None; STAGES.len()];
        frame(extractor, &space, options, &mesh, &mut timer)?;
        timer.collect(gpu, &mut seconds)?;
        stages.iter_mut().zip(seconds).for_each(|(all, one)| all.extend(one));
    }
    let stages: BTreeMap<_, _> = STAGES
        .into_iter()
        .zip(&stages)
        .filter_map(|(stage, seconds)| Some((stage, Seconds::of(seconds)?.median)))
        .collect();
    let gpu = (!stages.is_empty()).then(|| stages.values().sum());
    Ok(Frame { seconds: Seconds::of(&rounds).unwrap_or_default(), gpu, stages })
}

fn frame(
    extractor: &Extractor,
    space: &Workspace,
    options: &Options,
    mesh: &GpuMesh,
    timer: &mut Timer,
) -> Result<(), ExtractError> {
    let mut encoder = extractor.gpu().device.create_command_encoder(&Default::default());
    extractor.encode_timed(space, &mut encoder, options, mesh, timer)?;
    extractor.gpu().queue.submit([encoder.finish()]);
    Ok(())
}

/// Meshes `values` iso values of a volume, each in a frame of its own that is waited for, in buffers that hold the largest.
pub(super) fn sweep(
    extractor: &Extractor,
    volume: &Volume,
    options: &Options,
    values: u32,
) -> Result<Option<Sweep>, ExtractError> {
    let Some((low, high)) = volume.finite_range() else { return Ok(None) };
    let (gpu, source) = (extractor.gpu(), Source::Volume(volume));
    let at = |i: u32| low + (high - low) * ((i + 1) as f32 / (values + 1) as f32);
    let (mut most, mut triangles) = ([1u64; 3], 0);
    for i in 0..values {
        let report = extractor.extract(&source, &Options { iso: at(i), ..*options })?.report;
        let sizes = [report.active_bricks, report.vertices, report.triangles];
        most = [0, 1, 2].map(|k| most[k].max(sizes[k]));
        triangles += report.triangles;
    }
    let space = extractor.prepare_for(&source, options.memory_budget, most[0] as u32)?;
    let mesh = GpuMesh::with_capacity(gpu, most[1] as u32, most[2] as u32)?;
    frame(extractor, &space, options, &mesh, &mut Timer::off())?;
    gpu.wait()?;
    let mut seconds = Vec::new();
    for i in 0..values {
        let start = Instant::now();
        frame(extractor, &space, &Options { iso: at(i), ..*options }, &mesh, &mut Timer::off())?;
        gpu.wait()?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    let longest = seconds.iter().copied().fold(0.0, f64::max);
    let total = seconds.iter().sum();
    Ok(Some(Sweep { values, seconds: Seconds::of(&seconds).unwrap_or_default(), longest, total, triangles }))
}
