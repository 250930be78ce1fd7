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
use crate::volume::Scalar;
use std::sync::OnceLock;

/// What kernels of vertices are made of.
#[derive(Debug)]
enum Source {
    Volume(Scalar),
    /// The field's text.
    Field(Box<Wgsl>),
}

/// The kernels of the stage.
#[derive(Debug)]
pub struct Emit {
    source: Source,
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
        let kept = match samples {
            Samples::Volume(scalar) => Source::Volume(scalar),
            // The texts ask whether there is data, which may be large.
            Samples::Field(wgsl) => {
                let data = wgsl.data.iter().take(1).copied().collect();
                Source::Field(Box::new(Wgsl { data, ..wgsl.clone() }))
            }
        };
        Ok(Self {
            source: kept,
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
        let kind = match (&self.source, normals) {
            (Source::Volume(_), _) => 0,
            (Source::Field(wgsl), Normals::Exact) if wgsl.gradient.is_some() => 0,
            (Source::Field(_), Normals::Exact | Normals::Central { .. }) => 1,
            (Source::Field(_), Normals::Forward { .. }) => 2,
        };
        if let Some(kernel) = self.vertices[kind].get() {
            return Ok(kernel);
        }
        let samples = match &self.source {
            Source::Volume(scalar) => Samples::Volume(*scalar),
            Source::Field(wgsl) => Samples::Field(wgsl),
        };
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
