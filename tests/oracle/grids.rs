//! The random kinds of small grids.

use crate::common::Random;
use crate::exact::{Cell, decide_cell};
use crate::topology::Small;

/// What the values of a grid are like. All are whole numbers below 2³⁰, inside where they are positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// All alike.
    Uniform,
    /// Near whole numbers from −3 to 3: ties broken by a hundredth.
    Integers,
    /// Near each other, so that the last bits of products decide.
    Near,
    /// Near each other, inside and outside by turns: nearly every face and every body is ambiguous.
    Alternating,
    /// The same with sizes that differ more.
    Turns,
    /// Sizes of every order.
    Sizes,
    /// Of every order, too; one corner of every other cell is such that the next float would decide the cell otherwise.
    Brink,
    /// Floats whose differences from iso are no floats; near each other at that.
    Rounded,
    /// Every fifth equals iso: outside, by as little as one likes. The others are not much smaller than each other.
    Ties,
}

/// What a tie is to the oracle: so little beside [`UNIT`] that no other decision depends on how much.
const TIE: i64 = -1;

/// By how much the values that ties are among are multiplied.
const UNIT: i64 = 1 << 19;

/// 0.7, nearly: iso in the unit of [`Kind::Rounded`], 2⁻²⁴.
pub const SEVEN_TENTHS: i64 = 11_744_051;

/// What lies around every grid, a float whatever the kind.
pub const BORDER: i64 = -1024;

impl Kind {
    pub const ALL: [Self; 9] = [
        Self::Uniform,
        Self::Integers,
        Self::Near,
        Self::Alternating,
        Self::Turns,
        Self::Sizes,
        Self::Brink,
        Self::Rounded,
        Self::Ties,
    ];

    /// A grid of `n` points along each axis, and a border of points outside.
    pub fn grid(self, n: usize, seed: u64) -> Small {
        let mut random = Random(seed);
        let points = n + 2;
        let mut values = vec![BORDER; points.pow(3)];
        for z in 1..=n {
            for y in 1..=n {
                for x in 1..=n {
                    values[x + points * (y + points * z)] = self.value(&mut random, (x + y + z) % 2 == 1);
                }
            }
        }
        let mut grid = Small { points, values };
        if self == Self::Brink {
            to_the_brink(&mut grid, &mut random);
        }
        grid
    }

    fn value(self, random: &mut Random, odd: bool) -> i64 {
        let mut below = |count: u64| (random.next() % count) as i64;
        let any = below(2) == 1;
        let (inside, size) = match self {
            Self::Ties if below(5) == 0 => (false, 0),
            Self::Ties => (any, 1024 - below(768)),
            Self::Uniform => (any, below(1 << 23) + 1),
            Self::Integers => (any, below(4) * (1 << 16) + below(512) * 2 + 1),
            Self::Near => (any, (1 << 22) + below(512)),
            Self::Alternating => (odd != (below(8) == 0), (1 << 22) - below(4096)),
            Self::Turns => (odd != (below(16) == 0), (1 << 20) + below(1 << 21)),
            Self::Sizes => (any, (1 << below(22)) + below(1 << 12) + 1),
            // All 24 digits, at every place.
            Self::Brink => (any, ((1 << 29) + 64 * below(1 << 23)) >> below(16) >> below(15)),
            // Around 16, whose last bit is 32 units, and around −14.6, whose last is 16.
            Self::Rounded if any => (true, (1 << 28) + 32 * below(512) - SEVEN_TENTHS),
            Self::Rounded => (false, 16 * (15_309_209 + below(512)) + SEVEN_TENTHS),
        };
        if inside { size } else { -size }
    }

    /// The values that the interpolant is of. Differences from iso are as floats hold them, and a tie is as good as
    /// outside.
    pub fn differences(self, mut grid: Small) -> Small {
        match self {
            Self::Rounded => grid.values.iter_mut().for_each(|v| *v = *v as f32 as i64),
            Self::Ties => grid.values.iter_mut().for_each(|v| *v = if *v == 0 { TIE } else { UNIT * *v }),
            _ => (),
        }
        grid
    }
}

/// Moves a corner of every other cell along each axis to where the next float would connect others of its corners.
fn to_the_brink(grid: &mut Small, random: &mut Random) {
    let n = grid.points;
    let every = || (1..n - 2).step_by(2);
    for base in every().flat_map(|z| every().flat_map(move |y| every().map(move |x| x + n * (y + n * z)))) {
        let points =
            [0, 1, 2, 3, 4, 5, 6, 7usize].map(|c| base + (c & 1) + n * ((c >> 1 & 1) + n * (c >> 2)));
        let cell: Cell = points.map(|point| grid.values[point]);
        let corner = (random.next() % 8) as usize;
        // Floats from 2²³ to 2³⁰ are whole numbers, and their bits are in their order.
        let with = |bits: u32| {
            let mut cell = cell;
            cell[corner] = f32::from_bits(bits) as i64 * cell[corner].signum();
            cell
        };
        let decide = |bits: u32| decide_cell(&with(bits));
        let [mut low, mut high] = [23, 30].map(|exponent| 2f32.powi(exponent).to_bits());
        high -= 1;
        let first = decide(low);
        if first == decide(high) {
            continue;
        }
        while low + 1 < high {
            let middle = low.midpoint(high);
            if decide(middle) == first { low = middle } else { high = middle }
        }
        grid.values[points[corner]] = with([low, high][(random.next() % 2) as usize])[corner];
    }
}
