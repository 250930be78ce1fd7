//! Operators and conversions of scalars.

use super::super::{Expr, compound};
use super::truth::Truth;
use super::value::{Float, Scalar, Whole};
use super::{Found, What};
use naga::{BinaryOperator as Op, ScalarKind, UnaryOperator};

/// Whole numbers up to here are exact as `f32`.
const EXACT: i64 = 1 << 24;
/// Up to here, a quotient and half of one over the divisor differ by more than a GPU's division rounds.
const DIVISIBLE: i64 = 1 << 20;
/// An integer made of a float is taken to be no larger.
const CONVERTED: i64 = 1 << 18;

fn no_form(what: impl Into<String>) -> What {
    What::NoForm { what: what.into() }
}

/// A binary operator.
pub fn binary(op: Op, a: &Scalar, b: &Scalar) -> Found<Scalar> {
    match (a, b) {
        (Scalar::Float(a), Scalar::Float(b)) => float(op, a, b),
        (Scalar::Whole(a), Scalar::Whole(b)) => whole(op, a, b),
        (Scalar::Bool(a), Scalar::Bool(b)) => {
            let differs = || a.choose(&b.not(), b);
            Ok(Scalar::Bool(match op {
                Op::And | Op::LogicalAnd => a.and(b),
                Op::InclusiveOr | Op::LogicalOr => a.or(b),
                Op::Equal => differs().not(),
                Op::NotEqual | Op::ExclusiveOr => differs(),
                _ => return Err(no_form("this operation on booleans")),
            }))
        }
        _ => Err(no_form("an operation on numbers of different types")),
    }
}

/// A comparison, given what decides it and the expressions otherwise.
fn compare(op: Op, known: Option<std::cmp::Ordering>, a: &Expr, b: &Expr) -> Option<Truth> {
    let decided = |holds: fn(std::cmp::Ordering) -> bool, expr: &dyn Fn() -> Truth| {
        known.map_or_else(expr, |order| Truth::Known(holds(order)))
    };
    Some(match op {
        Op::Less => decided(|o| o.is_lt(), &|| Truth::of(a.less(b))),
        Op::LessEqual => decided(|o| o.is_le(), &|| Truth::of(a.less_equal(b))),
        Op::Greater => decided(|o| o.is_gt(), &|| Truth::of(b.less(a))),
        Op::GreaterEqual => decided(|o| o.is_ge(), &|| Truth::of(b.less_equal(a))),
        Op::Equal => decided(|o| o.is_eq(), &|| Truth::equal(a, b)),
        Op::NotEqual => decided(|o| o.is_ne(), &|| Truth::equal(a, b).not()),
        _ => return None,
    })
}

fn float(op: Op, a: &Float, b: &Float) -> Found<Scalar> {
    let known = a.known.zip(b.known);
    let order = known.and_then(|(a, b)| a.partial_cmp(&b));
    if let Some(truth) = compare(op, order, &a.expr, &b.expr) {
        // NaN is unlike anything, but so much the same everywhere.
        let unordered = known.is_some() && order.is_none();
        return Ok(Scalar::Bool(if unordered { Truth::Known(op == Op::NotEqual) } else { truth }));
    }
    if let Some((a, b)) = known {
        let value = match op {
            Op::Add => a + b,
            Op::Subtract => a - b,
            Op::Multiply => a * b,
            Op::Divide => a / b,
            Op::Modulo => a % b,
            _ => return Err(no_form("this operation on floats")),
        };
        return Ok(Scalar::Float(Float::known(value)));
    }
    let (a, b) = (&a.expr, &b.expr);
    Ok(Scalar::Float(Float::unknown(match op {
        Op::Add => a + b,
        Op::Subtract => a - b,
        Op::Multiply => a * b,
        Op::Divide => a / b,
        Op::Modulo => a - b * compound::trunc(&(a / b)),
        _ => return Err(no_form("this operation on floats")),
    })))
}

fn symbol(op: Op) -> &'static str {
    match op {
        Op::Add => "+",
        Op::Subtract => "-",
        Op::Multiply => "*",
        Op::Divide => "/",
        Op::Modulo => "%",
        Op::And => "&",
        Op::ExclusiveOr => "^",
        Op::InclusiveOr => "|",
        Op::ShiftLeft => "<<",
        Op::ShiftRight => ">>",
        _ => "an operation",
    }
}

