//! Why a mesh was not refined.

use super::MOST_LEVELS;
use crate::field::NoForm;
use crate::gpu::GpuError;

/// Why a mesh was not refined.
#[derive(Debug, Clone, thiserror::Error)]
pub enum RefineError {
    /// The flatness is no cosine of an angle below 180 degrees.
    #[error("flatness is {0}: give the cosine of the allowed angle between normals, above -1 and at most 1")]
    Flatness(f32),
    /// The tolerance is NaN, infinite, 0 or below.
    #[error("epsilon is {0}: give a finite distance over 0, in world units")]
    Epsilon(f32),
    /// The longest step is NaN, infinite, 0 or below.
    #[error("step is {0}: give a finite length over 0, in world units")]
    Step(f32),
    /// More levels than there may be.
    #[error("the depth is {0}: it may be {MOST_LEVELS} at most")]
    Depth(u32),
    /// The border is no box.
    #[error("the border is no box of finite size: give its lowest corner, then its highest")]
    Border,
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names a vertex that does not exist, of {vertices}: repair the mesh")]
    BadIndex {
        /// The triangle's number, from 0.
        triangle: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A vertex is NaN or infinite.
    #[error("vertex {vertex} of the mesh is not finite: repair the mesh")]
    NotFinite {
        /// Its number, from 0.
        vertex: usize,
    },
    /// The result would be beyond the limit, or 32-bit indices.
    #[error(
        "level {level} would have {vertices} vertices and {triangles} triangles, over the limit of {limit} triangles: \
         lower the flatness or the depth"
    )]
    TooLarge {
        /// The level, from 1; 0 is the start mesh.
        level: u32,
        /// Its vertices.
        vertices: u64,
        /// Its triangles.
        triangles: u64,
        /// The most triangles.
        limit: u64,
    },
    /// The field has no form for this backend.
    #[error(transparent)]
    NoForm(#[from] NoForm),
    /// The GPU failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
