//! Surfaces of higher degree.

use super::{Definition, Parameter, any};
use crate::field::Sense;
use crate::graph::{x, y, z};
use std::f64::consts::SQRT_2;

/// Steiner's Roman surface. The axes are singular: the gradient vanishes there.
pub const STEINER: Definition = Definition {
    half_edge: 0.6,
    ..Definition::plain("steiner", "x²y² + x²z² + y²z² + xyz", |_| {
        let yz = y() * z();
        // The last two terms as yz (yz + x).
        x().square() * (y().square() + z().square()) + &yz * (&yz + x())
    })
};

/// Boy's surface, which cuts itself.
pub const BOY: Definition = Definition {
    sense: Sense::Above,
    half_edge: 2.1,
    ..Definition::plain(
        "boy",
        "64(1−z)³z³ − 48(1−z)²z²(3s + 2z²) + 12(1−z)z(27s² − 24z²s + 36√2yz(y² − 3x²) + 4z⁴) \
     + (9s − 2z²)(−81s² − 72z²s + 108√2xz(x² − 3y²) + 4z⁴), s = x² + y²",
        |_| {
            let (xx, yy, zz) = (x().square(), y().square(), z().square());
            let (s, w, zzzz) = (&xx + &yy, (1.0 - z()) * z(), zz.square());
            let y_lobes = (y() * z()) * (&yy + &xx * -3.0);
            let x_lobes = (x() * z()) * (xx + yy * -3.0);
            // The factors of the formula, multiplied out where that saves operations.
            let first = w.square() * (&w * 64.0 + (&s * -144.0 + &zz * -96.0));
            let inner = y_lobes * (432.0 * SQRT_2) + &zzzz * 48.0;
            let second = w * (&s * (&s * 324.0 + &zz * -288.0) + inner);
            let inner = x_lobes * (108.0 * SQRT_2) + zzzz * 4.0;
            let third = (&s * 9.0 + &zz * -2.0) * (&s * (&s * -81.0 + &zz * -72.0) + inner);
            (first + second) + third
        },
    )
};

/// Two surfaces in one field.
pub const REDUCIBLE: Definition = Definition {
    name: "reducible",
    formula: "(x + d)(x² + y² + z² − r²): a plane and a sphere",
    parameters: &[
        any("d", "distance of the plane from the origin, towards −x", 3.0),
        Parameter { name: "r", meaning: "radius of the sphere", default: 1.0, least: 0.0 },
    ],
    iso: 0.0,
    sense: Sense::Below,
    half_edge: 3.5,
    build: |p| {
        let sphere = ((x().square() + y().square()) + z().square()) - p[1].square();
        (x() + &p[0]) * sphere
    },
};
