//! cull: keeps the bricks that can hold surface. Shader: `shaders/cull.wgsl`.
//!
//! Theory: the surface passes through few bricks, and a brick whose lowest and highest sample lie on
//! one side of iso is not among them. Practice: a volume's table of ranges is built once, so that
//! another iso value costs one look at each brick's pair of numbers; a field's table is made of
//! its intervals, from large boxes to small; fields without intervals keep all bricks. Output: the list of active bricks in brick order, the brick map that is its inverse, and
//! the arguments of the dispatches that follow. Culling is conservative: it never changes the mesh.

pub mod bounds;
pub mod cpu;

use super::shaders::{self, Samples};
use crate::field::Wgsl;
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Gpu, GpuError};

/// The kernels of the stage.
#[derive(Debug)]
pub struct Cull {
    cull: Kernel,
    keep_all: Kernel,
    compact: Kernel,
}

/// The kernel that builds the table of ranges.
#[derive(Debug)]
pub struct Range(Kernel);

/// The kernel that makes the table of ranges of a field that has intervals.
#[derive(Debug)]
pub struct Bounds(Kernel);

impl Bounds {
    /// Compiles the kernel, if the field has intervals.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, wgsl: &Wgsl) -> Result<Option<Self>, GpuError> {
        let source = shaders::bounds(wgsl);
        source.map(|source| Ok(Self(Kernel::new(gpu, &source, "bounds", &[])?))).transpose()
    }

    /// Makes the ranges of a box of so many bricks.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        extent: glam::UVec3,
    ) {
        self.0.dispatch(gpu, pass, bindings, extent.map(|n| n.div_ceil(4)).element_product());
    }
}

const THREADS: u32 = 64;

impl Range {
    /// Compiles the kernel for a source of samples.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, samples: Samples<'_>) -> Result<Self, GpuError> {
        Ok(Self(Kernel::new(gpu, &shaders::cull(samples), "range", &[])?))
    }

    /// Builds the ranges of `bricks` bricks from the first slot on.
    pub fn encode(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, bindings: &Bindings<'_>, bricks: u32) {
        self.0.dispatch(gpu, pass, bindings, bricks.div_ceil(THREADS));
    }
}

impl Cull {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let source = shaders::cull(Samples::Volume);
        Ok(Self {
            cull: Kernel::new(gpu, &source, "cull", &[])?,
            keep_all: Kernel::new(gpu, &source, "keep_all", &[])?,
            compact: Kernel::new(gpu, &source, "compact", &[])?,
        })
    }

    /// Marks the bricks to keep: by their ranges, or all.
    pub fn encode_mark(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        bricks: u32,
        has_ranges: bool,
    ) {
        let kernel = if has_ranges { &self.cull } else { &self.keep_all };
        kernel.dispatch(gpu, pass, bindings, bricks.div_ceil(THREADS));
    }

    /// Lists the bricks whose scanned marks say that they are kept.
    pub fn encode_compact(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        bricks: u32,
    ) {
        self.compact.dispatch(gpu, pass, bindings, bricks.div_ceil(THREADS));
    }
}
