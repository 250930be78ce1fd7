//! Writing the picture as a PNG file.

use super::RenderError;
use crate::atomic;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError, RgbaImage};
use std::io;
use std::path::Path;

/// Tells before the work starts whether [`save_png`] could write `path`.
///
/// # Errors
/// [`RenderError::NotPng`], or [`RenderError::Target`] if no file can be made there.
pub fn check_target(path: &Path) -> Result<(), RenderError> {
    is_png(path)?;
    Ok(atomic::check(path)?)
}

/// Writes `image` to `path` as a PNG: whole, or not at all. A picture without transparency is
/// written without an alpha channel.
///
/// # Errors
/// [`RenderError::NotPng`], [`RenderError::Target`].
pub fn save_png(image: RgbaImage, path: &Path) -> Result<(), RenderError> {
    is_png(path)?;
    let (width, height) = image.dimensions();
    let opaque = image.pixels().all(|p| p[3] == 255);
    let mut bytes = image.into_raw();
    let mut colour = ExtendedColorType::Rgba8;
    if opaque {
        // In place: a large picture in memory twice is much.
        let pixels = bytes.len() / 4;
        for pixel in 0..pixels {
            bytes.copy_within(4 * pixel..4 * pixel + 3, 3 * pixel);
        }
        bytes.truncate(3 * pixels);
        colour = ExtendedColorType::Rgb8;
    }
    let written = atomic::write(path, |file| {
        PngEncoder::new(file).write_image(&bytes, width, height, colour).map_err(|error| match error {
            ImageError::IoError(error) => error,
            other => io::Error::other(other),
        })
    });
    Ok(written?)
}

fn is_png(path: &Path) -> Result<(), RenderError> {
    let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if is_png { Ok(()) } else { Err(RenderError::NotPng { path: path.into() }) }
}
