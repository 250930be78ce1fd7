//! The built-in functions of WGSL.

use super::super::{Expr, compound};
use super::arithmetic::check_exact;
use super::truth::Truth;
use super::value::{Float, Scalar, Value, Whole};
use super::{Found, What};
use naga::MathFunction as Fun;

/// A built-in function.
pub fn call(fun: Fun, arguments: &[&Value]) -> Found<Value> {
    let value = match geometry(fun, arguments)? {
        Some(value) => value,
        None => componentwise(fun, arguments)?,
    };
    // Of known numbers, the number.
    if arguments.iter().all(|a| a.unknown_count() == 0) {
        return value.map(&mut |scalar| {
            Ok(match scalar {
                Scalar::Float(Float { expr, known: None }) => Scalar::Float(Float::folded(expr)),
                other => other.clone(),
            })
        });
    }
    Ok(value)
}

fn float(expr: Expr) -> Value {
    Float::unknown(expr).into()
}

fn exprs(value: &Value) -> Vec<Expr> {
    let scalar = |v: &Value| match v {
        Value::Scalar(scalar) => scalar.expr(),
        _ => 0.0.into(),
    };
    value.components().iter().map(scalar).collect()
}

/// A vector, or for one component a scalar.
fn vector(parts: Vec<Expr>, like: &Value) -> Value {
    match (like, parts.first()) {
        (Value::Scalar(_), Some(first)) => float(first.clone()),
        _ => Value::parts(parts.into_iter().map(float).collect()),
    }
}

fn is_float(value: &Value) -> bool {
    match value {
        Value::Scalar(scalar) => matches!(scalar, Scalar::Float(_)),
        Value::Parts(parts) => parts.iter().all(is_float),
        Value::Pointer(_) => false,
    }
}

fn length(parts: &[Expr]) -> Expr {
    if let [one] = parts { one.abs() } else { compound::length(parts) }
}

fn zip(a: &[Expr], b: &[Expr], f: impl Fn(&Expr, &Expr) -> Expr) -> Vec<Expr> {
    a.iter().zip(b).map(|(a, b)| f(a, b)).collect()
}

/// Functions of whole vectors and matrices; none if `fun` is none of them.
fn geometry(fun: Fun, arguments: &[&Value]) -> Found<Option<Value>> {
    let Some(first) = arguments.first() else { return Ok(None) };
    match fun {
        Fun::Transpose => {
            let columns: Vec<&[Value]> = first.components().iter().map(Value::components).collect();
            let rows = columns.first().map_or(0, |c| c.len());
            let row = |i: usize| Value::parts(columns.iter().map(|c| c[i].clone()).collect());
            return Ok(Some(Value::parts((0..rows).map(row).collect())));
        }
        Fun::Determinant => {
            let columns: Vec<Vec<Expr>> = first.components().iter().map(exprs).collect();
            return Ok(Some(float(determinant(&columns))));
        }
        _ if !is_float(first) => return Ok(None),
        _ => {}
    }
    let part = |i: usize| arguments.get(i).map_or_else(Vec::new, |a| exprs(a));
    let (a, b) = (part(0), part(1));
    let scaled = |a: &[Expr], by: &Expr| a.iter().map(|a| a * by).collect::<Vec<_>>();
    Ok(Some(match fun {
        Fun::Dot => float(compound::dot(&a, &b)),
        Fun::Length => float(length(&a)),
        Fun::Distance => float(length(&zip(&a, &b, |a, b| a - b))),
        Fun::Normalize => {
            let length = length(&a);
            vector(a.iter().map(|a| a / &length).collect(), first)
        }
        Fun::Cross => {
            let [ax, ay, az, bx, by, bz] = match (&a[..], &b[..]) {
                ([ax, ay, az], [bx, by, bz]) => [ax, ay, az, bx, by, bz],
                _ => return Ok(None),
            };
            let parts = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
            vector(parts.to_vec(), first)
        }
        Fun::Reflect => {
            let twice = compound::dot(&b, &a) * 2.0;
            vector(zip(&a, &scaled(&b, &twice), |a, b| a - b), first)
        }
        Fun::Refract => {
            let eta = part(2).first().cloned().unwrap_or_else(|| 0.0.into());
            let along = compound::dot(&b, &a);
            let k = 1.0 - (&eta * &eta) * (1.0 - &along * &along);
            let by = &eta * &along + k.max(0.0).sqrt();
            let bent = zip(&scaled(&a, &eta), &scaled(&b, &by), |a, b| a - b);
            vector(bent.iter().map(|v| k.less(0.0).select(0.0, v)).collect(), first)
        }
        Fun::FaceForward => {
            let against = compound::dot(&part(2), &b).less(0.0);
            vector(a.iter().map(|a| against.select(a, -a)).collect(), first)
        }
        Fun::Modf => {
            let whole: Vec<Expr> = a.iter().map(compound::trunc).collect();
            let rest = zip(&a, &whole, |a, w| a - w);
            Value::parts(vec![vector(rest, first), vector(whole, first)])
        }
        _ => return Ok(None),
    }))
}

