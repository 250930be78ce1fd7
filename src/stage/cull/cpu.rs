//! CPU twin of `shaders/cull.wgsl`.

use crate::stage::inside::order_key;
use crate::stage::params::Params;
use rayon::prelude::*;

/// Lowest and highest order key of a brick's samples: empty (low over high) for a brick with no finite
/// sample, the widest for one with finite and other samples.
pub type Range = [u32; 2];

/// What stands for a brick that is not active in the brick map.
pub const NO_SLOT: u32 = u32::MAX;

/// The table of ranges of all bricks of a volume, and how many samples are NaN or infinite.
pub fn range(params: &Params, values: &[f32]) -> (Vec<Range>, u64) {
    let [nx, ny, nz] = params.points.map(|n| n as usize);
    let [bx, by, _] = params.bricks.map(|n| n as usize);
    let mut ranges = vec![[u32::MAX, 0]; params.bricks.iter().map(|&n| n as usize).product()];
    // A layer of bricks a task: planes shared by two layers are read twice, nothing is written twice.
    let odd = ranges.par_chunks_mut(bx * by).enumerate().map(|(layer, ranges)| {
        let mut folds = vec![Fold::EMPTY; bx * by];
        let mut owned_odd = 0;
        for z in layer * 8..(layer * 8 + 9).min(nz) {
            for y in 0..ny {
                let row = &values[nx * (y + ny * z)..][..nx];
                for brick_x in 0..bx {
                    let fold = Fold::of(&row[brick_x * 8..nx.min(brick_x * 8 + 9)]);
                    folds[brick_x + bx * (y / 8)].merge(fold);
                    if y % 8 == 0 && y > 0 {
                        folds[brick_x + bx * (y / 8 - 1)].merge(fold);
                    }
                    if fold.odd > 0 && z < layer * 8 + 8 {
                        let own = &row[brick_x * 8..nx.min(brick_x * 8 + 8)];
                        owned_odd += own.iter().filter(|v| !v.is_finite()).count() as u64;
                    }
                }
            }
        }
        ranges.iter_mut().zip(&folds).for_each(|(range, fold)| *range = fold.range());
        owned_odd
    });
    let odd = odd.sum();
    (ranges, odd)
}

#[derive(Clone, Copy)]
struct Fold {
    low: f32,
    high: f32,
    finite: u32,
    odd: u32,
}

impl Fold {
    const EMPTY: Self = Self { low: f32::INFINITY, high: f32::NEG_INFINITY, finite: 0, odd: 0 };

    #[inline(always)]
    fn of(row: &[f32]) -> Self {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        let mut magnitude = 0u32;
        if let Ok(row) = <&[f32; 9]>::try_from(row) {
            // The usual case, with a length known to the compiler.
            for v in row {
                low = if *v < low { *v } else { low };
                high = if *v > high { *v } else { high };
                magnitude = magnitude.max(v.to_bits() & 0x7fff_ffff);
            }
        } else {
            for v in row {
                low = if *v < low { *v } else { low };
                high = if *v > high { *v } else { high };
                magnitude = magnitude.max(v.to_bits() & 0x7fff_ffff);
            }
        }
        if magnitude < 0x7f80_0000 {
            return Self { low, high, finite: row.len() as u32, odd: 0 };
        }
        let mut fold = Self::EMPTY;
        for &v in row {
            if v.is_finite() {
                fold.low = fold.low.min(v);
                fold.high = fold.high.max(v);
                fold.finite += 1;
            } else {
                fold.odd += 1;
            }
        }
        fold
    }

    #[inline(always)]
    fn merge(&mut self, other: Self) {
        self.low = if other.low < self.low { other.low } else { self.low };
        self.high = if other.high > self.high { other.high } else { self.high };
        self.finite += other.finite;
        self.odd += other.odd;
    }

    fn range(self) -> Range {
        match (self.finite, self.odd) {
            (0, _) => [u32::MAX, 0],
            (_, 0) => [order_key(self.low.to_bits()), order_key(self.high.to_bits())],
            _ => [0, u32::MAX],
        }
    }
}

/// Whether a brick with this range can have samples on both sides.
fn straddles(params: &Params, [low, high]: Range) -> bool {
    let (innermost, outermost) = if params.flip == 0 { (low, high) } else { (!high, !low) };
    low <= high && innermost < params.iso_key && outermost >= params.iso_key
}

/// Marks the bricks that are kept: (1, 0), else (0, 0).
pub fn cull(params: &Params, ranges: &[Range], marks: &mut [[u32; 2]]) {
    for (mark, range) in marks.iter_mut().zip(ranges) {
        *mark = [straddles(params, *range).into(), 0];
    }
}

/// Marks every brick as kept.
pub fn keep_all(marks: &mut [[u32; 2]]) {
    marks.fill([1, 0]);
}

/// From scanned marks (with the total behind the last brick) to the brick map and the active list.
pub fn compact(params: &Params, marks: &[[u32; 2]], slots: &mut [u32]) -> Vec<u32> {
    let count = params.slab_bricks as usize;
    let mut active_list = vec![0; marks[count][0] as usize];
    for index in 0..count {
        let slot = marks[index][0];
        let kept = marks[index + 1][0] > slot;
        slots[index] = if kept { slot } else { NO_SLOT };
        if kept {
            active_list[slot as usize] = params.first_brick + index as u32;
        }
    }
    active_list
}
