//! CPU twin of `shaders/place/snapped.wgsl`: vertices where the field itself crosses iso, all of a batch together.

use super::vertices::{Crossings, FAR, crossing};
use crate::field::{Field, NoForm, Points};
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use glam::Vec3;

const MOST_STEPS: usize = 32;
/// 2⁻²²: less does not show beside a whole number.
const LEAST_NEAR: f32 = f32::from_bits(105 << 23);

/// What is left of an edge: fractions of it, and the values there.
#[derive(Clone, Copy)]
struct Bracket {
    low: f32,
    high: f32,
    at_low: f32,
    at_high: f32,
    inside_low: bool,
    near: f32,
}

impl Bracket {
    fn is_open(&self) -> bool {
        self.high - self.low > 2.0 * self.near
    }

    /// Takes the value at a fraction; where to look next, so that the bracket closes if the fraction was good.
    fn take(&mut self, inside: Inside, t: f32, value: f32) -> f32 {
        if inside.test(value) == self.inside_low {
            (self.low, self.at_low) = (t, value);
            (t + self.near).min(self.high)
        } else {
            (self.high, self.at_high) = (t, value);
            (t - self.near).max(self.low)
        }
    }
}

/// Moves the fractions of the first `count` crossings to where `field` crosses iso.
///
/// # Errors
/// [`NoForm::Cpu`].
pub(super) fn snap<const N: usize>(
    batch: &mut Crossings<N>,
    params: &Params,
    inside: Inside,
    field: &dyn Field,
    count: usize,
) -> Result<(), NoForm> {
    let steps = [params.step_x, params.step_y, params.step_z].map(Vec3::from);
    let mut brackets: Vec<Bracket> = (0..count)
        .map(|i| {
            let [x, y, z] = batch.axis.map(|axis| axis[i]);
            let step = ((steps[0] * x + steps[1] * y) + steps[2] * z).abs();
            let near = (0.5 * params.epsilon / ((step.x + step.y) + step.z)).max(LEAST_NEAR);
            let [at_low, at_high] = batch.ends.map(|end| end[i]);
            // Where a border is closed there is nothing to look for.
            let near = if at_low.abs() == FAR || at_high.abs() == FAR { 1.0 } else { near };
            Bracket { low: 0.0, high: 1.0, at_low, at_high, inside_low: inside.test(at_low), near }
        })
        .collect();
    let mut values = [0.0; N];
    for round in 0..MOST_STEPS {
        let open: Vec<usize> = (0..count).filter(|&i| brackets[i].is_open()).collect();
        if open.is_empty() {
            break;
        }
        for &i in &open {
            let Bracket { low, high, at_low, at_high, .. } = brackets[i];
            let part = if round % 2 == 1 { 0.5 } else { crossing(params.iso, at_low, at_high) };
            batch.t[i] = low + (high - low) * part;
        }
        for _ in 0..2 {
            batch.position(params);
            let [x, y, z] = &batch.position;
            let points = Points { x: &x[..count], y: &y[..count], z: &z[..count] };
            field.values(points, &mut values[..count])?;
            for &i in &open {
                batch.t[i] = brackets[i].take(inside, batch.t[i], values[i]);
            }
        }
    }
    for (t, Bracket { low, high, at_low, at_high, .. }) in batch.t.iter_mut().zip(brackets) {
        *t = low + (high - low) * crossing(params.iso, at_low, at_high);
    }
    batch.position(params);
    Ok(())
}
