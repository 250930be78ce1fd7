//! Free-form deformation by a lattice of control points (Sederberg, Parry 1986).

use super::vector::{Vector, product, sum};
use super::{ShapeError, clamp};
use crate::graph::Expr;

/// The most control points along an axis: each is some operations at every point.
const MOST: usize = 8;

/// Control points, evenly over a box, with a displacement each.
#[derive(Debug, Clone)]
pub struct Lattice {
    low: Vector,
    high: Vector,
    counts: [usize; 3],
    displacements: Vec<Vector>,
}

impl Lattice {
    /// Control points over the box from `low` to `high`, `counts` along each axis, from 2 to 8. One displacement
    /// a point, x fastest.
    ///
    /// # Errors
    /// [`ShapeError::Lattice`], [`ShapeError::Empty`].
    pub fn new(
        low: impl Into<Vector>,
        high: impl Into<Vector>,
        counts: [usize; 3],
        displacements: impl IntoIterator<Item = impl Into<Vector>>,
    ) -> Result<Self, ShapeError> {
        let (low, high) = (low.into(), high.into());
        for (low, high) in low.0.iter().zip(&high.0) {
            super::range("lattice's box", low, high)?;
        }
        let displacements: Vec<Vector> = displacements.into_iter().map(Into::into).collect();
        let found = displacements.len();
        let counted = counts.iter().all(|n| (2..=MOST).contains(n));
        if !counted || found != counts.iter().product::<usize>() {
            return Err(ShapeError::Lattice { counts, found, most: MOST });
        }
        Ok(Self { low, high, counts, displacements })
    }

    /// The weights of the control points along an axis: Bernstein polynomials of where in the box a point is.
    fn weights(&self, axis: usize) -> Vec<Expr> {
        let degree = self.counts[axis] as i32 - 1;
        let (low, high) = (&self.low.0[axis], &self.high.0[axis]);
        let at = (&Vector::point().0[axis] - low) * (1.0 / (high - low));
        let at = clamp(&at, &0.0.into(), &1.0.into());
        let rest = 1.0 - &at;
        let mut chosen = 1.0;
        (0..=degree)
            .map(|i| {
                let weight = product(&at.powi(i), &rest.powi(degree - i));
                let weight = product(&weight, &chosen.into());
                chosen = chosen * f64::from(degree - i) / f64::from(i + 1);
                weight
            })
            .collect()
    }

    /// The displacement at the point.
    fn displacement(&self) -> Vector {
        let weights = [0, 1, 2].map(|axis| self.weights(axis));
        let [nx, ny, nz] = self.counts;
        Vector([0, 1, 2].map(|component| {
            let control =
                |i: usize, j: usize, k: usize| &self.displacements[i + nx * (j + ny * k)].0[component];
            let row = |j, k| sum((0..nx).map(|i| product(control(i, j, k), &weights[0][i])));
            let layer = |k| sum((0..ny).map(|j| product(&row(j, k), &weights[1][j])));
            sum((0..nz).map(|k| product(&layer(k), &weights[2][k])))
        }))
    }
}

impl Expr {
    /// Deformed freely: `f(p + displacement(p))`, the displacement being that of the control points weighted with
    /// Bernstein polynomials, and beyond the box as on its border.
    ///
    /// This is the inverse map, as of all deformations: a control point moved by +x makes the solid there move
    /// by −x, by as much where the displacements around it are alike.
    #[must_use]
    pub fn free_form(&self, lattice: &Lattice) -> Expr {
        self.at(Vector::point().plus(&lattice.displacement()).0)
    }
}
