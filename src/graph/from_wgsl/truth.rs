//! Conditions: known, or an expression that is 1 or 0.

use super::super::Expr;

/// Whether something holds.
#[derive(Debug, Clone)]
pub enum Truth {
    Known(bool),
    /// Where the expression is 1; if `negated`, where it is 0.
    Unknown {
        expr: Expr,
        negated: bool,
    },
}

impl Truth {
    /// Where `expr`, which is 1 or 0, is 1.
    pub fn of(expr: Expr) -> Self {
        Self::Unknown { expr, negated: false }
    }

    /// Where two numbers are equal.
    pub fn equal(a: &Expr, b: &Expr) -> Self {
        Self::of(a.less_equal(b).min(b.less_equal(a)))
    }

    pub fn known(&self) -> Option<bool> {
        match self {
            Self::Known(known) => Some(*known),
            Self::Unknown { .. } => None,
        }
    }

    /// 1 where it holds, else 0.
    pub fn expr(&self) -> Expr {
        match self {
            Self::Known(known) => f64::from(u8::from(*known)).into(),
            Self::Unknown { expr, negated: false } => expr.clone(),
            Self::Unknown { expr, negated: true } => 1.0 - expr,
        }
    }

    pub fn not(&self) -> Self {
        match self {
            Self::Known(known) => Self::Known(!known),
            Self::Unknown { expr, negated } => Self::Unknown { expr: expr.clone(), negated: !negated },
        }
    }

    pub fn and(&self, other: &Self) -> Self {
        use Truth::{Known, Unknown};
        match (self, other) {
            (Known(false), _) | (_, Known(false)) => Known(false),
            (Known(true), truth) | (truth, Known(true)) => truth.clone(),
            (Unknown { expr: a, negated: not_a }, Unknown { expr: b, negated: not_b }) => {
                if a.is(b) {
                    return if not_a == not_b { self.clone() } else { Known(false) };
                }
                match (not_a, not_b) {
                    (false, false) => Self::of(a.min(b)),
                    (true, true) => Unknown { expr: a.max(b), negated: true },
                    // 0 and 1 is the one case where one is less.
                    (true, false) => Self::of(a.less(b)),
                    (false, true) => Self::of(b.less(a)),
                }
            }
        }
    }

    pub fn or(&self, other: &Self) -> Self {
        self.not().and(&other.not()).not()
    }

    /// `yes` where it holds, else `no`.
    pub fn choose(&self, yes: &Self, no: &Self) -> Self {
        match (self.known(), yes.known(), no.known()) {
            (Some(true), ..) => yes.clone(),
            (Some(false), ..) => no.clone(),
            (None, Some(a), Some(b)) if a == b => yes.clone(),
            (None, Some(true), _) => self.or(no),
            (None, Some(false), _) => self.not().and(no),
            (None, _, Some(true)) => self.not().or(yes),
            (None, _, Some(false)) => self.and(yes),
            (None, None, None) if yes.same(no) => yes.clone(),
            (None, None, None) => Self::of(self.select(&yes.expr(), &no.expr())),
        }
    }

    /// `yes` where it holds, else `no`.
    pub fn select(&self, yes: &Expr, no: &Expr) -> Expr {
        match self {
            Self::Known(known) => if *known { yes } else { no }.clone(),
            Self::Unknown { expr, negated: false } => expr.select(yes, no),
            Self::Unknown { expr, negated: true } => expr.select(no, yes),
        }
    }

    /// Whether both are the very same.
    pub fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Known(a), Self::Known(b)) => a == b,
            (Self::Unknown { expr: a, negated: not_a }, Self::Unknown { expr: b, negated: not_b }) => {
                a.is(b) && not_a == not_b
            }
            _ => false,
        }
    }
}
