//! Functions that are combinations of operations, for the front ends.

use super::Expr;
use std::f64::consts::{LN_2, LOG2_E, LOG10_E};

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

/// A power: by products where the exponent is known and whole, by a root where it is a half.
pub fn power(a: &Expr, b: &Expr, known: Option<f64>) -> Expr {
    match known {
        Some(n) if n.fract() == 0.0 && n.abs() < f64::from(i32::MAX) => a.powi(n as i32),
        Some(0.5) => a.sqrt(),
        _ => a.pow(b),
    }
}

/// Tangent of an angle in radians.
pub fn tan(a: &Expr) -> Expr {
    a.sin() / a.cos()
}

/// 2 to the power of `a`.
pub fn exp2(a: &Expr) -> Expr {
    (a * LN_2).exp()
}

/// Logarithm to the base 2.
pub fn log2(a: &Expr) -> Expr {
    a.ln() * LOG2_E
}

/// Logarithm to the base 10.
pub fn log10(a: &Expr) -> Expr {
    a.ln() * LOG10_E
}

/// Hyperbolic sine.
pub fn sinh(a: &Expr) -> Expr {
    (a.exp() - (-a).exp()) * 0.5
}

/// Hyperbolic cosine.
pub fn cosh(a: &Expr) -> Expr {
    (a.exp() + (-a).exp()) * 0.5
}

/// Inverse hyperbolic sine.
pub fn asinh(a: &Expr) -> Expr {
    // Of the magnitude: the sum would cancel for negative numbers.
    a.sign() * (a.abs() + (a.square() + 1.0).sqrt()).ln()
}

/// Inverse hyperbolic cosine.
pub fn acosh(a: &Expr) -> Expr {
    (a + (a.square() - 1.0).sqrt()).ln()
}

/// Inverse hyperbolic tangent.
pub fn atanh(a: &Expr) -> Expr {
    ((1.0 + a) / (1.0 - a)).ln() * 0.5
}
