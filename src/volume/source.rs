//! What the readers share: opening files, gzip, checked sizes and grids.

use super::OpenOptions;
use super::decode::{Coding, fill};
use super::error::OpenError;
use crate::grid::{Grid, GridError};
use flate2::bufread::MultiGzDecoder;
use glam::{DMat3, DVec3, Vec3};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The most that deflate can shrink: 258 bytes to 2 bits.
const GZIP_MOST: u64 = 1032;

/// An open, ordinary file and its length.
pub(super) struct Source {
    pub path: PathBuf,
    pub reader: BufReader<File>,
    /// Bytes on disk.
    pub len: u64,
    /// Whether the contents start like gzip.
    pub gzip: bool,
}

impl Source {
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let failed = |source| OpenError::Read { file: path.to_owned(), source };
        // Asked before opening: opening a FIFO for reading would wait for a writer.
        let data = std::fs::metadata(path).map_err(failed)?;
        if !data.is_file() {
            return Err(OpenError::NotAFile { file: path.to_owned() });
        }
        let mut file = File::open(path).map_err(failed)?;
        let mut magic = [0; 2];
        let got = fill(&mut file, &mut magic).map_err(failed)?;
        file.seek(SeekFrom::Start(0)).map_err(failed)?;
        let gzip = got == 2 && magic == [0x1f, 0x8b];
        Ok(Self {
            path: path.to_owned(),
            reader: BufReader::with_capacity(1 << 16, file),
            len: data.len(),
            gzip,
        })
    }

    /// The most bytes that can follow `position`: exact for plain data, a bound for gzip.
    pub fn holds(&self, position: u64, gzip: bool) -> u64 {
        let rest = self.len.saturating_sub(position);
        if gzip { rest.saturating_mul(GZIP_MOST) } else { rest }
    }

    /// Refuses sizes that the file cannot hold, before anything is allocated for them.
    pub fn must_hold(&self, need: u64, position: u64, gzip: bool) -> Result<(), OpenError> {
        let most = self.holds(position, gzip);
        if need <= most {
            return Ok(());
        }
        let have = match gzip {
            true => format!("what is left of the compressed file unpacks to at most {most}"),
            false => format!("there are only {most}"),
        };
        Err(OpenError::Truncated { file: self.path.clone(), need, have })
    }

    /// The bytes from the present position on, unpacked where `gzip`.
    pub fn into_stream(self, gzip: bool) -> Box<dyn BufRead> {
        match gzip {
            true => Box::new(BufReader::with_capacity(1 << 16, MultiGzDecoder::new(self.reader))),
            false => Box::new(self.reader),
        }
    }
}

/// Values of `size` bytes to reserve memory for at once, when reading a file of `len` bytes.
pub(super) fn reserve(len: u64, gzip: bool, size: usize) -> u64 {
    // Few volumes pack better than 8:1; what does grows as it comes.
    let bytes = if gzip { len.saturating_mul(8) } else { len };
    bytes / size as u64
}

/// Passes over `count` bytes.
pub(super) fn skip(file: &Path, reader: &mut dyn Read, count: u64, what: &str) -> Result<(), OpenError> {
    let passed =
        io::copy(&mut reader.take(count), &mut io::sink()).map_err(|e| OpenError::reading(file, e))?;
    if passed < count {
        return Err(OpenError::corrupt(file, format!("it ends inside the {count} bytes of {what}")));
    }
    Ok(())
}

/// Looks at what follows the values: verifies the checksum of gzip data and notes leftovers.
pub(super) fn finish(file: &Path, reader: &mut dyn Read, notes: &mut Vec<String>) -> Result<(), OpenError> {
    // Enough to reach the checksum behind ordinary padding without unpacking a bomb.
    const LOOK: u64 = 1 << 16;
    match io::copy(&mut reader.take(LOOK), &mut io::sink()) {
        Ok(0) => Ok(()),
        Ok(n) if n < LOOK => {
            notes.push(format!("{n} bytes after the values are ignored"));
            Ok(())
        }
        Ok(_) => {
            notes.push("more than 64 KiB after the values are ignored".to_owned());
            Ok(())
        }
        // flate2's words for bytes behind the last gzip member that are no further member.
        Err(e) if e.to_string() == "invalid gzip header" => {
            notes.push("bytes after the compressed data are ignored".to_owned());
            Ok(())
        }
        Err(e) => Err(OpenError::reading(file, e)),
    }
}

/// Where samples lie: the centre of sample (0, 0, 0) and the way to the next along each axis.
pub(super) struct Placement {
    pub origin: DVec3,
    pub step: DMat3,
    /// Where the numbers come from, for messages.
    pub what: String,
    pub remedy: &'static str,
}

impl Placement {
    /// The same with other distances between samples. The origin keeps its place in the world. Axes without a direction are the
    /// file's fault and stay.
    fn spaced(&self, spacing: DVec3) -> Self {
        let along = |axis: usize| self.step.col(axis).try_normalize().map(|way| way * spacing[axis]);
        let (Some(x), Some(y), Some(z)) = (along(0), along(1), along(2)) else {
            return Self { what: self.what.clone(), ..*self };
        };
        Self {
            origin: self.origin,
            step: DMat3::from_cols(x, y, z),
            what: "the spacing that was given".to_owned(),
            remedy: "Give finite numbers that are not zero",
        }
    }
}

/// The grid of `dims` samples and the bytes that they take in the file; every size check that needs no look at the data.
pub(super) fn layout(
    file: &Path,
    dims: [u64; 3],
    coding: &Coding,
    place: &Placement,
    options: &OpenOptions,
) -> Result<(Grid, u64), OpenError> {
    if dims.iter().any(|&n| n < 2) {
        return Err(OpenError::TooThin { file: file.to_owned(), dims });
    }
    let too_large = |limit: String| OpenError::TooLarge { file: file.to_owned(), dims, limit };
    // The larger of the two sizes must be countable, so that no product below can overflow.
    let points = dims[0].checked_mul(dims[1]).and_then(|n| n.checked_mul(dims[2]));
    let Some(points) = points.filter(|n| *n <= 1 << 50) else {
        return Err(too_large("that is more than 2^50 samples".to_owned()));
    };
    let scalar = coding.kept();
    let needed = points * scalar.size() as u64;
    if let Some(budget) = options.max_bytes.filter(|most| needed > *most) {
        return Err(OpenError::Budget { file: file.to_owned(), dims, scalar, needed, budget });
    }
    let mut cells = [0; 3];
    for (cells, n) in cells.iter_mut().zip(dims) {
        *cells = u32::try_from(n - 1).map_err(|_| too_large("an axis is longer than 2^32".to_owned()))?;
    }
    let spaced = options.spacing.map(|spacing| place.spaced(Vec3::from(spacing).as_dvec3()));
    let place = spaced.as_ref().unwrap_or(place);
    let refused = |source: GridError| OpenError::Grid {
        file: file.to_owned(),
        what: match source {
            GridError::Cells { .. } => "the number of samples".to_owned(),
            _ => place.what.clone(),
        },
        remedy: match source {
            GridError::Cells { .. } => "Crop or downsample the volume",
            _ => place.remedy,
        },
        source,
    };
    let grid = Grid::new(cells, place.origin.as_vec3(), place.step.as_mat3()).map_err(refused)?;
    Ok((grid, points * coding.scalar.size() as u64))
}
