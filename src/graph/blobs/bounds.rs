//! Bounds of the sum over a box; twin of `{name}_interval` in `shaders/graph/blobs.wgsl`.
//!
//! Where few cells are concerned, each component's nearest and farthest distance bound its part. Else the
//! sums of peaks in coarse boxes are taken: enough to see that nothing reaches there.

use super::grid::{Grid, peak_level};
use super::kernel::{Blobby, InverseSquare, Kernel, Metaball, Profile, SoftObject};
use super::sum::{From, nearest};
use super::{Blobs, Few, Stored};
use crate::graph::interval::{ALL, Interval};
use multiversion::multiversion;

/// Cells whose components are looked at one by one, at most.
const FEW_CELLS: u32 = 512;
/// Components that are looked at together.
const LANES: usize = 8;
/// 2⁻²⁰: part by which q may be off where a driver contracts.
pub(super) const LESS: f32 = 1.0 - 1.0 / 1_048_576.0;
pub(super) const MORE: f32 = 1.0 + 1.0 / 1_048_576.0;
/// 2⁻²²: what adding another component may put the sum off by, as a part of all magnitudes; and 2⁻¹⁷.
const PER_COMPONENT: f32 = 1.0 / 4_194_304.0;
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
pub(super) struct Sums {
    lo: f32,
    hi: f32,
    /// Of the magnitudes of what was added one by one, and how many these were.
    magnitude: f32,
    count: u32,
    /// Of the magnitudes of peaks.
    coarse: f32,
    /// Components that wait for their turn.
    waiting: [Stored; LANES],
    waits: usize,
}

impl Sums {
    #[inline(always)]
    fn add_run(&mut self, profile: impl Profile, run: &[Stored], low: [f32; 3], high: [f32; 3]) {
        for component in run {
            self.waiting[self.waits] = *component;
            self.waits += 1;
            if self.waits == LANES {
                self.take_waiting(profile, low, high);
            }
        }
    }

    #[inline(always)]
    fn take_waiting(&mut self, profile: impl Profile, low: [f32; 3], high: [f32; 3]) {
        let [mut near, mut far, mut reached] = [[0.0; LANES]; 3];
        for (i, component) in self.waiting.iter().enumerate() {
            let q = nearest(component, low, high, LESS);
            near[i] = component[4] * profile.value(q);
            far[i] = component[4] * profile.value(farthest(component, low, high));
            reached[i] = if q < 1.0 { 1.0 } else { 0.0 };
        }
        // One that does not reach the box adds 0.
        for i in 0..self.waits {
            self.lo += if near[i] < far[i] { near[i] } else { far[i] };
            self.hi += if near[i] < far[i] { far[i] } else { near[i] };
            self.magnitude += near[i].abs();
            self.count += reached[i] as u32;
        }
        self.waits = 0;
    }

    /// Adds a component that reaches the box: its values where it is nearest and farthest.
    #[inline(always)]
    pub fn add(&mut self, near: f32, far: f32) {
        self.lo += if near < far { near } else { far };
        self.hi += if near < far { far } else { near };
        self.magnitude += near.abs();
        self.count += 1;
    }

    pub fn add_peaks(&mut self, grid: &Grid, [first, last]: [[u32; 3]; 2]) {
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

    pub fn interval(self, slack: f32) -> Interval {
        let by = self.magnitude * (self.count as f32 * PER_COMPONENT + AT_LEAST) + self.coarse * slack;
        let (lo, hi) = (self.lo - by, self.hi + by);
        if lo.is_finite() && hi.is_finite() { Interval::new(lo, hi) } else { ALL }
    }
}

/// What rounding may put a sum of all of so many components off by, as a part of the magnitudes.
pub(super) fn slack(components: usize) -> f32 {
    components as f32 * PER_COMPONENT + 1.0 / 1024.0
}

/// Whether the components in a box of cells are too many to be looked at one by one.
#[inline(always)]
pub(super) fn is_coarse([first, last]: [[u32; 3]; 2]) -> bool {
    let [nx, ny, nz] = [0, 1, 2].map(|k| (last[k] - first[k] + 1).min(FEW_CELLS + 1));
    nx * ny > FEW_CELLS || nx * ny * nz > FEW_CELLS
}

/// Corners of a box; `None` if it is unbounded.
#[inline(always)]
pub(super) fn corners(at: [Interval; 3]) -> Option<[[f32; 3]; 2]> {
    at.iter().all(|side| side.is_bounded()).then(|| [at.map(|side| side.lo), at.map(|side| side.hi)])
}

impl Blobs {
    pub(super) fn bounds(&self, at: [Interval; 3]) -> Interval {
        corners(at).map_or(ALL, |[low, high]| bounds(self.kernel, self.from(), low, high, self.slack))
    }
}

impl Few {
    pub(super) fn bounds(&self, at: [Interval; 3]) -> Interval {
        corners(at).map_or(ALL, |[low, high]| bounds(self.kernel, self.from(), low, high, 0.0))
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn bounds(kernel: Kernel, from: From<'_>, low: [f32; 3], high: [f32; 3], slack: f32) -> Interval {
    match kernel {
        Kernel::SoftObject => bounds_of(SoftObject, from, low, high, slack),
        Kernel::Metaball => bounds_of(Metaball, from, low, high, slack),
        Kernel::Blobby { .. } => bounds_of(Blobby(kernel.falloff()), from, low, high, slack),
        Kernel::InverseSquare => bounds_of(InverseSquare, from, low, high, slack),
    }
}

#[inline(always)]
fn bounds_of(profile: impl Profile, from: From<'_>, low: [f32; 3], high: [f32; 3], slack: f32) -> Interval {
    let mut sums = Sums::default();
    match from {
        From::List(components) => sums.add_run(profile, components, low, high),
        From::Grids(grids, components) => {
            for grid in grids {
                let Some(cells) = grid.cells(low, high) else { continue };
                if is_coarse(cells) {
                    // In the order of the grids.
                    sums.take_waiting(profile, low, high);
                    sums.add_peaks(grid, cells);
                } else {
                    for run in grid.runs(cells) {
                        sums.add_run(profile, &components[run], low, high);
                    }
                }
            }
        }
    }
    sums.take_waiting(profile, low, high);
    sums.interval(slack)
}
