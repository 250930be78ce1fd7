//! The values of a field at the vertices of a mesh.

use crate::field::{Field, NoForm, Points};
use crate::grid::Grid;
use crate::mesh::Mesh;
use glam::Vec3;
use rayon::prelude::*;

/// Vertices that are evaluated together.
const CHUNK: usize = 1 << 12;
/// Cells that a vertex may lie outside of a volume and count as inside: what rounding does to one on its border.
const MARGIN: f64 = 1e-3;

/// Why a mesh has no colours.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ColourError {
    /// Only a GPU evaluates the field.
    #[error(
        "colours are sampled on the CPU, and this WGSL function stays on the GPU: write it without what keeps it there"
    )]
    Form(NoForm),
    /// No vertex lies within the volume.
    #[error(
        "the mesh, from {} to {}, has no vertex within the volume that colours it, which reaches from {} to {}: take one of the \
         same space, or place it there (its origin and spacing)",
        mesh[0], mesh[1], volume[0], volume[1]
    )]
    Disjoint {
        /// Low and high corner of the box around the mesh.
        mesh: [Vec3; 2],
        /// Low and high corner of the box around the volume.
        volume: [Vec3; 2],
    },
}

/// Values at vertices.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// One a vertex; NaN outside the volume.
    pub values: Vec<f32>,
    /// Vertices outside the volume, or not finite themselves.
    pub outside: usize,
    /// Vertices within, at which the value is NaN or infinite.
    pub not_finite: usize,
}

/// The values of `field` at the vertices of `mesh`, in world coordinates, on all cores. `volume` is the grid of the volume
/// that the field is the interpolant of, if it is one: beyond it there are no values. Other fields have values everywhere.
///
/// # Errors
/// [`ColourError`].
pub fn sample(field: &dyn Field, volume: Option<&Grid>, mesh: &Mesh) -> Result<Samples, ColourError> {
    let mut values = vec![0.0; mesh.vertices.len()];
    let inside = Inside::of(volume);
    values.par_chunks_mut(CHUNK).zip(mesh.vertices.par_chunks(CHUNK)).try_for_each(
        |(values, vertices)| {
            let [x, y, z] =
                [0, 1, 2].map(|axis| vertices.iter().map(|v| v.position[axis]).collect::<Vec<f32>>());
            field.values(Points { x: &x, y: &y, z: &z }, values).map_err(ColourError::Form)
        },
    )?;
    let outside = values.par_iter_mut().zip(&mesh.vertices).map(|(value, vertex)| {
        let is_outside = !inside.has(vertex.at());
        if is_outside {
            *value = f32::NAN;
        }
        usize::from(is_outside)
    });
    let outside = outside.sum();
    let nowhere = values.iter().filter(|value| !value.is_finite()).count();
    if let (Some(volume), Some((low, high))) = (volume, mesh.bounds())
        && outside == values.len()
    {
        return Err(ColourError::Disjoint { mesh: [low, high], volume: corners(volume) });
    }
    Ok(Samples { values, outside, not_finite: nowhere - outside })
}

/// Low and high corner of the box around a grid.
fn corners(grid: &Grid) -> [Vec3; 2] {
    let last = (grid.points() - 1).as_vec3();
    let corner = |i: u32| grid.position(last * Vec3::from([0, 1, 2].map(|axis| (i >> axis & 1) as f32)));
    (1..8).map(corner).fold([grid.origin(); 2], |[low, high], p| [low.min(p), high.max(p)])
}

/// Where there are values.
struct Inside(Option<(glam::DMat3, glam::DVec3, glam::DVec3)>);

impl Inside {
    fn of(volume: Option<&Grid>) -> Self {
        let parts = |grid: &Grid| {
            let last = (grid.points() - 1).as_dvec3();
            (grid.step().as_dmat3().inverse(), grid.origin().as_dvec3(), last)
        };
        Self(volume.map(parts))
    }

    fn has(&self, p: Vec3) -> bool {
        let Some((to_grid, origin, last)) = &self.0 else { return p.is_finite() };
        let q = *to_grid * (p.as_dvec3() - *origin);
        q.cmpge(glam::DVec3::splat(-MARGIN)).all() && q.cmple(*last + MARGIN).all()
    }
}
