//! Bounds of the sum over a box; twin of `{name}_interval` in `shaders/graph/blobs.wgsl`.
//!
//! Where few cells are concerned, each component's nearest and farthest distance bound its part. Else the
//! sums of peaks in coarse boxes are taken: enough to see that nothing reaches there.

use super::grid::{Grid, peak_level};
use super::sum::nearest;
use super::{Blobs, Few, Stored};
use crate::graph::interval::{ALL, Interval};

/// Cells whose components are looked at one by one, at most.
const FEW_CELLS: u32 = 512;
/// 2⁻²⁰: part by which q may be off where a driver contracts.
const LESS: f32 = 1.0 - 1.0 / 1_048_576.0;
const MORE: f32 = 1.0 + 1.0 / 1_048_576.0;
/// 2⁻²²: what adding another component may put the sum off by, as a part of all magnitudes; and 2⁻¹⁷.
pub(super) const PER_COMPONENT: f32 = 1.0 / 4_194_304.0;
const AT_LEAST: f32 = 1.0 / 131_072.0;

/// The square of the largest distance, in radii, of a component from a point of the box, and a little more.
#[inline(always)]
fn farthest(component: &Stored, low: [f32; 3], high: [f32; 3]) -> f32 {
    let away = |k: usize| {
        let (above, below) = (high[k] - component[k], component[k] - low[k]);
        if above > below { above } else { below }
    };
    let [dx, dy, dz] = [away(0), away(1), away(2)];
    ((dx * dx + dy * dy + dz * dz) * MORE) * component[3]
}

/// Bounds as they grow, part by part.
#[derive(Default)]
struct Sums {
    lo: f32,
    hi: f32,
    /// Of the magnitudes of what was added one by one, and how many these were.
    magnitude: f32,
    count: u32,
    /// Of the magnitudes of peaks.
    coarse: f32,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, value: impl Fn(f32) -> f32, component: &Stored, low: [f32; 3], high: [f32; 3]) {
        let q = nearest(component, low, high, LESS);
        if q >= 1.0 {
            return;
        }
        let near = component[4] * value(q);
        let far = component[4] * value(farthest(component, low, high));
        self.lo += if near < far { near } else { far };
        self.hi += if near < far { far } else { near };
        self.magnitude += near.abs();
        self.count += 1;
    }

    fn add_peaks(&mut self, grid: &Grid, [first, last]: [[u32; 3]; 2]) {
        let mut level = 0;
        while (0..3).any(|k| (last[k] >> (level + 1)) - (first[k] >> (level + 1)) > 3) {
            level += 1;
        }
        let (boxes, before) = peak_level(grid.dims, level);
        let [first, last] = [first, last].map(|place| place.map(|n| n >> (level + 1)));
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    let [negative, positive] =
                        grid.peaks[before + (x + boxes[0] * (y + boxes[1] * z)) as usize];
                    self.lo += negative;
                    self.hi += positive;
                    self.coarse += positive - negative;
                }
            }
        }
    }

    fn interval(self, slack: f32) -> Interval {
        let by = self.magnitude * (self.count as f32 * PER_COMPONENT + AT_LEAST) + self.coarse * slack;
        let (lo, hi) = (self.lo - by, self.hi + by);
        if lo.is_finite() && hi.is_finite() { Interval::new(lo, hi) } else { ALL }
    }
}

/// Corners of a box; `None` if it is unbounded.
#[inline(always)]
pub(super) fn corners(at: [Interval; 3]) -> Option<[[f32; 3]; 2]> {
    at.iter().all(|side| side.is_bounded()).then(|| [at.map(|side| side.lo), at.map(|side| side.hi)])
}

impl Blobs {
    pub(super) fn bounds(&self, at: [Interval; 3]) -> Interval {
        let Some([low, high]) = corners(at) else { return ALL };
        let mut sums = Sums::default();
        for grid in &self.grids {
            let Some([first, last]) = grid.cells(low, high) else { continue };
            let [nx, ny, nz] = [0, 1, 2].map(|k| (last[k] - first[k] + 1).min(FEW_CELLS + 1));
            if nx * ny > FEW_CELLS || nx * ny * nz > FEW_CELLS {
                sums.add_peaks(grid, [first, last]);
            } else {
                for component in grid.runs([first, last]).flat_map(|run| &self.components[run]) {
                    sums.add(|q| self.kernel.value(q), component, low, high);
                }
            }
        }
        sums.interval(self.slack)
    }
}

impl Few {
    pub(super) fn bounds(&self, at: [Interval; 3]) -> Interval {
        let Some([low, high]) = corners(at) else { return ALL };
        let mut sums = Sums::default();
        for component in &self.components {
            sums.add(|q| self.kernel.value(q), component, low, high);
        }
        sums.interval(0.0)
    }
}
