//! The field graph: every operation on every evaluator, bounds, depth, parameters, culling.

mod common;
#[path = "graph/on_gpu.rs"]
mod on_gpu;
#[path = "graph/reference.rs"]
mod reference;

#[path = "graph/bounds.rs"]
mod bounds;
#[path = "graph/culling.rs"]
mod culling;
#[path = "graph/lattice.rs"]
mod lattice;
#[path = "graph/literals.rs"]
mod literals;
#[path = "graph/nested.rs"]
mod nested;
#[path = "graph/operations.rs"]
mod operations;
#[path = "graph/structure.rs"]
mod structure;

use isoforge::field::{Field, Points, Sense};
use isoforge::graph::{Expr, GraphField};

/// The field that an expression is.
pub fn field(expr: &Expr) -> GraphField {
    GraphField::new(expr, Sense::Below)
}

/// Values on the CPU.
pub fn values(field: &dyn Field, points: &[[f32; 3]]) -> Vec<f32> {
    let [x, y, z] = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).collect::<Vec<_>>());
    let mut out = vec![0.0; points.len()];
    field.values(Points { x: &x, y: &y, z: &z }, &mut out).unwrap();
    out
}

/// Gradients on the CPU.
pub fn gradients(field: &dyn Field, points: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let [x, y, z] = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).collect::<Vec<_>>());
    let mut out = vec![[0.0; 3]; points.len()];
    field.gradients(Points { x: &x, y: &y, z: &z }, &mut out).unwrap();
    out
}
