//! CPU twin of `shaders/emit.wgsl`.

mod centres;
mod ends;
mod indices;
mod snap;
mod tetrahedra;
mod vertices;

pub use centres::NormalsOf;
pub use ends::{count, ends};
pub use indices::{Beside, EdgeNumbers, Nearby};
pub use vertices::{FAR, Gradients, renumber_brick};

use crate::field::NoForm;
use crate::mesh::Vertex;
use crate::stage::classify::BrickRecord;
use crate::stage::inside::Inside;
use crate::stage::method::Method;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use glam::UVec3;

/// The triangles of the brick at `origin`, as vertex numbers of the whole mesh; `end` is the number behind its last vertex.
pub fn emit_indices(
    params: &Params,
    inside: Inside,
    (origin, samples): (UVec3, &Samples<'_>),
    beside: &Beside<'_>,
    numbers: &mut EdgeNumbers,
    end: u32,
    triangles: &mut [[u32; 3]],
) {
    match params.method {
        Method::MarchingCubes => indices::emit_indices(params, samples.extent, beside, numbers, triangles),
        Method::Mc33 => {
            indices::emit_indices_mc33(params, inside, samples, beside, numbers, end, triangles);
        }
        Method::Tetrahedra => tetrahedra::emit_indices(params, origin.to_array(), beside, numbers, triangles),
    }
}

/// The vertices of the brick at `origin`: on edges, and behind these within cells. Tells whether any had to be marked for the
/// normals stage.
///
/// # Errors
/// [`NoForm::Cpu`].
pub fn emit_vertices(
    params: &Params,
    inside: Inside,
    normals: NormalsOf<'_>,
    (origin, samples): (UVec3, &Samples<'_>),
    record: &BrickRecord,
    vertices: &mut [Vertex],
) -> Result<bool, NoForm> {
    let on_edges = match params.method {
        Method::Mc33 => (record.edge_vertices() as usize).min(vertices.len()),
        Method::MarchingCubes | Method::Tetrahedra => vertices.len(),
    };
    let (vertices, within) = vertices.split_at_mut(on_edges);
    let is_marked = match normals {
        NormalsOf::Field(field) => {
            vertices::emit_field_vertices(params, inside, &field, origin, samples, record, vertices)?
        }
        NormalsOf::Volume(values) => {
            vertices::emit_volume_vertices(params, inside, values, origin, record, vertices)
        }
    };
    if within.is_empty() {
        return Ok(is_marked);
    }
    Ok(is_marked | centres::emit_centres(params, inside, normals, origin, samples, record, within)?)
}
