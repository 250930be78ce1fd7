//! Turning, scaling, mirroring and any other affine map: f' = f ∘ D⁻¹.

use super::vector::{Vector, product, sine_and_cosine, sum};
use super::{ShapeError, positive};
use crate::graph::Expr;
use glam::{DAffine3, DVec3};

/// A determinant this much smaller than that of a right angle is 0.
const SINGULAR: f64 = 1e-12;

/// The point in other coordinates: a row of three factors an axis.
fn rows(rows: &[Vector; 3]) -> [Expr; 3] {
    rows.each_ref().map(|row| row.dot(&Vector::point()))
}

impl Expr {
    /// Moved by a vector: `f(p − by)`.
    #[must_use]
    pub fn translate(&self, by: impl Into<Vector>) -> Expr {
        self.at(Vector::point().minus(&by.into()).0)
    }

    /// Turned around a line through the origin by an angle in turns, counter-clockwise for who looks against the
    /// axis.
    ///
    /// # Errors
    /// [`ShapeError::NoDirection`] for the axis.
    pub fn rotate(&self, axis: impl Into<Vector>, turns: impl Into<Expr>) -> Result<Expr, ShapeError> {
        let n = axis.into().unit("axis")?;
        let (sine, cosine) = sine_and_cosine(&turns.into());
        let rest = 1.0 - &cosine;
        // Rodrigues' formula for the angle's negative: (1 − c) n nᵀ + c I − s [n]×.
        let entry = |row: usize, column: usize| {
            let outer = product(&product(&n.0[row], &n.0[column]), &rest);
            if row == column {
                return outer + &cosine;
            }
            let turn = product(&n.0[3 - row - column], &sine);
            if (row + 1) % 3 == column { sum([outer, turn]) } else { sum([outer, -turn]) }
        };
        let matrix = [0, 1, 2].map(|row| Vector([0, 1, 2].map(|column| entry(row, column))));
        Ok(self.at(rows(&matrix)))
    }

    /// Larger by a factor: `s · f(p / s)`, so that distances stay distances.
    ///
    /// # Errors
    /// [`ShapeError::NotPositive`]; [`Expr::mirror`] turns inside out.
    pub fn scale(&self, factor: impl Into<Expr>) -> Result<Expr, ShapeError> {
        let factor = positive("scale factor", factor)?;
        let inverse = 1.0 / &factor;
        Ok(self.at(Vector::point().map(|c| c * &inverse).0) * factor)
    }

    /// Larger by a factor along each axis: `min(s) · f(p / s)`, which is nowhere more than the distance where f is
    /// not.
    ///
    /// # Errors
    /// [`ShapeError::NotPositive`].
    pub fn scale_axes(&self, factors: impl Into<Vector>) -> Result<Expr, ShapeError> {
        let Vector([a, b, c]) = factors.into();
        let what = "scale factor";
        let factors = Vector([positive(what, a)?, positive(what, b)?, positive(what, c)?]);
        let [a, b, c] = &factors.0;
        Ok(self.at(Vector::point().zip(&factors, |c, s| c * (1.0 / s)).0) * a.min(b).min(c))
    }

    /// Mirrored in the plane `p · normal/|normal| = offset`.
    ///
    /// # Errors
    /// [`ShapeError::NoDirection`].
    pub fn mirror(&self, normal: impl Into<Vector>, offset: impl Into<Expr>) -> Result<Expr, ShapeError> {
        let normal = normal.into().unit("normal")?;
        let height = Vector::point().dot(&normal) - offset.into();
        Ok(self.at(Vector::point().minus(&normal.map(|n| product(n, &(&height * 2.0)))).0))
    }

    /// What is before the plane `p · normal/|normal| = offset`, where the normal points, and its mirror image
    /// behind it.
    ///
    /// # Errors
    /// [`ShapeError::NoDirection`].
    pub fn symmetric(&self, normal: impl Into<Vector>, offset: impl Into<Expr>) -> Result<Expr, ShapeError> {
        let normal = normal.into().unit("normal")?;
        let behind = (Vector::point().dot(&normal) - offset.into()).min(0.0);
        Ok(self.at(Vector::point().minus(&normal.map(|n| product(n, &(&behind * 2.0)))).0))
    }

    /// Under any affine map: `f(M⁻¹ p)`. Values are not scaled: they are distances no more, unless the map only
    /// turns and moves.
    ///
    /// # Errors
    /// [`ShapeError::Singular`] for a matrix without an inverse, or with numbers that are not finite.
    pub fn affine(&self, map: DAffine3) -> Result<Expr, ShapeError> {
        let m = map.matrix3;
        let determinant = m.determinant();
        let lengths = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        let inverse = map.inverse();
        let regular = lengths.is_finite() && determinant.abs() > SINGULAR * lengths && inverse.is_finite();
        if !regular {
            return Err(ShapeError::Singular { determinant });
        }
        let by = inverse.matrix3.transpose();
        let matrix = [by.x_axis, by.y_axis, by.z_axis].map(|row: DVec3| Vector::from(row));
        Ok(self.affine_inverse(&matrix, inverse.translation))
    }

    /// Under the affine map whose inverse has these rows and then moves by `by`: `f(rows · p + by)`. For maps whose
    /// numbers are parameters.
    #[must_use]
    pub fn affine_inverse(&self, matrix: &[Vector; 3], by: impl Into<Vector>) -> Expr {
        self.at(Vector(rows(matrix)).plus(&by.into()).0)
    }
}
