//! CPU twin of `shaders/emit.wgsl`.

mod centres;
mod indices;
mod vertices;

pub use centres::{NormalsOf, emit_centres};
pub use indices::{Beside, EdgeNumbers, Nearby, emit_indices, emit_indices_mc33};
pub use vertices::{Gradients, emit_field_vertices, emit_volume_vertices, renumber_brick};
