//! Unions, intersections and differences with rounded seams, for distance-like fields.

use super::ShapeError;
use crate::graph::Expr;

/// How much lower than the smaller of `a` and `b` their blend is: `max(r − |a − b|, 0)² / 4r`.
fn seam(a: &Expr, b: &Expr, radius: impl Into<Expr>) -> Expr {
    // Of radius 0, which a parameter may be, nothing is left.
    let radius = radius.into().max(1e-30);
    (&radius - (a - b).abs()).max(0.0).square() * (0.25 / &radius)
}

/// `r ln(1 + e^(−|a − b|/r))`.
fn exponential_seam(a: &Expr, b: &Expr, radius: impl Into<Expr>) -> Expr {
    let radius = radius.into().max(1e-30);
    (((a - b).abs() * (-1.0 / &radius)).exp() + 1.0).ln() * radius
}

/// `√(a² + b² − 2α a b)`, written so that it is |a − b| for α = 1 and nothing cancels for α from 0.
fn root(a: &Expr, b: &Expr, alpha: &Expr) -> Expr {
    let (apart, both) = ((a - b).square(), a.square() + b.square());
    let square = match alpha.constant() {
        Some(1.0) => return (a - b).abs(),
        Some(0.0) => both,
        _ => apart * alpha + both * (1.0 - alpha),
    };
    square.max(0.0).sqrt()
}

fn checked(alpha: impl Into<Expr>) -> Result<Expr, ShapeError> {
    let alpha = alpha.into();
    match alpha.constant() {
        Some(value) if !(value > -1.0 && value <= 1.0) => Err(ShapeError::Alpha { value }),
        _ => Ok(alpha),
    }
}

impl Expr {
    /// Union with a seam filled where the two differ by less than `radius`:
    /// `min(a, b) − max(r − |a − b|, 0)² / 4r`. Radius 0 is the sharp union.
    #[must_use]
    pub fn smooth_union(&self, other: impl Into<Expr>, radius: impl Into<Expr>) -> Expr {
        let other = other.into();
        self.min(&other) - seam(self, &other, radius)
    }

    /// Intersection with edges rounded where the two differ by less than `radius`:
    /// `max(a, b) + max(r − |a − b|, 0)² / 4r`.
    #[must_use]
    pub fn smooth_intersection(&self, other: impl Into<Expr>, radius: impl Into<Expr>) -> Expr {
        let other = other.into();
        self.max(&other) + seam(self, &other, radius)
    }

    /// Difference with edges rounded as those of [`Expr::smooth_intersection`] with the other's negation.
    #[must_use]
    pub fn smooth_difference(&self, other: impl Into<Expr>, radius: impl Into<Expr>) -> Expr {
        self.smooth_intersection(-other.into(), radius)
    }

    /// Union with a seam filled everywhere, less the further the two differ: `−r ln(e^(−a/r) + e^(−b/r))`, written
    /// as `min(a, b) − r ln(1 + e^(−|a − b|/r))`, which does not overflow. Smooth in all derivatives, and no
    /// matter in what order several are joined. Radius 0 is the sharp union.
    #[must_use]
    pub fn exponential_union(&self, other: impl Into<Expr>, radius: impl Into<Expr>) -> Expr {
        let other = other.into();
        self.min(&other) - exponential_seam(self, &other, radius)
    }

    /// Intersection with edges rounded as the seam of [`Expr::exponential_union`]:
    /// `max(a, b) + r ln(1 + e^(−|a − b|/r))`.
    #[must_use]
    pub fn exponential_intersection(&self, other: impl Into<Expr>, radius: impl Into<Expr>) -> Expr {
        let other = other.into();
        self.max(&other) + exponential_seam(self, &other, radius)
    }

    /// Difference: the [`Expr::exponential_intersection`] with the other's negation.
    #[must_use]
    pub fn exponential_difference(&self, other: impl Into<Expr>, radius: impl Into<Expr>) -> Expr {
        self.exponential_intersection(-other.into(), radius)
    }

    /// Union as an R-function (Pasko, Savchenko): `(a + b − √(a² + b² − 2α a b)) / (1 + α)`. Smooth but on the
    /// seam for α below 1; α = 1 gives `min(a, b)`.
    ///
    /// # Errors
    /// [`ShapeError::Alpha`] for α that is not above −1 and at most 1.
    pub fn r_union(&self, other: impl Into<Expr>, alpha: impl Into<Expr>) -> Result<Expr, ShapeError> {
        let (other, alpha) = (other.into(), checked(alpha)?);
        Ok(((self + &other) - root(self, &other, &alpha)) * (1.0 / (1.0 + alpha)))
    }

    /// Intersection as an R-function: `(a + b + √(a² + b² − 2α a b)) / (1 + α)`; α = 1 gives `max(a, b)`.
    ///
    /// # Errors
    /// As [`Expr::r_union`].
    pub fn r_intersection(&self, other: impl Into<Expr>, alpha: impl Into<Expr>) -> Result<Expr, ShapeError> {
        let (other, alpha) = (other.into(), checked(alpha)?);
        Ok(((self + &other) + root(self, &other, &alpha)) * (1.0 / (1.0 + alpha)))
    }

    /// Difference as an R-function: the intersection with the other's negation.
    ///
    /// # Errors
    /// As [`Expr::r_union`].
    pub fn r_difference(&self, other: impl Into<Expr>, alpha: impl Into<Expr>) -> Result<Expr, ShapeError> {
        self.r_intersection(-other.into(), alpha)
    }
}
