//! Blob components: points that are summed into a density field — atoms of a molecule, particles of
//! a fluid — read from files.
//!
//! [`open`] reads CSV tables, XYZ and PDB molecules and PLY points, a line or an element at a time.
//! Positions and radii keep the file's units (ångström in molecules). Files are data from outside:
//! damaged ones give errors that name the row, and memory grows with what was read, never with what
//! a header promises.

mod csv;
mod error;
mod pdb;
mod ply;
mod radii;
mod source;
mod xyz;

pub use error::OpenError;

use source::Source;
use std::path::Path;

/// The file endings that [`open`] knows, in lower case.
pub const ENDINGS: &[&str] = &[".csv", ".csv.gz", ".xyz", ".xyz.gz", ".pdb", ".pdb.gz", ".ply"];

/// One blob.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Component {
    /// The centre.
    pub position: [f32; 3],
    /// How far it reaches; above 0.
    pub radius: f32,
    /// What it counts in the sum; negative ones carve.
    pub weight: f32,
}

/// How to open a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenOptions {
    /// The radius of every component of a file that has none; molecules take their elements' instead.
    pub radius: f32,
    /// Refuse a file whose components take more than this many bytes (20 each); `None` for no limit.
    pub max_bytes: Option<u64>,
}

impl Default for OpenOptions {
    /// Radius 1, no limit.
    fn default() -> Self {
        Self { radius: 1.0, max_bytes: None }
    }
}

/// The components of a file, in its order, and what its user should know about how it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// The components; at least one.
    pub components: Vec<Component>,
    /// Remarks, one line each: what was left out or assumed.
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, Copy)]
enum Format {
    Csv,
    Xyz,
    Pdb,
    Ply,
}

/// The format that the ending stands for, and whether the contents are gzipped.
fn format_of(path: &Path) -> Option<(Format, bool)> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let (name, gzip) = name.strip_suffix(".gz").map_or((&*name, false), |name| (name, true));
    match name.rsplit_once('.')?.1 {
        "csv" => Some((Format::Csv, gzip)),
        "xyz" => Some((Format::Xyz, gzip)),
        "pdb" => Some((Format::Pdb, gzip)),
        "ply" if !gzip => Some((Format::Ply, gzip)),
        _ => None,
    }
}

/// Whether the path ends like a file of components, in either case: one of [`ENDINGS`]. PLY files hold
/// meshes too; read here, their vertices are the components.
pub fn is_component_ending(path: &Path) -> bool {
    format_of(path).is_some()
}

/// Reads components; the format is told by the file's ending (one of [`ENDINGS`], in either case).
///
/// * CSV: columns `x`, `y`, `z` and, where wanted, `radius` (or `r`) and `weight` (or `w`), named by a
///   header in any order and case, or 3 to 5 columns in that order without one. Separated by commas,
///   semicolons or tabs; `#` begins a comment.
/// * XYZ: the first frame of a molecule, with van der Waals radii, or plain points, one a line, if the
///   first line is no single integer.
/// * PDB: `ATOM` and `HETATM` records of the first model, with van der Waals radii. Waters and all but
///   one alternate location are left out.
/// * PLY: the element `vertex`, its `radius` (or `scale`) and `weight` where it has them.
///
/// Weights that are not given are 1.
///
/// # Errors
/// [`OpenError`] for a file that can't be read, is cut short or damaged, holds no component, or more
/// than [`OpenOptions::max_bytes`] allow.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Loaded, OpenError> {
    let (format, gzip) = format_of(path).ok_or_else(|| OpenError::Ending { path: path.to_owned() })?;
    let source = Source::open(path, gzip)?;
    match format {
        Format::Csv => csv::read(source, options),
        Format::Xyz => xyz::read(source, options),
        Format::Pdb => pdb::read(source, options),
        Format::Ply => ply::read(source, options),
    }
}
