//! Functions that are combinations of operations, for the front ends.

use super::Expr;
use std::f64::consts::TAU;

/// Smallest whole number not below.
pub fn ceil(a: &Expr) -> Expr {
    -(-a).floor()
}

/// Nearest whole number, of two the even one.
pub fn round(a: &Expr) -> Expr {
    let below = a.floor();
    let over = a - &below;
    let even = ((&below + 1.0) * 0.5).floor() * 2.0;
    over.less(0.5).select(&below, Expr::from(0.5).less(&over).select(&below + 1.0, even))
}

/// The whole part, towards 0.
pub fn trunc(a: &Expr) -> Expr {
    a.less(0.0).select(ceil(a), a.floor())
}

/// What is over the largest whole number not above.
pub fn fract(a: &Expr) -> Expr {
    a - a.floor()
}

/// `x` brought into the range from `low` to `high`.
pub fn clamp(x: &Expr, low: &Expr, high: &Expr) -> Expr {
    x.max(low).min(high)
}

/// From `a` at t = 0 to `b` at t = 1.
pub fn mix(a: &Expr, b: &Expr, t: &Expr) -> Expr {
    a * (1.0 - t) + b * t
}

/// 0 below `low`, 1 above `high`, smooth between.
pub fn smoothstep(low: &Expr, high: &Expr, x: &Expr) -> Expr {
    let t = clamp(&((x - low) / (high - low)), &0.0.into(), &1.0.into());
    t.square() * (3.0 - &t * 2.0)
}

/// Sum of products, the first two first.
pub fn dot(a: &[Expr], b: &[Expr]) -> Expr {
    let products = a.iter().zip(b).map(|(a, b)| a * b);
    products.reduce(|sum, next| sum + next).unwrap_or_else(|| 0.0.into())
}

/// Length of a vector.
pub fn length(a: &[Expr]) -> Expr {
    dot(a, a).sqrt()
}

/// Sine of an angle in radians.
pub fn sin(a: &Expr) -> Expr {
    (a * (1.0 / TAU)).sin_turns()
}

/// Cosine of an angle in radians.
pub fn cos(a: &Expr) -> Expr {
    (a * (1.0 / TAU)).cos_turns()
}