/// By the first column; matrices have at most four.
fn determinant(columns: &[Vec<Expr>]) -> Expr {
    let [first, rest @ ..] = columns else { return 1.0.into() };
    if let ([one], true) = (&first[..], rest.is_empty()) {
        return one.clone();
    }
    let mut sum: Option<Expr> = None;
    for (row, factor) in first.iter().enumerate() {
        let without = |column: &Vec<Expr>| {
            column.iter().enumerate().filter(|(i, _)| *i != row).map(|(_, e)| e.clone()).collect()
        };
        let minor = determinant(&rest.iter().map(without).collect::<Vec<_>>());
        let term = factor * minor;
        sum = Some(match sum {
            None => term,
            Some(sum) if row % 2 == 1 => sum - term,
            Some(sum) => sum + term,
        });
    }
    sum.unwrap_or_else(|| 0.0.into())
}

/// Functions of each component alone.
fn componentwise(fun: Fun, arguments: &[&Value]) -> Found<Value> {
    let Some(first) = arguments.first() else { return Err(no_form(fun)) };
    let Value::Parts(parts) = first else {
        let scalars: Option<Vec<&Scalar>> =
            arguments.iter().map(|a| if let Value::Scalar(s) = a { Some(s) } else { None }).collect();
        let scalars = scalars.ok_or_else(|| no_form(fun))?;
        return of_scalars(fun, &scalars).map(Value::Scalar);
    };
    let component = |i: usize| {
        // `mix` takes one weight for all components.
        let own: Vec<&Value> =
            arguments.iter().map(|a| a.components().get(i).unwrap_or(&a.components()[0])).collect();
        componentwise(fun, &own)
    };
    Ok(Value::parts((0..parts.len()).map(component).collect::<Found<_>>()?))
}

fn no_form(fun: Fun) -> What {
    // The names of WGSL are those of naga, small letters first.
    let name = format!("{fun:?}");
    let (first, rest) = name.split_at(1);
    What::NoForm { what: format!("`{}{rest}`", first.to_lowercase()) }
}

fn of_scalars(fun: Fun, arguments: &[&Scalar]) -> Found<Scalar> {
    if let Some(Scalar::Whole(a)) = arguments.first() {
        let wholes: Vec<&Whole> =
            arguments.iter().filter_map(|s| if let Scalar::Whole(w) = s { Some(w) } else { None }).collect();
        return of_wholes(fun, a, &wholes[1..]).map(Scalar::Whole);
    }
    let at = |i: usize| arguments.get(i).map_or_else(|| 0.0.into(), |a| a.expr());
    // `ldexp` has a whole exponent.
    if let (Fun::Ldexp, Some(Scalar::Whole(exponent))) = (fun, arguments.get(1)) {
        let by = exponent.value().filter(|e| e.abs() < 127).ok_or_else(|| no_form(fun))?;
        return Ok(Scalar::Float(Float::unknown(at(0) * 2f64.powi(by as i32))));
    }
    if let (Fun::Pow, Some(Scalar::Float(exponent))) = (fun, arguments.get(1)) {
        let power = compound::power(&at(0), &at(1), exponent.known.map(f64::from));
        return Ok(Scalar::Float(Float::unknown(power)));
    }
    of_floats(fun, &[at(0), at(1), at(2)]).map(|expr| Scalar::Float(Float::unknown(expr)))
}

