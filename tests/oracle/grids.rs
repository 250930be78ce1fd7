//! The random kinds of small grids, and volumes that hold hundreds of them.

use crate::common::Random;
use crate::topology::Small;
use glam::{Mat3, UVec3, Vec3};
use isoforge::extract::{Method, Options};
use isoforge::field::Sense;
use isoforge::grid::Grid;
use isoforge::volume::Volume;

/// What the values of a grid are like. All are whole numbers that are not 0 and below 2²³, inside where they are positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// All alike.
    Uniform,
    /// Near whole numbers from −3 to 3: ties broken by a thousandth.
    Integers,
    /// Values near each other, alternating signs, and sizes from 1 to 2²²: ambiguous faces and bodies, decided by the
    /// last bits.
    Adversarial,
    /// Whole numbers from −3 to 3. Those that equal iso are outside, by as little as one likes.
    Ties,
}

/// A tie, as the oracle takes it: so little that no other decision depends on how much.
const UNIT: i64 = 1 << 18;

impl Kind {
    pub const ALL: [Self; 4] = [Self::Uniform, Self::Integers, Self::Adversarial, Self::Ties];

    /// A grid of `n` points along each axis, and a border of points outside.
    pub fn grid(self, n: usize, seed: u64) -> Small {
        let mut random = Random(seed);
        let points = n + 2;
        let flavour = random.next() % 4;
        let mut value = |at: [usize; 3]| match self {
            Self::Uniform => (random.next() >> 41) as i64 * 2 + 1 - (1 << 23),
            Self::Integers => 4096 * (random.next() % 7) as i64 - 3 * 4096 + (random.next() % 8) as i64 * 2 - 7,
            Self::Ties => UNIT * ((random.next() % 7) as i64 - 3),
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
        let mut values = vec![-(1 << 20); points.pow(3)];
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
    /// Whichever side of whatever iso is inside, and in whatever units: `seed` tells.
    pub fn new(grids: &[Small], seed: u64) -> Self {
        let mut random = Random(seed);
        let n = grids[0].points;
        let pitch = n - 1;
        // As near to a cube as it takes.
        let side = (grids.len() as f64).cbrt().ceil() as u32;
        let across = UVec3::new(side, side, (grids.len() as u32).div_ceil(side * side));
        let sense = [Sense::Above, Sense::Below][(random.next() % 2) as usize];
        let iso = [0, (random.next() % (1 << 22)) as i64][(random.next() % 2) as usize];
        let unit = [1.0, 1.0 / 8192.0][(random.next() % 2) as usize];
        // Below 2²⁴ all whole numbers are floats.
        let exact = |v: i64| {
            assert!(v.abs() <= 1 << 24);
            v as f32 * unit
        };
        let value = |v: i64| exact(if sense == Sense::Above { iso + v } else { iso - v });
        let grid = Grid::new((across * pitch as u32).to_array(), Vec3::ZERO, Mat3::IDENTITY).expect("a good grid");
        let [w, h] = [grid.points().x as usize, grid.points().y as usize];
        let mut values = vec![value(-(1 << 20)); grid.point_count() as usize];
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
    grid.values.iter_mut().filter(|v| **v == 0).for_each(|v| *v = -1);
}
