//! Sums of components at points: values and gradients.

use super::grid::Grid;
use super::kernel::{Blobby, InverseSquare, Kernel, Metaball, Profile, SoftObject};
use super::{Blobs, Few, Stored};
use crate::field::Points;
use crate::graph::leaf::DualSlices;
use multiversion::multiversion;

/// Points that are looked at together.
const CHUNK: usize = 64;
/// Points whose sums are kept in registers.
const LANES: usize = 16;
/// Components that are gathered before they are summed.
const BATCH: usize = 256;
/// Cells above which points are looked at apart.
const MOST_CELLS: u32 = 512;

/// Where the components come from.
#[derive(Clone, Copy)]
pub(super) enum From<'a> {
    Grids(&'a [Grid], &'a [Stored]),
    List(&'a [Stored]),
}

impl Blobs {
    fn from(&self) -> From<'_> {
        From::Grids(&self.grids, &self.components)
    }

    pub(super) fn sum_values(&self, at: Points<'_>, out: &mut [f32]) {
        values(self.kernel, self.from(), at, out);
    }

    pub(super) fn sum_gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        gradients(self.kernel, self.from(), at, out);
    }
}

impl Few {
    pub(super) fn sum_values(&self, at: Points<'_>, out: &mut [f32]) {
        values(self.kernel, From::List(&self.components), at, out);
    }

    pub(super) fn sum_gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        gradients(self.kernel, From::List(&self.components), at, out);
    }
}

/// The square of the distance, in radii, of a component from a box, times `part`. For each point of the box the
/// same operations give at least this: rounding keeps the order.
#[inline(always)]
pub(super) fn nearest(component: &Stored, low: [f32; 3], high: [f32; 3], part: f32) -> f32 {
    let away = |k: usize| {
        let (below, above) = (low[k] - component[k], component[k] - high[k]);
        let d = if below > above { below } else { above };
        if d > 0.0 { d } else { 0.0 }
    };
    let [dx, dy, dz] = [away(0), away(1), away(2)];
    ((dx * dx + dy * dy + dz * dz) * part) * component[3]
}

/// The points of a chunk, filled up with its last.
struct Chunk {
    at: [[f32; CHUNK]; 3],
    count: usize,
    low: [f32; 3],
    high: [f32; 3],
}

impl Chunk {
    #[inline(always)]
    fn new(points: Points<'_>, range: std::ops::Range<usize>) -> Self {
        let count = range.len();
        let mut chunk =
            Self { at: [[0.0; CHUNK]; 3], count, low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };
        for (k, axis) in [points.x, points.y, points.z].into_iter().enumerate() {
            let axis = &axis[range.clone()];
            chunk.at[k][..count].copy_from_slice(axis);
            chunk.at[k][count..].fill(axis.last().copied().unwrap_or(0.0));
            let mut lows = [f32::INFINITY; LANES];
            let mut highs = [f32::NEG_INFINITY; LANES];
            for lanes in chunk.at[k].chunks_exact(LANES) {
                for i in 0..LANES {
                    // NaN, which nothing reaches, is passed over.
                    lows[i] = if lanes[i] < lows[i] { lanes[i] } else { lows[i] };
                    highs[i] = if lanes[i] > highs[i] { lanes[i] } else { highs[i] };
                }
            }
            chunk.low[k] = lows.iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a });
            chunk.high[k] = highs.iter().fold(f32::NEG_INFINITY, |a, &b| if b > a { b } else { a });
        }
        chunk
    }

    /// Whether the points lie so far apart that they are better looked at in two parts.
    #[inline(always)]
    fn is_wide(&self, from: From<'_>) -> bool {
        let From::Grids(grids, _) = from else { return false };
        self.count > 1
            && grids.iter().any(|grid| {
                grid.cells(self.low, self.high).is_some_and(|[first, last]| {
                    let sides = [0, 1, 2].map(|k| last[k] - first[k] + 1);
                    // No product of three passes 64 bits.
                    sides.iter().map(|&n| u64::from(n)).product::<u64>() > u64::from(MOST_CELLS)
                })
            })
    }

    /// Hands on the components that reach the points' box, in order, some at a time.
    #[inline(always)]
    fn gather(&self, from: From<'_>, mut take: impl FnMut(&[Stored])) {
        let mut batch = [[0.0; 5]; BATCH];
        let mut held = 0;
        let mut look = |run: &[Stored]| {
            for component in run {
                batch[held] = *component;
                held += usize::from(nearest(component, self.low, self.high, 1.0) < 1.0);
                if held == BATCH {
                    take(&batch);
                    held = 0;
                }
            }
        };
        match from {
            From::List(components) => look(components),
            From::Grids(grids, components) => {
                for grid in grids {
                    if let Some(cells) = grid.cells(self.low, self.high) {
                        grid.runs(cells).for_each(|run| look(&components[run]));
                    }
                }
            }
        }
        take(&batch[..held]);
    }
}

