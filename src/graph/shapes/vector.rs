//! [`Vector`]: three expressions as an argument.

use super::ShapeError;
use crate::graph::Expr;
use glam::{DVec3, Vec3};

/// Three numbers: a point, a direction, or one number an axis. Made of an array, a tuple (whose parts may be
/// of different types, as in `(Expr::parameter("x", 0.0), 1.0, 2.0)`) or a vector of `glam`.
#[derive(Debug, Clone)]
pub struct Vector(pub [Expr; 3]);

impl<T: Into<Expr>> From<[T; 3]> for Vector {
    fn from(v: [T; 3]) -> Self {
        Self(v.map(Into::into))
    }
}

impl<A: Into<Expr>, B: Into<Expr>, C: Into<Expr>> From<(A, B, C)> for Vector {
    fn from((a, b, c): (A, B, C)) -> Self {
        Self([a.into(), b.into(), c.into()])
    }
}

impl From<Vec3> for Vector {
    fn from(v: Vec3) -> Self {
        v.to_array().into()
    }
}

impl From<DVec3> for Vector {
    fn from(v: DVec3) -> Self {
        v.to_array().into()
    }
}

impl From<&Vector> for Vector {
    fn from(v: &Vector) -> Self {
        v.clone()
    }
}

impl Vector {
    /// x, y, z.
    pub(crate) fn point() -> Self {
        Self([crate::graph::x(), crate::graph::y(), crate::graph::z()])
    }

    pub(super) fn zip(&self, other: &Self, f: impl Fn(&Expr, &Expr) -> Expr) -> Self {
        Self([0, 1, 2].map(|i| f(&self.0[i], &other.0[i])))
    }

    pub(super) fn map(&self, f: impl Fn(&Expr) -> Expr) -> Self {
        Self([0, 1, 2].map(|i| f(&self.0[i])))
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    pub(super) fn dot(&self, other: &Self) -> Expr {
        sum(self.0.iter().zip(&other.0).map(|(a, b)| product(a, b)))
    }

    /// x² + y² + z².
    pub(crate) fn length_square(&self) -> Expr {
        let [x, y, z] = &self.0;
        (x.square() + y.square()) + z.square()
    }

    pub(super) fn length(&self) -> Expr {
        self.length_square().sqrt()
    }

    /// The numbers, if all are constants.
    pub(super) fn constant(&self) -> Option<DVec3> {
        let [x, y, z] = self.0.each_ref().map(Expr::constant);
        Some(DVec3::new(x?, y?, z?))
    }

    /// The same direction with length 1; `what` it is, for the error.
    pub(super) fn unit(&self, what: &'static str) -> Result<Self, ShapeError> {
        let Some(constant) = self.constant() else {
            let length = self.length();
            return Ok(self.map(|c| c / &length));
        };
        // Scaled first: squares of tiny and huge numbers leave the range.
        let most = constant.abs().max_element();
        if !constant.is_finite() || most == 0.0 {
            return Err(ShapeError::NoDirection { what });
        }
        Ok((constant / most).normalize().into())
    }
}

/// `a · b`, without the operation where one is the constant 0 or 1.
pub(super) fn product(a: &Expr, b: &Expr) -> Expr {
    match (a.constant(), b.constant()) {
        (Some(0.0), _) | (_, Some(0.0)) => 0.0.into(),
        (Some(1.0), _) => b.clone(),
        (_, Some(1.0)) => a.clone(),
        _ => a * b,
    }
}

/// The sum; constants 0 take no operation, once it is made flat.
pub(super) fn sum(terms: impl IntoIterator<Item = Expr>) -> Expr {
    terms.into_iter().reduce(|a, b| a + b).unwrap_or_else(|| 0.0.into())
}

/// Sine and cosine of an angle in turns; exact for constant quarters of a turn.
pub(super) fn sine_and_cosine(turns: &Expr) -> (Expr, Expr) {
    let Some(angle) = turns.constant() else { return (turns.sin_turns(), turns.cos_turns()) };
    let part = angle - angle.floor();
    let (sine, cosine) = match part {
        0.0 => (0.0, 1.0),
        0.25 => (1.0, 0.0),
        0.5 => (0.0, -1.0),
        0.75 => (-1.0, 0.0),
        _ => (part * std::f64::consts::TAU).sin_cos(),
    };
    (sine.into(), cosine.into())
}
