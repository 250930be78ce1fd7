//! Sampled volumes: values on a grid, read from files.
//!
//! [`open`] reads NIfTI-1, TIFF stacks, NRRD and raw files. Samples of 8 and 16 bits keep their type in memory, others
//! become `f32` ([`Values`]); world units, orientation and axis order are those of the file (nothing is flipped between
//! anatomical conventions). A sample's world position is its centre.

mod decode;
mod error;
mod nifti;
mod nrrd;
mod planes;
mod raw;
mod source;
mod tiff;
pub(crate) mod values;

pub use decode::{Endian, ParseEndianError, ParseScalarError, Scalar};
pub use error::OpenError;
pub use planes::Planes;
pub use raw::RawLayout;
pub use values::{Sample, Slice, Values};

use crate::grid::Grid;
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The file endings that [`open`] knows, in lower case.
pub const ENDINGS: &[&str] = &[".nii", ".nii.gz", ".tif", ".tiff", ".nrrd", ".nhdr", ".raw", ".bin"];

/// A sampled volume: one value a grid point, x fastest, in the file's own units.
#[derive(Debug, Clone)]
pub struct Volume {
    grid: Grid,
    values: Values,
    ranges: OnceLock<BrickRanges>,
    /// Which values these are: those of copies are the same.
    id: u64,
}

/// A number that no other has.
fn new_id() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// Lowest and highest order key of each brick's samples, and the samples that are not finite.
pub(crate) type BrickRanges = (Vec<[u32; 2]>, u64);

/// Why values and grid do not make a volume.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{values} values do not fill a grid of {points} points")]
pub struct VolumeSizeError {
    /// Values given.
    pub values: usize,
    /// Points of the grid.
    pub points: u64,
}

impl Volume {
    /// A volume of `values`, one a point of `grid`, x fastest.
    ///
    /// # Errors
    /// [`VolumeSizeError`] if there is not exactly one value a point.
    pub fn new(grid: Grid, values: Vec<f32>) -> Result<Self, VolumeSizeError> {
        Self::of(grid, values.into())
    }

    /// A volume of samples in a type of their own, one a point of `grid`, x fastest. The mesh is that of the same
    /// numbers as `f32`.
    ///
    /// # Errors
    /// [`VolumeSizeError`] if there is not exactly one sample a point.
    pub fn of(grid: Grid, values: Values) -> Result<Self, VolumeSizeError> {
        if values.len() as u64 != grid.point_count() {
            return Err(VolumeSizeError { values: values.len(), points: grid.point_count() });
        }
        Ok(Self::window(grid, values))
    }

    /// The grid that the values lie on: spacing, origin and orientation of the file.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The values, x fastest, then y, then z.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// The values: to change them and make a volume of them again ([`of`](Self::of)), in the same memory.
    pub fn into_values(self) -> Values {
        self.values
    }

    /// Bytes that the values take in memory.
    pub fn bytes(&self) -> u64 {
        self.values.bytes().len() as u64
    }

    /// The values of a part of a larger grid, for a run that knows which; there may be any number of them.
    pub(crate) fn window(grid: Grid, values: Values) -> Self {
        Self { grid, values, ranges: OnceLock::new(), id: new_id() }
    }

    pub(crate) fn id(&self) -> u64 {
        self.id
    }

    pub(crate) fn values_mut(&mut self) -> &mut Values {
        self.id = new_id();
        &mut self.values
    }

    /// The table that the CPU's cull stage reads, built by `build` on the first call, and by others that come meanwhile: `build`
    /// waits for rayon's threads, which may begin another extraction of this volume on the very thread that would hold a lock.
    pub(crate) fn ranges(&self, build: impl FnOnce(&Values) -> BrickRanges) -> &BrickRanges {
        if let Some(ranges) = self.ranges.get() {
            return ranges;
        }
        let ranges = build(&self.values);
        self.ranges.get_or_init(|| ranges)
    }

    /// The lowest and the highest finite value; `None` if no value is finite.
    pub fn finite_range(&self) -> Option<(f32, f32)> {
        self.values.finite_range()
    }

