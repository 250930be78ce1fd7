//! emit: vertices and triangles. Shader: `shaders/emit.wgsl`.
//!
//! Theory: Lorensen & Cline 1987, with one vertex a crossed grid edge. Practice: a brick's vertices
//! follow its edge masks, in the order brick, plane, row, axis, place; a cell finds the number of
//! the vertex on an edge from the owner's brick: first vertex + prefix of the plane + prefix of the
//! row + population count. Order is a function of the input alone, and no vertex is made twice.

pub mod cpu;

use super::shaders::{self, Samples};
use crate::field::differences::Normals;
use crate::gpu::kernel::{Bindings, Kernel, made};
use crate::gpu::{Gpu, GpuError};
use crate::stage::method::{Method, Placement};
use std::sync::OnceLock;

/// The kernels of the stage.
#[derive(Debug)]
pub struct Emit {
    method: Method,
    /// One for each kind of normals and placement, compiled when it is first asked for.
    vertices: [OnceLock<Vertices>; 9],
    indices: Kernel,
    totals: Kernel,
}

/// The kernels of vertices with normals of one kind.
#[derive(Debug)]
pub struct Vertices {
    on_edges: Kernel,
    /// Of those within cells, where the method has them.
    centres: Option<Kernel>,
}

impl Emit {
    /// Compiles the kernels for a source of samples, but that of vertices.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, samples: Samples<'_>, method: Method) -> Result<Self, GpuError> {
        // What places vertices and makes normals is no part of these.
        let source = shaders::emit(samples, method, Placement::Linear, Normals::Exact, gpu.form());
        Ok(Self {
            method,
            vertices: Default::default(),
            indices: Kernel::new(gpu, &source, "emit_indices", &[])?,
            totals: Kernel::new(gpu, &source, "totals", &[])?,
        })
    }

    /// The kernels of vertices so placed and with such normals, for the source of samples that the others were compiled for; compiled on
    /// the first call.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn vertices(
        &self,
        gpu: &Gpu,
        samples: Samples<'_>,
        placement: Placement,
        normals: Normals,
    ) -> Result<&Vertices, GpuError> {
        let kind = match (samples, normals) {
            (Samples::Volume(_), _) => 0,
            (Samples::Field(wgsl), Normals::Exact) if wgsl.gradient.is_some() => 0,
            (Samples::Field(_), Normals::Exact | Normals::Central { .. }) => 1,
            (Samples::Field(_), Normals::Forward { .. }) => 2,
        };
        made(&self.vertices[kind + 3 * placement.kind()], || {
            let source = shaders::emit(samples, self.method, placement, normals, gpu.form());
            let centres = match self.method {
                Method::MarchingCubes | Method::Tetrahedra => None,
                Method::Mc33 => Some(Kernel::new(gpu, &source, "emit_centres", &[])?),
            };
            Ok(Vertices { on_edges: Kernel::new(gpu, &source, "emit_vertices", &[])?, centres })
        })
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
        vertices: &Vertices,
        (dispatches, offset): (&wgpu::Buffer, u64),
    ) {
        vertices.on_edges.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
        if let Some(centres) = &vertices.centres {
            centres.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
        }
        self.indices.dispatch_indirect(gpu, pass, bindings, dispatches, offset);
    }
}
