//! CPU twin of `shaders/place/snapped.wgsl`: vertices where the field itself crosses iso, all of a batch together.

use super::crossings::{Crossings, crossing, is_beyond};
use crate::field::unit::{has_direction, largest, unit};
use crate::field::{Field, NoForm, Points};
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use glam::{UVec3, Vec3};

const MOST_STEPS: usize = 32;
/// 2⁻²²: less does not show beside a whole number.
const LEAST_NEAR: f32 = f32::from_bits(105 << 23);

/// A corner that is taken in place of an earlier one is nearer by this much at least, of squares.
const NEARER: f32 = f32::from_bits(107 << 23);

/// How far apart on its line the field is looked at for a vertex within a cell, in grid steps along the axis that the line goes
/// along most, and how often on either side.
const LOOK_STEP: f32 = 0.125;
const LOOKS: usize = 6;
/// From the cell's faces such a vertex stays this far on the gradient's line, in grid steps.
const MARGIN: f32 = 0.015625;

/// What is left of a line: fractions of it, and the values there.
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
    /// Of a line that goes `way` in grid steps.
    fn new(params: &Params, inside: Inside, way: Vec3, [low, high]: [f32; 2], values: [f32; 2]) -> Self {
        let [x, y, z] = [params.step_x, params.step_y, params.step_z].map(Vec3::from);
        let step = ((x * way.x + y * way.y) + z * way.z).abs();
        let near = (0.5 * params.epsilon / ((step.x + step.y) + step.z)).max(LEAST_NEAR);
        let [at_low, at_high] = values;
        // Where a border is closed there is nothing to look for.
        let near = if is_beyond(at_low, at_high) { 1.0 } else { near };
        Self { low, high, at_low, at_high, inside_low: inside.test(at_low), near }
    }

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
    let bracket = |i: usize| {
        let way = Vec3::from(batch.axis.map(|axis| axis[i]));
        Bracket::new(params, inside, way, [0.0, 1.0], batch.ends.map(|end| end[i]))
    };
    let brackets = (0..count).map(bracket).collect();
    close(batch, params, inside, field, brackets)
}

/// Closes brackets on the first lines of a batch, and moves their fractions there.
fn close<const N: usize>(
    batch: &mut Crossings<N>,
    params: &Params,
    inside: Inside,
    field: &dyn Field,
    mut brackets: Vec<Bracket>,
) -> Result<(), NoForm> {
    let count = brackets.len();
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

/// How far a vertex within a cell may go.
fn reach(within: Vec3, way: Vec3) -> f32 {
    let room = Vec3::select(way.cmpgt(Vec3::ZERO), 1.0 - within, within) - MARGIN;
    (room / way.abs().max(Vec3::splat(LEAST_NEAR))).min_element().max(0.0)
}

/// Moves a vertex within a cell to where the field crosses iso: to the nearest crossing that is found in the cell on the line
/// through it along `outward`, and where none is, on the segment to the nearest corner of the other side, which always has
/// one. In grid steps in the domain. A cell beyond a closed border has no such vertex: one of its faces is outside altogether.
///
/// # Errors
/// [`NoForm::Cpu`].
pub(super) fn snap_within(
    params: &Params,
    inside: Inside,
    field: &dyn Field,
    cell: &Cell,
    within: Vec3,
    outward: Vec3,
) -> Result<Vec3, NoForm> {
    let p = (cell.lowest - params.margin) + within;
    let forth = line_of(params, outward);
    let ways = [-forth, forth];
    let reaches = ways.map(|way| reach(within, way));
    // First where it is, then by turns on either side.
    let mut line = Crossings::<{ 1 + 2 * LOOKS }>::new();
    for look in 0..=2 * LOOKS {
        line.set_line(look, p, ways[look % 2]);
        line.t[look] = (look.div_ceil(2) as f32 * LOOK_STEP).min(reaches[look % 2]);
    }
    line.position(params);
    let mut values = [0.0; 1 + 2 * LOOKS];
    let [x, y, z] = &line.position;
    field.values(Points { x, y, z }, &mut values)?;
    let is_there = inside.test(values[0]);
    let (way, bracket) = match values.iter().position(|&value| inside.test(value) != is_there) {
        Some(look) => {
            let way = ways[look % 2];
            let last = ((look - 1) / 2) as f32 * LOOK_STEP;
            let ends = [values[look.saturating_sub(2)], values[look]];
            (way, Bracket::new(params, inside, way, [last, line.t[look]], ends))
        }
        None => {
            let corner = cell.nearest(inside, within, !is_there);
            let way = corner_at(corner) - within;
            (way, Bracket::new(params, inside, way, [0.0, 1.0], [values[0], cell.samples[corner]]))
        }
    };
    let mut line = Crossings::<1>::new();
    line.set_line(0, p, way);
    close(&mut line, params, inside, field, vec![bracket])?;
    Ok(p + way * line.t[0])
}

/// The line along a vector of the world, in grid steps, of which the longest is one; zero where there is no direction.
fn line_of(params: &Params, outward: Vec3) -> Vec3 {
    if !has_direction(outward) {
        return Vec3::ZERO;
    }
    let v = unit(outward);
    // What takes gradients to the world, the other way round, is the inverse of the grid's steps.
    let columns = [params.outward_x, params.outward_y, params.outward_z];
    let along = Vec3::from(columns.map(|c| (c[0] * v.x + c[1] * v.y) + c[2] * v.z));
    if has_direction(along) { along / largest(along) } else { Vec3::ZERO }
}

/// A cell that corners of either side surround.
pub(super) struct Cell {
    /// Its lowest corner's point of the grid.
    pub(super) lowest: Vec3,
    pub(super) samples: [f32; 8],
}

impl Cell {
    /// The corner on a side that is nearest to a place, of several the first.
    fn nearest(&self, inside: Inside, within: Vec3, side: bool) -> usize {
        let (mut nearest, mut least) = (0, f32::INFINITY);
        for (corner, &sample) in self.samples.iter().enumerate() {
            let way = corner_at(corner) - within;
            let length = (way.x * way.x + way.y * way.y) + way.z * way.z;
            // Of near ties the first: drivers that contract sums must not choose another.
            if inside.test(sample) == side && length < least - NEARER {
                (nearest, least) = (corner, length);
            }
        }
        nearest
    }
}

fn corner_at(corner: usize) -> Vec3 {
    UVec3::from([0, 1, 2].map(|k| corner as u32 >> k & 1)).as_vec3()
}