/// Parts of all points that lie close enough together.
#[inline(always)]
fn each_chunk(from: From<'_>, points: Points<'_>, mut take: impl FnMut(Chunk, std::ops::Range<usize>)) {
    for first in (0..points.x.len()).step_by(CHUNK) {
        // Halves of halves: as many as it takes to single points.
        let mut open = [0..0, 0..0, 0..0, 0..0, 0..0, 0..0, 0..0, 0..0];
        open[0] = first..(first + CHUNK).min(points.x.len());
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let range = open[depth].clone();
            let chunk = Chunk::new(points, range.clone());
            if chunk.is_wide(from) {
                let middle = range.start + range.len() / 2;
                open[depth] = middle..range.end;
                open[depth + 1] = range.start..middle;
                depth += 2;
            } else {
                take(chunk, range);
            }
        }
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn values(kernel: Kernel, from: From<'_>, at: Points<'_>, out: &mut [f32]) {
    match kernel {
        Kernel::SoftObject => values_of(SoftObject, from, at, out),
        Kernel::Metaball => values_of(Metaball, from, at, out),
        Kernel::Blobby { .. } => values_of(Blobby(kernel.falloff()), from, at, out),
        Kernel::InverseSquare => values_of(InverseSquare, from, at, out),
    }
}

#[inline(always)]
fn values_of(profile: impl Profile, from: From<'_>, at: Points<'_>, out: &mut [f32]) {
    each_chunk(from, at, |chunk, range| {
        let mut sums = [0.0; CHUNK];
        chunk.gather(from, |components| {
            let [x, y, z] = &chunk.at;
            for first in (0..chunk.count).step_by(LANES) {
                let own = first..first + LANES;
                add(profile, components, [&x[own.clone()], &y[own.clone()], &z[own.clone()]], &mut sums[own]);
            }
        });
        out[range].copy_from_slice(&sums[..chunk.count]);
    });
}

#[inline(always)]
fn add(profile: impl Profile, components: &[Stored], at: [&[f32]; 3], sums: &mut [f32]) {
    let mut lanes = [[0.0; LANES]; 4];
    for (to, from) in lanes.iter_mut().zip([at[0], at[1], at[2], sums]) {
        to.copy_from_slice(&from[..LANES]);
    }
    let [x, y, z, mut sum] = lanes;
    for &[cx, cy, cz, inverse_square, weight] in components {
        for i in 0..LANES {
            let (dx, dy, dz) = (x[i] - cx, y[i] - cy, z[i] - cz);
            let q = (dx * dx + dy * dy + dz * dz) * inverse_square;
            sum[i] += weight * profile.value(q);
        }
    }
    sums.copy_from_slice(&sum);
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn gradients(kernel: Kernel, from: From<'_>, at: Points<'_>, out: DualSlices<'_>) {
    match kernel {
        Kernel::SoftObject => gradients_of(SoftObject, from, at, out),
        Kernel::Metaball => gradients_of(Metaball, from, at, out),
        Kernel::Blobby { .. } => gradients_of(Blobby(kernel.falloff()), from, at, out),
        Kernel::InverseSquare => gradients_of(InverseSquare, from, at, out),
    }
}

#[inline(always)]
fn gradients_of(profile: impl Profile, from: From<'_>, at: Points<'_>, out: DualSlices<'_>) {
    let DualSlices { value, derivatives: [by_x, by_y, by_z] } = out;
    each_chunk(from, at, |chunk, range| {
        let mut sums = [[0.0; CHUNK]; 4];
        chunk.gather(from, |components| {
            for first in (0..chunk.count).step_by(LANES) {
                add_gradients(profile, components, &chunk.at, first, &mut sums);
            }
        });
        for (out, sum) in [&mut *value, &mut *by_x, &mut *by_y, &mut *by_z].into_iter().zip(&sums) {
            out[range.clone()].copy_from_slice(&sum[..chunk.count]);
        }
    });
}

#[inline(always)]
fn add_gradients(
    profile: impl Profile,
    components: &[Stored],
    at: &[[f32; CHUNK]; 3],
    first: usize,
    sums: &mut [[f32; CHUNK]; 4],
) {
    let mut lanes = [[0.0; LANES]; 7];
    for (to, from) in lanes.iter_mut().zip(at.iter().chain(&*sums)) {
        to.copy_from_slice(&from[first..first + LANES]);
    }
    let [x, y, z, mut sum, mut by_x, mut by_y, mut by_z] = lanes;
    for &[cx, cy, cz, inverse_square, weight] in components {
        let twice = inverse_square + inverse_square;
        for i in 0..LANES {
            let (dx, dy, dz) = (x[i] - cx, y[i] - cy, z[i] - cz);
            let q = (dx * dx + dy * dy + dz * dz) * inverse_square;
            sum[i] += weight * profile.value(q);
            // An infinite distance has no direction.
            let slope = if q < 1.0 { (weight * profile.slope(q)) * twice } else { 0.0 };
            let [dx, dy, dz] = [dx, dy, dz].map(|d| if q < 1.0 { d } else { 0.0 });
            by_x[i] += slope * dx;
            by_y[i] += slope * dy;
            by_z[i] += slope * dz;
        }
    }
    for (to, from) in sums.iter_mut().zip([sum, by_x, by_y, by_z]) {
        to[first..first + LANES].copy_from_slice(&from);
    }
}
