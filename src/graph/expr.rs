//! [`Expr`]: what fields are built of, by operators and methods. Cheap to clone, parts are shared.

use super::leaf::Leaf;
use super::lower::Program;
use super::ops::{Binary, Unary};
use std::collections::HashSet;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::Arc;

/// A number that depends on the point: a field, or a part of one.
///
/// Built from [`x`], [`y`], [`z`], constants (anything `Into<Expr>`) and [`Expr::parameter`]; turned into
/// something to extract by [`GraphField`](super::GraphField). Equal parts are found and done once.
#[derive(Debug, Clone)]
pub struct Expr(pub(super) Arc<Node>);

/// What an [`Expr`] is.
#[derive(Debug)]
pub(super) enum Node {
    /// A coordinate of the point: 0 x, 1 y, 2 z.
    Axis(u8),
    Constant(f64),
    Parameter {
        name: Arc<str>,
        default: f64,
    },
    Unary(Unary, Expr),
    Binary(Binary, Expr, Expr),
    /// The second where the first is not 0, else the third.
    Select(Expr, Expr, Expr),
    /// The expression with other ones in place of x, y, z.
    At(Expr, [Expr; 3]),
    /// A function of the point.
    Leaf(Arc<dyn Leaf>),
}

/// The point's x coordinate.
pub fn x() -> Expr {
    Expr::new(Node::Axis(0))
}

/// The point's y coordinate.
pub fn y() -> Expr {
    Expr::new(Node::Axis(1))
}

/// The point's z coordinate.
pub fn z() -> Expr {
    Expr::new(Node::Axis(2))
}

