//! CPU twin of `shaders/cull.wgsl`.

use crate::stage::inside::order_key;
use crate::stage::params::Params;
use crate::stage::samples::load_line;
use crate::volume::values::each_type;
use crate::volume::{Sample, Values};
use multiversion::multiversion;
use rayon::prelude::*;

/// Lowest and highest order key of a brick's samples: empty (low over high) for a brick with no finite
/// sample, the widest for one with finite and other samples.
pub type Range = [u32; 2];

/// Layers of bricks that one task takes, at most.
const LAYERS: usize = 8;

/// Bytes of samples that are read at once: they stay in the processor's cache until their bricks are done.
const AT_ONCE: usize = 1 << 19;

/// The table of ranges of all bricks of a volume, or of the layers of bricks that `params` names, of which `values`
/// holds the box. And how many samples are NaN or infinite.
pub fn range(params: &Params, values: &Values) -> (Vec<Range>, u64) {
    let (ranges, odd, _) = range_and(params, values, |(), _, _| {});
    (ranges, odd)
}

/// As [`range`]. `then` hears of each few rows of bricks along x while their samples, which have just been read, are in the processor's
/// cache: the number of their first brick, and their ranges. What it makes of the first argument is returned, in the order of the bricks.
pub fn range_and<W: Default + Send>(
    params: &Params,
    values: &Values,
    then: impl Fn(&mut W, u32, &[Range]) + Sync,
) -> (Vec<Range>, u64, Vec<W>) {
    each_type!(Values, values, samples => range_of(params, samples, then))
}

fn range_of<T: Sample, W: Default + Send>(
    params: &Params,
    values: &[T],
    then: impl Fn(&mut W, u32, &[Range]) + Sync,
) -> (Vec<Range>, u64, Vec<W>) {
    let [bx, by, bz] = params.slab_extent.map(|n| n as usize);
    let rows = (AT_ONCE / (72 * params.points[0] as usize * size_of::<T>())).clamp(1, by);
    let blocks = by.div_ceil(rows);
    let layers = (bz * blocks).div_ceil(8 * rayon::current_num_threads()).clamp(1, LAYERS);
    // A task has a few rows of some layers, one layer after another: the plane between two is read twice, the second time from the cache.
    let tasks = (0..bz.div_ceil(layers) * blocks).into_par_iter().map(|task| {
        let first = task % blocks * rows;
        let mut folds = Folds::<T>::new(params, rows);
        let layers = (task / blocks * layers..bz).take(layers).map(|layer| {
            let mut ranges = vec![[u32::MAX, 0]; bx * rows.min(by - first)];
            let odd = folds.ranges(params, values, [first, layer], &mut ranges);
            let mut work = W::default();
            then(&mut work, (bx * (first + by * layer)) as u32, &ranges);
            (ranges, odd, work)
        });
        layers.collect::<Vec<_>>().into_iter()
    });
    let mut tasks: Vec<_> = tasks.collect();
    let (mut table, mut all_odd, mut works) = (Vec::with_capacity(bx * by * bz), 0, Vec::new());
    for layer in 0..bz {
        for task in &mut tasks[layer / layers * blocks..][..blocks] {
            let Some((ranges, odd, work)) = task.next() else { continue };
            table.extend(ranges);
            all_odd += odd;
            works.push(work);
        }
    }
    (table, all_odd, works)
}

/// The planes of a layer of bricks, counted from the first that the values hold.
fn planes(params: &Params, layer: usize) -> std::ops::Range<usize> {
    let (first, end) = (8 * layer, (8 * layer + 9).min(params.points[2] as usize));
    let lowest = params.source_first[2] as usize;
    first - lowest..end - lowest
}

/// For each of a few rows of bricks along x, the folds of all samples with the same x.
struct Folds<T> {
    low: Vec<T>,
    high: Vec<T>,
    /// Bits without the sign: NaN and infinities are the largest. Not kept where there are none.
    magnitude: Vec<u32>,
}

impl<T: Sample> Folds<T> {
    fn new(params: &Params, rows: usize) -> Self {
        let count = params.points[0] as usize * rows;
        Self { low: vec![T::HIGHEST; count], high: vec![T::LOWEST; count], magnitude: vec![0; count] }
    }

    /// The ranges of a few rows of bricks of a layer, from row `first` on, and how many of their samples are NaN or infinite.
    fn ranges(
        &mut self,
        params: &Params,
        values: &[T],
        [first, layer]: [usize; 2],
        ranges: &mut [Range],
    ) -> u64 {
        let bx = params.slab_extent[0] as usize;
        let planes = planes(params, params.slab_first[2] as usize + layer);
        self.fill(params, values, first..first + ranges.len() / bx, planes.clone());
        let mut odd = 0;
        for (i, range) in ranges.iter_mut().enumerate() {
            *range = self.range(params, [i % bx, i / bx]).unwrap_or_else(|| {
                let origin = [8 * (i % bx), 8 * (first + i / bx)];
                let [finite, _, owned] = count_odd(params, values, origin, planes.clone());
                odd += u64::from(owned);
                if finite == 0 { [u32::MAX, 0] } else { [0, u32::MAX] }
            });
        }
        odd
    }

