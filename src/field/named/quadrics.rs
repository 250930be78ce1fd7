//! Surfaces of second degree.

use super::{Definition, Parameter, any, positive};
use crate::field::Sense;
use crate::graph::{Expr, x, y, z};

const fn quadric(
    name: &'static str,
    formula: &'static str,
    parameters: &'static [Parameter],
    build: fn(&[Expr]) -> Expr,
) -> Definition {
    Definition { name, formula, parameters, iso: 0.0, sense: Sense::Below, half_edge: 1.5, build }
}

/// c²/p²: `p` goes into a factor, which is computed once.
fn over(c: Expr, p: &Expr) -> Expr {
    c.square() * (1.0 / p.square())
}

/// Any of them.
pub const QUADRIC: Definition = quadric(
    "quadric",
    "ax² + by² + cz² + 2dxy + 2exz + 2fyz + gx + hy + iz + j",
    &[
        any("a", "factor of x²", 1.0),
        any("b", "factor of y²", 2.0),
        any("c", "factor of z²", 3.0),
        any("d", "half the factor of xy", 0.6),
        any("e", "half the factor of xz", -0.4),
        any("f", "half the factor of yz", 0.8),
        any("g", "factor of x", 0.0),
        any("h", "factor of y", 0.0),
        any("i", "factor of z", 0.0),
        any("j", "constant", -1.0),
    ],
    |p| {
        let squares = (x().square() * &p[0] + y().square() * &p[1]) + z().square() * &p[2];
        let twice = |i: usize| &p[i] * 2.0;
        let mixed = (x() * y() * twice(3) + x() * z() * twice(4)) + y() * z() * twice(5);
        let linear = (x() * &p[6] + y() * &p[7]) + z() * &p[8];
        ((squares + mixed) + linear) + &p[9]
    },
);

const HALF_AXES: &[Parameter] = &[
    positive("a", "half axis along x", 1.3),
    positive("b", "half axis along y", 1.0),
    positive("c", "half axis along z", 0.7),
];

/// x²/a² + y²/b² − z²/c²: a hyperboloid of one sheet above 0, of two below, and their common cone at 0.
fn hyperboloid(p: &[Expr]) -> Expr {
    (over(x(), &p[0]) + over(y(), &p[1])) - over(z(), &p[2])
}

/// Closed.
pub const ELLIPSOID: Definition = Definition {
    iso: 1.0,
    ..quadric("ellipsoid", "x²/a² + y²/b² + z²/c²; at iso 1 with these half axes", HALF_AXES, |p| {
        (over(x(), &p[0]) + over(y(), &p[1])) + over(z(), &p[2])
    })
};

const WAIST: &[Parameter] = &[
    positive("a", "half axis of the waist along x", 0.6),
    positive("b", "half axis of the waist along y", 0.5),
    positive("c", "height at which the waist is wider by √2", 0.7),
];

/// A cooling tower.
pub const HYPERBOLOID_ONE_SHEET: Definition = Definition {
    iso: 1.0,
    ..quadric("hyperboloid_one_sheet", "x²/a² + y²/b² − z²/c²; at iso 1 with this waist", WAIST, hyperboloid)
};

const BOWLS: &[Parameter] = &[
    positive("a", "width along x", 0.5),
    positive("b", "width along y", 0.4),
    positive("c", "distance of the bowls from the origin", 0.4),
];

/// Two bowls.
pub const HYPERBOLOID_TWO_SHEETS: Definition = Definition {
    iso: -1.0,
    ..quadric("hyperboloid_two_sheets", "x²/a² + y²/b² − z²/c²; at iso −1 so far apart", BOWLS, hyperboloid)
};

const WIDTHS: &[Parameter] = &[positive("a", "width along x", 1.0), positive("b", "width along y", 1.0)];

/// A saddle.
pub const HYPERBOLIC_PARABOLOID: Definition =
    quadric("hyperbolic_paraboloid", "x²/a² − y²/b² − z", WIDTHS, |p| {
        (over(x(), &p[0]) - over(y(), &p[1])) - z()
    });

/// A bowl.
pub const ELLIPTIC_PARABOLOID: Definition =
    quadric("elliptic_paraboloid", "x²/a² + y²/b² − z", WIDTHS, |p| {
        (over(x(), &p[0]) + over(y(), &p[1])) - z()
    });

const SLOPES: &[Parameter] = &[
    positive("a", "half axis along x at z = c", 1.0),
    positive("b", "half axis along y at z = c", 0.7),
    positive("c", "height where a and b are measured", 1.0),
];

/// Both halves; the tip is singular.
pub const ELLIPTIC_CONE: Definition = quadric("elliptic_cone", "x²/a² + y²/b² − z²/c²", SLOPES, hyperboloid);

const SECTION: &[Parameter] =
    &[positive("a", "half axis along x", 1.0), positive("b", "half axis along y", 0.6)];

/// Without ends.
pub const ELLIPTIC_CYLINDER: Definition = Definition {
    iso: 1.0,
    ..quadric("elliptic_cylinder", "x²/a² + y²/b²; at iso 1 with these half axes", SECTION, |p| {
        over(x(), &p[0]) + over(y(), &p[1])
    })
};

/// They cross in the z axis, which is singular.
pub const PAIR_OF_PLANES: Definition =
    quadric("pair_of_planes", "x²/a² − y²/b²", WIDTHS, |p| over(x(), &p[0]) - over(y(), &p[1]));
