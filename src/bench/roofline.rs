//! How far each stage is from what the adapter can do (Williams, Waterman & Patterson 2009).
//!
//! A stage's bytes are the fewest that it must move through the adapter's memory, worked out from the counts of the run:
//! each sample of an active brick read or written once, each record, offset, vertex and index once. What caches
//! save beyond that makes a share over 1; what is read twice makes it smaller. Limits are measured by
//! `shaders/bench/limits.wgsl`, on the same adapter in the same run.

use super::{Backend, Input, Row};
use crate::gpu::kernel::{Bindings, Kernel, binding as b};
use crate::gpu::{Gpu, GpuError};
use crate::stage::classify::BrickRecord;
use crate::stage::sample::BRICK_BYTES;
use std::fmt;
use std::time::Instant;
use wgpu::BufferUsages as U;

/// What an adapter can do, measured.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Limits {
    /// Bytes read and written per second by a kernel that copies.
    pub bytes_per_second: f64,
    /// Multiplications and additions of f32 per second.
    pub operations_per_second: f64,
}

/// What one stage of one row reaches.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Roof {
    /// Name of the field or volume.
    pub case: String,
    /// Where its samples came from.
    pub input: Input,
    /// Cells along x, y, z.
    pub cells: [u32; 3],
    /// The stage.
    pub stage: &'static str,
    /// The fewest bytes that it must move.
    pub bytes: u64,
    /// Seconds on the GPU, in a frame.
    pub seconds: f64,
    /// Those bytes per second.
    pub bytes_per_second: f64,
    /// Of [`Limits::bytes_per_second`].
    pub share_of_bandwidth: f64,
    /// Samples taken of a field per second.
    pub evaluations_per_second: Option<f64>,
    /// Operations per second that an evaluation of one operation would leave: [`Limits::operations_per_second`] over
    /// that.
    pub operations_an_evaluation: Option<f64>,
}

impl fmt::Display for Roof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let input = format!("{:?}", self.input).to_lowercase();
        write!(
            f,
            "{:<12} {input:<9} {:>14} {:<9} {:>9.3} MB {:>9.4} ms {:>8.1} GB/s {:>5.1} %",
            self.case,
            self.cells.map(|n| n.to_string()).join("×"),
            self.stage,
            self.bytes as f64 * 1e-6,
            self.seconds * 1e3,
            self.bytes_per_second * 1e-9,
            self.share_of_bandwidth * 1e2,
        )?;
        if let (Some(rate), Some(room)) = (self.evaluations_per_second, self.operations_an_evaluation) {
            write!(f, " {:>8.2} Gsamples/s, time for {room:.0} operations each", rate * 1e-9)?;
        }
        writeln!(f)
    }
}

/// Bytes that are copied, and invocations that multiply.
const COPIED: u64 = 256 << 20;
const MULTIPLIERS: u32 = 1 << 20;
/// Multiplications and additions of an invocation: as many steps of 64 as the shader makes.
const OPERATIONS: f64 = 1024.0 * 64.0;

impl Limits {
    /// Measures them.
    ///
    /// # Errors
    /// As [`Gpu::buffer`] and [`Gpu::wait`].
    pub fn measure(gpu: &Gpu) -> Result<Self, GpuError> {
        let bytes = COPIED.min(gpu.device.limits().max_storage_buffer_binding_size / 2);
        let usage = U::STORAGE | U::COPY_DST;
        let (from, to) = (gpu.buffer("copied from", bytes, usage)?, gpu.buffer("copied to", bytes, usage)?);
        let mut bindings = Bindings::default();
        bindings.set(b::SOURCE, &from).set(b::SAMPLES, &to);
        let source = include_str!("../../shaders/bench/limits.wgsl");
        let copy = Kernel::new(gpu, source, "copy", &[])?;
        let multiply = Kernel::new(gpu, source, "multiply", &[])?;
        // One group an invocation of which moves 16 bytes, 16 times.
        let copies = (bytes / 16 / 256 / 16).max(1) as u32;
        let software = gpu.is_software();
        let multipliers = if software { MULTIPLIERS / 256 } else { MULTIPLIERS };
        Ok(Self {
            bytes_per_second: 2.0 * bytes as f64 * rate(gpu, &copy, &bindings, copies)?,
            operations_per_second: f64::from(multipliers)
                * OPERATIONS
                * rate(gpu, &multiply, &bindings, multipliers / 256)?,
        })
    }
}

/// Runs of a kernel per second: of several submissions, each of ever more, the fastest.
fn rate(gpu: &Gpu, kernel: &Kernel, bindings: &Bindings<'_>, groups: u32) -> Result<f64, GpuError> {
    let (mut best, mut runs) = (0.0f64, 1u32);
    let begin = Instant::now();
    loop {
        let start = Instant::now();
        gpu.guarded("limits", 0, || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            (0..runs).for_each(|_| kernel.dispatch(gpu, &mut pass, bindings, groups));
            drop(pass);
            gpu.queue.submit([encoder.finish()]);
        })?;
        gpu.wait()?;
        best = best.max(f64::from(runs) / start.elapsed().as_secs_f64());
        if begin.elapsed().as_secs_f64() > 0.3 {
            return Ok(best);
        }
        runs = (runs * 2).min(64);
    }
}

/// What the stages of the GPU's frames reach.
pub(super) fn roofs(limits: &Limits, rows: &[Row]) -> Vec<Roof> {
    let rows = rows.iter().filter(|row| row.backend == Backend::Gpu);
    rows.flat_map(|row| row.frame.iter().flat_map(|frame| &frame.stages).map(move |of| (row, of)))
        .map(|(row, (&stage, &seconds))| {
            let bytes = bytes_of(row, stage);
            let samples = (row.active_bricks * BRICK_BYTES / 4) as f64;
            let takes = match (row.input, stage) {
                (Input::Analytic, "sample") => true,
                // Where there is no sample stage, classify takes them.
                (Input::Analytic, "classify") => {
                    row.frame.as_ref().is_some_and(|frame| !frame.stages.contains_key("sample"))
                }
                _ => false,
            };
            let rate = takes.then_some(samples / seconds);
            Roof {
                case: row.case.clone(),
                input: row.input,
                cells: row.cells,
                stage,
                bytes,
                seconds,
                bytes_per_second: bytes as f64 / seconds,
                share_of_bandwidth: bytes as f64 / seconds / limits.bytes_per_second,
                evaluations_per_second: rate,
                operations_an_evaluation: rate.map(|rate| limits.operations_per_second / rate),
            }
        })
        .collect()
}

/// The fewest bytes that a stage must move.
fn bytes_of(row: &Row, stage: &str) -> u64 {
    let record = size_of::<BrickRecord>() as u64;
    let sample = row.sample_bytes;
    // Bricks share their outermost samples: 8³ each are their own.
    let samples = match row.input {
        Input::Volume => 512 * sample,
        Input::Analytic => BRICK_BYTES,
    };
    let map = row.bricks / 4;
    match stage {
        "cull" => {
            let ranges = if row.input == Input::Volume { 8 * row.bricks } else { 0 };
            ranges + 3 * map + 4 * row.active_bricks
        }
        "sample" => row.active_bricks * samples,
        "classify" => row.active_bricks * (samples + record + 8),
        "scan" => row.active_bricks * 24,
        // The samples at both ends of each vertex's edge.
        "emit" => row.active_bricks * (record + 8) + (2 * sample + 24) * row.vertices + 12 * row.triangles,
        _ => 0,
    }
}
