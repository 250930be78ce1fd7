//! Writing the picture as a PNG file.

use super::RenderError;
use crate::atomic::{folder_of, temporary_beside};
use image::{DynamicImage, ImageFormat, RgbaImage};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Tells before the work starts whether [`save_png`] could write `path`.
///
/// # Errors
/// [`RenderError::Target`] if the name does not end in `.png`, if it is a folder, or if no file
/// can be made in its folder.
pub fn check_target(path: &Path) -> Result<(), RenderError> {
    let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if !is_png {
        return Err(target(path, "pictures are written as PNG: end the name in .png".into()));
    }
    if path.is_dir() {
        return Err(target(path, "this is a folder: give a file name".into()));
    }
    temporary(path).map(drop)
}

/// Writes `image` to `path` as a PNG: whole, or not at all. A picture without transparency is
/// written without an alpha channel.
///
/// # Errors
/// [`RenderError::Target`].
pub fn save_png(image: &RgbaImage, path: &Path) -> Result<(), RenderError> {
    check_target(path)?;
    let mut file = temporary(path)?;
    let opaque = image.pixels().all(|p| p[3] == 255);
    let picture = DynamicImage::ImageRgba8(image.clone());
    let picture = if opaque { DynamicImage::ImageRgb8(picture.into_rgb8()) } else { picture };
    // The encoder wants to seek, which only a memory buffer or the bare file can.
    let mut bytes = io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).map_err(|e| target(path, e.to_string()))?;
    let mut writer = BufWriter::new(file.as_file_mut());
    let written = writer.write_all(bytes.get_ref()).and_then(|()| writer.flush());
    drop(writer);
    written.map_err(|e| target(path, format!("{e}; is the disk full?")))?;
    file.persist(path).map(drop).map_err(|e| target(path, format!("{}; choose another name", e.error)))
}

fn target(path: &Path, reason: String) -> RenderError {
    RenderError::Target { path: PathBuf::from(path), reason }
}

/// A file beside `path`, so that it can take its name in one step.
fn temporary(path: &Path) -> Result<tempfile::NamedTempFile, RenderError> {
    let folder = folder_of(path);
    temporary_beside(path).map_err(|e| {
        let remedy =
            if folder.is_dir() { "choose a folder that you may write to" } else { "make the folder first" };
        target(path, format!("no file can be made in {}: {e}; {remedy}", folder.display()))
    })
}
