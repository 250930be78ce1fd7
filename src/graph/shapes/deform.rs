//! Twist, bend, taper, repetition: f' = f ∘ D⁻¹, D⁻¹ written in place of the point. None of them keeps
//! distances.

use super::vector::{Vector, sine_and_cosine};
use super::{ShapeError, clamp, positive, range};
use crate::graph::{Expr, x, y, z};
use std::f64::consts::TAU;

/// `a` and `b` turned from the one towards the other.
fn turned(a: &Expr, b: &Expr, turns: &Expr) -> (Expr, Expr) {
    let (sine, cosine) = sine_and_cosine(turns);
    (a * &cosine - b * &sine, a * &sine + b * &cosine)
}

impl Expr {
    /// Twisted around the z axis: by `turns_per_length` more for each unit of z between `z0` and `z1`, not at all
    /// below, and as at `z1` above.
    ///
    /// # Errors
    /// [`ShapeError::Empty`] where `z1` is not above `z0`.
    pub fn twist(
        &self,
        turns_per_length: impl Into<Expr>,
        z0: impl Into<Expr>,
        z1: impl Into<Expr>,
    ) -> Result<Expr, ShapeError> {
        let (z0, z1) = range("twist's reference box", z0, z1)?;
        let turns = (clamp(&z(), &z0, &z1) - &z0) * turns_per_length.into();
        let (across, along) = turned(&x(), &y(), &-turns);
        Ok(self.at([across, along, z()]))
    }

    /// Bent towards +z in the plane of x and z: what lies on the x axis between `x0` and `x1` comes to lie on a circle
    /// through the origin, by `turns_per_length` of a turn for each unit of x, and keeps its length; beyond its
    /// ends it goes on straight. The origin and the y axis stay where they are. With κ = 2π · turns_per_length
    /// and `s = clamp(atan2(κx, 1 − κz) / κ, x0, x1)`, θ = κs, a point comes from
    /// `((θ − sin θ)/κ + x cos θ + z sin θ, y, 2 sin²(θ/2)/κ − x sin θ + z cos θ)`.
    ///
    /// # Errors
    /// [`ShapeError::Empty`] where `x1` is not above `x0`.
    pub fn bend(
        &self,
        turns_per_length: impl Into<Expr>,
        x0: impl Into<Expr>,
        x1: impl Into<Expr>,
    ) -> Result<Expr, ShapeError> {
        let (x0, x1) = range("bend's reference box", x0, x1)?;
        // A circle too large to be told from a line, in place of none.
        let turns = turns_per_length.into();
        let turns = Expr::from(1e-7).less(turns.abs()).select(&turns, 1e-7);
        let curvature = &turns * TAU;
        let angle = (x() * &curvature).atan2(1.0 - z() * &curvature);
        let along = clamp(&(angle * (1.0 / &curvature)), &x0, &x1);
        let turned = &along * turns;
        let (sine, cosine) = (turned.sin_turns(), turned.cos_turns());
        let rise = (turned * 0.5).sin_turns().square() * (2.0 / &curvature);
        let ahead = along - &sine * (1.0 / curvature);
        let across = (x() * &cosine + z() * &sine) + ahead;
        let up = (z() * cosine - x() * sine) + rise;
        Ok(self.at([across, y(), up]))
    }

    /// Tapered along the z axis: x and y larger by a factor that goes evenly from `low` at `z0` to `high` at `z1` and
    /// stays the same beyond.
    ///
    /// # Errors
    /// [`ShapeError::Empty`] where `z1` is not above `z0`, [`ShapeError::NotPositive`] for the factors.
    pub fn taper(
        &self,
        low: impl Into<Expr>,
        high: impl Into<Expr>,
        z0: impl Into<Expr>,
        z1: impl Into<Expr>,
    ) -> Result<Expr, ShapeError> {
        let (z0, z1) = range("taper's reference box", z0, z1)?;
        let (low, high) = (positive("taper factor", low)?, positive("taper factor", high)?);
        let part = (clamp(&z(), &z0, &z1) - &z0) * (1.0 / (&z1 - &z0));
        let factor = &low + part * (&high - &low);
        Ok(self.at([x() / &factor, y() / &factor, z()]))
    }

    /// Repeated along an axis (0 x, 1 y, 2 z) at every whole multiple of `period`: what lies within half a period of
    /// the origin is what is repeated. With a limit there are so many copies to either side, and beyond them
    /// the field goes on.
    ///
    /// # Errors
    /// [`ShapeError::NotPositive`] for the period.
    pub fn repeat(
        &self,
        axis: Axis,
        period: impl Into<Expr>,
        limit: Option<u32>,
    ) -> Result<Expr, ShapeError> {
        let period = positive("period", period)?;
        let mut point = Vector::point();
        let own = &mut point.0[axis as usize];
        let cell = (&*own * (1.0 / &period) + 0.5).floor();
        *own = match limit {
            Some(limit) => {
                let limit = Expr::from(f64::from(limit));
                &*own - clamp(&cell, &-&limit, &limit) * period
            }
            // The same number, but for intervals, which do not see that the two move together. A little more
            // than half, so that rounding at the cells' borders is left alone.
            None => super::primitives::within(&(&*own - cell * &period), &(&period * 0.5001)),
        };
        Ok(self.at(point.0))
    }
}

/// An axis of coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// x.
    X = 0,
    /// y.
    Y = 1,
    /// z.
    Z = 2,
}
