//! Every operation of the field graph, defined in one place for everything that evaluates it: constant
//! folding in `f64`, values and derivatives on the CPU, intervals, and the WGSL of all three.
//!
//! An entry that lacks a part does not compile. In WGSL, `A`, `B` and `V` stand for the operands and the
//! value; in that of intervals for theirs. The Rust closures do the same in the same order, so that both
//! give the same bits (`src/gpu/exact.rs`).

use super::interval::{self as iv, Interval};
use crate::field::functions::{acos, asin, atan, atan2, cos, cos_turns, exp, ln, pow, sin, sin_turns, tanh};

/// The WGSL of an operation.
#[derive(Debug)]
pub struct OpWgsl {
    /// Its value.
    pub value: &'static str,
    /// Derivatives of the value by each operand.
    pub slopes: &'static [&'static str],
    /// Its interval.
    pub interval: &'static str,
}

macro_rules! operations {
    ($kind:ident, $visit:ident, $fold_type:ty, $args:tt, ($($arg:ident),*); $(
        $(#[$doc:meta])* $name:ident {
            fold: $fold:expr, value: $value:expr, slopes: [$($slope:expr),*], interval: $interval:expr,
            wgsl: $wgsl_value:literal, [$($wgsl_slope:literal),*], $wgsl_interval:literal $(,)?
        }
    )*) => {
        /// The operations of so many operands.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $kind { $($(#[$doc])* $name),* }

        impl $kind {
            /// All of them.
            pub const ALL: &'static [$kind] = &[$($kind::$name),*];

            /// The value in `f64`, for folding constants.
            pub fn fold(self, $($arg: f64),*) -> f64 {
                let fold: $fold_type = match self { $($kind::$name => $fold),* };
                fold $args
            }

            /// The interval of the value.
            #[inline(always)]
            pub fn interval(self, $($arg: Interval),*) -> Interval {
                match self { $($kind::$name => ($interval) $args),* }
            }

            /// The WGSL.
            pub fn wgsl(self) -> OpWgsl {
                match self { $($kind::$name => OpWgsl {
                    value: $wgsl_value, slopes: &[$($wgsl_slope),*], interval: $wgsl_interval,
                }),* }
            }

            /// Hands the value's closure, and those of its slopes, to the visitor.
            #[inline(always)]
            pub(super) fn visit<V: $visit>(self, visitor: V) {
                match self { $($kind::$name => visitor.visit($value, ($($slope,)*))),* }
            }
        }
    };
}

/// Takes the closures of a [`Unary`] operation: value of `a`; slope of `a` and the value.
pub(super) trait VisitUnary {
    /// Applies them.
    fn visit(self, value: impl Fn(f32) -> f32, slopes: (impl Fn(f32, f32) -> f32,));
}

/// Takes the closures of a [`Binary`] operation: value of `a` and `b`; slopes of `a`, `b` and the value.
pub(super) trait VisitBinary {
    /// Applies them.
    fn visit(
        self,
        value: impl Fn(f32, f32) -> f32,
        slopes: (impl Fn(f32, f32, f32) -> f32, impl Fn(f32, f32, f32) -> f32),
    );
}

