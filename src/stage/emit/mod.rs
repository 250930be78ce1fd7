//! emit: vertices and triangles. Shader: `shaders/emit.wgsl`.
//!
//! Theory: Lorensen & Cline 1987, with one vertex a crossed grid edge. Practice: a brick's vertices
//! follow its edge masks, in the order brick, plane, row, axis, place; a cell finds the number of
//! the vertex on an edge from the owner's brick: first vertex + prefix of the plane + prefix of the
//! row + population count. Order is a function of the input alone, and no vertex is made twice.

pub mod cpu;

use super::shaders::{self, Samples};
use crate::field::Wgsl;
use crate::field::differences::Normals;
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Gpu, GpuError};
use std::sync::OnceLock;

/// The kernels of the stage.
#[derive(Debug)]
pub struct Emit {
    /// The field's text; none of a volume.
    field: Option<Wgsl>,
    /// One for each kind of normals, compiled when it is first asked for.
    vertices: [OnceLock<Kernel>; 3],
    indices: Kernel,
    totals: Kernel,
}

impl Emit {
    /// Compiles the kernels for a source of samples, but that of vertices.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, samples: Samples<'_>) -> Result<Self, GpuError> {
        // What makes normals is no part of these.
        let source = shaders::emit(samples, Normals::Exact, gpu.form());
        let field = match samples {
            Samples::Volume => None,
            // The texts ask whether there is data, which may be large.
            Samples::Field(wgsl) => {
                Some(Wgsl { data: wgsl.data.iter().take(1).copied().collect(), ..wgsl.clone() })
            }
        };
        Ok(Self {
            field,
            vertices: Default::default(),
            indices: Kernel::new(gpu, &source, "emit_indices", &[])?,
            totals: Kernel::new(gpu, &source, "totals", &[])?,
        })
    }

    /// The kernel of vertices with such normals, compiled on the first call.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn vertices(&self, gpu: &Gpu, normals: Normals) -> Result<&Kernel, GpuError> {
        let has_own = self.field.as_ref().is_none_or(|wgsl| wgsl.gradient.is_some());
        let kind = match normals {
            _ if self.field.is_none() => 0,
            Normals::Exact if has_own => 0,
            Normals::Exact | Normals::Central { .. } => 1,
            Normals::Forward { .. } => 2,
        };
        if let Some(kernel) = self.vertices[kind].get() {
            return Ok(kernel);
        }
        let samples = self.field.as_ref().map_or(Samples::Volume, Samples::Field);
        let kernel = Kernel::new(gpu, &shaders::emit(samples, normals, gpu.form()), "emit_vertices", &[])?;
        Ok(self.vertices[kind].get_or_init(|| kernel))
    }

    /// Writes the slab's totals and the mesh header.
    pub fn encode_totals(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, bindings: &Bindings<'_>) {
        self.totals.dispatch(gpu, pass, bindings, 1);
    }

    /// Emits one workgroup a brick, as many as lie at `offset` of `dispatches`; `vertices` is one of
    /// [`Emit::vertices`].
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        vertices: &Kernel,
        (dispatches, offset): (&wgpu::Buffer, u64),
    ) {
        vertices.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
        self.indices.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
    }
}