/// An integer that is chosen among some is computed with as `f32`: so it must be no larger than these hold.
pub fn check_exact(a: &Whole) -> Found<()> {
    if a.expr.is_some() && (a.low < -EXACT || a.high > EXACT) {
        return Err(no_form("an integer that varies and may be large"));
    }
    Ok(())
}

fn whole(op: Op, a: &Whole, b: &Whole) -> Found<Scalar> {
    let unsigned = a.unsigned;
    let order = if a.high < b.low {
        Some(std::cmp::Ordering::Less)
    } else if a.low > b.high {
        Some(std::cmp::Ordering::Greater)
    } else if a.value().is_some() && a.value() == b.value() {
        Some(std::cmp::Ordering::Equal)
    } else {
        None
    };
    if order.is_none() || compare(op, order, &a.expr(), &b.expr()).is_none() {
        check_exact(a)?;
        check_exact(b)?;
    }
    if let Some(truth) = compare(op, order, &a.expr(), &b.expr()) {
        // Where the ranges touch, `<=` and `>=` may still be certain.
        let certain = match op {
            Op::LessEqual if a.high <= b.low => Some(true),
            Op::Less if a.low >= b.high => Some(false),
            Op::GreaterEqual if a.low >= b.high => Some(true),
            Op::Greater if a.high <= b.low => Some(false),
            _ => None,
        };
        return Ok(Scalar::Bool(certain.map_or(truth, Truth::Known)));
    }
    if let (Some(a), Some(b)) = (a.value(), b.value()) {
        let shift = (b & 31) as u32;
        let value = match op {
            Op::Add => a + b,
            Op::Subtract => a - b,
            Op::Multiply => a.wrapping_mul(b),
            // As WGSL defines it.
            Op::Divide => a.checked_div(b).unwrap_or(a),
            Op::Modulo => a.checked_rem(b).unwrap_or(0),
            Op::And => a & b,
            Op::ExclusiveOr => a ^ b,
            Op::InclusiveOr => a | b,
            Op::ShiftLeft => a << shift,
            Op::ShiftRight => a >> shift,
            _ => return Err(no_form("this operation on integers")),
        };
        return Ok(Scalar::Whole(Whole::known(unsigned, value)));
    }
    let large = || no_form(format!("integer `{}`, whose result may be large,", symbol(op)));
    let result = |expr: Expr, ends: [i64; 4]| {
        let (low, high) = (ends.into_iter().min().unwrap_or(0), ends.into_iter().max().unwrap_or(0));
        if low < -EXACT || high > EXACT || (unsigned && low < 0) {
            return Err(large());
        }
        Ok(Scalar::Whole(Whole { unsigned, low, high, expr: Some(expr) }))
    };
    let small = a.low >= -DIVISIBLE && a.high <= DIVISIBLE;
    let (ea, eb) = (a.expr(), b.expr());
    // Half more than the number: then a quotient's rounding never reaches the next whole number.
    let quotient = |by: i64| ea.sign() * ((ea.abs() + 0.5) / by as f64).floor();
    match (op, b.value()) {
        (Op::Add, _) => result(ea + eb, [a.low + b.low, a.high + b.high, a.low + b.low, a.high + b.high]),
        (Op::Subtract, _) => {
            result(ea - eb, [a.low - b.high, a.high - b.low, a.low - b.high, a.high - b.low])
        }
        (Op::Multiply, _) => {
            result(ea * eb, [a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high])
        }
        (Op::Divide, Some(by @ 1..=DIVISIBLE)) if small => {
            result(quotient(by), [a.low / by, a.high / by, a.low / by, a.high / by])
        }
        (Op::Modulo, Some(by @ 1..=DIVISIBLE)) if small => {
            let least = if a.low < 0 { 1 - by } else { 0 };
            result(&ea - quotient(by) * by as f64, [least, by - 1, 0, 0])
        }
        (Op::And, Some(mask)) if mask >= 0 && (mask + 1).count_ones() == 1 && mask < EXACT => {
            let size = (mask + 1) as f64;
            result(&ea - (&ea * (1.0 / size)).floor() * size, [0, mask, 0, 0])
        }
        (Op::ShiftRight, Some(by @ 0..=24)) => {
            let size = (1_i64 << by) as f64;
            result((&ea * (1.0 / size)).floor(), [a.low >> by, a.high >> by, a.low >> by, a.high >> by])
        }
        (Op::Divide | Op::Modulo, _) => Err(large()),
        _ => Err(no_form(format!("integer `{}`", symbol(op)))),
    }
}

