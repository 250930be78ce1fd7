//! Surfaces that repeat along all axes, as lattice makers use them.

use super::{Definition, Parameter, positive};
use crate::field::Sense;
use crate::graph::{Expr, x, y, z};

const PARAMETERS: &[Parameter] = &[
    positive("period", "length of one repeat", 1.0),
    Parameter {
        name: "thickness",
        meaning: "0: the surface itself; else the sheet |f| − thickness/2, in units of f",
        default: 0.0,
        least: 0.0,
    },
];

const fn periodic(name: &'static str, formula: &'static str, build: fn(&[Expr]) -> Expr) -> Definition {
    Definition { name, formula, parameters: PARAMETERS, iso: 0.0, sense: Sense::Below, half_edge: 1.0, build }
}

/// The coordinates in periods.
fn phases(p: &[Expr]) -> [Expr; 3] {
    [x(), y(), z()].map(|c| c * (1.0 / &p[0]))
}

/// The surface, or the sheet where it has a thickness.
fn sheet(value: Expr, p: &[Expr]) -> Expr {
    p[1].select(value.abs() - &p[1] * 0.5, value)
}

/// Schoen's gyroid.
pub const GYROID: Definition =
    periodic("gyroid", "sin X cos Y + sin Y cos Z + sin Z cos X, X = 2πx/period", |p| {
        let [x, y, z] = phases(p);
        let value =
            (x.sin_turns() * y.cos_turns() + y.sin_turns() * z.cos_turns()) + z.sin_turns() * x.cos_turns();
        sheet(value, p)
    });

/// Schwarz' primitive surface.
pub const SCHWARZ_P: Definition = periodic("schwarz_p", "cos X + cos Y + cos Z, X = 2πx/period", |p| {
    let [x, y, z] = phases(p).map(|c| c.cos_turns());
    sheet((x + y) + z, p)
});

/// Schwarz' diamond surface.
pub const SCHWARZ_D: Definition = periodic(
    "schwarz_d",
    "sin X sin Y sin Z + sin X cos Y cos Z + cos X sin Y cos Z + cos X cos Y sin Z, X = 2πx/period",
    |p| {
        let [x, y, z] = phases(p);
        let (sx, sy, sz) = (x.sin_turns(), y.sin_turns(), z.sin_turns());
        let (cx, cy, cz) = (x.cos_turns(), y.cos_turns(), z.cos_turns());
        let (first, last) = (&sy * &sz + &cy * &cz, &sy * &cz + &cy * &sz);
        sheet(sx * first + cx * last, p)
    },
);

/// Neovius' surface.
pub const NEOVIUS: Definition =
    periodic("neovius", "3 (cos X + cos Y + cos Z) + 4 cos X cos Y cos Z, X = 2πx/period", |p| {
        let [x, y, z] = phases(p).map(|c| c.cos_turns());
        let product = (&x * &y) * &z;
        sheet(((x + y) + z) * 3.0 + product * 4.0, p)
    });