fn of_floats(fun: Fun, [a, b, c]: &[Expr; 3]) -> Found<Expr> {
    Ok(match fun {
        Fun::Abs => a.abs(),
        Fun::Min => a.min(b),
        Fun::Max => a.max(b),
        Fun::Clamp => compound::clamp(a, b, c),
        Fun::Saturate => compound::clamp(a, &0.0.into(), &1.0.into()),
        Fun::Ceil => compound::ceil(a),
        Fun::Floor => a.floor(),
        Fun::Round => compound::round(a),
        Fun::Trunc => compound::trunc(a),
        Fun::Fract => compound::fract(a),
        Fun::Sign => a.sign(),
        Fun::Fma => a * b + c,
        Fun::Mix => compound::mix(a, b, c),
        Fun::Step => a.less_equal(b),
        Fun::SmoothStep => compound::smoothstep(a, b, c),
        Fun::Sqrt => a.sqrt(),
        Fun::InverseSqrt => 1.0 / a.sqrt(),
        Fun::Radians => a * 1f64.to_radians(),
        Fun::Degrees => a * 1f64.to_degrees(),
        Fun::Sin => a.sin(),
        Fun::Cos => a.cos(),
        Fun::Tan => compound::tan(a),
        Fun::Asin => a.asin(),
        Fun::Acos => a.acos(),
        Fun::Atan => a.atan(),
        Fun::Atan2 => a.atan2(b),
        Fun::Exp => a.exp(),
        Fun::Exp2 => compound::exp2(a),
        Fun::Log => a.ln(),
        Fun::Log2 => compound::log2(a),
        Fun::Sinh => compound::sinh(a),
        Fun::Cosh => compound::cosh(a),
        Fun::Tanh => a.tanh(),
        Fun::Asinh => compound::asinh(a),
        Fun::Acosh => compound::acosh(a),
        Fun::Atanh => compound::atanh(a),
        _ => return Err(no_form(fun)),
    })
}

fn of_wholes(fun: Fun, a: &Whole, others: &[&Whole]) -> Found<Whole> {
    check_exact(a)?;
    others.iter().try_for_each(|other| check_exact(other))?;
    let lesser = |a: &Whole, b: &Whole| match (a.value(), b.value()) {
        (Some(x), Some(y)) => Whole::known(a.unsigned, x.min(y)),
        _ => Whole {
            unsigned: a.unsigned,
            low: a.low.min(b.low),
            high: a.high.min(b.high),
            expr: Some(a.expr().min(b.expr())),
        },
    };
    let greater = |a: &Whole, b: &Whole| match (a.value(), b.value()) {
        (Some(x), Some(y)) => Whole::known(a.unsigned, x.max(y)),
        _ => Whole {
            unsigned: a.unsigned,
            low: a.low.max(b.low),
            high: a.high.max(b.high),
            expr: Some(a.expr().max(b.expr())),
        },
    };
    match (fun, others, a.value()) {
        (Fun::Min, [b], _) => Ok(lesser(a, b)),
        (Fun::Max, [b], _) => Ok(greater(a, b)),
        (Fun::Clamp, [low, high], _) => Ok(lesser(&greater(a, low), high)),
        (Fun::Abs, [], Some(value)) => Ok(Whole::known(a.unsigned, value.abs())),
        (Fun::Sign, [], Some(value)) => Ok(Whole::known(a.unsigned, value.signum())),
        (Fun::Abs, [], None) => {
            let high = a.high.abs().max(a.low.abs());
            Ok(Whole { unsigned: a.unsigned, low: 0, high, expr: Some(a.expr().abs()) })
        }
        (Fun::Sign, [], None) => {
            Ok(Whole { unsigned: a.unsigned, low: -1, high: 1, expr: Some(a.expr().sign()) })
        }
        _ => Err(no_form(fun)),
    }
}

/// `all` and `any` of a vector of booleans.
pub fn relational(fun: naga::RelationalFunction, argument: &Value) -> Found<Value> {
    let truths = argument.components().iter().filter_map(|v| match v {
        Value::Scalar(Scalar::Bool(truth)) => Some(truth.clone()),
        _ => None,
    });
    let truth = match fun {
        naga::RelationalFunction::All => truths.fold(Truth::Known(true), |all, one| all.and(&one)),
        naga::RelationalFunction::Any => truths.fold(Truth::Known(false), |any, one| any.or(&one)),
        _ => return Err(What::NoForm { what: "`isNan`".into() }),
    };
    Ok(truth.into())
}
