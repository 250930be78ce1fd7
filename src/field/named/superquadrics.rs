//! Superquadrics, raised to `e1/2`, so that values grow evenly.

use super::{Definition, Parameter, positive};
use crate::field::Sense;
use crate::graph::shapes::superquadrics as shapes;

/// Below it nothing but the box is left, and powers leave the range of numbers.
const fn exponent(name: &'static str, meaning: &'static str, default: f64) -> Parameter {
    Parameter { name, meaning, default, least: 0.01 }
}

/// From an octahedron to a box.
pub const SUPERELLIPSOID: Definition = Definition {
    name: "superellipsoid",
    formula: "((|x/a1|^(2/e2) + |y/a2|^(2/e2))^(e2/e1) + |z/a3|^(2/e1))^(e1/2); at iso 1 with these half axes",
    parameters: &[
        positive("a1", "half axis along x", 1.0),
        positive("a2", "half axis along y", 1.0),
        positive("a3", "half axis along z", 1.0),
        exponent("e1", "exponent seen from the side: 0.1 square, 1 round, 2 straight, above pinched", 0.4),
        exponent("e2", "exponent seen from above", 1.6),
    ],
    iso: 1.0,
    sense: Sense::Below,
    half_edge: 1.1,
    build: |p| shapes::ellipsoid([&p[0], &p[1], &p[2], &p[3], &p[4]]),
};

/// Of one sheet.
pub const SUPERHYPERBOLOID: Definition = Definition {
    name: "superhyperboloid",
    formula: "(|x/a1|^(2/e2) + |y/a2|^(2/e2))^(e2/2) − (1 + |z/a3|^(2/e1))^(e1/2)",
    parameters: &[
        positive("a1", "half axis of the waist along x", 0.6),
        positive("a2", "half axis of the waist along y", 0.6),
        positive("a3", "height in which the waist widens", 0.7),
        exponent("e1", "exponent seen from the side", 0.7),
        exponent("e2", "exponent seen from above", 0.4),
    ],
    iso: 0.0,
    sense: Sense::Below,
    half_edge: 1.5,
    build: |p| shapes::hyperboloid([&p[0], &p[1], &p[2], &p[3], &p[4]]),
};

/// Around the z axis.
pub const SUPERTORUS: Definition = Definition {
    name: "supertorus",
    formula: "(|(|x/a1|^(2/e2) + |y/a2|^(2/e2))^(e2/2) − a4|^(2/e1) + |z/a3|^(2/e1))^(e1/2); the surface is at iso 1",
    parameters: &[
        positive("a1", "half width of the ring along x", 0.35),
        positive("a2", "half width of the ring along y", 0.35),
        positive("a3", "half height of the ring", 0.35),
        positive("a4", "distance of the ring from the axis, in half widths", 2.4),
        exponent("e1", "exponent of the ring's section", 0.5),
        exponent("e2", "exponent seen from above", 0.5),
    ],
    iso: 1.0,
    sense: Sense::Below,
    half_edge: 1.3,
    build: |p| shapes::torus([&p[0], &p[1], &p[2], &p[3], &p[4], &p[5]]),
};
