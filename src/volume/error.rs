//! Why a volume file was refused.

use super::Scalar;
use crate::grid::GridError;
use std::io;
use std::path::{Path, PathBuf};

/// Why [`open`](super::open) refused a file. Every message names the file, the thing that is wrong
/// and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The operating system did not hand over the file.
    #[error("{file}: cannot be read: {source}. Check that the path is right and that you may read it")]
    Read {
        /// The file.
        file: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The path is a directory, a device or something else that holds no file contents.
    #[error("{file}: is not an ordinary file. Give the path of a volume file")]
    NotAFile {
        /// The path.
        file: PathBuf,
    },
    /// The file's ending belongs to no known format, and no layout is given.
    #[error(
        "{file}: the ending names no volume format. Known endings: {}; any other file is read as raw values where its \
         dimensions and scalar type are given", super::ENDINGS.join(", ")
    )]
    Ending {
        /// The file.
        file: PathBuf,
    },
    /// A raw file without [`OpenOptions::raw`](super::OpenOptions::raw).
    #[error(
        "{file}: a raw file does not say how large it is. Give its dimensions and scalar type \
         (and byte order, spacing and origin where they matter)"
    )]
    NoLayout {
        /// The file.
        file: PathBuf,
    },
    /// A header that contradicts itself or the format.
    #[error("{file}: {problem}. {remedy}")]
    Header {
        /// The file.
        file: PathBuf,
        /// The field and what is wrong with it.
        problem: String,
        /// What to do.
        remedy: String,
    },
    /// A sound file that uses what this reader does not take.
    #[error("{file}: {what} is not supported. {remedy}")]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// The feature.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// Fewer than two samples along an axis: no cell to put a surface in.
    #[error(
        "{file}: the volume is {} x {} x {} samples; a surface needs at least 2 along each axis. \
         Give a 3-D volume", dims[0], dims[1], dims[2]
    )]
    TooThin {
        /// The file.
        file: PathBuf,
        /// Samples along x, y, z.
        dims: [u64; 3],
    },
    /// More bytes than [`OpenOptions::max_bytes`](super::OpenOptions::max_bytes).
    #[error(
        "{file}: {} x {} x {} samples take {needed} bytes as {scalar}, over the memory budget of {budget} bytes. Raise the budget \
         (`OpenOptions::max_bytes`), or crop or downsample the volume", dims[0], dims[1], dims[2]
    )]
    Budget {
        /// The file.
        file: PathBuf,
        /// Samples along x, y, z.
        dims: [u64; 3],
        /// Their type in memory.
        scalar: Scalar,
        /// The bytes that they take there.
        needed: u64,
        /// The bytes that they may take.
        budget: u64,
    },
    /// More samples than fit in memory, or than can be counted.
    #[error(
        "{file}: {} x {} x {} samples do not fit: {limit}. Crop or downsample the volume, or correct \
         the dimensions if they are not the ones you expect", dims[0], dims[1], dims[2]
    )]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// Samples along x, y, z.
        dims: [u64; 3],
        /// The limit that is passed.
        limit: String,
    },
    /// The file ends before its values do.
    #[error(
        "{file}: the values need {need} bytes, but {have}. The file is cut short or its header's sizes \
         and type are not those of the data: copy or export it again, or correct the sizes"
    )]
    Truncated {
        /// The file (for a detached header, the data file).
        file: PathBuf,
        /// Bytes of values that the header promises.
        need: u64,
        /// What there is instead.
        have: String,
    },
    /// Contents that do not decode.
    #[error("{file}: {what}. The file is damaged: copy or export it again")]
    Corrupt {
        /// The file.
        file: PathBuf,
        /// What did not decode.
        what: String,
    },
    /// Spacing, origin or orientation that make no grid.
    #[error("{file}: {what} gives no usable grid: {source}. {remedy}")]
    Grid {
        /// The file.
        file: PathBuf,
        /// Where the numbers come from.
        what: String,
        /// What is wrong with them.
        source: GridError,
        /// What to do.
        remedy: &'static str,
    },
}

impl OpenError {
    pub(super) fn header(file: &Path, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Header { file: file.to_owned(), problem: problem.into(), remedy: remedy.into() }
    }

    pub(super) fn unsupported(file: &Path, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unsupported { file: file.to_owned(), what: what.into(), remedy: remedy.into() }
    }

    pub(super) fn corrupt(file: &Path, what: impl Into<String>) -> Self {
        Self::Corrupt { file: file.to_owned(), what: what.into() }
    }

    pub(super) fn no_memory(file: &Path, dims: [u64; 3]) -> Self {
        let limit = "there is not enough memory for the values".to_owned();
        Self::TooLarge { file: file.to_owned(), dims, limit }
    }

    /// Sorts an error met while reading contents: damage is told apart from the disk's failures.
    pub(super) fn reading(file: &Path, source: io::Error) -> Self {
        match source.kind() {
            io::ErrorKind::UnexpectedEof => Self::corrupt(file, "it ends in the middle of its data"),
            io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput => {
                Self::corrupt(file, format!("the compressed data does not decode ({source})"))
            }
            _ => Self::Read { file: file.to_owned(), source },
        }
    }
}
