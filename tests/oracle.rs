//! The topology of the meshes against an oracle: the trilinear isosurface of thousands of random grids, decided in whole
//! numbers ([`exact`]) and counted without a triangle ([`topology`]). The oracle in turn is held against the same
//! interpolant sampled finely ([`supersample`]), and the checker of the crate against a count made here ([`count`]).

#[path = "oracle/checker.rs"]
mod checker;
mod common;
#[path = "oracle/count.rs"]
mod count;
#[path = "oracle/exact.rs"]
mod exact;
#[path = "oracle/grids.rs"]
mod grids;
#[path = "oracle/masks.rs"]
mod masks;
#[path = "oracle/methods.rs"]
mod methods;
#[path = "oracle/packed.rs"]
mod packed;
#[path = "oracle/rows.rs"]
mod rows;
#[path = "oracle/supersample.rs"]
mod supersample;
#[path = "oracle/topology.rs"]
mod topology;
