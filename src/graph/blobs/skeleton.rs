//! Blobs around other skeletons than points, as expressions: the distance to the skeleton takes the place of
//! the distance to the centre.
//!
//! A blob is `kernel_expr(kernel, distance_square, radius)`, times its weight; [`Expr::at`] turns and scales it,
//! and a sum of several is a sum of expressions. The distances are squared: no root is taken that would be
//! squared again.

use super::kernel::Kernel;
use crate::graph::shapes::{Vector, segment_offset};
use crate::graph::{Expr, x, y, z};

/// The square of the distance from a point.
#[must_use]
pub fn point_square(at: impl Into<Vector>) -> Expr {
    Vector::point().minus(&at.into()).length_square()
}

/// The square of the distance from the segment between two points; from the point where they are one.
#[must_use]
pub fn segment_square(a: impl Into<Vector>, b: impl Into<Vector>) -> Expr {
    segment_offset(&a.into(), &b.into()).length_square()
}

/// The square of the distance from the lines between one point and the next; `None` of no point.
#[must_use]
pub fn polyline_square(points: impl IntoIterator<Item = impl Into<Vector>>) -> Option<Expr> {
    let points: Vec<Vector> = points.into_iter().map(Into::into).collect();
    match &points[..] {
        [] => None,
        [only] => Some(point_square(only)),
        more => more.windows(2).map(|pair| segment_square(&pair[0], &pair[1])).reduce(|a, b| a.min(b)),
    }
}

/// The square of the distance from a circle of radius `major` around the origin, in the plane z = 0.
#[must_use]
pub fn circle_square(major: impl Into<Expr>) -> Expr {
    let ring = (x().square() + y().square()).sqrt() - major.into();
    ring.square() + z().square()
}

/// xⁿ + yⁿ + zⁿ to the power of 2/n, n = 2, 4, 8 or 16: the square of a distance that makes cubes with round
/// edges, rounder for smaller n. Other n are taken for the next of these.
#[must_use]
pub fn superellipsoid_square(n: u32) -> Expr {
    let halvings = n.clamp(2, 16).next_power_of_two().ilog2() - 1;
    let raised = |axis: Expr| (0..halvings).fold(axis.square(), |power, _| power.square());
    let sum = raised(x()) + raised(y()) + raised(z());
    (0..halvings).fold(sum, |root, _| root.sqrt())
}

/// The kernel of weight 1 around a skeleton from which `distance_square` is the square of the distance; from
/// `radius` on it is 0.
#[must_use]
pub fn kernel_expr(kernel: Kernel, distance_square: &Expr, radius: impl Into<Expr>) -> Expr {
    let inverse_square = 1.0 / radius.into().square();
    let q = distance_square * &inverse_square;
    let u = || (1.0 - q.min(1.0)).max(0.0);
    let inside = || q.less(1.0);
    match kernel {
        Kernel::SoftObject => u().square() * (5.0 / 9.0 + u() * (4.0 / 9.0)),
        Kernel::Metaball => {
            let rest = 1.0 - q.min(1.0).sqrt();
            q.less(1.0 / 9.0).select(1.0 - q.min(1.0 / 9.0) * 3.0, (&rest * 1.5) * &rest)
        }
        Kernel::Blobby { .. } => {
            let falloff = f64::from(kernel.falloff()) * std::f64::consts::LN_2;
            inside().select((-(q.min(1.0) * falloff)).exp(), 0.0)
        }
        Kernel::InverseSquare => {
            let core = 1.0 / 1_048_576.0;
            inside().select(inverse_square / q.max(core), 0.0)
        }
    }
}

/// a · exp(−b g): any field g as the generator of a blob.
#[must_use]
pub fn equipotential(a: impl Into<Expr>, b: impl Into<Expr>, g: &Expr) -> Expr {
    (-(g * b.into())).exp() * a.into()
}
