//! What a WGSL expression stands for while a function is lowered.

use super::super::Expr;
use super::super::lower::Program;
use super::truth::Truth;
use std::cell::Cell;
use std::rc::Rc;

/// A value of any type.
#[derive(Debug, Clone)]
pub enum Value {
    Scalar(Scalar),
    /// Components of a vector, columns of a matrix, elements of an array, members of a structure.
    Parts(Rc<Vec<Value>>),
    Pointer(Place),
}

#[derive(Debug, Clone)]
pub enum Scalar {
    Float(Float),
    Whole(Whole),
    Bool(Truth),
}

/// An `f32`, with its number where that is the same at all points.
#[derive(Debug, Clone)]
pub struct Float {
    pub expr: Expr,
    pub known: Option<f32>,
}

/// An `i32` or `u32`: a range, and where that is more than one number, the expression.
#[derive(Debug, Clone)]
pub struct Whole {
    pub unsigned: bool,
    pub low: i64,
    pub high: i64,
    pub expr: Option<Expr>,
}

/// Where a pointer points.
#[derive(Debug, Clone)]
pub struct Place {
    pub slot: usize,
    pub path: Vec<Whole>,
}

impl Float {
    pub fn known(value: f32) -> Self {
        Self { expr: value.into(), known: Some(value) }
    }

    pub fn unknown(expr: Expr) -> Self {
        Self { expr, known: None }
    }

    /// The number that an expression without coordinates is.
    pub fn folded(expr: &Expr) -> Self {
        let value = Program::new(expr).uniforms(&[]).first().copied();
        value.map_or_else(|| Self::unknown(expr.clone()), Self::known)
    }
}

impl Whole {
    pub fn known(unsigned: bool, value: i64) -> Self {
        let value = if unsigned { i64::from(value as u32) } else { i64::from(value as i32) };
        Self { unsigned, low: value, high: value, expr: None }
    }

    pub fn value(&self) -> Option<i64> {
        self.expr.is_none().then_some(self.low)
    }

    pub fn expr(&self) -> Expr {
        self.expr.clone().unwrap_or_else(|| (self.low as f64).into())
    }
}

impl From<Float> for Value {
    fn from(float: Float) -> Self {
        Self::Scalar(Scalar::Float(float))
    }
}

impl From<Whole> for Value {
    fn from(whole: Whole) -> Self {
        Self::Scalar(Scalar::Whole(whole))
    }
}

impl From<Truth> for Value {
    fn from(truth: Truth) -> Self {
        Self::Scalar(Scalar::Bool(truth))
    }
}

impl Value {
    pub fn parts(parts: Vec<Value>) -> Self {
        Self::Parts(Rc::new(parts))
    }

    /// The components of a vector, itself of a scalar.
    pub fn components(&self) -> &[Value] {
        match self {
            Self::Parts(parts) => parts,
            other => std::slice::from_ref(other),
        }
    }

    /// The same shape with other scalars.
    pub fn map<E>(&self, f: &mut impl FnMut(&Scalar) -> Result<Scalar, E>) -> Result<Value, E> {
        Ok(match self {
            Self::Scalar(scalar) => Self::Scalar(f(scalar)?),
            Self::Parts(parts) => {
                Self::parts(parts.iter().map(|part| part.map(f)).collect::<Result<_, _>>()?)
            }
            Self::Pointer(place) => Self::Pointer(place.clone()),
        })
    }

    /// How many scalars are not known.
    pub fn unknown_count(&self) -> usize {
        match self {
            Self::Scalar(scalar) => usize::from(!scalar.is_known()),
            Self::Parts(parts) => parts.iter().map(Value::unknown_count).sum(),
            Self::Pointer(_) => 0,
        }
    }

    /// Whether both are the very same, which spares a choice between them.
    pub fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Scalar(a), Self::Scalar(b)) => a.same(b),
            (Self::Parts(a), Self::Parts(b)) => {
                Rc::ptr_eq(a, b) || a.iter().zip(&**b).all(|(a, b)| a.same(b))
            }
            _ => false,
        }
    }

    /// `yes` where `truth` holds, else `no`. Counts the operations that it takes.
    pub fn choose(truth: &Truth, yes: &Self, no: &Self, made: &Cell<usize>) -> Self {
        match (truth.known(), yes, no) {
            (Some(known), ..) => if known { yes } else { no }.clone(),
            (None, ..) if yes.same(no) => yes.clone(),
            (None, Self::Scalar(a), Self::Scalar(b)) => {
                made.set(made.get() + 1);
                Self::Scalar(Scalar::choose(truth, a, b))
            }
            (None, Self::Parts(a), Self::Parts(b)) => {
                Self::parts(a.iter().zip(&**b).map(|(a, b)| Self::choose(truth, a, b, made)).collect())
            }
            // Pointers are not stored, so that there is never a choice between them.
            _ => yes.clone(),
        }
    }
}

impl Scalar {
    pub fn is_known(&self) -> bool {
        match self {
            Self::Float(a) => a.known.is_some(),
            Self::Whole(a) => a.expr.is_none(),
            Self::Bool(a) => a.known().is_some(),
        }
    }

    /// The number; 1 or 0 of a condition.
    pub fn expr(&self) -> Expr {
        match self {
            Self::Float(a) => a.expr.clone(),
            Self::Whole(a) => a.expr(),
            Self::Bool(a) => a.expr(),
        }
    }

    fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Float(a), Self::Float(b)) => {
                a.expr.is(&b.expr)
                    || a.known.is_some_and(|a| b.known.is_some_and(|b| a.to_bits() == b.to_bits()))
            }
            (Self::Whole(a), Self::Whole(b)) => match (&a.expr, &b.expr) {
                (Some(a), Some(b)) => a.is(b),
                (None, None) => a.low == b.low,
                _ => false,
            },
            (Self::Bool(a), Self::Bool(b)) => a.same(b),
            _ => false,
        }
    }

    fn choose(truth: &Truth, yes: &Self, no: &Self) -> Self {
        match (yes, no) {
            (Self::Whole(a), Self::Whole(b)) => Self::Whole(Whole {
                unsigned: a.unsigned,
                low: a.low.min(b.low),
                high: a.high.max(b.high),
                expr: Some(truth.select(&a.expr(), &b.expr())),
            }),
            (Self::Bool(a), Self::Bool(b)) => Self::Bool(truth.choose(a, b)),
            _ => Self::Float(Float::unknown(truth.select(&yes.expr(), &no.expr()))),
        }
    }
}
