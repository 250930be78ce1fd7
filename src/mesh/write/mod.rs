//! Mesh files: OFF, OBJ, PLY, STL, GLB and RIB, chosen by the ending of the path.
//!
//! A file appears whole or not at all: it is written under a temporary name in its own folder and
//! renamed at the end, which replaces an older file of that name. (A killed process may leave the
//! temporary file, `.isoforge-*`; no half file ever has the name asked for.) Symbolic links are followed,
//! and a device or a pipe is written straight into. Coordinates go out as they are, in world units, without
//! any change of axes.

mod glb;
mod obj;
mod off;
pub(crate) mod parts;
mod ply;
mod rib;
mod stl;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::atomic::{self, TargetError};
use crate::colour::Coloured;
use rayon::prelude::*;

use crate::render::{RenderError, View, check_view};

use super::{Mesh, Vertex};

/// The endings that [`write()`] knows, in lower case; case does not matter. [`read`](super::read::read) knows all but
/// `rib`.
pub const ENDINGS: [&str; 6] = ["off", "obj", "ply", "stl", "glb", "rib"];

/// Why a mesh was not written. Nothing is left behind then, and an older file of that name stays.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The ending of the path stands for no known format.
    #[error(
        "{}: not a mesh file ending; name the file .off, .obj, .ply, .stl, .glb or .rib, which chooses the format.",
        path.display()
    )]
    UnknownEnding {
        /// The path asked for.
        path: PathBuf,
    },
    /// The file cannot be made or filled there.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The format cannot hold a mesh of this size.
    #[error("{}: {what}; write .ply, .obj or .off, or a coarser mesh.", path.display())]
    TooLarge {
        /// The path asked for.
        path: PathBuf,
        /// The limit.
        what: String,
    },
    /// A format that needs the whole mesh at once.
    #[error("{}: only .ply and .stl are written in parts; name the file so.", path.display())]
    NotInParts {
        /// The path asked for.
        path: PathBuf,
    },
    /// A format that has no place for what a mesh has beside its triangles.
    #[error("{}: the format has no place for {what}; name the file {endings}.", path.display())]
    NoPlace {
        /// The path asked for.
        path: PathBuf,
        /// What it cannot hold.
        what: &'static str,
        /// The endings of the formats that can.
        endings: &'static str,
    },
    /// A view that no picture has.
    #[error("{}: {error}", path.display())]
    View {
        /// The path asked for.
        path: PathBuf,
        /// What is wrong with it.
        error: RenderError,
    },
    /// Not one value and one colour a vertex.
    #[error("{}: {values} values and {colours} colours for {vertices} vertices; give one of each a vertex.", path.display())]
    Colours {
        /// The path asked for.
        path: PathBuf,
        /// How many values there are.
        values: usize,
        /// How many colours there are.
        colours: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error(
        "{}: triangle {triangle} names vertex {vertex}, but the mesh has {vertices}; the mesh is broken.",
        path.display()
    )]
    BadIndex {
        /// The path asked for.
        path: PathBuf,
        /// The first such triangle, from 0.
        triangle: usize,
        /// The vertex it names, from 0.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
}

/// Whether the path ends in one of [`ENDINGS`].
pub fn is_mesh_ending(path: &Path) -> bool {
    ending(path).is_some()
}

/// The ending as it stands in [`ENDINGS`].
pub(crate) fn ending(path: &Path) -> Option<&'static str> {
    let found = path.extension()?.to_str()?;
    ENDINGS.into_iter().find(|known| known.eq_ignore_ascii_case(found))
}

/// Refuses a path that [`write()`] could not write to now: unknown ending, no folder, or a folder that
/// takes no files. Meant for before long work; leaves nothing behind.
///
/// # Errors
///
/// As [`write()`], without what depends on the mesh.
pub fn check_target(path: &Path) -> Result<(), WriteError> {
    ending(path).ok_or_else(|| WriteError::UnknownEnding { path: path.into() })?;
    Ok(atomic::check(path)?)
}

/// Writes a mesh in the format that the ending of `path` stands for; returns the size in bytes.
///
/// | ending | what |
/// |---|---|
/// | `.off` | text; positions only, in digits that read back to the same bits |
/// | `.obj` | text; positions and normals |
/// | `.ply` | little-endian binary; positions and normals |
/// | `.stl` | binary; unconnected triangles with facet normals |
/// | `.glb` | glTF 2.0 binary; positions, and normals where there are any. glTF viewers take the unit as a metre and y as up |
/// | `.rib` | text for RenderMan renderers: positions, and normals where there are any, with a camera that sees all of the mesh, and lights |
///
/// # Errors
///
/// [`WriteError`]; each message names the path and what to do.
pub fn write(mesh: &Mesh, path: &Path) -> Result<u64, WriteError> {
    write_with(mesh, &Extra::default(), path)
}

