//! What can go wrong between a mesh and its picture.

use super::camera::{MAX_PIXELS, MAX_SIDE};
use crate::atomic::TargetError;
use crate::gpu::GpuError;
use std::path::PathBuf;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A side of zero or over [`MAX_SIDE`], or more than [`MAX_PIXELS`] in all.
    #[error(
        "a picture of {width} x {height} pixels cannot be made: give sides from 1 to {MAX_SIDE} \
         and at most {MAX_PIXELS} pixels in all"
    )]
    Size {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
    /// The adapter's textures are smaller than the picture.
    #[error(
        "a picture of {width} x {height} pixels is too large for this adapter: make it at most \
         {limit} pixels a side, or draw it with the CPU backend"
    )]
    TooLargeForAdapter {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// The adapter's largest side.
        limit: u32,
    },
    /// An angle that is no number, or a field of view that no lens has.
    #[error("the {what} is {degrees} degrees: give {range}")]
    Angle {
        /// Which angle.
        what: &'static str,
        /// Its value.
        degrees: f32,
        /// What it may be.
        range: &'static str,
    },
    /// The box to look at is not finite, or too large for `f32` with the camera outside it.
    #[error("the box to look at is not finite or too large: give ordinary numbers, at most 1e36")]
    Bounds,
    /// The GPU failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The name does not end in `.png`.
    #[error("{}: pictures are written as PNG: end the name in .png", path.display())]
    NotPng {
        /// The path asked for.
        path: PathBuf,
    },
    /// The file cannot be made or filled there.
    #[error(transparent)]
    Target(#[from] TargetError),
}
