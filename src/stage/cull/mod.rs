//! cull: keeps the bricks that can hold surface. Shader: `shaders/cull.wgsl`.
//!
//! Theory: the surface passes through few bricks, and a brick whose lowest and highest sample lie on
//! one side of iso is not among them. Practice: a volume's table of ranges is built once, so that
//! another iso value costs one look at each brick's pair of numbers; a field's bricks are found by
//! its intervals, from large boxes to small, so that empty space costs nothing (`shaders/bounds.wgsl`); fields without
//! intervals keep all bricks. Output: the brick map ([`map::BrickMap`]); the scan of its bits makes the list of active bricks, in brick
//! order; and the arguments of the dispatches that follow. Culling is conservative: it never changes the mesh.

pub mod bounds;
pub mod cpu;
pub mod map;

use super::shaders::{self, Samples};
use crate::field::Wgsl;
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Gpu, GpuError};
use crate::volume::Scalar;

/// The kernels of the stage.
#[derive(Debug)]
pub struct Cull {
    cull: Kernel,
    keep_all: Kernel,
    arrange: Kernel,
}

/// The kernel that builds the table of ranges.
#[derive(Debug)]
pub struct Range(Kernel);

/// The kernels that find the bricks of a field that has intervals.
#[derive(Debug)]
pub struct Bounds {
    /// To boxes of 16 bricks an axis, of 4, to bricks.
    narrow: [Kernel; 3],
    /// The dispatches of the second and the third.
    dispatch: [Kernel; 2],
}

/// Bricks along the edges of the parts that boxes are cut into, level by level.
pub const SIDES: [u32; 3] = [16, 4, 1];

impl Bounds {
    /// Compiles the kernel, if the field has intervals.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, wgsl: &Wgsl) -> Result<Option<Self>, GpuError> {
        let Some(source) = shaders::bounds(wgsl) else { return Ok(None) };
        let kernel = |entry, side| Kernel::new(gpu, &source, entry, &[("side", f64::from(side))]);
        let [large, small, brick] = SIDES;
        Ok(Some(Self {
            narrow: [kernel("narrow", large)?, kernel("narrow", small)?, kernel("narrow", brick)?],
            dispatch: [kernel("dispatch_boxes", large)?, kernel("dispatch_boxes", small)?],
        }))
    }

    /// Words of the lists of boxes for slabs that have at most `extent` bricks along the axes.
    pub fn list_words(extent: glam::UVec3) -> u64 {
        let boxes = |side| extent.to_array().map(|n| u64::from(n.div_ceil(side))).iter().product::<u64>();
        boxes(SIDES[0]) + boxes(SIDES[1])
    }

    /// Sets the bits of the bricks that may hold surface, of a slab of so many, in a map without bits. The arguments
    /// of two dispatches lie at `offset` of `dispatches`.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        extent: glam::UVec3,
        (dispatches, offset): (&wgpu::Buffer, u64),
    ) {
        let first = extent.map(|n| n.div_ceil(4 * SIDES[0])).element_product();
        self.narrow[0].dispatch(gpu, pass, bindings, first);
        for level in 0..2 {
            self.dispatch[level].dispatch(gpu, pass, bindings, 1);
            self.narrow[level + 1].dispatch_indirect(gpu, pass, bindings, dispatches, offset);
        }
    }
}

const THREADS: u32 = 64;

impl Range {
    /// Compiles the kernel for a source of samples.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
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
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        // These kernels read no samples.
        let source = shaders::cull(Samples::Volume(Scalar::F32));
        Ok(Self {
            cull: Kernel::new(gpu, &source, "cull", &[])?,
            keep_all: Kernel::new(gpu, &source, "keep_all", &[])?,
            arrange: Kernel::new(gpu, &source, "arrange", &[])?,
        })
    }

    /// Sets the bits of the bricks to keep: by their ranges, or all.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        bricks: u32,
        has_ranges: bool,
    ) {
        let kernel = if has_ranges { &self.cull } else { &self.keep_all };
        kernel.dispatch(gpu, pass, bindings, bricks.div_ceil(32 * THREADS));
    }

    /// Once the bits are scanned: the numbers of active bricks, and the arguments of the dispatches over them.
    pub fn encode_arrange(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, bindings: &Bindings<'_>) {
        self.arrange.dispatch(gpu, pass, bindings, 1);
    }
}