#[inline(always)]
fn sign(a: f32) -> f32 {
    if a > 0.0 {
        1.0
    } else if a < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// The derivative of v = aᵇ by a, without a second power.
#[inline(always)]
fn pow_slope(a: f32, b: f32, v: f32) -> f32 {
    if a != 0.0 {
        b * v / a
    } else if b >= 1.0 {
        if b == 1.0 { 1.0 } else { 0.0 }
    } else {
        1.0 / a
    }
}

const TAU: f32 = std::f32::consts::TAU;

operations! { Unary, VisitUnary, fn(f64) -> f64, (a), (a);
    /// −a
    Neg {
        fold: |a| -a, value: |a: f32| -a, slopes: [|_: f32, _: f32| -1.0], interval: iv::neg,
        wgsl: "-A", ["-1.0"], "iv_neg(A)",
    }
    /// |a|
    Abs {
        fold: f64::abs, value: f32::abs, slopes: [|a: f32, _: f32| sign(a)], interval: iv::abs,
        wgsl: "abs(A)", ["(f32(A > 0.0) - f32(A < 0.0))"], "iv_abs(A)",
    }
    /// a²
    Square {
        fold: |a| a * a, value: |a: f32| a * a, slopes: [|a: f32, _: f32| a + a], interval: iv::square,
        wgsl: "A * A", ["A + A"], "iv_square(A)",
    }
    /// √a
    Sqrt {
        fold: f64::sqrt, value: f32::sqrt, slopes: [|_: f32, v: f32| 0.5 / v], interval: iv::sqrt,
        wgsl: "sqrt(A)", ["0.5 / V"], "iv_sqrt(A)",
    }
    /// Largest whole number not above a
    Floor {
        fold: f64::floor, value: f32::floor, slopes: [|_: f32, _: f32| 0.0], interval: iv::floor,
        wgsl: "floor(A)", ["0.0"], "iv_floor(A)",
    }
    /// −1, 0 or 1
    Sign {
        fold: |a| if a == 0.0 { 0.0 } else { a.signum() }, value: sign, slopes: [|_: f32, _: f32| 0.0],
        interval: iv::sign,
        wgsl: "f32(A > 0.0) - f32(A < 0.0)", ["0.0"], "iv_sign(A)",
    }
    /// Sine of a in turns
    SinTurns {
        fold: |a| (a * std::f64::consts::TAU).sin(), value: sin_turns,
        slopes: [|a: f32, _: f32| TAU * cos_turns(a)],
        interval: |a: Interval| iv::wave(a, (sin_turns(a.lo), sin_turns(a.hi)), 0.25),
        wgsl: "sin_turns(A)", ["6.2831855f * cos_turns(A)"],
        "iv_wave(A, vec2<f32>(sin_turns(A.x), sin_turns(A.y)), 0.25)",
    }
    /// Cosine of a in turns
    CosTurns {
        fold: |a| (a * std::f64::consts::TAU).cos(), value: cos_turns,
        slopes: [|a: f32, _: f32| -TAU * sin_turns(a)],
        interval: |a: Interval| iv::wave(a, (cos_turns(a.lo), cos_turns(a.hi)), 0.0),
        wgsl: "cos_turns(A)", ["-6.2831855f * sin_turns(A)"],
        "iv_wave(A, vec2<f32>(cos_turns(A.x), cos_turns(A.y)), 0.0)",
    }
    /// eᵃ
    Exp {
        fold: f64::exp, value: exp, slopes: [|_: f32, v: f32| v],
        interval: |a: Interval| Interval::new(exp(a.lo), exp(a.hi)).grown(a.is_bounded(), 1e-5, 0.0),
        wgsl: "iso_exp(A)", ["V"],
        "iv_grown(vec2<f32>(iso_exp(A.x), iso_exp(A.y)), iv_bounded(A), 1e-5f, 0.0)",
    }
    /// Natural logarithm
    Ln {
        fold: f64::ln, value: ln, slopes: [|a: f32, _: f32| 1.0 / a],
        interval: |a: Interval| {
            Interval::new(ln(a.lo), ln(a.hi)).grown(a.is_bounded() && a.lo > 1e-30, 1e-5, 1e-6)
        },
        wgsl: "iso_ln(A)", ["1.0 / A"],
        "iv_grown(vec2<f32>(iso_ln(A.x), iso_ln(A.y)), iv_bounded(A) && A.x > 1e-30f, 1e-5f, 1e-6f)",
    }
    /// Sine of a in radians
    Sin {
        fold: f64::sin, value: sin, slopes: [|a: f32, _: f32| cos(a)],
        interval: |a: Interval| iv::wave(iv::in_turns(a), (sin(a.lo), sin(a.hi)), 0.25),
        wgsl: "iso_sin(A)", ["iso_cos(A)"],
        "iv_wave(iv_in_turns(A), vec2<f32>(iso_sin(A.x), iso_sin(A.y)), 0.25)",
    }
    /// Cosine of a in radians
    Cos {
        fold: f64::cos, value: cos, slopes: [|a: f32, _: f32| -sin(a)],
        interval: |a: Interval| iv::wave(iv::in_turns(a), (cos(a.lo), cos(a.hi)), 0.0),
        wgsl: "iso_cos(A)", ["-iso_sin(A)"],
        "iv_wave(iv_in_turns(A), vec2<f32>(iso_cos(A.x), iso_cos(A.y)), 0.0)",
    }
    /// Arc sine, in radians
    Asin {
        fold: f64::asin, value: asin, slopes: [|a: f32, _: f32| 1.0 / (1.0 - a * a).sqrt()],
        interval: |a: Interval| {
            Interval::new(asin(a.lo), asin(a.hi)).grown(a.lo >= -1.0 && a.hi <= 1.0, 1e-5, 1e-6)
        },
        wgsl: "iso_asin(A)", ["1.0 / sqrt(1.0 - A * A)"],
        "iv_grown(vec2<f32>(iso_asin(A.x), iso_asin(A.y)), A.x >= -1.0 && A.y <= 1.0, 1e-5f, 1e-6f)",
    }
    /// Arc cosine, in radians
    Acos {
        fold: f64::acos, value: acos, slopes: [|a: f32, _: f32| -1.0 / (1.0 - a * a).sqrt()],
        interval: |a: Interval| {
            Interval::new(acos(a.hi), acos(a.lo)).grown(a.lo >= -1.0 && a.hi <= 1.0, 1e-5, 1e-6)
        },
        wgsl: "iso_acos(A)", ["-1.0 / sqrt(1.0 - A * A)"],
        "iv_grown(vec2<f32>(iso_acos(A.y), iso_acos(A.x)), A.x >= -1.0 && A.y <= 1.0, 1e-5f, 1e-6f)",
    }
    /// Arc tangent, in radians
    Atan {
        fold: f64::atan, value: atan, slopes: [|a: f32, _: f32| 1.0 / (1.0 + a * a)],
        interval: |a: Interval| Interval::new(atan(a.lo), atan(a.hi)).grown(a.is_bounded(), 1e-5, 1e-6),
        wgsl: "iso_atan(A)", ["1.0 / (1.0 + A * A)"],
        "iv_grown(vec2<f32>(iso_atan(A.x), iso_atan(A.y)), iv_bounded(A), 1e-5f, 1e-6f)",
    }
    /// Hyperbolic tangent
    Tanh {
        fold: f64::tanh, value: tanh, slopes: [|_: f32, v: f32| 1.0 - v * v],
        interval: |a: Interval| Interval::new(tanh(a.lo), tanh(a.hi)).grown(a.is_bounded(), 1e-5, 1e-6),
        wgsl: "iso_tanh(A)", ["(1.0 - V * V)"],
        "iv_grown(vec2<f32>(iso_tanh(A.x), iso_tanh(A.y)), iv_bounded(A), 1e-5f, 1e-6f)",
    }
}

operations! { Binary, VisitBinary, fn(f64, f64) -> f64, (a, b), (a, b);
    /// a + b
    Add {
        fold: |a, b| a + b, value: |a: f32, b: f32| a + b,
        slopes: [|_: f32, _: f32, _: f32| 1.0, |_: f32, _: f32, _: f32| 1.0], interval: iv::add,
        wgsl: "A + B", ["1.0", "1.0"], "iv_add(A, B)",
    }
    /// a − b
    Sub {
        fold: |a, b| a - b, value: |a: f32, b: f32| a - b,
        slopes: [|_: f32, _: f32, _: f32| 1.0, |_: f32, _: f32, _: f32| -1.0], interval: iv::sub,
        wgsl: "A - B", ["1.0", "-1.0"], "iv_sub(A, B)",
    }
    /// a · b
    Mul {
        fold: |a, b| a * b, value: |a: f32, b: f32| a * b,
        slopes: [|_: f32, b: f32, _: f32| b, |a: f32, _: f32, _: f32| a], interval: iv::mul,
        wgsl: "A * B", ["B", "A"], "iv_mul(A, B)",
    }
    /// a / b
    Div {
        fold: |a, b| a / b, value: |a: f32, b: f32| a / b,
        slopes: [|_: f32, b: f32, _: f32| 1.0 / b, |_: f32, b: f32, v: f32| -v / b], interval: iv::div,
        wgsl: "A / B", ["1.0 / B", "-V / B"], "iv_div(A, B)",
    }
    /// The smaller; a where neither is
    Min {
        fold: |a, b| if b < a { b } else { a }, value: |a: f32, b: f32| if b < a { b } else { a },
        slopes: [
            |a: f32, b: f32, _: f32| if b < a { 0.0 } else { 1.0 },
            |a: f32, b: f32, _: f32| if b < a { 1.0 } else { 0.0 }
        ],
        interval: iv::min,
        wgsl: "select(A, B, B < A)", ["f32(!(B < A))", "f32(B < A)"], "iv_min(A, B)",
    }
    /// The larger; a where neither is
    Max {
        fold: |a, b| if b > a { b } else { a }, value: |a: f32, b: f32| if b > a { b } else { a },
        slopes: [
            |a: f32, b: f32, _: f32| if b > a { 0.0 } else { 1.0 },
            |a: f32, b: f32, _: f32| if b > a { 1.0 } else { 0.0 }
        ],
        interval: iv::max,
        wgsl: "select(A, B, B > A)", ["f32(!(B > A))", "f32(B > A)"], "iv_max(A, B)",
    }
    /// 1 where a < b, else 0
    Less {
        fold: |a, b| f64::from(u8::from(a < b)), value: |a: f32, b: f32| if a < b { 1.0 } else { 0.0 },
        slopes: [|_: f32, _: f32, _: f32| 0.0, |_: f32, _: f32, _: f32| 0.0], interval: iv::less,
        wgsl: "f32(A < B)", ["0.0", "0.0"], "iv_less(A, B)",
    }
    /// 1 where a ≤ b, else 0
    LessEqual {
        fold: |a, b| f64::from(u8::from(a <= b)), value: |a: f32, b: f32| if a <= b { 1.0 } else { 0.0 },
        slopes: [|_: f32, _: f32, _: f32| 0.0, |_: f32, _: f32, _: f32| 0.0], interval: iv::less_equal,
        wgsl: "f32(A <= B)", ["0.0", "0.0"], "iv_less_equal(A, B)",
    }
    /// aᵇ; NaN for negative a unless b is whole
    Pow {
        fold: f64::powf, value: pow,
        slopes: [pow_slope, |a: f32, _: f32, v: f32| v * ln(a)],
        interval: iv::pow,
        wgsl: "iso_pow(A, B)", ["select(B * V / A, select(1.0 / A, f32(B == 1.0), B >= 1.0), A == 0.0)", "V * iso_ln(A)"], "iv_pow(A, B)",
    }
    /// The angle of the point (b, a), in radians from −π to π
    Atan2 {
        fold: f64::atan2, value: atan2,
        slopes: [|a: f32, b: f32, _: f32| b / (a * a + b * b), |a: f32, b: f32, _: f32| -a / (a * a + b * b)],
        interval: iv::atan2,
        wgsl: "iso_atan2(A, B)",
        ["B / (A * A + B * B)", "-A / (A * A + B * B)"],
        "iv_atan2(A, B)",
    }
}
