//! Solids, what combines them and what deforms them, as functions and methods on [`Expr`].
//!
//! ```
//! use isoforge::graph::{Expr, shapes::*};
//!
//! let hole = cylinder(0.3, 3.0).rotate([1.0, 0.0, 0.0], 0.25)?;
//! let part = box_([-1.0; 3], [1.0; 3]).smooth_union(sphere(Expr::parameter("r", 1.2)), 0.2);
//! let part = part.difference(hole).translate((0.0, 0.0, Expr::parameter("height", 0.5)));
//! # Ok::<(), ShapeError>(())
//! ```
//!
//! Every number may be an [`Expr::parameter`], which is changed later without compiling anything. All solids
//! are distance-like: below 0 inside, above 0 outside, in world units; where the value is the exact distance
//! the function says so. Angles are in turns: 1 is a full circle. Constants that make no sense are a
//! [`ShapeError`], or an empty solid where a function returns none; parameters that make none only leave NaN or an empty solid.

mod blend;
mod csg;
mod deform;
mod lattice;
mod matrix;
mod primitives;
mod profile;
pub(crate) mod superquadrics;
mod vector;

pub use csg::{intersection, union};
pub use deform::Axis;
pub use lattice::Lattice;
pub(crate) use primitives::segment_offset;
pub use primitives::{
    box_, capsule, cone, cylinder, ellipsoid, frustum, half_space, infinite_cylinder, rounded_box, sphere,
    torus_distance,
};
pub use profile::{extrude, revolve};
pub use superquadrics::{superellipsoid, superhyperboloid, supertorus};
pub use vector::Vector;

use super::Expr;

/// Why a shape cannot be made of these constants.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A size that must be above 0.
    #[error("the {what} is {value}: give a finite number above 0")]
    NotPositive {
        /// What it is.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// A direction without a length.
    #[error("the {what} has no direction: give one with a component that is not 0")]
    NoDirection {
        /// What it is.
        what: &'static str,
    },
    /// A matrix that makes solids flat.
    #[error("the matrix has no inverse (determinant {determinant}): give one whose columns span the space")]
    Singular {
        /// Its determinant.
        determinant: f64,
    },
    /// A range or box without extent.
    #[error("the {what} reaches from {from} to {to}, which is empty: let it end above its start")]
    Empty {
        /// What it is.
        what: &'static str,
        /// Where it starts.
        from: f64,
        /// Where it ends.
        to: f64,
    },
    /// The α of an R-function.
    #[error("alpha is {value}: an R-function takes one above -1 and at most 1")]
    Alpha {
        /// What was given.
        value: f64,
    },
    /// The number of a lattice's control points.
    #[error(
        "a lattice of {counts:?} control points was given {found} displacements: give one a point, and from 2 to {most} \
         points an axis"
    )]
    Lattice {
        /// Control points along each axis.
        counts: [usize; 3],
        /// Displacements that were given.
        found: usize,
        /// The most control points along an axis.
        most: usize,
    },
}

/// `value`, unless it is a constant that is not finite and above 0.
pub(crate) fn positive(what: &'static str, value: impl Into<Expr>) -> Result<Expr, ShapeError> {
    let value = value.into();
    match value.constant() {
        Some(v) if !(v.is_finite() && v > 0.0) => Err(ShapeError::NotPositive { what, value: v }),
        _ => Ok(value),
    }
}

/// `from` and `to`, unless they are constants with nothing between them.
fn range(what: &'static str, from: impl Into<Expr>, to: impl Into<Expr>) -> Result<(Expr, Expr), ShapeError> {
    let (from, to) = (from.into(), to.into());
    match (from.constant(), to.constant()) {
        (Some(a), Some(b)) if !(a < b && (b - a).is_finite()) => {
            Err(ShapeError::Empty { what, from: a, to: b })
        }
        _ => Ok((from, to)),
    }
}

/// `value` between the two; where they are in the wrong order, the last.
fn clamp(value: &Expr, low: &Expr, high: &Expr) -> Expr {
    value.max(low).min(high)
}