    /// Folds some planes of some rows of bricks.
    fn fill(
        &mut self,
        params: &Params,
        values: &[T],
        rows: std::ops::Range<usize>,
        planes: std::ops::Range<usize>,
    ) {
        self.low.fill(T::HIGHEST);
        self.high.fill(T::LOWEST);
        self.magnitude.fill(0);
        let [nx, ny, _] = params.points.map(|n| n as usize);
        for z in planes {
            for (row, first) in rows.clone().map(|row| 8 * row).enumerate() {
                let samples = &values[nx * (first + ny * z)..nx * ((first + 9).min(ny) + ny * z)];
                let own = nx * row..nx * (row + 1);
                // Where those lie that come next: the next row of bricks, or the first one in the next plane.
                let next = if row + 1 < rows.len() { 8 * nx } else { nx * (ny - 8 * row) };
                fold_rows(
                    samples,
                    next,
                    &mut self.low[own.clone()],
                    &mut self.high[own.clone()],
                    &mut self.magnitude[own],
                );
            }
        }
    }

    /// The range of brick x of a row of them, if all of its samples are finite.
    #[inline(always)]
    fn range(&self, params: &Params, [brick, row]: [usize; 2]) -> Option<Range> {
        let nx = params.points[0] as usize;
        let own = nx * row + 8 * brick..nx * row + nx.min(8 * brick + 9);
        if self.magnitude[own.clone()].iter().any(|&m| m >= 0x7f80_0000) {
            return None;
        }
        let low = self.low[own.clone()].iter().fold(T::HIGHEST, |a, &b| lower(a, b));
        let high = self.high[own].iter().fold(T::LOWEST, |a, &b| higher(a, b));
        Some([low, high].map(|v| order_key(v.to_f32().to_bits())))
    }
}

/// The lower; of NaN and a number the number, where the number is the second.
#[inline(always)]
fn lower<T: Sample>(v: T, so_far: T) -> T {
    if v < so_far { v } else { so_far }
}

/// The higher; of NaN and a number the number, where the number is the second.
#[inline(always)]
fn higher<T: Sample>(v: T, so_far: T) -> T {
    if v > so_far { v } else { so_far }
}

/// Bytes of a line of the cache.
const LINE: usize = 64;

/// Columns that are folded together.
const COLUMNS: usize = 16;

/// Folds rows, each as long as the folds, into the folds, and meanwhile asks for what lies `next` samples behind: nine rows at once are a
/// pattern that processors do not foresee.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
fn fold_rows<T: Sample>(rows: &[T], next: usize, low: &mut [T], high: &mut [T], magnitude: &mut [u32]) {
    let length = low.len();
    let mut first = 0;
    while first + COLUMNS <= length {
        if first.is_multiple_of(LINE / size_of::<T>()) {
            for row in rows.chunks_exact(length) {
                load_line(row[first..].as_ptr().wrapping_add(next));
            }
        }
        fold_columns::<T, COLUMNS>(rows, first, low, high, magnitude);
        first += COLUMNS;
    }
    if first < length && length >= COLUMNS {
        // Folding a value twice changes nothing.
        fold_columns::<T, COLUMNS>(rows, length - COLUMNS, low, high, magnitude);
    } else {
        for column in first..length {
            fold_columns::<T, 1>(rows, column, low, high, magnitude);
        }
    }
}

#[inline(always)]
fn fold_columns<T: Sample, const N: usize>(
    rows: &[T],
    first: usize,
    low: &mut [T],
    high: &mut [T],
    magnitude: &mut [u32],
) {
    let length = low.len();
    let own = first..first + N;
    // Whole arrays are taken out and put back: a store that depends on a comparison becomes a masked one, which some
    // processors take twenty times as long for.
    let (mut lows, mut highs, mut magnitudes) = ([T::HIGHEST; N], [T::LOWEST; N], [0; N]);
    lows.copy_from_slice(&low[own.clone()]);
    highs.copy_from_slice(&high[own.clone()]);
    magnitudes.copy_from_slice(&magnitude[own.clone()]);
    for row in rows.chunks_exact(length) {
        for (i, &v) in row[own.clone()].iter().enumerate().take(N) {
            lows[i] = lower(v, lows[i]);
            highs[i] = higher(v, highs[i]);
            if !T::ALWAYS_FINITE {
                magnitudes[i] = magnitudes[i].max(v.to_f32().to_bits() & 0x7fff_ffff);
            }
        }
    }
    low[own.clone()].copy_from_slice(&lows);
    high[own.clone()].copy_from_slice(&highs);
    magnitude[own].copy_from_slice(&magnitudes);
}

/// The finite and the other samples of a brick, and how many of the others its own points have.
fn count_odd<T: Sample>(
    params: &Params,
    values: &[T],
    origin: [usize; 2],
    planes: std::ops::Range<usize>,
) -> [u32; 3] {
    let [nx, ny, _] = params.points.map(|n| n as usize);
    let [x, y] = origin;
    let mut counts = [0; 3];
    for (dz, z) in planes.enumerate() {
        for (dy, y) in (y..ny.min(y + 9)).enumerate() {
            let row = &values[nx * (y + ny * z)..][x..nx.min(x + 9)];
            for (dx, v) in row.iter().enumerate() {
                let is_odd = !v.to_f32().is_finite();
                counts[usize::from(is_odd)] += 1;
                counts[2] += u32::from(is_odd && dx.max(dy).max(dz) < 8);
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
