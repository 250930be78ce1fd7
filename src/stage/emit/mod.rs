//! emit: vertices and triangles. Shader: `shaders/emit.wgsl`.
//!
//! Theory: Lorensen & Cline 1987, with one vertex a crossed grid edge. Practice: a brick's vertices
//! follow its edge masks, in the order brick, plane, row, axis, place; a cell finds the number of
//! the vertex on an edge from the owner's brick: first vertex + prefix of the plane + prefix of the
//! row + population count. Order is a function of the input alone, and no vertex is made twice.

pub mod cpu;

use super::shaders::{self, Samples};
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Gpu, GpuError};

/// The kernels of the stage.
#[derive(Debug)]
pub struct Emit {
    vertices: Kernel,
    indices: Kernel,
    totals: Kernel,
}

impl Emit {
    /// Compiles the kernels for a source of samples.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, samples: Samples<'_>) -> Result<Self, GpuError> {
        let source = shaders::emit(samples);
        Ok(Self {
            vertices: Kernel::new(gpu, &source, "emit_vertices", &[])?,
            indices: Kernel::new(gpu, &source, "emit_indices", &[])?,
            totals: Kernel::new(gpu, &source, "totals", &[])?,
        })
    }

    /// Writes the slab's totals and the mesh header.
    pub fn encode_totals(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, bindings: &Bindings<'_>) {
        self.totals.dispatch(gpu, pass, bindings, 1);
    }

    /// Emits one workgroup a brick, as many as lie at `offset` of `dispatches`.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        dispatches: &wgpu::Buffer,
        offset: u64,
    ) {
        self.vertices.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
        self.indices.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
    }
}
