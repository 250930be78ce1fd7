//! Projection of points on a field's surface, robust against gradients that are badly scaled, zero or not finite; twin of
//! `shaders/refine/search.wgsl`.
//!
//! Theory: Newton's method on the normalised field f / |∇f| goes to the surface along the gradient; a change of the
//! field's sign between two points proves that the surface of a continuous field runs between them, and from there on
//! only the signs matter. Practice: each point asks for one value at a time, and for a gradient only while no
//! sign change is known, so that a batch of points is evaluated together:
//!
//! 1. where the caller has a guess (the refiner has: along the normals that it knows), steps along that;
//! 2. Newton steps, each clamped;
//! 3. steps to both sides along the gradient at the start;
//! 4. once the sign has changed, the secant through both ends, moved by a little less than half of ε
//!    towards the farther end: so two good guesses leave a bracket shorter than ε (the truncation of the ITP method,
//!    Oliveira & Takahashi 2020). Every second step is a bisection where that does not help.

use super::unit::{has_direction, largest, length, unit};
use super::{NoForm, Surface};
use glam::Vec3;
use rayon::prelude::*;

/// Guesses along the hint.
const HINTS: u32 = 2;
/// Newton steps.
const STEPS: u32 = 6;
/// Places along the gradient at the start, in radii; the side on which the gradient expects the surface first.
const PLACES: [f32; 8] = [0.125, -0.125, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0];
/// Most steps that narrow a bracket. From the fifth on two of them halve it at least.
const NARROWINGS: u32 = 64;
/// Part of ε by which a guess within a bracket is moved.
const NUDGE: f32 = 0.45;
/// 2⁻¹⁰⁰: the part of a bracket up to which the secant says nothing, since the value behind is not finite. Some GPUs take
/// such numbers for 0.
const LEAST_PART: f32 = f32::from_bits(27 << 23);
/// Least tolerance in parts of the point's largest coordinate: four times the spacing of floats.
const RESOLUTION: f32 = 1.0 / (1 << 21) as f32;
/// Points that one task projects.
const TASK: usize = 512;

/// What [`project`] reached.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Projection {
    /// Of each point, whether it lies on the surface now.
    pub converged: Vec<bool>,
}

impl Projection {
    /// How many points lie on the surface.
    pub fn count(&self) -> usize {
        self.converged.iter().filter(|&&c| c).count()
    }

    /// How many points were left where they were.
    pub fn failed(&self) -> usize {
        self.converged.len() - self.count()
    }
}

/// Moves each point to the surface, no farther than its radius (world units; rounding aside).
///
/// A point has converged when the field is exactly iso there, or when a sign change is known on a segment through it
/// that is no longer than `epsilon` (world units): so the surface of a continuous field lies within `epsilon`. Where
/// positions are coarser, 2⁻²¹ of the largest coordinate takes the place of `epsilon`. What does not converge stays
/// where it was, bit for bit; so does a point that is not finite. `radii` is as long as `points`; missing ones
/// count as 0.
///
/// # Errors
/// [`NoForm::Cpu`], never of a surface that [`Surface::new`] made.
pub fn project(
    surface: &Surface<'_>,
    points: &mut [Vec3],
    radii: &[f32],
    epsilon: f32,
) -> Result<Projection, NoForm> {
    let radius = |i: usize| radii.get(i).copied().unwrap_or(0.0);
    let begin = |(i, p): (usize, &Vec3)| Search::new(*p, radius(i), epsilon);
    let mut searches: Vec<Search> = points.iter().enumerate().map(begin).collect();
    searches.par_chunks_mut(TASK).try_for_each(|searches| search(surface, searches))?;
    points.iter_mut().zip(&searches).for_each(|(p, s)| *p = s.at);
    Ok(Projection { converged: searches.iter().map(Search::converged).collect() })
}

