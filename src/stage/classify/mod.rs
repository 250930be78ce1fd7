//! classify: which edges the surface crosses, and how much each brick will emit. Shader:
//! `shaders/classify.wgsl`.
//!
//! Theory: Lorensen & Cline 1987; the corners' inside bits choose a case of the table. Practice: each
//! point owns its +x, +y and +z edge, so every crossed edge has one owner and becomes one vertex. A
//! brick's crossed edges are kept as bit masks with prefix sums beside them, so that the number of
//! any vertex follows from one population count: 416 bytes a brick, 0.81 a cell. How it differs
//! from the usual: no case bytes are stored (they follow from the masks and a sample a row), and no edge table.

pub mod cpu;
pub mod tetrahedra;

use super::shaders::{self, Samples};
use crate::field::Wgsl;
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Gpu, GpuError};
use crate::stage::method::Method;

/// What classify leaves of a brick; `shaders/shared/record.wgsl` describes the words.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[allow(missing_docs, reason = "each field is described in the shader")]
pub struct BrickRecord {
    pub rows: [u32; 64],
    pub planes: [u32; 8],
    pub triangles: [u32; 32],
}

impl BrickRecord {
    /// How many vertices lie on the brick's edges; its centres are behind them.
    #[inline(always)]
    pub fn edge_vertices(&self) -> u32 {
        (self.planes[7] & 0xffff) + (self.rows[63] >> 24) + (self.rows[63] & 0xff_ffff).count_ones()
    }

    /// How many vertices lie within the cells of row `y + 8 z`.
    #[inline(always)]
    pub fn centres(&self, row: usize) -> u32 {
        self.triangles[row / 2] >> (16 * (row % 2) + 11) & 31
    }
}

/// The kernel of the stage.
#[derive(Debug)]
pub struct Classify(Kernel);

impl Classify {
    /// Compiles the kernel for a source of samples.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, samples: Samples<'_>, method: Method) -> Result<Self, GpuError> {
        Ok(Self(Kernel::new(gpu, &shaders::classify(samples, method, gpu.form()), "classify", &[])?))
    }

    /// Compiles the kernel that takes the samples of a field itself, and leaves those of bricks that make anything where the sample stage would;
    /// `by_planes`, for grids along the world's axes, by the field's parts.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn sampling(gpu: &Gpu, wgsl: &Wgsl, by_planes: bool) -> Result<Self, GpuError> {
        let source = shaders::classify_sampling(wgsl, gpu.form(), by_planes);
        Ok(Self(Kernel::new(gpu, &source, "classify", &[])?))
    }

    /// Classifies one workgroup a brick, as many as lie at `offset` of `dispatches`.
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
