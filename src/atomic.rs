//! Files that appear whole or not at all: written beside their target, then renamed.
//!
//! Symbolic links are followed, as any program does that opens a file. What is there and no ordinary file,
//! a device or a pipe, is written straight into: a file in its place would be another thing.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Why a file was not written. Nothing is left behind then, and an older file of that name stays.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// The folder the file should go into does not exist.
    #[error("{}: there is no folder {}; create it, or write elsewhere.", path.display(), folder.display())]
    FolderMissing {
        /// The path asked for.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The path is a folder, or what should be its folder is a file.
    #[error("{}: {} is in the way; choose another name.", path.display(), what)]
    InTheWay {
        /// The path asked for.
        path: PathBuf,
        /// What stands where.
        what: String,
    },
    /// The folder may not be written to.
    #[error(
        "{}: no file can be made in the folder {} ({source}); allow writing there, or write elsewhere.",
        path.display(), folder.display()
    )]
    NotWritable {
        /// The path asked for.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The disk or a quota is full, or its file system takes no file of this size.
    #[error("{}: no room for the file ({source}); make room, or write elsewhere.", path.display())]
    Full {
        /// The path asked for.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Writing failed in another way.
    #[error("{}: cannot write: {source}; write elsewhere.", path.display())]
    Io {
        /// The path asked for.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// Where the bytes go.
enum Place {
    /// A new file, or an ordinary one that is replaced.
    File(PathBuf),
    /// A device or a pipe.
    Straight,
}

/// Refuses a path that [`write`] could not write to now. Meant for before long work; leaves nothing behind.
pub(crate) fn check(path: &Path) -> Result<(), TargetError> {
    match place(path)? {
        Place::File(file) => temporary(path, &file).map(drop),
        // Opening a pipe waits for its reader, who would see its end.
        Place::Straight => Ok(()),
    }
}

/// Writes what `work` writes to `path`.
pub(crate) fn write<T>(
    path: &Path,
    work: impl FnOnce(&mut BufWriter<&File>) -> io::Result<T>,
) -> Result<T, TargetError> {
    let failed = |source| failed(path, source);
    let buffered = |file: &File| {
        let mut out = BufWriter::with_capacity(1 << 20, file);
        let done = work(&mut out)?;
        out.flush()?;
        Ok(done)
    };
    match place(path)? {
        Place::Straight => {
            let file = File::options().write(true).open(path).map_err(failed)?;
            buffered(&file).map_err(failed)
        }
        Place::File(target) => {
            let file = temporary(path, &target)?;
            let done = buffered(file.as_file()).map_err(failed)?;
            if let Ok(older) = fs::metadata(&target) {
                // Replacing a file keeps who may read it. Where that is not allowed the new file is as any new one.
                let _ = file.as_file().set_permissions(older.permissions());
            }
            file.persist(&target).map_err(|error| failed(error.error))?;
            Ok(done)
        }
    }
}

/// Why writing what is to be at `path` failed.
pub(crate) fn failed(path: &Path, source: io::Error) -> TargetError {
    match source.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            TargetError::Full { path: path.into(), source }
        }
        _ => TargetError::Io { path: path.into(), source },
    }
}

/// A file without a name on the disk that `path` is to lie on, for what is gathered before `path` can be written. The
/// system frees it whatever becomes of the process.
pub(crate) fn scratch(path: &Path) -> Result<File, TargetError> {
    let made = match place(path)? {
        Place::File(target) => tempfile::tempfile_in(folder_of(&target)),
        Place::Straight => tempfile::tempfile(),
    };
    made.map_err(|source| failed(path, source))
}

/// Follows symbolic links, also to a file that does not exist yet.
fn place(path: &Path) -> Result<Place, TargetError> {
    /// As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let in_the_way = |what: &str| TargetError::InTheWay { path: path.into(), what: what.into() };
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => return Err(in_the_way("a folder of that name")),
        Ok(there) if !there.is_file() => return Ok(Place::Straight),
        _ => {}
    }
    let mut target = PathBuf::from(path);
    for _ in 0..MOST_LINKS {
        match fs::read_link(&target) {
            Ok(to) => target = folder_of(&target).join(to),
            Err(_) => return Ok(Place::File(target)),
        }
    }
    Err(in_the_way("a symbolic link to itself"))
}

/// The folder that `path` lies in.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file beside `target`, removed on drop unless it takes `target`'s name.
fn temporary(path: &Path, target: &Path) -> Result<NamedTempFile, TargetError> {
    let folder = folder_of(target);
    let mut builder = tempfile::Builder::new();
    // Made as any file is: the library's own way makes private files, and names them in its errors.
    let make = |name: &Path| File::options().write(true).create_new(true).open(name);
    builder.prefix(".isoforge-").make_in(folder, make).map_err(|source| {
        let (path, folder) = (PathBuf::from(path), PathBuf::from(folder));
        match source.kind() {
            // /proc says so too, of a file that cannot be made.
            ErrorKind::NotFound if !folder.exists() => TargetError::FolderMissing { path, folder },
            ErrorKind::NotADirectory => {
                TargetError::InTheWay { path, what: format!("the file {}", folder.display()) }
            }
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => TargetError::Full { path, source },
            _ => TargetError::NotWritable { path, folder, source },
        }
    })
}
