//! The random kinds of small grids, and volumes that hold hundreds of them.

use crate::common::Random;
use crate::topology::Small;
use glam::{Mat3, UVec3, Vec3};
use isoforge::extract::{Method, Options};
use isoforge::field::Sense;
use isoforge::grid::Grid;
use isoforge::volume::Volume;

/// What the values of a grid are like. All are whole numbers, inside where they are positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// All alike.
    Uniform,
    /// Near whole numbers from −3 to 3: ties broken by a hundredth.
    Integers,
    /// Values near each other, alternating signs, and sizes from 1 to 2²²: ambiguous faces and bodies, decided by the
    /// last bits.
    Adversarial,
    /// Every fifth equals iso: outside, by as little as one likes.
    Ties,
    /// Floats whose differences from iso are no floats; near each other at that.
    Rounded,
}

/// What a tie is to the oracle: so little beside [`UNIT`] that no other decision depends on how much.
const TIE: i64 = -1;

/// By how much the values that ties are among are multiplied.
const UNIT: i64 = 64;

/// 0.7, nearly, in the unit of [`Kind::Rounded`], 2⁻²⁴.
const SEVEN_TENTHS: i64 = 11_744_051;

/// What lies around every grid, a float whatever the kind.
pub const BORDER: i64 = -(1 << 20);

impl Kind {
    pub const ALL: [Self; 5] = [Self::Uniform, Self::Integers, Self::Adversarial, Self::Ties, Self::Rounded];

    /// A grid of `n` points along each axis, and a border of points outside.
    pub fn grid(self, n: usize, seed: u64) -> Small {
        let mut random = Random(seed);
        let points = n + 2;
        let flavour = random.next() % 4;
        let mut value = |at: [usize; 3]| match self {
            Self::Uniform => (random.next() >> 41) as i64 * 2 + 1 - (1 << 23),
            Self::Integers => {
                ((random.next() % 7) as i64 - 3) * (1 << 16) + (random.next() % 512) as i64 * 2 - 511
            }
            Self::Ties if random.next() % 5 == 0 => 0,
            Self::Ties => (random.next() >> 41) as i64 * 2 + 1 - (1 << 23),
            Self::Rounded => {
                // Around 16, whose last bit is 32 units, and around −14.6, whose last is 16.
                let far = [
                    (1 << 28) + 32 * (random.next() % 512) as i64,
                    -16 * (15_309_209 + (random.next() % 512) as i64),
                ];
                far[(random.next() % 2) as usize] - SEVEN_TENTHS
            }
            Self::Adversarial => {
                let odd = at.iter().sum::<usize>() % 2 == 1;
                let any = random.next() % 2 == 1;
                let (inside, size) = match flavour {
                    // Near each other, with any signs, and with alternating ones.
                    0 => (any, (1 << 22) + (random.next() % 512) as i64),
                    1 => (odd != (random.next() % 8 == 0), (1 << 22) - (random.next() % 4096) as i64),
                    // Alternating signs, sizes alike.
                    2 => (odd != (random.next() % 16 == 0), (1 << 20) + (random.next() % (1 << 21)) as i64),
                    // Sizes of every order.
                    _ => (any, (1 << (random.next() % 22)) + (random.next() % (1 << 12)) as i64 + 1),
                };
                if inside { size } else { -size }
            }
        };
        let mut values = vec![BORDER; points.pow(3)];
        for z in 1..=n {
            for y in 1..=n {
                for x in 1..=n {
                    values[x + points * (y + points * z)] = value([x, y, z]);
                }
            }
        }
        Small { points, values }
    }
}

/// Grids of one size, side by side in one volume: neighbours share the border between them, so that no cell is of two.
pub struct Packed {
    pub volume: Volume,
    pub iso: f32,
    pub sense: Sense,
    /// Cells along an axis from one grid to the next.
    pitch: usize,
    across: UVec3,
}

impl Packed {
    /// Whichever side of whatever iso is inside, and in whatever unit, as `seed` tells where `kind` does not.
    pub fn new(kind: Kind, grids: &[Small], seed: u64) -> Self {
        let mut random = Random(seed);
        let mut iso = [0, (random.next() % (1 << 22)) as i64][(random.next() % 2) as usize];
        let mut sense = [Sense::Above, Sense::Below][(random.next() % 2) as usize];
        // The products of the last are none that floats could hold.
        let mut unit = [1.0, 2f32.powi(-24), 2f32.powi(-90), 2f32.powi(90)][(random.next() % 4) as usize];
        if kind == Kind::Rounded {
            (iso, sense, unit) = (SEVEN_TENTHS, Sense::Above, 2f32.powi(-24));
        }
        let n = grids[0].points;
        let pitch = n - 1;
        // As near to a cube as it takes.
        let side = (grids.len() as f64).cbrt().ceil() as u32;
        let across = UVec3::new(side, side, (grids.len() as u32).div_ceil(side * side));
        let exact = |v: i64| {
            assert_eq!(v as f32 as i64, v, "a whole number that a float holds");
            v as f32 * unit
        };
        let value = |v: i64| exact(if sense == Sense::Above { iso + v } else { iso - v });
        let grid =
            Grid::new((across * pitch as u32).to_array(), Vec3::ZERO, Mat3::IDENTITY).expect("a good grid");
        let [w, h] = [grid.points().x as usize, grid.points().y as usize];
        let mut values = vec![value(BORDER); grid.point_count() as usize];
        for (i, small) in grids.iter().enumerate() {
            let low = Self::low(across, i).map(|at| at * pitch);
            for (row, from) in small.values.chunks(n).enumerate() {
                let to = low[0] + w * (low[1] + row % n + h * (low[2] + row / n));
                values[to..to + n].iter_mut().zip(from).for_each(|(to, from)| *to = value(*from));
            }
        }
        let volume = Volume::new(grid, values).expect("one value a point");
        Self { volume, iso: exact(iso), sense, pitch, across }
    }

    fn low(across: UVec3, i: usize) -> [usize; 3] {
        let [x, y] = [across.x as usize, across.y as usize];
        [i % x, i / x % y, i / (x * y)]
    }

    /// The grid that a point of the surface is of.
    pub fn grid_at(&self, [x, y, z]: [f32; 3]) -> usize {
        let [x, y, z] = [x, y, z].map(|at| at as usize / self.pitch);
        x + self.across.x as usize * (y + self.across.y as usize * z)
    }

    pub fn options(&self, method: Method) -> Options {
        Options { method, sense: Some(self.sense), ..Options::new(self.iso) }
    }
}

/// Replaces what equals iso by what is hardly outside.
pub fn break_ties(grid: &mut Small) {
    if grid.values.contains(&0) {
        grid.values.iter_mut().for_each(|v| *v = if *v == 0 { TIE } else { UNIT * *v });
    }
}
