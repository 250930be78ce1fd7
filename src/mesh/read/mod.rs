//! Reading mesh files: OFF, OBJ, PLY, STL and GLB, chosen by the ending of the path.
//!
//! Vertices and triangles keep the file's order, so that numbers in a [`Report`](super::check::Report)
//! are those of the file (STL files have no vertex numbers, and polygons become several triangles).
//! Files are data from outside: damaged ones give errors, and what a header promises is compared with
//! the size of the file before memory is set aside for it.

mod glb;
mod obj;
mod off;
mod ply;
mod polygon;
mod stl;

use std::path::{Path, PathBuf};
use std::{fs, io};

use super::Mesh;

/// The endings that [`read`] knows, in lower case; case does not matter.
pub const ENDINGS: [&str; 5] = ["off", "obj", "ply", "stl", "glb"];

/// Why a mesh file was not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The ending of the path stands for no known format.
    #[error(
        "{}: not a mesh file ending; .off, .obj, .ply, .stl and .glb files can be read.",
        path.display()
    )]
    UnknownEnding {
        /// The path asked for.
        path: PathBuf,
    },
    /// The file cannot be opened or read.
    #[error("{}: cannot read: {source}; check that it is a file that you may read.", path.display())]
    Io {
        /// The path asked for.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is damaged, cut short, or of another format than its ending says.
    #[error(
        "{}{}: {what}; the file is damaged, cut short, or no mesh of this format: export it again.",
        path.display(), in_line(*line)
    )]
    Malformed {
        /// The path asked for.
        path: PathBuf,
        /// The line, from 1, where there are lines and it is known.
        line: Option<usize>,
        /// What is wrong, naming the vertex or face (numbered from 0) where there is one.
        what: String,
    },
    /// The file uses a part of the format that is not supported.
    #[error("{}{}: {what}; save it without, or in another format.", path.display(), in_line(*line))]
    Unsupported {
        /// The path asked for.
        path: PathBuf,
        /// The line, from 1, where there are lines and it is known.
        line: Option<usize>,
        /// What is not supported.
        what: String,
    },
}

fn in_line(line: Option<usize>) -> String {
    line.map_or(String::new(), |line| format!(", line {line}"))
}

/// What is wrong with the contents of a file.
#[derive(Debug)]
struct Fault {
    line: Option<usize>,
    what: String,
    supported: bool,
}

impl Fault {
    fn new(what: impl Into<String>) -> Self {
        Fault { line: None, what: what.into(), supported: true }
    }

    fn at(line: usize, what: impl Into<String>) -> Self {
        Fault { line: Some(line), what: what.into(), supported: true }
    }

    /// A part of the format that is not read.
    fn unsupported(line: Option<usize>, what: impl Into<String>) -> Self {
        Fault { line, what: what.into(), supported: false }
    }
}

/// What a mesh file holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Contents {
    /// The mesh.
    pub mesh: Mesh,
    /// Faces of fewer than three corners, which the mesh is without.
    pub left_out: usize,
}

impl From<Mesh> for Contents {
    fn from(mesh: Mesh) -> Self {
        Contents { mesh, left_out: 0 }
    }
}

/// Reads a mesh in the format that the ending of `path` stands for.
///
/// * Polygons are cut into triangles, each edge of the polygon kept: as fans from their first corner where that leaves no
///   triangle turned over or flat, as of convex ones, else by a Delaunay triangulation of what they enclose, seen along the
///   axis that they look along most. Polygons that cross or touch themselves are cut as fans all the same.
/// * Faces of fewer than three corners are left out and counted. Points and lines are left out, and so are triangles of a
///   GLB strip that repeat a vertex.
/// * Positions that are NaN or infinite are kept: [`check`](super::check) counts them, and
///   [`remove_broken`](Mesh::remove_broken) removes what they spoil.
/// * Normals are taken from the file where it has them, and zero elsewhere. An OBJ vertex with different
///   normals in different faces gets their normalised sum.
/// * STL triangles are welded by position ([`Mesh::weld`]).
/// * The meshes of a GLB scene are placed as its nodes say and put one after the other.
///
/// # Errors
///
/// [`ReadError`]; each message names the file and, where known, the line.
pub fn read(path: &Path) -> Result<Contents, ReadError> {
    let found =
        path.extension().and_then(|e| ENDINGS.into_iter().find(|known| e.eq_ignore_ascii_case(known)));
    let format = found.ok_or_else(|| ReadError::UnknownEnding { path: path.into() })?;
    let bytes = fs::read(path).map_err(|source| ReadError::Io { path: path.into(), source })?;
    let contents = match format {
        _ if bytes.is_empty() => Err(Fault::new("the file is empty")),
        "off" => off::parse(&bytes),
        "obj" => obj::parse(&bytes),
        "ply" => ply::parse(&bytes),
        "stl" => stl::parse(bytes).map(Contents::from),
        _ => glb::parse(&bytes).map(Contents::from),
    };
    contents.map_err(|Fault { line, what, supported }| {
        let path = path.into();
        if supported {
            ReadError::Malformed { path, line, what }
        } else {
            ReadError::Unsupported { path, line, what }
        }
    })
}

/// The text of a file. Bytes that are not UTF-8 occur in comments, and are an error only if not there.
fn text(bytes: &[u8]) -> std::borrow::Cow<'_, str> {
    // Some editors begin a file with a byte order mark.
    String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}

/// Three numbers, and the words after them.
fn three<'a>(words: &mut impl Iterator<Item = &'a str>, line: usize) -> Result<[f32; 3], Fault> {
    let mut numbers = [0.0; 3];
    for number in &mut numbers {
        let word = words.next().ok_or_else(|| Fault::at(line, "three numbers expected, found fewer"))?;
        *number = word.parse().map_err(|_| Fault::at(line, format!("{word:?} is not a number")))?;
    }
    Ok(numbers)
}

/// A vertex count that u32 indices can reach.
fn countable(vertices: usize) -> Result<(), Fault> {
    if vertices < u32::MAX as usize {
        return Ok(());
    }
    Err(Fault::new(format!("{vertices} vertices are more than 32-bit indices can number")))
}