/// What a file holds beside positions, normals and triangles.
#[derive(Debug, Clone, Copy, Default)]
pub struct Extra<'a> {
    /// A value and a colour a vertex, in two formats. `.ply`: `float value` (NaN where there is none) and `uchar red`,
    /// `green`, `blue`. `.glb`: `_VALUE` (float; 0 where there is none, since glTF has no NaN) and `COLOR_0`, in linear light
    /// as glTF wants it.
    pub colours: Option<&'a Coloured>,
    /// The triangles as one strip, written in their place: `.glb`, as a primitive of mode 5. See
    /// [`triangles_of_strip`](super::triangles_of_strip).
    pub strip: Option<&'a [u32]>,
    /// From where the camera of a `.rib` file looks, and how large its picture is.
    pub view: View,
}

/// As [`write()`], with more in the file.
///
/// # Errors
///
/// As [`write()`]; [`WriteError::NoPlace`], [`WriteError::Colours`].
pub fn write_with(mesh: &Mesh, extra: &Extra, path: &Path) -> Result<u64, WriteError> {
    let format = ending(path).ok_or_else(|| WriteError::UnknownEnding { path: path.into() })?;
    let vertices = mesh.vertices.len();
    let bad = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= vertices);
    if let Some(triangle) = mesh.triangles.par_iter().position_first(bad) {
        let vertex = mesh.triangles[triangle].into_iter().max().unwrap_or(0);
        return Err(WriteError::BadIndex { path: path.into(), triangle, vertex, vertices });
    }
    if let Some(Coloured { values, colours }) = extra.colours
        && [values.len(), colours.len()] != [vertices; 2]
    {
        let (values, colours) = (values.len(), colours.len());
        return Err(WriteError::Colours { path: path.into(), values, colours, vertices });
    }
    let strip = extra.strip.unwrap_or_default();
    if let Some(i) = strip.iter().position(|&v| v as usize >= vertices) {
        let (triangle, vertex) = (i.saturating_sub(2), strip[i]);
        return Err(WriteError::BadIndex { path: path.into(), triangle, vertex, vertices });
    }
    has_place(format, extra).map_err(|(what, endings)| WriteError::NoPlace {
        path: path.into(),
        what,
        endings,
    })?;
    let too_large = |what: String| WriteError::TooLarge { path: path.into(), what };
    match format {
        "stl" => stl::fits(mesh.triangles.len() as u64).map_err(too_large)?,
        "glb" => glb::fits(mesh, extra).map_err(too_large)?,
        "rib" => check_view(&extra.view).map_err(|error| WriteError::View { path: path.into(), error })?,
        _ => {}
    }

    let bytes = atomic::write(path, |file| {
        let mut out = Counted { inner: file, bytes: 0 };
        match format {
            "off" => off::write(mesh, &mut out),
            "obj" => obj::write(mesh, &mut out),
            "ply" => ply::write(mesh, extra.colours, &mut out),
            "stl" => stl::write(mesh, &mut out),
            "rib" => {
                let name = path.file_stem().unwrap_or_default().to_string_lossy();
                rib::write(mesh, &name, &extra.view, &mut out)
            }
            _ => glb::write(mesh, extra, &mut out),
        }?;
        Ok(out.bytes)
    })?;
    Ok(bytes)
}

/// Whether a format can hold it; else what it cannot, and the endings of those that can.
fn has_place(format: &str, extra: &Extra) -> Result<(), (&'static str, &'static str)> {
    if extra.colours.is_some() && !["ply", "glb"].contains(&format) {
        return Err(("colours", ".ply or .glb"));
    }
    if extra.strip.is_some() && format != "glb" {
        return Err(("triangle strips", ".glb"));
    }
    Ok(())
}

struct Counted<W> {
    inner: W,
    bytes: u64,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(data)?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// Formats items on all cores and writes them in order, holding a bounded part of the file at a time.
fn in_chunks<T: Sync>(
    out: &mut impl Write,
    items: &[T],
    format: impl Fn(&mut Vec<u8>, &T) -> io::Result<()> + Sync,
) -> io::Result<()> {
    const CHUNK: usize = 1 << 13;
    let buffers = 4 * rayon::current_num_threads();
    let mut filled: Vec<Vec<u8>> = vec![Vec::new(); buffers];
    for batch in items.chunks(buffers * CHUNK) {
        filled.par_iter_mut().zip(batch.par_chunks(CHUNK)).try_for_each(|(buffer, chunk)| {
            buffer.clear();
            chunk.iter().try_for_each(|item| format(buffer, item))
        })?;
        for buffer in &filled[..batch.len().div_ceil(CHUNK)] {
            out.write_all(buffer)?;
        }
    }
    Ok(())
}

/// Positions and normals as little-endian floats, 24 bytes a vertex.
fn vertices_le(out: &mut impl Write, vertices: &[Vertex]) -> io::Result<()> {
    if cfg!(target_endian = "little") {
        return out.write_all(bytemuck::cast_slice(vertices));
    }
    in_chunks(out, vertices, |buffer, v| floats_le(buffer, v.position.iter().chain(&v.normal)))
}

fn floats_le<'a>(buffer: &mut Vec<u8>, floats: impl IntoIterator<Item = &'a f32>) -> io::Result<()> {
    floats.into_iter().for_each(|x| buffer.extend_from_slice(&x.to_le_bytes()));
    Ok(())
}
