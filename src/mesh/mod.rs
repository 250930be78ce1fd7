//! Triangle meshes in main memory: the mesh itself, the checker, clean-up, and files.

use glam::Vec3;

mod border;
pub mod check;
pub mod clean;
mod collapse;
mod components;
mod crease;
mod flip;
mod order;
pub mod read;
mod repair;
mod report;
mod simplify;
mod smooth;
mod stitch;
mod strip;
mod weld;
pub mod write;

pub use components::{Component, Components, Least};
pub use repair::Repaired;
pub use simplify::{Budget, Unfit};
pub use smooth::{SmoothError, Taubin};
pub use strip::triangles_of_strip;
pub use weld::WeldError;

/// A vertex as it lies in GPU buffers and in [`Mesh::vertices`]: 24 bytes, no padding.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// Position in world units.
    pub position: [f32; 3],
    /// Unit normal, out of the solid.
    pub normal: [f32; 3],
}

impl Vertex {
    /// The position as a vector.
    pub fn at(&self) -> Vec3 {
        Vec3::from(self.position)
    }
}

/// An indexed triangle mesh.
///
/// Triangles are counter-clockwise seen from outside the solid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions in world units and unit normals out of the solid (all zero where a file had none).
    pub vertices: Vec<Vertex>,
    /// Three vertex numbers a triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The smallest axis-aligned box around the vertices, as (low, high) corner; `None` without
    /// any finite vertex.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.vertices.iter().map(Vertex::at).filter(|p| p.is_finite()).fold(None, |box_, p| match box_ {
            None => Some((p, p)),
            Some((lo, hi)) => Some((lo.min(p), hi.max(p))),
        })
    }
}
