//! Sampled volumes: values on a grid, read from files.

use crate::grid::Grid;
use std::sync::OnceLock;

/// A sampled volume: one value a grid point, x fastest, in the file's own units.
#[derive(Debug, Clone)]
pub struct Volume {
    grid: Grid,
    values: Vec<f32>,
    ranges: OnceLock<BrickRanges>,
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
        if values.len() as u64 != grid.point_count() {
            return Err(VolumeSizeError { values: values.len(), points: grid.point_count() });
        }
        Ok(Self { grid, values, ranges: OnceLock::new() })
    }

    /// The grid that the values lie on: spacing, origin and orientation of the file.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The values, x fastest, then y, then z.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The table that the CPU's cull stage reads, built by `build` on the first call.
    pub(crate) fn ranges(&self, build: impl FnOnce(&[f32]) -> BrickRanges) -> &BrickRanges {
        self.ranges.get_or_init(|| build(&self.values))
    }
}