/// A unary operator.
pub fn unary(op: UnaryOperator, a: &Scalar) -> Found<Scalar> {
    Ok(match (op, a) {
        (UnaryOperator::Negate, Scalar::Float(a)) => {
            Scalar::Float(Float { expr: -&a.expr, known: a.known.map(|a| -a) })
        }
        (UnaryOperator::Negate, Scalar::Whole(a)) => match a.value() {
            Some(value) => Scalar::Whole(Whole::known(a.unsigned, -value)),
            None => {
                check_exact(a)?;
                Scalar::Whole(Whole { low: -a.high, high: -a.low, expr: Some(-a.expr()), ..a.clone() })
            }
        },
        (UnaryOperator::LogicalNot, Scalar::Bool(a)) => Scalar::Bool(a.not()),
        (UnaryOperator::BitwiseNot, Scalar::Whole(a)) if a.value().is_some() => {
            Scalar::Whole(Whole::known(a.unsigned, !a.low))
        }
        _ => return Err(no_form("integer `~`")),
    })
}

/// A conversion by value.
pub fn convert(a: &Scalar, to: ScalarKind) -> Found<Scalar> {
    let unsigned = to == ScalarKind::Uint;
    Ok(match (to, a) {
        (ScalarKind::Float | ScalarKind::AbstractFloat, Scalar::Float(_))
        | (ScalarKind::Bool, Scalar::Bool(_)) => a.clone(),
        (ScalarKind::Float | ScalarKind::AbstractFloat, Scalar::Whole(a)) => Scalar::Float(match a.value() {
            Some(value) => Float::known(value as f32),
            None => Float::unknown(a.expr()),
        }),
        (ScalarKind::Float | ScalarKind::AbstractFloat, Scalar::Bool(a)) => Scalar::Float(match a.known() {
            Some(known) => Float::known(f32::from(u8::from(known))),
            None => Float::unknown(a.expr()),
        }),
        (ScalarKind::Bool, Scalar::Float(a)) => Scalar::Bool(match a.known {
            Some(known) => Truth::Known(known != 0.0),
            None => Truth::equal(&a.expr, &0.0.into()).not(),
        }),
        (ScalarKind::Bool, Scalar::Whole(_)) => {
            let zero = Whole { low: 0, high: 0, expr: None, unsigned };
            binary(Op::NotEqual, a, &Scalar::Whole(zero))?
        }
        (_, Scalar::Float(a)) => Scalar::Whole(match a.known {
            // The largest floats that the types hold.
            Some(known) if unsigned => {
                Whole::known(true, i64::from(known.clamp(0.0, 4_294_967_040.0) as u32))
            }
            Some(known) => Whole::known(false, i64::from(known.clamp(f32::MIN, 2_147_483_520.0) as i32)),
            None => {
                let low = if unsigned { 0 } else { -CONVERTED };
                let whole = if unsigned { a.expr.floor().max(0.0) } else { compound::trunc(&a.expr) };
                Whole { unsigned, low, high: CONVERTED, expr: Some(whole) }
            }
        }),
        (_, Scalar::Bool(a)) => Scalar::Whole(match a.known() {
            Some(known) => Whole::known(unsigned, i64::from(known)),
            None => Whole { unsigned, low: 0, high: 1, expr: Some(a.expr()) },
        }),
        (_, Scalar::Whole(a)) => Scalar::Whole(match a.value() {
            Some(value) => Whole::known(unsigned, value),
            None if unsigned && a.low < 0 => return Err(no_form("`u32` of an integer that may be negative")),
            None => {
                check_exact(a)?;
                Whole { unsigned, ..a.clone() }
            }
        }),
    })
}
