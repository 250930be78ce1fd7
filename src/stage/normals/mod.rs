//! normals: of vertices whose gradient has no direction. Shader: `shaders/normals.wgsl`.
//!
//! emit leaves a mark in the normal of a vertex whose gradient is zero or not finite: tips of cones, lines where
//! a surface meets itself. Once all slabs are emitted (neighbours may be of later ones) such a vertex gets the average
//! of its neighbours' normals: of the other corners of its triangles, each as often as it has a triangle in common,
//! those left out that are marked, too. Where they cancel or there are none, the normal runs along the vertex's
//! edge, out of the solid. Without a marked vertex nothing runs.

pub mod cpu;

use super::shaders;
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Gpu, GpuError};

/// Items a workgroup: `LANES` and `ITEMS` of the shader.
const GROUP: u32 = 64 * 32;

/// The kernels of the stage.
#[derive(Debug)]
pub struct Normals {
    arrange: Kernel,
    add_neighbours: Kernel,
    average: Kernel,
}

impl Normals {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let source = shaders::normals();
        Ok(Self {
            arrange: Kernel::new(gpu, &source, "arrange", &[])?,
            add_neighbours: Kernel::new(gpu, &source, "add_neighbours", &[])?,
            average: Kernel::new(gpu, &source, "average", &[])?,
        })
    }

    /// The whole stage on a mesh in one window, if its vertices were marked, which the GPU finds out.
    /// `dispatches` are the arguments, `offset` where those of the stage begin.
    pub fn encode_if_marked(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        (dispatches, offset): (&wgpu::Buffer, u64),
    ) {
        self.arrange.dispatch(gpu, pass, bindings, 1);
        self.add_neighbours.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
        self.average.dispatch_indirect(gpu, pass, bindings, dispatches, offset + 12);
    }

    /// Adds to the marked vertices of a window what the bound `triangles` have beside them.
    pub fn encode_add_neighbours(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        triangles: u32,
    ) {
        self.add_neighbours.dispatch(gpu, pass, bindings, triangles.div_ceil(GROUP));
    }

    /// Turns what is marked in a window of so many `vertices` into normals.
    pub fn encode_average(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        vertices: u32,
    ) {
        self.average.dispatch(gpu, pass, bindings, vertices.div_ceil(GROUP));
    }
}
