//! What the machine is, and how fast its adapter copies.

use super::Limits;
use crate::gpu::{Gpu, GpuError};
use std::time::Instant;

/// The machine of a benchmark.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Machine {
    /// Version of the crate.
    pub isoforge: &'static str,
    /// Cores that the process may use.
    pub cores: usize,
    /// Threads of the CPU backend.
    pub threads: usize,
    /// Operating system and processor family.
    pub system: String,
    /// The adapter, if one was used.
    pub adapter: Option<Adapter>,
}

/// The adapter of a benchmark.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Adapter {
    /// Its name.
    pub name: String,
    /// Vulkan, Metal, …
    pub backend: String,
    /// Discrete, integrated, software, …
    pub kind: String,
    /// The driver and its version.
    pub driver: String,
    /// The largest buffer that a shader may see.
    pub max_binding_bytes: u64,
    /// Whether stages are timed by the adapter itself.
    pub timestamps: bool,
    /// How workgroups share their work.
    pub form: String,
    /// What kernels can do, where it was asked for.
    pub limits: Option<Limits>,
    /// Bytes copied per second from a large buffer to another (each byte is read and written once);
    /// none if the copy failed.
    pub copied_bytes_per_second: Option<f64>,
}

impl Machine {
    pub(super) fn of(gpu: Option<&Gpu>, with_limits: bool) -> Self {
        Self {
            isoforge: env!("CARGO_PKG_VERSION"),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            threads: rayon::current_num_threads(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            adapter: gpu.map(|gpu| Adapter::of(gpu, with_limits)),
        }
    }
}

impl Adapter {
    fn of(gpu: &Gpu, with_limits: bool) -> Self {
        let (info, limits) = (&gpu.info, gpu.device.limits());
        Self {
            name: info.name.clone(),
            backend: info.backend.to_string(),
            kind: format!("{:?}", info.device_type),
            driver: format!("{} {}", info.driver, info.driver_info).trim().into(),
            max_binding_bytes: limits.max_storage_buffer_binding_size,
            timestamps: gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY),
            form: format!("bricks {}, scans {}", gpu.form(), gpu.scan_form()),
            limits: with_limits.then(|| Limits::measure(gpu).ok()).flatten(),
            copied_bytes_per_second: copy_bandwidth(gpu).ok(),
        }
    }
}

/// Bytes of the buffers that are copied: more than any cache holds.
const COPY_BYTES: u64 = 512 << 20;
/// Seconds that the copies take at least, all together.
const COPY_SECONDS: f64 = 0.3;

/// Bytes copied per second from buffer to buffer: the best of several submissions, each of ever more
/// copies, so that the submission itself costs nothing beside them.
///
/// # Errors
/// As [`Gpu::buffer`] and [`Gpu::wait`].
pub fn copy_bandwidth(gpu: &Gpu) -> Result<f64, GpuError> {
    use wgpu::BufferUsages as U;
    let mut bytes = COPY_BYTES.min(gpu.device.limits().max_buffer_size) & !0xff;
    if gpu.is_software() {
        bytes = bytes.min(COPY_BYTES / 4);
    }
    let make = |bytes| -> Result<_, GpuError> {
        let from = gpu.buffer("copied from", bytes, U::COPY_SRC | U::COPY_DST)?;
        Ok((from, gpu.buffer("copied to", bytes, U::COPY_DST)?))
    };
    let (from, to) = loop {
        match make(bytes) {
            Err(GpuError::OutOfMemory { .. }) if bytes > 1 << 20 => bytes /= 2,
            made => break made?,
        }
    };
    let (mut best, mut copies) = (0.0f64, 1u32);
    let begin = Instant::now();
    loop {
        let start = Instant::now();
        gpu.guarded("copies", bytes, || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            for _ in 0..copies {
                encoder.copy_buffer_to_buffer(&from, 0, &to, 0, bytes);
            }
            gpu.queue.submit([encoder.finish()]);
        })?;
        gpu.wait()?;
        let seconds = start.elapsed().as_secs_f64();
        best = best.max(bytes as f64 * f64::from(copies) / seconds);
        if begin.elapsed().as_secs_f64() > COPY_SECONDS {
            return Ok(best);
        }
        copies = (copies * 2).min(64);
    }
}
