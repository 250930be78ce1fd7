//! sample: a field's values at the 9³ points of each active brick. Shader: `shaders/sample.wgsl`.
//!
//! The grid is never stored whole: samples live only for a batch of bricks, between this stage and
//! the next that reads them. Volumes need no such stage: their samples are read where they lie.

pub mod cpu;
pub mod row;

use super::shaders;
use crate::field::Wgsl;
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Gpu, GpuError};

/// Bytes of the samples of a brick.
pub const BRICK_BYTES: u64 = 4 * crate::grid::SAMPLES_PER_BRICK as u64;

/// The kernel of the stage, for one field.
#[derive(Debug)]
pub struct Sample(Kernel);

impl Sample {
    /// Compiles the kernel.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, wgsl: &Wgsl) -> Result<Self, GpuError> {
        Ok(Self(Kernel::new(gpu, &shaders::sample(wgsl), "sample", &[])?))
    }

    /// Samples one workgroup a brick, as many as lie at `offset` of `dispatches`.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        dispatches: &wgpu::Buffer,
        offset: u64,
    ) {
        self.0.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
    }
}
