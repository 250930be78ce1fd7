//! isoforge turns a density field into a triangle mesh with WGSL compute passes and leaves the
//! mesh on the GPU, ready to draw.
#![warn(missing_docs)]
#![deny(unsafe_code)]

pub mod cli;
pub mod compare;
pub mod extract;
pub mod field;
pub mod gpu;
pub mod grid;
pub mod mesh;
pub mod render;
pub mod stage;
pub mod table;
pub mod volume;
