//! Every operation of the field graph, defined in one place for everything that evaluates it: constant
//! folding in `f64`, values and derivatives on the CPU, intervals, and the WGSL of all three.
//!
//! An entry that lacks a part does not compile. In WGSL, `A`, `B` and `V` stand for the operands and the
//! value; in that of intervals for theirs. The Rust closures do the same in the same order, so that both
//! give the same bits where the GPU does not contract.

use super::interval::{self as iv, Interval};
use crate::field::turns::{cos_turns, sin_turns};

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
    /// √a. Its slope at 0 is taken as 0: of lengths, that is the mean over all directions.
    Sqrt {
        fold: f64::sqrt, value: f32::sqrt, slopes: [|_: f32, v: f32| if v == 0.0 { 0.0 } else { 0.5 / v }],
        interval: iv::sqrt,
        wgsl: "sqrt(A)", ["select(0.5 / V, 0.0, V == 0.0)"], "iv_sqrt(A)",
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
}
