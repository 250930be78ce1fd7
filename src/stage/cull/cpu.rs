//! CPU twin of `shaders/cull.wgsl`.

use crate::stage::inside::order_key;
use crate::stage::params::Params;
use multiversion::multiversion;
use rayon::prelude::*;

/// Lowest and highest order key of a brick's samples: empty (low over high) for a brick with no finite
/// sample, the widest for one with finite and other samples.
pub type Range = [u32; 2];

/// Layers of bricks that one task takes, at most: the plane between two layers is read twice, the second
/// time from the cache.
const LAYERS: usize = 8;

/// The table of ranges of all bricks of a volume, and how many samples are NaN or infinite.
pub fn range(params: &Params, values: &[f32]) -> (Vec<Range>, u64) {
    let [_, _, nz] = params.points.map(|n| n as usize);
    let [bx, by, bz] = params.slab_extent.map(|n| n as usize);
    let mut ranges = vec![[u32::MAX, 0]; bx * by * bz];
    let layers = bz.div_ceil(8 * rayon::current_num_threads()).clamp(1, LAYERS);
    let odd = ranges.par_chunks_mut(bx * by * layers).enumerate().map(|(task, ranges)| {
        let mut folds = Folds::new(params);
        let mut odd = 0;
        for (layer, ranges) in ranges.chunks_mut(bx * by).enumerate() {
            let z = 8 * (layer + task * layers);
            folds.fill(params, values, z..(z + 9).min(nz));
            for (brick, range) in ranges.iter_mut().enumerate() {
                let origin = [8 * (brick % bx), 8 * (brick / bx), z];
                *range = match folds.range(params, brick) {
                    Some(range) => range,
                    None => {
                        let [finite, _, owned] = count_odd(params, values, origin);
                        odd += owned as u64;
                        if finite == 0 { [u32::MAX, 0] } else { [0, u32::MAX] }
                    }
                }
            }
        }
        odd
    });
    let odd = odd.sum();
    (ranges, odd)
}

/// For each row of bricks along x of a layer, the folds of all samples with the same x.
struct Folds {
    low: Vec<f32>,
    high: Vec<f32>,
    /// Bits without the sign: NaN and infinities are the largest.
    magnitude: Vec<u32>,
}

impl Folds {
    fn new(params: &Params) -> Self {
        let count = (params.points[0] * params.slab_extent[1]) as usize;
        Self { low: vec![0.0; count], high: vec![0.0; count], magnitude: vec![0; count] }
    }

    /// Folds the rows of the planes `planes`.
    fn fill(&mut self, params: &Params, values: &[f32], planes: std::ops::Range<usize>) {
        self.low.fill(f32::INFINITY);
        self.high.fill(f32::NEG_INFINITY);
        self.magnitude.fill(0);
        let [nx, ny, _] = params.points.map(|n| n as usize);
        for z in planes {
            for first in (0..ny).step_by(8) {
                let rows = first..(first + 9).min(ny);
                let rows = &values[nx * (rows.start + ny * z)..nx * (rows.end + ny * z)];
                let own = nx * (first / 8)..nx * (first / 8 + 1);
                fold_rows(
                    rows,
                    &mut self.low[own.clone()],
                    &mut self.high[own.clone()],
                    &mut self.magnitude[own],
                );
            }
        }
    }

    /// The range of a brick of the layer, if all of its samples are finite.
    #[inline(always)]
    fn range(&self, params: &Params, brick: usize) -> Option<Range> {
        let [nx, bx] = [params.points[0], params.slab_extent[0]].map(|n| n as usize);
        let (x, row) = (8 * (brick % bx), brick / bx);
        let own = nx * row + x..nx * row + nx.min(x + 9);
        if self.magnitude[own.clone()].iter().any(|&m| m >= 0x7f80_0000) {
            return None;
        }
        let low = self.low[own.clone()].iter().fold(f32::INFINITY, |a, &b| a.min(b));
        let high = self.high[own].iter().fold(f32::NEG_INFINITY, |a, &b| a.max(b));
        Some([low, high].map(|v| order_key(v.to_bits())))
    }
}

/// Columns that are folded together.
const COLUMNS: usize = 16;

/// Folds rows, each as long as the folds, into the folds.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
fn fold_rows(rows: &[f32], low: &mut [f32], high: &mut [f32], magnitude: &mut [u32]) {
    let length = low.len();
    let mut first = 0;
    while first + COLUMNS <= length {
        fold_columns::<COLUMNS>(rows, first, low, high, magnitude);
        first += COLUMNS;
    }
    if first < length && length >= COLUMNS {
        // Folding a value twice changes nothing.
        fold_columns::<COLUMNS>(rows, length - COLUMNS, low, high, magnitude);
    } else {
        for column in first..length {
            fold_columns::<1>(rows, column, low, high, magnitude);
        }
    }
}

#[inline(always)]
fn fold_columns<const N: usize>(
    rows: &[f32],
    first: usize,
    low: &mut [f32],
    high: &mut [f32],
    magnitude: &mut [u32],
) {
    let length = low.len();
    let own = first..first + N;
    let (mut lows, mut highs, mut magnitudes) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N], [0; N]);
    for row in rows.chunks_exact(length) {
        for (i, &v) in row[own.clone()].iter().enumerate().take(N) {
            lows[i] = if v < lows[i] { v } else { lows[i] };
            highs[i] = if v > highs[i] { v } else { highs[i] };
            magnitudes[i] = magnitudes[i].max(v.to_bits() & 0x7fff_ffff);
        }
    }
    for (to, v) in low[own.clone()].iter_mut().zip(lows) {
        *to = to.min(v);
    }
    for (to, v) in high[own.clone()].iter_mut().zip(highs) {
        *to = to.max(v);
    }
    for (to, v) in magnitude[own].iter_mut().zip(magnitudes) {
        *to = (*to).max(v);
    }
}

/// The finite and the other samples of a brick, and how many of the others its own points have.
fn count_odd(params: &Params, values: &[f32], origin: [usize; 3]) -> [u32; 3] {
    let [nx, ny, nz] = params.points.map(|n| n as usize);
    let [x, y, z] = origin;
    let mut counts = [0; 3];
    for (dz, z) in (z..nz.min(z + 9)).enumerate() {
        for (dy, y) in (y..ny.min(y + 9)).enumerate() {
            let row = &values[nx * (y + ny * z)..][x..nx.min(x + 9)];
            for (dx, v) in row.iter().enumerate() {
                counts[usize::from(!v.is_finite())] += 1;
                counts[2] += u32::from(!v.is_finite() && dx.max(dy).max(dz) < 8);
            }
        }
    }
    counts
}

/// Whether a brick with this range can have samples on both sides.
pub fn straddles(params: &Params, [low, high]: Range) -> bool {
    let (innermost, outermost) = if params.flip == 0 { (low, high) } else { (!high, !low) };
    low <= high && innermost < params.iso_key && outermost >= params.iso_key
}
