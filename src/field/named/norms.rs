//! Balls of norms, and the torus.

use super::{Definition, Parameter};
use crate::field::Sense;
use crate::graph::{Expr, x, y, z};

fn distance_square() -> Expr {
    (x().square() + y().square()) + z().square()
}

/// Euclid's norm.
pub const SPHERE: Definition = Definition {
    name: "sphere",
    formula: "sqrt(x² + y² + z²); iso is the radius",
    parameters: &[],
    iso: 1.0,
    sense: Sense::Below,
    half_edge: 1.5,
    build: |_| distance_square().sqrt(),
};

/// The sum norm.
pub const OCTAHEDRON: Definition = Definition {
    name: "octahedron",
    formula: "|x| + |y| + |z|; iso is the distance of the corners",
    parameters: &[],
    iso: 1.0,
    sense: Sense::Below,
    half_edge: 1.5,
    build: |_| (x().abs() + y().abs()) + z().abs(),
};

/// The maximum norm.
pub const CUBE: Definition = Definition {
    name: "cube",
    formula: "max(|x|, |y|, |z|); iso is half the edge",
    parameters: &[],
    iso: 1.0,
    sense: Sense::Below,
    half_edge: 1.5,
    build: |_| x().abs().max(y().abs()).max(z().abs()),
};

/// Of any radii; a sphere where the major is 0.
pub const TORUS: Definition = Definition {
    name: "torus",
    formula: "(x² + y² + z² + R² − r²)² − 4R²(x² + y²), axis z; the surface is at iso 0",
    parameters: &[
        Parameter {
            name: "R",
            meaning: "major radius",
            default: std::f64::consts::FRAC_1_SQRT_2,
            least: 0.0,
        },
        Parameter {
            name: "r",
            meaning: "minor radius",
            default: std::f64::consts::FRAC_1_SQRT_2 / 2.0,
            least: 0.0,
        },
    ],
    iso: 0.0,
    sense: Sense::Below,
    half_edge: 1.5,
    build: |p| {
        // The uniforms R² − r² and 4R² round to exactly 0.375 and 2 for the defaults.
        let flat = x().square() + y().square();
        let k = (&flat + z().square()) + (p[0].square() - p[1].square());
        k.square() - flat * (p[0].square() * 4.0)
    },
};
