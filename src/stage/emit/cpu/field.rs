//! CPU twin of `emit_vertices` in `shaders/emit/cubes.wgsl` and `shaders/emit/tetrahedra.wgsl`, for fields.

use super::crossings::Crossings;
use super::edges::Edge;
use super::snap::snap;
use crate::field::differences::{Normals, central, forward};
use crate::field::{Field, NoForm, Points};
use crate::graph::eval::LANES;
use crate::mesh::Vertex;
use crate::stage::inside::Inside;
use crate::stage::method::Placement;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use glam::UVec3;
use multiversion::multiversion;

/// Where the normals of a brick of a field come from.
#[derive(Debug, Clone, Copy)]
pub struct Gradients<'a> {
    /// How.
    pub normals: Normals,
    /// The field as it is within the brick.
    pub here: &'a dyn Field,
    /// The field as it is everywhere: differences reach out of the brick.
    pub whole: &'a dyn Field,
}

impl Gradients<'_> {
    pub(super) fn at(&self, points: Points<'_>, delta: f32, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        match self.normals {
            Normals::Exact => match self.here.gradients(points, out) {
                Err(NoForm::Gradient) => central(self.whole, points, delta, out),
                done => done,
            },
            Normals::Central { .. } => central(self.whole, points, delta, out),
            Normals::Forward { .. } => forward(self.whole, points, delta, out),
        }
    }
}

/// The vertices on the edges of a brick of a field: normals from the field's gradients at the vertices, as many at a time as its
/// evaluators take. Tells whether any had to be marked for the normals stage.
///
/// # Errors
/// [`NoForm::Cpu`].
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
pub fn emit_field_vertices(
    params: &Params,
    inside: Inside,
    field: &Gradients<'_>,
    origin: UVec3,
    samples: &Samples<'_>,
    edges: &[Edge],
    vertices: &mut [Vertex],
) -> Result<bool, NoForm> {
    let mut batch = Crossings::<LANES>::new();
    let mut marked = false;
    for (edges, vertices) in edges.chunks(LANES).zip(vertices.chunks_mut(LANES)) {
        batch.set(params, origin.to_array(), edges);
        for (i, edge) in edges.iter().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|k| edge.coordinate(k) as usize);
            let [dx, dy, dz] = [0, 1, 2].map(|k| edge.way(k) as usize);
            batch.ends[0][i] = samples.at(x, y, z);
            batch.ends[1][i] = samples.at(x + dx, y + dy, z + dz);
        }
        batch.place(params);
        let count = vertices.len();
        if matches!(params.placement, Placement::Snapped { .. }) {
            snap(&mut batch, params, inside, field.here, count)?;
        }
        let mut gradients = [[1.0; 3]; LANES];
        let [x, y, z] = &batch.position;
        let points = Points { x: &x[..count], y: &y[..count], z: &z[..count] };
        field.at(points, params.delta, &mut gradients[..count])?;
        let mut vectors = [[0.0; LANES]; 3];
        for (k, vector) in vectors.iter_mut().enumerate() {
            for i in 0..LANES {
                vector[i] = gradients[i][k] * params.outward_sign;
            }
        }
        marked |= batch.write(inside, &vectors, vertices);
    }
    Ok(marked)
}
