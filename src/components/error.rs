//! Why a file of components was refused.

use super::ENDINGS;
use std::io;
use std::path::PathBuf;

/// Why [`open`](super::open) refused a file. Every message names the file, the row where there is one
/// (its line, from 1), the thing that is wrong and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The operating system did not hand over the file.
    #[error("{path}: cannot be read: {source}. Check that the path is right and that you may read it")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The path is a directory, a device or something else that holds no file contents.
    #[error("{path}: is not an ordinary file. Give the path of a file of components")]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// The file's ending belongs to no known format.
    #[error("{path}: the ending names no format of components. Known endings: {}", ENDINGS.join(", "))]
    Ending {
        /// The file.
        path: PathBuf,
    },
    /// A number that is none, or none that fits its column.
    #[error("{path}, {record} {number}, column {column}: {found:?} {problem}. Correct it or leave it out")]
    Value {
        /// The file.
        path: PathBuf,
        /// What is counted: `row` in text, `vertex` in binary files.
        record: &'static str,
        /// The row or vertex, from 1.
        number: u64,
        /// The column.
        column: String,
        /// The text found there, cut where it is long.
        found: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// An atom without a known radius.
    #[error(
        "{path}, row {row}: {element:?} is no element with a known van der Waals radius. Correct the \
         symbol, leave the atom out, or give positions and radii as .csv"
    )]
    Element {
        /// The file.
        path: PathBuf,
        /// The row, from 1.
        row: u64,
        /// What stands for the element.
        element: String,
    },
    /// A row, a header or a count that contradicts the format.
    #[error("{path}{}: {problem}. {remedy}", row.map_or(String::new(), |row| format!(", row {row}")))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The row, from 1, where there is one.
        row: Option<u64>,
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A file without radii, and [`OpenOptions::radius`](super::OpenOptions::radius) is none either.
    #[error("{path}: has no radii, and {radius} cannot be used for them. Give a radius above 0")]
    Radius {
        /// The file.
        path: PathBuf,
        /// The radius of the options.
        radius: f32,
    },
    /// More components than [`OpenOptions::max_bytes`](super::OpenOptions::max_bytes) allow.
    #[error(
        "{path}: its components take {bytes} bytes or more, and {limit} are allowed. Raise the limit or \
         thin the components out"
    )]
    TooMany {
        /// The file.
        path: PathBuf,
        /// Bytes that they take at least.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// More components than there is memory for.
    #[error("{path}: there is no memory for {bytes} bytes of components. Thin the components out")]
    Memory {
        /// The file.
        path: PathBuf,
        /// Bytes asked for.
        bytes: u64,
    },
    /// A sound file with nothing in it.
    #[error("{path}: holds no component{why}. {remedy}")]
    Empty {
        /// The file.
        path: PathBuf,
        /// Why not, where there was something; begins with a colon.
        why: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Compressed contents that do not unpack.
    #[error("{path}: {what}. The file is damaged: copy or export it again")]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// What did not unpack.
        what: String,
    },
}
