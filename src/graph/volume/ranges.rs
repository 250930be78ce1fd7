//! Lowest and highest samples of blocks, and bounds from them.

use super::VolumeLeaf;
use crate::graph::interval::{ALL, Interval};
use crate::volume::values::each_type;
use crate::volume::{Sample, Values};
use rayon::prelude::*;

/// Cells along the edge of the lowest blocks, as a power of two.
const BLOCK: u32 = 2;
/// Samples beyond this are bounded by nothing: their differences may overflow.
const LARGEST: f32 = 1e38;
/// 2⁻²⁰: by this part of the largest magnitude interpolation may pass over its samples.
const STEP: f32 = 1.0 / 1_048_576.0;

impl VolumeLeaf {
    /// Bounds over the cells from `first` to `last`.
    pub(super) fn bounds(&self, [first, last]: [[u32; 3]; 2]) -> Interval {
        let mut shift = BLOCK;
        let mut before = 0;
        let mut blocks = blocks(self.points, shift);
        while (0..3).any(|k| (last[k] >> shift) - (first[k] >> shift) > 3) {
            before += count(blocks);
            shift += 1;
            blocks = self::blocks(self.points, shift);
        }
        let (mut lo, mut hi) = (f32::MAX, -f32::MAX);
        for z in first[2] >> shift..=last[2] >> shift {
            for y in first[1] >> shift..=last[1] >> shift {
                for x in first[0] >> shift..=last[0] >> shift {
                    let [low, high] = self.ranges[before + (x + blocks[0] * (y + blocks[1] * z)) as usize];
                    lo = if low < lo { low } else { lo };
                    hi = if high > hi { high } else { hi };
                }
            }
        }
        let most = if -lo > hi { -lo } else { hi };
        if most > LARGEST { ALL } else { Interval::new(lo - most.abs() * STEP, hi + most.abs() * STEP) }
    }
}

/// Blocks along each axis, whose edge is 2 to the power of `shift` cells.
fn blocks(points: [u32; 3], shift: u32) -> [u32; 3] {
    points.map(|n| ((n - 2) >> shift) + 1)
}

fn count(blocks: [u32; 3]) -> usize {
    blocks.iter().map(|&n| n as usize).product()
}

/// Of blocks of all sizes, the smallest first.
pub(super) fn ranges(points: [u32; 3], values: &Values) -> Vec<[f32; 2]> {
    each_type!(Values, values, samples => ranges_of(points, samples))
}

fn ranges_of<T: Sample>(points: [u32; 3], values: &[T]) -> Vec<[f32; 2]> {
    let [nx, ny, _] = points.map(|n| n as usize);
    let join = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let place = |i: usize, n: [u32; 3]| {
        [i % n[0] as usize, i / n[0] as usize % n[1] as usize, i / (n[0] * n[1]) as usize]
    };
    let none = [f32::MAX, -f32::MAX];
    let lowest = blocks(points, BLOCK);
    let block = |i: usize| {
        let first = place(i, lowest).map(|n| n << BLOCK);
        let end = [0, 1, 2].map(|k| (first[k] + (1 << BLOCK) + 1).min(points[k] as usize));
        let mut range = none;
        for row in (first[2]..end[2]).flat_map(|z| (first[1]..end[1]).map(move |y| nx * (y + ny * z))) {
            for v in &values[row + first[0]..row + end[0]] {
                let v = v.to_f32();
                // Of what is not finite, or nearly so, nothing is known.
                range = join(range, if v.abs() <= LARGEST { [v, v] } else { [-f32::MAX, f32::MAX] });
            }
        }
        range
    };
    let mut all: Vec<[f32; 2]> = (0..count(lowest)).into_par_iter().map(block).collect();
    let (mut shift, mut before) = (BLOCK, 0);
    while blocks(points, shift).iter().any(|&n| n > 4) {
        let (from, to) = (blocks(points, shift), blocks(points, shift + 1));
        for i in 0..count(to) {
            let first = place(i, to).map(|n| 2 * n);
            let end = [0, 1, 2].map(|k| (first[k] + 2).min(from[k] as usize));
            let mut range = none;
            for z in first[2]..end[2] {
                for y in first[1]..end[1] {
                    for x in first[0]..end[0] {
                        let at = x + from[0] as usize * (y + from[1] as usize * z);
                        range = join(range, all[before + at]);
                    }
                }
            }
            all.push(range);
        }
        before += count(from);
        shift += 1;
    }
    all
}
