//! The front ends of the field graph: formulas and WGSL functions become the same expressions.

mod common;

#[path = "front/black_boxes.rs"]
mod black_boxes;
#[path = "front/formula.rs"]
mod formula;
#[allow(dead_code, reason = "shared with the tests of the graph")]
#[path = "graph/on_gpu.rs"]
mod on_gpu;
#[path = "front/wgsl.rs"]
mod wgsl;

use isoforge::field::{Field, Points};

/// The value of a field at one point.
fn at(field: &dyn Field, [x, y, z]: [f32; 3]) -> f32 {
    let mut out = [0.0];
    field.values(Points { x: &[x], y: &[y], z: &[z] }, &mut out).expect("a CPU form");
    out[0]
}