/// Runs all searches to their end, together: so it pays to hand over some hundred, and not all, which threads share.
pub(crate) fn search(surface: &Surface<'_>, searches: &mut [Search]) -> Result<(), NoForm> {
    let mut active: Vec<usize> = (0..searches.len()).filter(|&i| searches[i].is_running()).collect();
    let mut steepest = Vec::with_capacity(active.len());
    let mut points = Vec::with_capacity(active.len());
    let (mut gradients, mut values) = (vec![Vec3::ZERO; active.len()], vec![0.0; active.len()]);
    while !active.is_empty() {
        steepest.clear();
        steepest.extend(active.iter().copied().filter(|&i| searches[i].wants_gradient()));
        points.clear();
        points.extend(steepest.iter().map(|&i| searches[i].low));
        surface.gradients(&points, &mut gradients[..steepest.len()])?;
        for (&i, &gradient) in steepest.iter().zip(&gradients) {
            searches[i].aim(gradient);
        }
        points.clear();
        points.extend(active.iter().map(|&i| searches[i].at));
        surface.values(&points, &mut values[..active.len()])?;
        for (&i, &value) in active.iter().zip(&values) {
            searches[i].take(value);
        }
        active.retain(|&i| searches[i].is_running());
    }
    Ok(())
}

/// What a [`Search`] is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Start,
    Hint,
    Newton,
    Line,
    Bracket,
    Converged,
    Failed,
}

/// The way of one point to the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Search {
    start: Vec3,
    start_value: f32,
    /// Outwards along the normal that the surface may have, as far as the surface may be; 0 if nothing is known.
    hint: Vec3,
    radius: f32,
    /// The longest Newton step.
    step: f32,
    /// 1 for each axis along which the point may move, else 0.
    free: Vec3,
    epsilon: f32,
    /// The unit gradient at the start, once it is known.
    line: Vec3,
    phase: Phase,
    /// Steps of the phase.
    round: u32,
    /// A point on the start's side, and its value.
    low: Vec3,
    low_value: f32,
    /// A point on the other side, once there is one.
    high: Vec3,
    high_value: f32,
    /// The point whose value is asked for; in the end the result.
    pub(crate) at: Vec3,
}

impl Search {
    /// From `start`, within `radius` around it.
    pub(crate) fn new(start: Vec3, radius: f32, epsilon: f32) -> Self {
        let least = largest(start) * RESOLUTION;
        let phase = if start.is_finite() { Phase::Start } else { Phase::Failed };
        Self {
            start,
            start_value: 0.0,
            hint: Vec3::ZERO,
            radius,
            step: radius * 0.5,
            free: Vec3::ONE,
            epsilon: if epsilon > least { epsilon } else { least },
            line: Vec3::ZERO,
            phase,
            round: 0,
            low: start,
            low_value: 0.0,
            high: start,
            high_value: 0.0,
            at: start,
        }
    }

    /// A step outwards that may reach the surface from inside, and with the other sign from outside.
    pub(crate) fn with_hint(self, hint: Vec3) -> Self {
        Self { hint, ..self }
    }

    /// With no Newton step longer than that.
    pub(crate) fn with_step(self, longest: f32) -> Self {
        Self { step: if longest < self.step { longest } else { self.step }, ..self }
    }

    /// Moves along the axes alone where `free` is 1, not 0.
    pub(crate) fn with_free(self, free: Vec3) -> Self {
        Self { free, hint: self.hint * free, ..self }
    }

    pub(crate) fn converged(&self) -> bool {
        self.phase == Phase::Converged
    }

    fn is_running(&self) -> bool {
        !matches!(self.phase, Phase::Converged | Phase::Failed)
    }

    /// Whether the gradient at `low` is wanted before the next value.
    fn wants_gradient(&self) -> bool {
        self.phase == Phase::Newton
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.round = 0;
    }

    fn fail(&mut self) {
        self.at = self.start;
        self.phase = Phase::Failed;
    }

