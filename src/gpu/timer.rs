//! How long each stage ran on the GPU, by timestamps at the borders of its passes.

use super::{Gpu, GpuError};

/// Passes that one timer can time.
const PASSES: u32 = 1024;

/// Collects the time of passes by a stage number, where the device has timestamps.
#[derive(Debug)]
pub struct Timer {
    set: Option<wgpu::QuerySet>,
    stages: Vec<usize>,
    /// Stages with passes beyond [`PASSES`], whose sum would be too small.
    untimed: Vec<usize>,
}

impl Timer {
    /// A timer; it times nothing on a device without timestamps.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let has = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let descriptor = wgpu::QuerySetDescriptor {
            label: Some("stage times"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * PASSES,
        };
        let set = has.then(|| gpu.guarded("timestamps", 0, || gpu.device.create_query_set(&descriptor)));
        Ok(Self { set: set.transpose()?, stages: Vec::new(), untimed: Vec::new() })
    }

    /// A timer that times nothing.
    pub fn off() -> Self {
        Self { set: None, stages: Vec::new(), untimed: Vec::new() }
    }

    /// Begins a pass whose time counts for `stage`.
    pub fn pass<'e>(
        &mut self,
        encoder: &'e mut wgpu::CommandEncoder,
        label: &str,
        stage: usize,
    ) -> wgpu::ComputePass<'e> {
        let first = 2 * self.stages.len() as u32;
        let timed = self.set.as_ref().filter(|_| first < 2 * PASSES);
        let timestamp_writes = timed.map(|query_set| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        });
        if timed.is_some() {
            self.stages.push(stage);
        } else if self.set.is_some() {
            self.untimed.push(stage);
        }
        encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes })
    }

    /// Adds the seconds of every timed pass to its stage's entry, and starts anew; does nothing
    /// without timestamps. A stage with more passes than can be timed has no entry. Waits for the passes.
    ///
    /// # Errors
    /// As [`Gpu::read`].
    pub fn collect(&mut self, gpu: &Gpu, seconds: &mut [Option<f64>]) -> Result<(), GpuError> {
        let Some(set) = self.set.as_ref().filter(|_| !self.stages.is_empty()) else { return Ok(()) };
        let count = 2 * self.stages.len() as u32;
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let buffer = gpu.buffer("stage times", u64::from(count) * 8, usage)?;
        gpu.guarded("timestamps", 0, || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.resolve_query_set(set, 0..count, &buffer, 0);
            gpu.queue.submit([encoder.finish()]);
        })?;
        let ticks: Vec<u64> = gpu.read(&buffer, count.into())?;
        let period = f64::from(gpu.queue.get_timestamp_period()) * 1e-9;
        for (pair, &stage) in ticks.chunks_exact(2).zip(&self.stages) {
            *seconds[stage].get_or_insert(0.0) += pair[1].saturating_sub(pair[0]) as f64 * period;
        }
        self.stages.clear();
        self.untimed.iter().for_each(|&stage| seconds[stage] = None);
        Ok(())
    }
}
