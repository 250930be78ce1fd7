//! Blobs around other skeletons than points, as expressions: the distance to the skeleton takes the place of
//! the distance to the centre.
//!
//! A blob is `kernel_expr(kernel, distance_square, radius)`, times its weight; [`Expr::at`] turns and scales it,
//! and a sum of several is a sum of expressions. The distances are squared: no root is taken that would be
//! squared again.

use super::kernel::Kernel;
use crate::graph::{Expr, x, y, z};

/// Sum of squares.
fn length_square([x, y, z]: [Expr; 3]) -> Expr {
    x.square() + y.square() + z.square()
}

/// The square of the distance from a point.
#[must_use]
pub fn point_square(at: [f64; 3]) -> Expr {
    length_square([x() - at[0], y() - at[1], z() - at[2]])
}

/// The square of the distance from the segment between two points; from the point where they are one.
#[must_use]
pub fn segment_square(a: [f64; 3], b: [f64; 3]) -> Expr {
    let along = [0, 1, 2].map(|k| b[k] - a[k]);
    let square: f64 = along.iter().map(|v| v * v).sum();
    let from_a = || [x() - a[0], y() - a[1], z() - a[2]];
    if square == 0.0 {
        return length_square(from_a());
    }
    let [dx, dy, dz] = from_a();
    let [ux, uy, uz] = along.map(|v| v / square);
    let t = (dx * ux + dy * uy + dz * uz).max(0.0).min(1.0);
    let [dx, dy, dz] = from_a();
    let [vx, vy, vz] = along;
    length_square([dx - &t * vx, dy - &t * vy, dz - &t * vz])
}

/// The square of the distance from the lines between one point and the next; `None` of no point.
#[must_use]
pub fn polyline_square(points: &[[f64; 3]]) -> Option<Expr> {
    match points {
        [] => None,
        [only] => Some(point_square(*only)),
        more => more.windows(2).map(|pair| segment_square(pair[0], pair[1])).reduce(|a, b| a.min(b)),
    }
}

/// The square of the distance from a circle of radius `major` around the origin, in the plane z = 0.
#[must_use]
pub fn circle_square(major: f64) -> Expr {
    let ring = (x().square() + y().square()).sqrt() - major;
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
pub fn kernel_expr(kernel: Kernel, distance_square: &Expr, radius: f64) -> Expr {
    let q = distance_square * (1.0 / (radius * radius));
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
            inside().select((1.0 / (radius * radius)) / q.max(core), 0.0)
        }
    }
}

/// a · exp(−b g): any field g as the generator of a blob.
#[must_use]
pub fn equipotential(a: f64, b: f64, g: &Expr) -> Expr {
    (-(g * b)).exp() * a
}