    /// How many values are NaN or infinite.
    pub fn non_finite_count(&self) -> u64 {
        self.values.non_finite_count()
    }
}

/// How to open a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OpenOptions {
    /// The layout of a `.raw` or `.bin` file, or of one with an ending that is none of [`ENDINGS`]; the formats of the others say
    /// it themselves and ignore this.
    pub raw: Option<RawLayout>,
    /// Way from a sample to the next along each of the file's axes, in world units, in place of what the file (or the layout)
    /// says; directions and the position of the first sample stay.
    pub spacing: Option<[f32; 3]>,
    /// Refuse a volume whose values take more than this many bytes in memory; `None` for no limit.
    pub max_bytes: Option<u64>,
}

/// A volume and what its user should know about how it was read.
#[derive(Debug, Clone)]
pub struct Opened {
    /// The volume.
    pub volume: Volume,
    /// Remarks, one line each, empty for most files: what was left out, rounded or assumed.
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, Copy)]
enum Format {
    Nifti,
    Tiff,
    Nrrd,
    Raw,
}

/// Whether `path` ends as files do whose layout the user must tell.
pub fn is_raw_ending(path: &Path) -> bool {
    matches!(format_of(path), Some(Format::Raw))
}

/// The format of a file by its ending; of other files, raw where the layout is given.
fn format(path: &Path, options: &OpenOptions) -> Result<Format, OpenError> {
    let raw = options.raw.as_ref().map(|_| Format::Raw);
    format_of(path).or(raw).ok_or_else(|| OpenError::Ending { file: path.to_owned() })
}

fn format_of(path: &Path) -> Option<Format> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
    if ends(&[".nii", ".nii.gz"]) {
        Some(Format::Nifti)
    } else if ends(&[".tif", ".tiff"]) {
        Some(Format::Tiff)
    } else if ends(&[".nrrd", ".nhdr"]) {
        Some(Format::Nrrd)
    } else if ends(&[".raw", ".bin"]) {
        Some(Format::Raw)
    } else {
        None
    }
}

/// Whether the path ends like a volume file, in either case: one of [`ENDINGS`].
pub fn is_volume_ending(path: &Path) -> bool {
    format_of(path).is_some()
}

/// Reads a volume; the format is told by the file's ending (one of [`ENDINGS`], in either case), or is that of
/// [`OpenOptions::raw`] for any other ending.
///
/// Values of 8 and 16 bits that the file does not scale keep their type. Others are scaled as the file says, worked out
/// in `f64`, and rounded to `f32`. Memory is taken for what the file holds, never for what a header merely promises.
///
/// # Errors
/// [`OpenError`] for a file that can't be read, is cut short or damaged, contradicts itself, uses
/// what its reader does not take, or has fewer than 2 samples along an axis.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Opened, OpenError> {
    match format(path, options)? {
        Format::Nifti => nifti::read(path, options),
        Format::Tiff => tiff::read(path, options),
        Format::Nrrd => nrrd::read(path, options),
        Format::Raw => raw::read(path, options),
    }
}

/// Puts a reader's results together.
fn opened(path: &Path, grid: Grid, values: Values, notes: Vec<String>) -> Result<Opened, OpenError> {
    let volume = Volume::of(grid, values).map_err(|e| OpenError::corrupt(path, e.to_string()))?;
    Ok(Opened { volume, notes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn values_and_back_in_the_same_memory() {
        let grid = Grid::from_bounds([1; 3], Vec3::ZERO, Vec3::ONE).unwrap();
        let samples = vec![1.5f32; 8];
        let place = samples.as_ptr();
        let volume = Volume::new(grid, samples).unwrap();
        let id = volume.id();
        volume.ranges(|_| (vec![[1, 2]], 0));
        let Values::F32(mut samples) = volume.into_values() else { panic!("of another type") };
        assert_eq!(samples.as_ptr(), place);
        samples[0] = 2.5;
        let volume = Volume::new(grid, samples).unwrap();
        assert!(volume.id() != id && volume.values().get(0) == 2.5);
        assert_eq!(volume.ranges(|_| (vec![[3, 4]], 0)).0, [[3, 4]]);
    }
}