    /// A Newton step along the `gradient` at `low`.
    fn aim(&mut self, gradient: Vec3) {
        let gradient = gradient * self.free;
        if !has_direction(gradient) {
            return self.search_line();
        }
        let direction = unit(gradient);
        if self.line == Vec3::ZERO {
            self.line = direction;
        }
        // A little too far rather than too short: a sign change is what is wanted.
        let newton = (self.low_value.abs() / length(gradient)) * 1.0625 + self.epsilon * 0.5;
        let step = if newton < self.step { newton } else { self.step };
        self.at = self.within(self.low + direction * (self.outwards(self.low_value) * step));
    }

    fn search_line(&mut self) {
        if self.line == Vec3::ZERO {
            // Nothing is known: any direction, the same on every machine.
            self.line = self.free * 0.577_350_26;
        }
        (self.low, self.low_value) = (self.start, self.start_value);
        self.enter(Phase::Line);
        self.aim_line();
    }

    fn aim_line(&mut self) {
        let along = PLACES[self.round as usize] * self.radius;
        self.at = self.start + self.line * (self.outwards(self.start_value) * along);
    }

    fn aim_hint(&mut self) {
        let far = if self.round == 0 { 1.0 } else { 3.0 };
        self.at = self.within(self.start + self.hint * (self.outwards(self.start_value) * far));
    }

    /// Which way along the gradient the surface lies from a point with this value.
    fn outwards(&self, value: f32) -> f32 {
        if value < 0.0 { 1.0 } else { -1.0 }
    }

    /// The point, or the place in its direction where the ball ends.
    fn within(&self, p: Vec3) -> Vec3 {
        let offset = p - self.start;
        let far = length(offset);
        if far > self.radius { self.start + offset * (self.radius / far) } else { p }
    }

    /// Takes the field's value at `at`, and asks for the next.
    fn take(&mut self, value: f32) {
        let value = if value <= f32::MAX { value.max(-f32::MAX) } else { f32::MAX };
        if value == 0.0 {
            self.phase = Phase::Converged;
            return;
        }
        if self.phase == Phase::Start {
            (self.low_value, self.start_value) = (value, value);
            if !(self.radius > 0.0 && self.radius <= f32::MAX) {
                self.fail();
            } else if self.hint == Vec3::ZERO {
                self.enter(Phase::Newton);
            } else {
                self.enter(Phase::Hint);
                self.aim_hint();
            }
            return;
        }
        let is_across = (value < 0.0) != (self.low_value < 0.0);
        self.round += 1;
        if self.phase == Phase::Bracket || is_across {
            if is_across {
                (self.high, self.high_value) = (self.at, value);
            } else {
                (self.low, self.low_value) = (self.at, value);
            }
            if self.phase != Phase::Bracket {
                self.enter(Phase::Bracket);
            }
            return self.narrow();
        }
        match self.phase {
            Phase::Hint if self.round < HINTS => self.aim_hint(),
            Phase::Hint => self.enter(Phase::Newton),
            Phase::Newton if self.round < STEPS => (self.low, self.low_value) = (self.at, value),
            Phase::Newton => self.search_line(),
            _ if (self.round as usize) < PLACES.len() => self.aim_line(),
            _ => self.fail(),
        }
    }

    /// Ends the search in a bracket that is short enough, or asks for a value in it.
    fn narrow(&mut self) {
        let along = self.high - self.low;
        let far = length(along);
        let secant = self.low_value / (self.low_value - self.high_value);
        let mut t = if (LEAST_PART..1.0).contains(&secant) { secant } else { 0.5 };
        if far <= self.epsilon {
            self.at = self.low + along * t;
            self.phase = Phase::Converged;
            return;
        }
        if self.round == NARROWINGS {
            return self.fail();
        }
        let nudge = (self.epsilon * NUDGE) / far;
        t = if t < 0.5 { t + nudge } else { t - nudge };
        if self.round >= 4 && self.round.is_multiple_of(2) {
            t = 0.5;
        }
        self.at = self.low + along * t;
    }
}

#[cfg(test)]
mod tests;
