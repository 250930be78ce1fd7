//! The stages of extraction, in order: cull, sample, classify, scan, emit, normals.
//!
//! A stage `X` has its shader in `shaders/X.wgsl`, its GPU side in `stage/X/mod.rs`, its CPU twin in
//! `stage/X/cpu.rs` and its parity test in `tests/stage/X.rs`. Twins have the shader's names and read
//! and write the same structures.

pub mod classify;
pub mod cull;
pub mod dispatches;
pub mod emit;
pub mod inside;
pub mod method;
pub mod normals;
pub mod params;
pub mod sample;
pub mod samples;
pub mod scan;
pub mod shaders;
pub mod trilinear;
