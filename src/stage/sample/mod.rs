//! sample: a field's values at the 9³ points of each active brick. Shader: `shaders/sample.wgsl`.
//!
//! The grid is never stored whole: samples live only for a batch of bricks, between this stage and
//! the next that reads them. Volumes need no such stage: their samples are read where they lie.

pub mod cpu;
pub mod row;

use super::shaders;
use crate::field::Wgsl;
use crate::gpu::kernel::{Bindings, Kernel, Latest};
use crate::gpu::{Gpu, GpuError};
use std::sync::Arc;

/// Bytes of the samples of a brick.
pub const BRICK_BYTES: u64 = 4 * crate::grid::SAMPLES_PER_BRICK as u64;

/// The kernels of the stage for one field, each compiled when a grid asks for it.
#[derive(Debug)]
pub struct Samplers {
    wgsl: Wgsl,
    /// For grids along the world's axes, and for others.
    kernels: Latest<bool, Sample>,
}

impl Samplers {
    /// Compiles nothing.
    pub fn new(wgsl: &Wgsl) -> Self {
        // The texts ask whether there is data, which may be large.
        let data = wgsl.data.iter().take(1).copied().collect();
        Self { wgsl: Wgsl { data, ..wgsl.clone() }, kernels: Latest::default() }
    }

    /// The kernel for a grid; `is_aligned` says whether its axes are the world's.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn get(&self, gpu: &Gpu, is_aligned: bool) -> Result<Arc<Sample>, GpuError> {
        self.kernels.get(is_aligned, || match is_aligned {
            true => Sample::by_planes(gpu, &self.wgsl),
            false => Sample::new(gpu, &self.wgsl),
        })
    }
}

/// The kernel of the stage, for one field.
#[derive(Debug)]
pub struct Sample(Kernel);

impl Sample {
    /// Compiles the kernel.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, wgsl: &Wgsl) -> Result<Self, GpuError> {
        Ok(Self(Kernel::new(gpu, &shaders::sample(wgsl), "sample", &[])?))
    }

    /// Compiles the kernel for grids along the world's axes, that of [`Sample::new`] for fields without parts for it.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn by_planes(gpu: &Gpu, wgsl: &Wgsl) -> Result<Self, GpuError> {
        match shaders::sample_planes(wgsl, gpu.form()) {
            Some(source) => Ok(Self(Kernel::new(gpu, &source, "sample", &[])?)),
            None => Self::new(gpu, wgsl),
        }
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
