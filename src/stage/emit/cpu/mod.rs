//! CPU twin of `shaders/emit.wgsl`.

mod around;
mod centres;
mod crossings;
mod edges;
mod ends;
mod field;
mod indices;
mod snap;
mod tetrahedra;
mod volume;

pub use centres::NormalsOf;
pub use crossings::FAR;
pub use edges::Renumber;
pub use ends::{count, ends};
pub use field::Gradients;
pub use indices::{Beside, Nearby};

use crate::field::NoForm;
use crate::mesh::Vertex;
use crate::stage::inside::Inside;
use crate::stage::method::Method;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use around::Around;
use edges::EdgeList;
use glam::UVec3;
use indices::EdgeNumbers;

/// What the work on a brick needs room for; the next brick has the same.
#[derive(Default)]
pub struct Work {
    edges: EdgeList,
    numbers: EdgeNumbers,
    around: Around,
}

/// The mesh of the brick at `origin`, into the room for its vertices and triangles: these as vertex numbers of the whole mesh, vertices
/// on edges first and behind them those within cells. Tells whether any had to be marked for the normals stage.
///
/// # Errors
/// [`NoForm::Cpu`], where the triangles are written already.
pub fn emit(
    params: &Params,
    inside: Inside,
    normals: NormalsOf<'_>,
    (origin, samples): (UVec3, &Samples<'_>),
    beside: &Beside<'_>,
    work: &mut Work,
    (vertices, triangles): (&mut [Vertex], &mut [[u32; 3]]),
) -> Result<bool, NoForm> {
    let (record, Work { edges, numbers, around }) = (beside.own(), work);
    let edges = edges.fill(params.method, samples.extent, record);
    match params.method {
        Method::MarchingCubes => {
            indices::emit_indices(params, samples.extent, edges, beside, numbers, triangles);
        }
        Method::Mc33 => {
            indices::emit_indices_mc33(params, inside, samples, edges, beside, numbers, triangles);
        }
        Method::Tetrahedra => tetrahedra::emit_indices(params, origin.to_array(), beside, numbers, triangles),
    }

    let (on_edges, within) = vertices.split_at_mut(edges.len().min(vertices.len()));
    let is_marked = match normals {
        NormalsOf::Field(field) => {
            field::emit_field_vertices(params, inside, &field, origin, samples, edges, on_edges)?
        }
        NormalsOf::Volume(values) => {
            volume::emit_volume_vertices(params, inside, values, origin, edges, around, on_edges)
        }
    };
    if within.is_empty() {
        return Ok(is_marked);
    }
    Ok(is_marked | centres::emit_centres(params, inside, normals, origin, samples, record, within)?)
}
