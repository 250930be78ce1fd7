//! Solids made of solids, for distance-like fields: the gradient is that of the one that counts at a point.

use crate::graph::Expr;

/// All in any of the solids: the smallest value. Empty (1 everywhere) if there are none.
pub fn union(solids: impl IntoIterator<Item = Expr>) -> Expr {
    balanced(solids, |a, b| a.min(b)).unwrap_or_else(|| 1.0.into())
}

/// All in each of the solids: the largest value. Everything (−1 everywhere) if there are none.
pub fn intersection(solids: impl IntoIterator<Item = Expr>) -> Expr {
    balanced(solids, |a, b| a.max(b)).unwrap_or_else(|| (-1.0).into())
}

/// Pairs of pairs: neither deep, nor long chains of dependent operations.
fn balanced(solids: impl IntoIterator<Item = Expr>, join: impl Fn(&Expr, &Expr) -> Expr) -> Option<Expr> {
    let mut row: Vec<Expr> = solids.into_iter().collect();
    while row.len() > 1 {
        row =
            row.chunks(2).map(|pair| pair.iter().skip(1).fold(pair[0].clone(), |a, b| join(&a, b))).collect();
    }
    row.pop()
}

impl Expr {
    /// All in either: `min(a, b)`.
    #[must_use]
    pub fn union(&self, other: impl Into<Expr>) -> Expr {
        self.min(other)
    }

    /// All in both: `max(a, b)`.
    #[must_use]
    pub fn intersection(&self, other: impl Into<Expr>) -> Expr {
        self.max(other)
    }

    /// This without the other: `max(a, −b)`.
    #[must_use]
    pub fn difference(&self, other: impl Into<Expr>) -> Expr {
        self.max(-other.into())
    }

    /// This without any of the others: `max(a, −min(others))`.
    #[must_use]
    pub fn difference_of(&self, others: impl IntoIterator<Item = Expr>) -> Expr {
        self.difference(union(others))
    }

    /// All but this: `−a`.
    #[must_use]
    pub fn negation(&self) -> Expr {
        -self
    }

    /// The surface, so thick: `|a| − thickness/2`, half of it to either side.
    #[must_use]
    pub fn shell(&self, thickness: impl Into<Expr>) -> Expr {
        self.abs() - thickness.into() * 0.5
    }

    /// Grown by a distance, or shrunk by a negative one: `a − distance`. Rounds outer edges as it grows.
    #[must_use]
    pub fn offset(&self, distance: impl Into<Expr>) -> Expr {
        self - distance.into()
    }

    /// Grown by `radius`, which is then that of its outer edges and corners: `a − radius`. To keep the size, start
    /// with a solid that is smaller by the radius ([`rounded_box`](super::rounded_box) does).
    #[must_use]
    pub fn round(&self, radius: impl Into<Expr>) -> Expr {
        self.offset(radius)
    }

    /// Between this (at `part` 1) and the other (at 0): `part · a + (1 − part) · b`.
    #[must_use]
    pub fn morph(&self, other: impl Into<Expr>, part: impl Into<Expr>) -> Expr {
        let part = part.into();
        self * &part + other.into() * (1.0 - part)
    }
}
