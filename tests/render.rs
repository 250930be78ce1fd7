//! Pictures: the camera, both backends against each other, and what each must show.
//!
//! Without an adapter the GPU tests fail; `ISOFORGE_TESTS=cpu` leaves them out on purpose.

mod common;

#[path = "render/backends.rs"]
mod backends;
#[path = "render/camera.rs"]
mod camera;
#[path = "render/compare.rs"]
mod compare;
#[path = "render/hostile.rs"]
mod hostile;
#[path = "render/output.rs"]
mod output;
#[path = "render/shaders.rs"]
mod shaders;
#[path = "render/shapes.rs"]
mod shapes;
