//! A WGSL function as an [`Expr`], from naga's representation.
//!
//! The function is run once with expressions for numbers: calls are inlined, both sides of a condition that
//! varies are computed and one is chosen, loops are unrolled. What is the same at all points (counters,
//! flags, sizes) stays a number, in `f32` where it is a float, so that a loop ends where it does on a GPU.
//! Integers that vary are whole `f32` numbers; those made of floats are taken to be under 2¹⁸ in magnitude,
//! and an operation that could leave the exact range (2²⁴) has no form. What has no form is an
//! [`Obstacle`]: the function can then run on a GPU alone.

mod arithmetic;
mod expression;
mod math;
mod run;
mod state;
mod truth;
mod value;

use super::{Expr, GraphField};
use crate::field::Sense;
use naga::{Module, Span};
use run::Lowering;
use value::{Scalar, Value};

/// Operations that a function may be lowered to.
pub const MOST_OPERATIONS: usize = 20_000;
/// Expressions that may be looked at on the way.
const MOST_STEPS: usize = 500_000;
/// Elements that an array may have, and parts among which an index may choose.
const LARGEST_ARRAY: u32 = 4096;
const LARGEST_CHOICE: usize = 64;

/// What kept a WGSL function from becoming an expression.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Obstacle {
    /// A loop that ends at no iteration known in advance.
    #[error("`{keyword}` at line {line} has no known bound")]
    Loop {
        /// `for`, `while` or `loop`.
        keyword: String,
        /// Its line, from 1.
        line: u32,
    },
    /// Too much work to write out.
    #[error("{what} at line {line} unrolls to more than {MOST_OPERATIONS} operations")]
    Long {
        /// A loop, or where the count was reached.
        what: String,
        /// Its line, from 1.
        line: u32,
    },
    /// A construct that expressions do not have.
    #[error("{what} at line {line} has no CPU form")]
    NoForm {
        /// The construct.
        what: String,
        /// Its line, from 1.
        line: u32,
    },
}

/// What a part of the lowering stumbled over.
#[derive(Debug)]
enum What {
    NoForm {
        what: String,
    },
    Long,
    /// A loop that did not end; whether one of its ends does not depend on the point.
    Unbounded {
        decided: bool,
    },
}

type Found<T> = Result<T, What>;

/// And where.
struct Stop {
    what: What,
    span: Span,
}

/// The function `density` of a valid module as an expression and the field that it is. `source` is the module's
/// text.
///
/// # Errors
/// [`Obstacle`].
pub fn lower(module: &Module, source: &str, sense: Sense) -> Result<(Expr, GraphField), Obstacle> {
    let density = module.functions.iter().find(|(_, f)| f.name.as_deref() == Some("density"));
    let unknown = || Obstacle::NoForm { what: "the function".into(), line: 1 };
    let (handle, function) = density.ok_or_else(unknown)?;
    let found = Lowering::new(module).call(function, vec![expression::point()], &mut Vec::new());
    match found {
        Ok(Some(Value::Scalar(Scalar::Float(value)))) => {
            let field = GraphField::new(&value.expr, sense);
            if field.operations() > MOST_OPERATIONS {
                let span = module.functions.get_span(handle);
                return Err(obstacle(Stop { what: What::Long, span }, source));
            }
            Ok((value.expr, field))
        }
        Ok(_) => Err(unknown()),
        Err(stop) => Err(obstacle(stop, source)),
    }
}

fn obstacle(Stop { what, span }: Stop, source: &str) -> Obstacle {
    let place = if span.is_defined() { span.location(source).offset as usize } else { 0 };
    let line = source.get(..place).map_or(1, |before| before.matches('\n').count() as u32 + 1);
    let rest = source.get(place..).unwrap_or("");
    let keyword = ["for", "while", "loop"].into_iter().find(|word| rest.starts_with(word));
    let keyword = keyword.unwrap_or("a loop").to_string();
    match what {
        What::NoForm { what } => Obstacle::NoForm { what, line },
        What::Unbounded { decided: false } => Obstacle::Loop { keyword, line },
        What::Unbounded { decided: true } => Obstacle::Long { what: format!("`{keyword}`"), line },
        What::Long => Obstacle::Long { what: "the function".into(), line },
    }
}
