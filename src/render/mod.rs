//! Offscreen pictures of meshes: a mesh in GPU buffers is drawn where it lies ([`Renderer`]), and a
//! mesh in main memory without any adapter ([`render_software`]). Both give the same picture, up to
//! rounding.
//!
//! Colours are mixed as stored: shading is worked out in linear light and encoded as sRGB by the
//! fragment shader, and samples, lines and background are then averaged in sRGB. The hardware
//! formats that do this by themselves resolve differently from driver to driver.

mod bounds;
mod camera;
mod error;
mod gpu;
mod label;
#[cfg(test)]
mod layout_tests;
mod output;
mod shade;
pub mod shaders;
mod software;
mod style;
mod wire;

pub use bounds::gpu_bounds;
pub(crate) use camera::check as check_view;
pub use camera::{Camera, MAX_PIXELS, MAX_SIDE, View, picture_bytes};
pub use error::RenderError;
pub use gpu::Renderer;
pub use label::{LETTER, label};
pub use output::{check_target, save_png};
pub use software::{render_software, render_software_coloured};
pub use style::{BAD_NORMAL, BEHIND, Shade, Style, WRONG_NORMAL};
