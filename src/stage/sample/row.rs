//! The samples of bricks one after another: those in a row along x together, where the field is faster so.

use super::cpu::sample;
use crate::field::{Field, NoForm};
use crate::grid::{BRICK, SAMPLES_PER_BRICK};
use crate::stage::params::Params;
use crate::stage::samples::Samples;

/// Samples bricks.
#[derive(Debug)]
pub struct Sampler {
    /// Of the row of bricks at hand, or of one brick.
    values: Vec<f32>,
    first: u32,
    count: u32,
    points: [usize; 3],
}

impl Default for Sampler {
    fn default() -> Self {
        Self { values: vec![0.0; SAMPLES_PER_BRICK], first: 0, count: 0, points: [0; 3] }
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
        let is_at_hand = brick.wrapping_sub(self.first) < self.count;
        if is_at_hand || (field.lattice().is_some() && self.take_row(params, field, brick, row())) {
            let first = (BRICK * (brick - self.first)) as usize;
            return Ok(Samples::of_row(&self.values[first..], self.points, params.points, origin));
        }
        self.count = 0;
        let values = self.values.first_chunk_mut().expect("a brick's samples at least");
        sample(params, field, origin, values)?;
        Ok(Samples::of_brick(values, params.points, origin))
    }

    /// Samples `count` bricks from `first` on; `false` if the field or the grid is not made for it.
    fn take_row(&mut self, params: &Params, field: &dyn Field, first: u32, count: u32) -> bool {
        let (Some(lattice), true) = (field.lattice(), params.is_aligned()) else { return false };
        let origin = params.brick_origin(first).to_array();
        let steps = [params.step_x[0], params.step_y[1], params.step_z[2]];
        let axis = |k: usize, bricks: u32| -> Vec<f32> {
            let end = (origin[k] + BRICK * bricks + 1).min(params.points[k]);
            // As positions are everywhere: the sum with what the other axes add, which is 0.
            (origin[k]..end)
                .map(|i| params.origin[k] + (steps[k] * (i as f32 - params.margin) + 0.0))
                .collect()
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
