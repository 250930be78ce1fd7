//! What the operations mean, in `f64`, written independently of the crate; and random expressions of them.
//! Whatever comes of a NaN is NaN here, so that a comparison can leave it out.

use crate::common::Random;
use isoforge::graph::ops::{Binary, Unary};
use isoforge::graph::{Expr, x, y, z};

pub fn unary(op: Unary, a: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    match op {
        Unary::Neg => -a,
        Unary::Abs => a.abs(),
        Unary::Square => a.powi(2),
        Unary::Sqrt => a.sqrt(),
        Unary::Floor => a.floor(),
        Unary::Sign if a == 0.0 => 0.0,
        Unary::Sign => a.signum(),
        // π is no `f64`: what is 0 comes out a little beside it.
        Unary::SinTurns if (2.0 * a).fract() == 0.0 => 0.0,
        Unary::CosTurns if (2.0 * a + 0.5).fract() == 0.0 => 0.0,
        Unary::SinTurns => (turn * a).sin(),
        Unary::CosTurns => (turn * a).cos(),
        Unary::Exp => a.exp(),
        Unary::Ln => a.ln(),
        Unary::Sin => a.sin(),
        Unary::Cos => a.cos(),
        Unary::Asin => a.asin(),
        Unary::Acos => a.acos(),
        Unary::Atan => a.atan(),
        Unary::Tanh => a.tanh(),
    }
}

pub fn binary(op: Binary, a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        return f64::NAN;
    }
    match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
        Binary::Pow if a == 0.0 && b == 0.0 => 1.0,
        // Zero has no sign here.
        Binary::Pow if a == 0.0 => [f64::INFINITY, 0.0][usize::from(b > 0.0)],
        Binary::Pow => a.powf(b),
        Binary::Atan2 => a.atan2(b),
        Binary::Less => f64::from(u8::from(a < b)),
        Binary::LessEqual => f64::from(u8::from(a <= b)),
    }
}

/// An expression and what it means.
pub struct Pair {
    pub expr: Expr,
    pub value: Box<dyn Fn([f64; 3]) -> f64>,
}

/// A random expression of `size` operations or fewer.
pub fn random(random: &mut Random, size: u32) -> Pair {
    if size == 0 {
        return match random.next() % 5 {
            0 => Pair { expr: x(), value: Box::new(|p| p[0]) },
            1 => Pair { expr: y(), value: Box::new(|p| p[1]) },
            2 => Pair { expr: z(), value: Box::new(|p| p[2]) },
            _ => {
                let c = f64::from(random.unit()) * 4.0 - 2.0;
                Pair { expr: c.into(), value: Box::new(move |_| c) }
            }
        };
    }
    let kinds = Unary::ALL.len() + Binary::ALL.len() + 2;
    let kind = random.next() as usize % kinds;
    if let Some(&op) = Unary::ALL.get(kind) {
        let a = self::random(random, size - 1);
        return Pair { expr: Expr::unary(op, a.expr), value: Box::new(move |p| unary(op, (a.value)(p))) };
    }
    let left = (size - 1) / 2;
    let (a, b) = (self::random(random, left), self::random(random, left));
    if let Some(&op) = Binary::ALL.get(kind - Unary::ALL.len()) {
        return Pair {
            expr: Expr::binary(op, a.expr, b.expr),
            value: Box::new(move |p| binary(op, (a.value)(p), (b.value)(p))),
        };
    }
    let c = self::random(random, left / 2);
    if kind + 1 == kinds {
        Pair {
            expr: c.expr.select(a.expr, b.expr),
            value: Box::new(move |p| match (c.value)(p) {
                0.0 => (b.value)(p),
                c if c.is_nan() => c,
                _ => (a.value)(p),
            }),
        }
    } else {
        // The first at another point.
        Pair {
            expr: a.expr.at([b.expr, y() + c.expr, z()]),
            value: Box::new(move |p| (a.value)([(b.value)(p), p[1] + (c.value)(p), p[2]])),
        }
    }
}