macro_rules! unary_methods {
    ($($(#[$doc:meta])* $name:ident $op:ident)*) => { $(
        $(#[$doc])*
        #[must_use]
        pub fn $name(&self) -> Expr {
            Expr::new(Node::Unary(Unary::$op, self.clone()))
        }
    )* };
}

macro_rules! binary_methods {
    ($($(#[$doc:meta])* $name:ident $op:ident)*) => { $(
        $(#[$doc])*
        #[must_use]
        pub fn $name(&self, other: impl Into<Expr>) -> Expr {
            Expr::new(Node::Binary(Binary::$op, self.clone(), other.into()))
        }
    )* };
}

impl Expr {
    pub(super) fn new(node: Node) -> Self {
        Self(Arc::new(node))
    }

    /// An operation of one operand.
    pub fn unary(op: Unary, a: impl Into<Expr>) -> Self {
        Self::new(Node::Unary(op, a.into()))
    }

    /// An operation of two operands.
    pub fn binary(op: Binary, a: impl Into<Expr>, b: impl Into<Expr>) -> Self {
        Self::new(Node::Binary(op, a.into(), b.into()))
    }

    /// Whether both are one and the same part.
    pub(super) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// A function of the point that is no combination of operations.
    pub fn leaf(leaf: Arc<dyn Leaf>) -> Self {
        Self::new(Node::Leaf(leaf))
    }

    /// A number with a name, which can be changed later without compiling anything. The same name means the
    /// same parameter throughout a field: give it the same default each time, for only one of them counts.
    pub fn parameter(name: &str, default: f64) -> Self {
        Self::new(Node::Parameter { name: name.into(), default })
    }

    /// The number that it is, if it is made of constants alone.
    pub fn constant(&self) -> Option<f64> {
        if let Node::Constant(value) = *self.0 {
            return Some(value);
        }
        // Most expressions are none, and show it soon.
        let (mut seen, mut open) = (HashSet::new(), vec![self]);
        while let Some(expr) = open.pop() {
            match *expr.0 {
                Node::Axis(_) | Node::Parameter { .. } | Node::Leaf(_) => return None,
                _ if seen.insert(Arc::as_ptr(&expr.0)) => open.extend(expr.0.parts()),
                _ => {}
            }
        }
        Program::new(self).whole()
    }

    unary_methods! {
        /// Magnitude.
        abs Abs
        /// a².
        square Square
        /// Square root; NaN, which is outside, of negative numbers.
        sqrt Sqrt
        /// Largest whole number not above.
        floor Floor
        /// −1, 0 or 1.
        sign Sign
        /// Sine of an angle in turns: 1 is a full circle.
        sin_turns SinTurns
        /// Cosine of an angle in turns.
        cos_turns CosTurns
        /// The exponential function.
        exp Exp
        /// Natural logarithm; NaN, which is outside, of negative numbers.
        ln Ln
        /// Sine of an angle in radians.
        sin Sin
        /// Cosine of an angle in radians.
        cos Cos
        /// Arc sine, in radians.
        asin Asin
        /// Arc cosine, in radians.
        acos Acos
        /// Arc tangent, in radians.
        atan Atan
        /// Hyperbolic tangent.
        tanh Tanh
    }

    binary_methods! {
        /// The smaller: for distance-like fields the union.
        min Min
        /// The larger: for distance-like fields the intersection.
        max Max
        /// The power; NaN, which is outside, of negative numbers unless the exponent is whole.
        pow Pow
        /// The angle of the point (`other`, this), in radians from −π to π.
        atan2 Atan2
        /// 1 where less than `other`, else 0.
        less Less
        /// 1 where at most `other`, else 0.
        less_equal LessEqual
    }

    /// `yes` where this is not 0, else `no`.
    #[must_use]
    pub fn select(&self, yes: impl Into<Expr>, no: impl Into<Expr>) -> Expr {
        Expr::new(Node::Select(self.clone(), yes.into(), no.into()))
    }

    /// The expression at another point: `coordinates` in place of x, y, z. All deformations are this.
    #[must_use]
    pub fn at(&self, coordinates: [Expr; 3]) -> Expr {
        Expr::new(Node::At(self.clone(), coordinates))
    }

    /// Tangent of an angle in radians.
    #[must_use]
    pub fn tan(&self) -> Expr {
        self.sin() / self.cos()
    }

    /// A whole power, by multiplications; 1 over it where `exponent` is negative.
    #[must_use]
    pub fn powi(&self, exponent: i32) -> Expr {
        let mut left = exponent.unsigned_abs();
        let (mut power, mut result) = (self.clone(), None::<Expr>);
        while left > 0 {
            if left & 1 == 1 {
                result = Some(result.map_or(power.clone(), |r| r * power.clone()));
            }
            left >>= 1;
            if left > 0 {
                power = power.square();
            }
        }
        let result = result.unwrap_or_else(|| 1.0.into());
        if exponent < 0 { 1.0 / result } else { result }
    }
}

impl From<f64> for Expr {
    fn from(value: f64) -> Self {
        Self::new(Node::Constant(value))
    }
}

impl From<f32> for Expr {
    fn from(value: f32) -> Self {
        f64::from(value).into()
    }
}

impl From<i32> for Expr {
    fn from(value: i32) -> Self {
        f64::from(value).into()
    }
}

impl From<&Expr> for Expr {
    fn from(value: &Expr) -> Self {
        value.clone()
    }
}

impl Neg for Expr {
    type Output = Expr;
    fn neg(self) -> Expr {
        Expr::new(Node::Unary(Unary::Neg, self))
    }
}

impl Neg for &Expr {
    type Output = Expr;
    fn neg(self) -> Expr {
        -self.clone()
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident $op:ident)*) => { $(
        impl<T: Into<Expr>> $trait<T> for Expr {
            type Output = Expr;
            fn $method(self, other: T) -> Expr {
                Expr::new(Node::Binary(Binary::$op, self, other.into()))
            }
        }
        impl<T: Into<Expr>> $trait<T> for &Expr {
            type Output = Expr;
            fn $method(self, other: T) -> Expr {
                $trait::$method(self.clone(), other)
            }
        }
        impl $trait<Expr> for f64 {
            type Output = Expr;
            fn $method(self, other: Expr) -> Expr {
                $trait::$method(Expr::from(self), other)
            }
        }
        impl $trait<&Expr> for f64 {
            type Output = Expr;
            fn $method(self, other: &Expr) -> Expr {
                $trait::$method(Expr::from(self), other)
            }
        }
    )* };
}

operators! { Add add Add Sub sub Sub Mul mul Mul Div div Div }

impl Node {
    /// The expressions that this is made of, at most four.
    pub(super) fn parts(&self) -> impl Iterator<Item = &Expr> {
        let parts: [Option<&Expr>; 4] = match self {
            Node::Axis(_) | Node::Constant(_) | Node::Parameter { .. } | Node::Leaf(_) => [None; 4],
            Node::Unary(_, a) => [Some(a), None, None, None],
            Node::Binary(_, a, b) => [Some(a), Some(b), None, None],
            Node::Select(a, b, c) => [Some(a), Some(b), Some(c), None],
            Node::At(e, [x, y, z]) => [Some(e), Some(x), Some(y), Some(z)],
        };
        parts.into_iter().flatten()
    }
}

/// Takes deep expressions apart piece by piece: the compiler's own way would recurse into the parts.
impl Drop for Expr {
    fn drop(&mut self) {
        // Leaves and shared expressions have nothing to take apart.
        if Arc::strong_count(&self.0) > 1 || self.0.parts().next().is_none() {
            return;
        }
        let mut left: Vec<Expr> = Vec::new();
        let take = |node: &mut Arc<Node>, left: &mut Vec<Expr>| {
            let Some(node) = Arc::get_mut(node) else { return };
            match std::mem::replace(node, Node::Axis(0)) {
                Node::Axis(_) | Node::Constant(_) | Node::Parameter { .. } | Node::Leaf(_) => {}
                Node::Unary(_, a) => left.push(a),
                Node::Binary(_, a, b) => left.extend([a, b]),
                Node::Select(a, b, c) => left.extend([a, b, c]),
                Node::At(e, at) => {
                    left.push(e);
                    left.extend(at);
                }
            }
        };
        take(&mut self.0, &mut left);
        while let Some(mut expr) = left.pop() {
            take(&mut expr.0, &mut left);
        }
    }
}
