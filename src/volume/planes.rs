//! Volumes too large for memory: files whose values lie there as they are, read some planes at a time.

use super::decode::{Coding, Loss, Scalar, append, grow};
use super::error::OpenError;
use super::values::{Values, each_type};
use super::{Format, OpenOptions, format, nifti, nrrd, raw, tiff};
use crate::grid::Grid;
use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bytes that are read at once.
const PIECE: usize = 1 << 20;

/// Where a file's values lie; what every format's header comes to.
pub(super) struct Located {
    /// The file that holds them.
    pub path: PathBuf,
    pub grid: Grid,
    pub coding: Coding,
    pub starts: Starts,
    pub notes: Vec<String>,
}

/// The first bytes of planes, in order of z.
pub(super) enum Starts {
    /// Of the first; the others follow each other.
    Together(u64),
    Each(Vec<u64>),
}

/// An open volume file whose values are read some planes of constant z at a time: a raw file, an uncompressed `.nii`, NRRD with
/// encoding raw, or a stack of uncompressed TIFF pages.
#[derive(Debug)]
pub struct Planes {
    file: File,
    path: PathBuf,
    grid: Grid,
    coding: Coding,
    starts: Starts,
    notes: Vec<String>,
    loss: Loss,
    piece: Vec<u8>,
}

impl std::fmt::Debug for Starts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Together(start) => write!(f, "Together({start})"),
            Self::Each(starts) => write!(f, "Each({} planes)", starts.len()),
        }
    }
}

impl Planes {
    /// Opens a file and reads its header, as [`open`](super::open) does. [`OpenOptions::max_bytes`] is not asked.
    ///
    /// # Errors
    /// [`OpenError`], among them [`Unsupported`](OpenError::Unsupported) for files that are compressed, or hold their
    /// values otherwise than plane by plane.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, OpenError> {
        let options = OpenOptions { max_bytes: None, ..options.clone() };
        let located = match format(path, &options)? {
            Format::Nifti => nifti::locate(path, &options),
            Format::Tiff => tiff::locate(path, &options),
            Format::Nrrd => nrrd::locate(path, &options),
            Format::Raw => raw::locate(path, &options),
        }?;
        let Located { path, grid, coding, starts, notes } = located;
        let file = File::open(&path).map_err(|e| OpenError::reading(&path, e))?;
        Ok(Self { file, path, grid, coding, starts, notes, loss: Loss::default(), piece: Vec::new() })
    }

    /// The grid of all planes.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The type that values have in memory.
    pub fn scalar(&self) -> Scalar {
        self.coding.kept()
    }

    /// Bytes that the whole volume would take in memory.
    pub fn bytes(&self) -> u64 {
        self.grid.point_count() * self.scalar().size() as u64
    }

    /// Remarks about the file, one line each, with what was lost of the values read so far.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = self.notes.clone();
        self.loss.notes(&self.coding, &mut notes);
        notes
    }

    /// Reads planes, in place of what `values` holds; its memory is used again where the type is that of the file.
    ///
    /// # Errors
    /// [`OpenError::Truncated`] where the file ends, [`OpenError::Read`] where the disk fails, [`OpenError::TooLarge`] where
    /// there is no memory.
    pub fn read(&mut self, planes: Range<u32>, values: &mut Values) -> Result<(), OpenError> {
        let points = self.grid.points();
        if values.scalar() == self.scalar() {
            each_type!(Values, values, samples => samples.clear());
        } else {
            *values = self.coding.none();
        }
        // On 32 bits a plane may be more than there can be in memory.
        let dims = points.to_array().map(u64::from);
        let count = dims[0] * dims[1];
        let size = count * self.coding.scalar.size() as u64;
        let all = count.checked_mul(planes.len() as u64).and_then(|all| usize::try_from(all).ok());
        grow(&self.path, dims, values, all.unwrap_or(usize::MAX))?;
        match &self.starts {
            Starts::Together(start) => {
                let start = start + u64::from(planes.start) * size;
                self.append(start, size * planes.len() as u64, values)
            }
            Starts::Each(starts) => {
                let starts = starts[planes.start as usize..planes.end as usize].to_vec();
                starts.into_iter().try_for_each(|start| self.append(start, size, values))
            }
        }
    }

    fn append(&mut self, start: u64, size: u64, values: &mut Values) -> Result<(), OpenError> {
        self.file.seek(SeekFrom::Start(start)).map_err(|e| OpenError::reading(&self.path, e))?;
        self.piece.resize(PIECE, 0);
        for first in (0..size).step_by(PIECE) {
            let piece = &mut self.piece[..(size - first).min(PIECE as u64) as usize];
            self.file.read_exact(piece).map_err(|e| match e.kind() {
                // It was long enough when it was opened.
                ErrorKind::UnexpectedEof => OpenError::Truncated {
                    file: self.path.clone(),
                    need: start + size,
                    have: "the file has become shorter meanwhile".to_owned(),
                },
                _ => OpenError::reading(&self.path, e),
            })?;
            let count = piece.len() / self.coding.scalar.size();
            self.loss = self.loss.plus(append(piece, &self.coding, values, count));
        }
        Ok(())
    }
}

/// The refusal of a file that cannot be read by planes.
pub(super) fn no_planes(file: &Path, what: &str) -> OpenError {
    OpenError::unsupported(
        file,
        format!("reading a volume in parts that is {what}"),
        "Save it uncompressed, one plane after another (raw, .nii, NRRD with encoding raw), or give it the memory that all \
         of it takes",
    )
}
