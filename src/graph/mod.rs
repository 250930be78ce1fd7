//! The field graph: fields as expressions, defined once and evaluated everywhere.
//!
//! An [`Expr`] is built with operators and methods, from a formula or a file. [`GraphField`] makes it flat
//! ([`lower`]: equal parts found by hashing, constants folded), and has from the one [`tape`] values,
//! exact gradients and bounds, on the CPU ([`eval`], [`interval`]) and as WGSL ([`wgsl`]). Every operation
//! is defined in one place, [`ops`]. Parameters lie in a buffer: changing one compiles nothing.

pub mod blobs;
mod compound;
pub mod eval;
mod expr;
mod field;
pub mod formula;
pub mod from_wgsl;
pub mod interval;
mod lattice;
pub mod leaf;
pub mod lower;
mod noise;
pub mod ops;
mod prune;
mod same;
mod seam;
pub mod shapes;
pub mod tape;
pub mod volume;
pub mod wgsl;

pub use expr::{Expr, x, y, z};
pub use field::{GraphField, ParameterError};
