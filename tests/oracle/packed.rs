//! Volumes that hold hundreds of small grids, so that one extraction does for all of them.

use crate::common::Random;
use crate::grids::{BORDER, Kind, SEVEN_TENTHS};
use crate::topology::Small;
use glam::{Mat3, UVec3, Vec3};
use isoforge::extract::{Method, Options};
use isoforge::field::Sense;
use isoforge::grid::Grid;
use isoforge::volume::Volume;

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
        match kind {
            Kind::Rounded => (iso, sense, unit) = (SEVEN_TENTHS, Sense::Above, 2f32.powi(-24)),
            // No float has room for another iso, too.
            Kind::Brink => iso = 0,
            _ => (),
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
