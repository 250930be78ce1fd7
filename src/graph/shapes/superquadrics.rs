//! Superquadrics (Barr 1981), in the form whose values grow evenly: raised to `e1/2`.

use super::vector::Vector;
use super::{ShapeError, positive};
use crate::graph::{Expr, x, y, z};

/// `|c / a|^(2/e)`.
fn term(c: &Expr, a: &Expr, e: &Expr) -> Expr {
    (c * (1.0 / a)).abs().pow(2.0 / e)
}

/// `|x/a₁|^(2/e₂) + |y/a₂|^(2/e₂)`.
fn section([a, b]: [&Expr; 2], e2: &Expr) -> Expr {
    term(&x(), a, e2) + term(&y(), b, e2)
}

/// `(|…|^(e₂/e₁) + |z/a₃|^(2/e₁))^(e₁/2)`; the surface is at 1. Of a₁ a₂ a₃ e₁ e₂.
pub(crate) fn ellipsoid([a, b, c, e1, e2]: [&Expr; 5]) -> Expr {
    (section([a, b], e2).pow(e2 / e1) + term(&z(), c, e1)).pow(e1 * 0.5)
}

/// `|…|^(e₂/2) − (1 + |z/a₃|^(2/e₁))^(e₁/2)`; the surface, of one sheet, is at 0. Of a₁ a₂ a₃ e₁ e₂.
pub(crate) fn hyperboloid([a, b, c, e1, e2]: [&Expr; 5]) -> Expr {
    section([a, b], e2).pow(e2 * 0.5) - (term(&z(), c, e1) + 1.0).pow(e1 * 0.5)
}

/// `(||…|^(e₂/2) − a₄|^(2/e₁) + |z/a₃|^(2/e₁))^(e₁/2)`; the surface is at 1. Of a₁ a₂ a₃ a₄ e₁ e₂.
pub(crate) fn torus([a, b, c, hole, e1, e2]: [&Expr; 6]) -> Expr {
    let across = (section([a, b], e2).pow(e2 * 0.5) - hole).abs().pow(2.0 / e1);
    (across + term(&z(), c, e1)).pow(e1 * 0.5)
}

fn checked(
    radii: impl Into<Vector>,
    e1: impl Into<Expr>,
    e2: impl Into<Expr>,
) -> Result<[Expr; 5], ShapeError> {
    let Vector([a, b, c]) = radii.into();
    let radius = |r| positive("radius", r);
    Ok([radius(a)?, radius(b)?, radius(c)?, positive("exponent", e1)?, positive("exponent", e2)?])
}

/// Superellipsoid with these half axes. `e1` rounds it seen from the side, `e2` seen from above: 1 and 1 give the
/// ellipsoid, 0.1 and 1 a cylinder, 0.1 and 0.1 a box, 2 and 2 an octahedron, more is pinched. Values are
/// `((|x/a₁|^(2/e₂) + |y/a₂|^(2/e₂))^(e₂/e₁) + |z/a₃|^(2/e₁))^(e₁/2) − 1`.
///
/// # Errors
/// [`ShapeError::NotPositive`] for half axes and exponents.
pub fn superellipsoid(
    half_axes: impl Into<Vector>,
    e1: impl Into<Expr>,
    e2: impl Into<Expr>,
) -> Result<Expr, ShapeError> {
    Ok(ellipsoid(checked(half_axes, e1, e2)?.each_ref()) - 1.0)
}

/// Superhyperboloid of one sheet with half axes `a₁`, `a₂` of its waist, exponents as in [`superellipsoid`]:
/// `(|x/a₁|^(2/e₂) + |y/a₂|^(2/e₂))^(e₂/2) − (1 + |z/a₃|^(2/e₁))^(e₁/2)`.
///
/// # Errors
/// As [`superellipsoid`].
pub fn superhyperboloid(
    radii: impl Into<Vector>,
    e1: impl Into<Expr>,
    e2: impl Into<Expr>,
) -> Result<Expr, ShapeError> {
    Ok(hyperboloid(checked(radii, e1, e2)?.each_ref()))
}

/// Supertorus: a ring around the z axis whose section has half axes as wide as `radii`, at `hole` times them from
/// the axis; `e1` rounds the section, `e2` the ring seen from above:
/// `(|(|x/a₁|^(2/e₂) + |y/a₂|^(2/e₂))^(e₂/2) − hole|^(2/e₁) + |z/a₃|^(2/e₁))^(e₁/2) − 1`.
///
/// # Errors
/// As [`superellipsoid`].
pub fn supertorus(
    radii: impl Into<Vector>,
    hole: impl Into<Expr>,
    e1: impl Into<Expr>,
    e2: impl Into<Expr>,
) -> Result<Expr, ShapeError> {
    let ([a, b, c, e1, e2], hole) = (checked(radii, e1, e2)?, hole.into());
    Ok(torus([&a, &b, &c, &hole, &e1, &e2]) - 1.0)
}
