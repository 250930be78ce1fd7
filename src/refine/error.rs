//! Why a mesh was not refined.

use super::MOST_LEVELS;
use super::gpu::LONGEST_FAN;
use crate::extract::ExtractError;
use crate::field::NoForm;
use crate::gpu::GpuError;

/// Why a mesh was not refined.
#[derive(Debug, Clone, thiserror::Error)]
pub enum RefineError {
    /// The flatness is no cosine of an angle below 180 degrees.
    #[error("flatness is {0}: give the cosine of the allowed angle between normals, above -1 and at most 1")]
    Flatness(f32),
    /// The iso value is NaN or infinite.
    #[error("the iso value is {0}: give a finite number")]
    Iso(f32),
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
    /// A vertex has no normal, and the GPU does not make one from the triangles around.
    #[error("vertex {vertex} of the mesh has no normal: refine it on the CPU, or give it one")]
    NoNormal {
        /// Its number, from 0.
        vertex: usize,
    },
    /// A vertex has more edges than the GPU sorts.
    #[error(
        "more than {LONGEST_FAN} sides of triangles join one vertex of the mesh to vertices after it: refine it on the CPU"
    )]
    Crowded,
    /// A search on the GPU was ended from outside.
    #[error(
        "the loops of the field and of the search for its surface took more iterations than an invocation on this \
         adapter may make: refine the mesh on the CPU"
    )]
    CutShort,
    /// A buffer is more than the adapter binds.
    #[error(
        "{what} take {needed} bytes, and the adapter {adapter} binds at most {limit}: refine the mesh on the CPU, or \
         lower the flatness or the depth"
    )]
    Binding {
        /// What the buffer holds.
        what: &'static str,
        /// Its bytes.
        needed: u64,
        /// Bytes that the adapter binds.
        limit: u64,
        /// Its name.
        adapter: String,
    },
    /// The field does not fit on the GPU.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// The field has no form for this backend.
    #[error(transparent)]
    NoForm(#[from] NoForm),
    /// The GPU failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl RefineError {
    /// Whether the GPU alone is at fault, so that [`super::refine`] may do what it did not.
    pub fn is_of_gpu(&self) -> bool {
        matches!(
            self,
            Self::NoNormal { .. }
                | Self::Crowded
                | Self::CutShort
                | Self::Binding { .. }
                | Self::Extract(ExtractError::FieldData { .. } | ExtractError::TooManyParameters { .. })
                | Self::NoForm(NoForm::Gpu)
                | Self::Gpu(GpuError::OutOfMemory { .. })
        )
    }
}
