//! CPU twin of `shaders/emit.wgsl`.

mod indices;
mod vertices;

pub use indices::{Beside, EdgeNumbers, Nearby, emit_indices};
pub use vertices::{Gradients, emit_field_vertices, emit_volume_vertices, renumber_brick};
