//! The drawing shaders, put together.

use crate::stage::shaders::HEADER;

/// Drawing the mesh.
pub const MESH: &str = include_str!("../../shaders/render/mesh.wgsl");

/// Triangles into lines.
pub fn wire() -> String {
    [HEADER, include_str!("../../shaders/render/wire.wgsl")].join("\n")
}

/// The box around a mesh.
pub fn bounds() -> String {
    [HEADER, include_str!("../../shaders/render/bounds.wgsl")].join("\n")
}
