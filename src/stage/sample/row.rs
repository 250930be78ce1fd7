//! The samples of bricks one after another: those in a row along x together, where the field is faster so.

use super::cpu::sample;
use crate::field::{Field, NoForm, Points};
use crate::grid::{BRICK, SAMPLES_PER_BRICK};
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use glam::{UVec3, Vec3};

/// Samples bricks.
#[derive(Debug)]
pub struct Sampler {
    /// Of the row of bricks at hand, or of one brick.
    values: Vec<f32>,
    first: u32,
    count: u32,
    points: [usize; 3],
    /// Positions and values of some points of a brick.
    some: [Vec<f32>; 4],
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            values: vec![0.0; SAMPLES_PER_BRICK],
            first: 0,
            count: 0,
            points: [0; 3],
            some: Default::default(),
        }
    }
}

impl Sampler {
    /// The samples of a brick. `row` says how many bricks, from this one on in a row along x, have this field and
    /// are asked for next.
    ///
    /// # Errors
    /// [`NoForm::Cpu`].
    #[inline(always)]
    pub fn brick(
        &mut self,
        params: &Params,
        field: &dyn Field,
        brick: u32,
        row: impl FnOnce() -> u32,
    ) -> Result<Samples<'_>, NoForm> {
        let origin = params.brick_origin(brick);
        if self.has(brick) || (field.lattice().is_some() && self.take_row(params, field, brick, row())) {
            let first = (BRICK * (brick - self.first)) as usize;
            return Ok(Samples::of_row(&self.values[first..], self.points, params.points, origin));
        }
        self.count = 0;
        let values = brick_of(&mut self.values);
        sample(params, field, origin, values)?;
        Ok(Samples::of_brick(values, params.points, origin))
    }

    /// How many points [`Sampler::some`] takes, at most, for less work than [`Sampler::brick`] is: 0 where it never is.
    #[inline(always)]
    pub fn most_points(&self, params: &Params, field: &dyn Field, brick: u32) -> usize {
        match field.lattice() {
            _ if self.has(brick) => 0,
            Some(lattice) if params.is_aligned() => lattice.points_as_a_brick(),
            _ => SAMPLES_PER_BRICK,
        }
    }

    fn has(&self, brick: u32) -> bool {
        brick.wrapping_sub(self.first) < self.count
    }

    /// The samples of a brick at some of its points, a bit each of row y + 9 z. The
    /// values need not be, bit for bit, those that classify saw: what decides cases is not asked of them.
    ///
    /// # Errors
    /// [`NoForm::Cpu`].
    pub fn some(
        &mut self,
        params: &Params,
        field: &dyn Field,
        brick: u32,
        points: &[u16; 81],
    ) -> Result<Samples<'_>, NoForm> {
        let origin = params.brick_origin(brick);
        let [x, y, z, found] = &mut self.some;
        [&mut *x, &mut *y, &mut *z].into_iter().for_each(Vec::clear);
        let along = (field.lattice().is_some() && params.is_aligned()).then(|| {
            [0, 1, 2].map(|k| [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|i| coordinate(params, k, origin[k] + i)))
        });
        each(points, |[i, j, k]| {
            let p = match &along {
                Some([x, y, z]) => [x[i], y[j], z[k]],
                None => {
                    let point = origin + UVec3::new(i as u32, j as u32, k as u32);
                    params.grid_position(point.as_vec3(), Vec3::ZERO).to_array()
                }
            };
            x.push(p[0]);
            y.push(p[1]);
            z.push(p[2]);
        });
        found.resize(x.len(), 0.0);
        if !found.is_empty() {
            field.values(Points { x, y, z }, found)?;
        }
        self.count = 0;
        let values = brick_of(&mut self.values);
        let mut found = found.iter();
        each(points, |[i, j, k]| {
            if let Some(&value) = found.next() {
                values[i + 9 * (j + 9 * k)] = value;
            }
        });
        Ok(Samples::of_brick(values, params.points, origin))
    }

    /// Samples `count` bricks from `first` on; `false` if the field or the grid is not made for it.
    fn take_row(&mut self, params: &Params, field: &dyn Field, first: u32, count: u32) -> bool {
        let (Some(lattice), true) = (field.lattice(), params.is_aligned()) else { return false };
        let origin = params.brick_origin(first).to_array();
        let axis = |k: usize, bricks: u32| -> Vec<f32> {
            let end = (origin[k] + BRICK * bricks + 1).min(params.points[k]);
            (origin[k]..end).map(|i| coordinate(params, k, i)).collect()
        };
        let [x, y, z] = [axis(0, count), axis(1, 1), axis(2, 1)];
        self.points = [x.len(), y.len(), z.len()];
        let all = self.points.iter().product::<usize>();
        if self.values.len() < all {
            self.values.resize(all, 0.0);
        }
        (self.first, self.count) = (first, count);
        lattice.lattice_values([&x, &y, &z], &mut self.values[..all])
    }
}

/// The values of a brick, which come first; there is always room for one.
fn brick_of(values: &mut [f32]) -> &mut [f32; SAMPLES_PER_BRICK] {
    values.first_chunk_mut().expect("a brick's samples at least")
}

/// Where point `i` along axis `k` lies, in a grid along the world's axes.
fn coordinate(params: &Params, k: usize, i: u32) -> f32 {
    let step = [params.step_x[0], params.step_y[1], params.step_z[2]][k];
    // As positions are everywhere: the sum with what the other axes add, which is 0.
    params.origin[k] + (step * (i as f32 - params.margin) + 0.0)
}

/// Hands on each of the points that have a bit in row y + 9 z.
fn each(points: &[u16; 81], mut take: impl FnMut([usize; 3])) {
    for (row, &bits) in points.iter().enumerate() {
        let mut left = bits;
        while left != 0 {
            take([left.trailing_zeros() as usize, row % 9, row / 9]);
            left &= left - 1;
        }
    }
}
