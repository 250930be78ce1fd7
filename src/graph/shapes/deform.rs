//! Twist, bend, taper, repetition: f' = f ∘ D⁻¹, D⁻¹ written in place of the point. None of them keeps
//! distances.

use super::vector::{Vector, sine_and_cosine};
use super::{ShapeError, clamp, positive, range};
use crate::graph::{Expr, x, y, z};

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

    /// Bent around the y axis: what lies along x between `x0` and `x1` (0 between them) is turned towards +z by
    /// `turns_per_length` more for each unit of x away from 0; as at the ends beyond them. The map is given by its
    /// inverse, which turns each point back by the angle that belongs to its own x: lengths along the bend grow
    /// with the angle, so keep that under an eighth of a turn.
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
        // Both arms rise: the angle has the sign of x.
        let turns = clamp(&x(), &x0, &x1) * turns_per_length.into();
        let (across, up) = turned(&x(), &z(), &-turns);
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
