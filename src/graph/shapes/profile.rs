//! Solids of plane figures.

use super::primitives::{from_axis, square_walls};
use crate::graph::{Expr, z};

/// The figure `profile` (of x and y; z is 0 in it) from `z = −height/2` to `height/2`. The exact distance where
/// that of the figure is.
pub fn extrude(profile: &Expr, height: impl Into<Expr>) -> Expr {
    let figure = profile.at([crate::graph::x(), crate::graph::y(), 0.0.into()]);
    square_walls(&[figure, z().abs() - height.into() * 0.5])
}

/// The figure `profile` turned around the z axis: its x is the distance from the axis, its y is z, its z 0.
/// The exact distance where that of the figure is, if the figure has nothing at negative x or is symmetric.
pub fn revolve(profile: &Expr) -> Expr {
    profile.at([from_axis(), z(), 0.0.into()])
}
