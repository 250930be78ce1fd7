//! The functions and constants that a formula may name.

use super::super::{Expr, compound};
use std::f64::consts::{E, PI, TAU};

/// A function of a formula.
pub struct Function {
    pub name: &'static str,
    /// How many arguments it takes.
    pub least: usize,
    pub most: usize,
    /// The value, given so many arguments.
    pub build: fn(&[Expr]) -> Expr,
}

macro_rules! functions {
    ($($name:literal $least:literal..=$most:expr, $build:expr;)*) => {
        /// All of them.
        pub const FUNCTIONS: &[Function] =
            &[$(Function { name: $name, least: $least, most: $most, build: $build }),*];
    };
}

const ANY: usize = usize::MAX;

functions! {
    "sqrt" 1..=1, |a| a[0].sqrt();
    "abs" 1..=1, |a| a[0].abs();
    "square" 1..=1, |a| a[0].square();
    "sign" 1..=1, |a| a[0].sign();
    "floor" 1..=1, |a| a[0].floor();
    "ceil" 1..=1, |a| compound::ceil(&a[0]);
    "round" 1..=1, |a| compound::round(&a[0]);
    "trunc" 1..=1, |a| compound::trunc(&a[0]);
    "fract" 1..=1, |a| compound::fract(&a[0]);
    "mod" 2..=2, |a| &a[0] - &a[1] * (&a[0] / &a[1]).floor();
    "min" 1..=ANY, |a| a[1..].iter().fold(a[0].clone(), |least, next| least.min(next));
    "max" 1..=ANY, |a| a[1..].iter().fold(a[0].clone(), |most, next| most.max(next));
    "clamp" 3..=3, |a| compound::clamp(&a[0], &a[1], &a[2]);
    "mix" 3..=3, |a| compound::mix(&a[0], &a[1], &a[2]);
    "step" 2..=2, |a| a[0].less_equal(&a[1]);
    "smoothstep" 3..=3, |a| compound::smoothstep(&a[0], &a[1], &a[2]);
    "select" 3..=3, |a| a[0].select(&a[1], &a[2]);
    "if" 3..=3, |a| a[0].select(&a[1], &a[2]);
    "length" 1..=ANY, compound::length;
    "hypot" 2..=ANY, compound::length;
    "sin" 1..=1, |a| a[0].sin();
    "cos" 1..=1, |a| a[0].cos();
    "tan" 1..=1, |a| compound::tan(&a[0]);
    "asin" 1..=1, |a| a[0].asin();
    "acos" 1..=1, |a| a[0].acos();
    "atan" 1..=1, |a| a[0].atan();
    "atan2" 2..=2, |a| a[0].atan2(&a[1]);
    "exp" 1..=1, |a| a[0].exp();
    "ln" 1..=1, |a| a[0].ln();
    "log2" 1..=1, |a| compound::log2(&a[0]);
    "log10" 1..=1, |a| compound::log10(&a[0]);
    "pow" 2..=2, |a| a[0].pow(&a[1]);
    "sinh" 1..=1, |a| compound::sinh(&a[0]);
    "cosh" 1..=1, |a| compound::cosh(&a[0]);
    "tanh" 1..=1, |a| a[0].tanh();
}

/// Numbers with a name.
pub const CONSTANTS: [(&str, f64); 3] = [("pi", PI), ("tau", TAU), ("e", E)];
