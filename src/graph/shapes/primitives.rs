//! Solids around the origin: below 0 inside, above 0 outside, in world units.

use super::vector::Vector;
use super::{ShapeError, clamp, positive};
use crate::graph::{Expr, x, y, z};

/// The distance from the z axis, √(x² + y²).
pub(super) fn from_axis() -> Expr {
    (x().square() + y().square()).sqrt()
}

/// What is below 0 in all of `walls`, exact outside too where the walls stand square to each other and their
/// values are exact distances: `|max(walls, 0)| + min(max(walls), 0)`.
pub(super) fn square_walls(walls: &[Expr]) -> Expr {
    let outside = walls.iter().map(|w| w.max(0.0).square()).reduce(|a, b| a + b);
    let deepest = walls.iter().cloned().reduce(|a, b| a.max(b));
    match (outside, deepest) {
        (Some(outside), Some(deepest)) => outside.sqrt() + deepest.min(0.0),
        _ => 0.0.into(),
    }
}

/// Ball: `√(x² + y² + z²) − radius`. The exact distance.
pub fn sphere(radius: impl Into<Expr>) -> Expr {
    Vector::point().length() - radius.into()
}

/// Ellipsoid with these half axes: `(√((x/a)² + (y/b)² + (z/c)²) − 1) · min(a, b, c)`. Nowhere more than the
/// distance, and as steep as it at the ends of the shortest axis.
///
/// # Errors
/// [`ShapeError::NotPositive`] for a half axis.
pub fn ellipsoid(half_axes: impl Into<Vector>) -> Result<Expr, ShapeError> {
    let Vector([a, b, c]) = half_axes.into();
    let [a, b, c] = [positive("half axis", a)?, positive("half axis", b)?, positive("half axis", c)?];
    let scaled = Vector([x() * (1.0 / &a), y() * (1.0 / &b), z() * (1.0 / &c)]);
    Ok((scaled.length() - 1.0) * a.min(b).min(c))
}

/// Box between two opposite corners. With `q = |p − centre| − half`: `|max(q, 0)| + min(max(q), 0)`, the
/// exact distance inside and out. Nothing where `high` is not above `low`.
pub fn box_(low: impl Into<Vector>, high: impl Into<Vector>) -> Expr {
    rounded(low.into(), high.into(), None)
}

/// Box between two opposite corners, whose edges and corners are rounded with a radius. The exact distance as
/// long as the radius is at most half the shortest edge.
pub fn rounded_box(low: impl Into<Vector>, high: impl Into<Vector>, radius: impl Into<Expr>) -> Expr {
    rounded(low.into(), high.into(), Some(radius.into()))
}

fn rounded(low: Vector, high: Vector, radius: Option<Expr>) -> Expr {
    let centre = low.plus(&high).map(|c| c * 0.5);
    let half = high.minus(&low).map(|c| c * 0.5);
    let half = radius.as_ref().map_or(half.clone(), |r| half.map(|c| c - r));
    let walls = Vector::point().minus(&centre).zip(&half, |c, half| c.abs() - half);
    let solid = square_walls(&walls.0);
    radius.map_or(solid.clone(), |r| solid - r)
}

/// Half-space behind a plane: `p · normal/|normal| − offset`, the exact distance. The normal points out of
/// it, and `offset` is the plane's distance from the origin along the normal.
///
/// # Errors
/// [`ShapeError::NoDirection`].
#[doc(alias = "plane")]
pub fn half_space(normal: impl Into<Vector>, offset: impl Into<Expr>) -> Result<Expr, ShapeError> {
    Ok(Vector::point().dot(&normal.into().unit("normal")?) - offset.into())
}

/// Cylinder around the z axis, from `−height/2` to `height/2`. The exact distance.
pub fn cylinder(radius: impl Into<Expr>, height: impl Into<Expr>) -> Expr {
    square_walls(&[infinite_cylinder(radius), z().abs() - height.into() * 0.5])
}

/// Cylinder around the z axis without ends: `√(x² + y²) − radius`. The exact distance.
pub fn infinite_cylinder(radius: impl Into<Expr>) -> Expr {
    from_axis() - radius.into()
}

/// All within a radius of the segment from `a` to `b`: a cylinder with round ends. The exact distance. A ball
/// where the ends are one.
pub fn capsule(a: impl Into<Vector>, b: impl Into<Vector>, radius: impl Into<Expr>) -> Expr {
    segment_offset(&a.into(), &b.into()).length() - radius.into()
}

/// From the nearest point of the segment between two points; from the point where they are one.
pub(crate) fn segment_offset(a: &Vector, b: &Vector) -> Vector {
    let (along, to_point) = (b.minus(a), Vector::point().minus(a));
    let length_square = along.length_square();
    if length_square.constant() == Some(0.0) {
        return to_point;
    }
    let part = along.map(|c| c / &length_square);
    // The order matters: of NaN, where parameters make the ends one, the constant is taken.
    let part = Expr::from(1.0).min(Expr::from(0.0).max(to_point.dot(&part)));
    to_point.minus(&along.map(|c| &part * c))
}

/// Cone around the z axis: base of that radius at `z = −height/2`, tip at `z = height/2`. The exact distance.
///
/// # Errors
/// [`ShapeError::NotPositive`] for the height.
pub fn cone(radius: impl Into<Expr>, height: impl Into<Expr>) -> Result<Expr, ShapeError> {
    frustum(radius, 0.0, height)
}

/// Cone without its tip, around the z axis: radius `low` at `z = −height/2`, `high` at `z = height/2`. The
/// exact distance.
///
/// # Errors
/// [`ShapeError::NotPositive`] for the height.
pub fn frustum(
    low: impl Into<Expr>,
    high: impl Into<Expr>,
    height: impl Into<Expr>,
) -> Result<Expr, ShapeError> {
    let (low, high, height) = (low.into(), high.into(), positive("height", height)?);
    let (half, narrowing) = (&height * 0.5, &low - &high);
    let slant = (height.square() + narrowing.square()).sqrt();
    // In the plane of the axis: across and along the slanted wall, from the lower rim.
    let (out, up) = (from_axis() - &low, z() + &half);
    let (cosine, sine) = (&height / &slant, &narrowing / &slant);
    let wall = product(&out, &cosine) + product(&up, &sine);
    let along = product(&up, &cosine) - product(&out, &sine);
    let from_high = from_axis() - &high;
    // Nearest to a rim where beyond the wall's end and the flat end's; to a wall or end elsewhere.
    let rim = |out: &Expr, up: Expr| (out.square() + up.square()).sqrt();
    let near_low = Expr::from(0.0).less_equal(&out) * along.less_equal(0.0);
    let near_high = Expr::from(0.0).less_equal(&from_high) * slant.less_equal(&along);
    let faces = wall.max(z().abs() - &half);
    Ok(near_low.select(rim(&out, up), near_high.select(rim(&from_high, z() - &half), faces)))
}

/// Ring around the z axis: `√((√(x² + y²) − major)² + z²) − minor`, the exact distance. (The named field
/// `torus` is the polynomial with the same surface.)
pub fn torus_distance(major: impl Into<Expr>, minor: impl Into<Expr>) -> Expr {
    ((from_axis() - major.into()).square() + z().square()).sqrt() - minor.into()
}

fn product(a: &Expr, b: &Expr) -> Expr {
    super::vector::product(a, b)
}

/// `value`, kept between −`most` and `most`.
pub(super) fn within(value: &Expr, most: &Expr) -> Expr {
    clamp(value, &-most, most)
}
