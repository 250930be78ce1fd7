//! Arithmetic with the CPU's bits on every driver.
//!
//! WGSL leaves a driver free to contract `a * b + c`, to reorder sums, to divide to 2.5 units in the last place and to take roots
//! to more. So each `+ - * /` and `sqrt` of floats in a kernel becomes a call of a function that hides its result from the
//! driver's algebra, and rounds quotients and roots to the nearest float: `shaders/shared/exact.wgsl`, `nearest.wgsl`. Shaders are
//! written as if there were nothing to it, and what a library user's own WGSL computes is taken care of, too.

use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    BinaryOperator, Block, Expression, Function, Handle, MathFunction, Module, Range, ScalarKind, Span,
    Statement, TypeInner,
};
use std::collections::HashMap;

const OPERATIONS: &str = include_str!("../../shaders/shared/exact.wgsl");
const NEAREST: &str = include_str!("../../shaders/shared/nearest.wgsl");
const ROUNDED_BY_DRIVER: &str = include_str!("../../shaders/shared/rounded.wgsl");
/// What the names of the functions begin with that are called in place of operations, and of those that these call.
const NAMES: [&str; 3] = ["iso_exact_", "iso_hidden_", "iso_nearest_"];

/// The text of the functions, for kernels whose `params` have `nothing`, a 0 that no compiler knows. `rounds` says whether the
/// driver's own quotients and roots are the nearest floats.
pub fn functions(rounds: bool) -> String {
    [OPERATIONS, if rounds { ROUNDED_BY_DRIVER } else { NEAREST }].join("\n")
}

/// Puts calls of [`functions`], which must be in the module, in place of operations.
pub fn hide_operations(module: &mut Module, info: &ModuleInfo) {
    let is_own = |f: &Function| f.name.as_ref().is_some_and(|n| NAMES.iter().any(|own| n.starts_with(own)));
    let named = |(handle, f): (Handle<Function>, &Function)| Some((f.name.clone()?, handle));
    let own: HashMap<String, Handle<Function>> =
        module.functions.iter().filter(|(_, f)| is_own(f)).filter_map(named).collect();
    let types = &module.types;
    for (handle, function) in module.functions.iter_mut().filter(|(_, f)| !is_own(f)) {
        Hiding { types, own: &own, info: &info[handle] }.rewrite(function);
    }
    for (place, entry) in module.entry_points.iter_mut().enumerate() {
        Hiding { types, own: &own, info: info.get_entry_point(place) }.rewrite(&mut entry.function);
    }
}

struct Hiding<'a> {
    types: &'a naga::UniqueArena<naga::Type>,
    own: &'a HashMap<String, Handle<Function>>,
    info: &'a FunctionInfo,
}

impl Hiding<'_> {
    fn rewrite(&self, function: &mut Function) {
        let mut body = std::mem::take(&mut function.body);
        self.rewrite_block(&mut body, &mut function.expressions);
        function.body = body;
    }

    /// How many floats an expression has, if it is a number or a vector of them.
    fn width(&self, of: Handle<Expression>) -> Option<u32> {
        match *self.info[of].ty.inner_with(self.types) {
            TypeInner::Scalar(s) if s.kind == ScalarKind::Float => Some(1),
            TypeInner::Vector { size, scalar } if scalar.kind == ScalarKind::Float => Some(size as u32),
            _ => None,
        }
    }

    /// The function that is called in place of an operation, and its arguments.
    fn call(&self, expression: &Expression) -> Option<(Handle<Function>, Vec<Handle<Expression>>)> {
        let (name, width, arguments) = match *expression {
            Expression::Binary { op, left, right } => {
                let name = match op {
                    BinaryOperator::Add => "sum",
                    BinaryOperator::Subtract => "difference",
                    BinaryOperator::Multiply => "product",
                    BinaryOperator::Divide => "quotient",
                    _ => return None,
                };
                match (self.width(left)?, self.width(right)?) {
                    (a, b) if a == b => (name, a, vec![left, right]),
                    (a, 1) => ("multiple", a, vec![left, right]),
                    (1, b) => ("multiple", b, vec![right, left]),
                    _ => return None,
                }
            }
            Expression::Math { fun: MathFunction::Sqrt, arg, .. } => ("root", self.width(arg)?, vec![arg]),
            _ => return None,
        };
        Some((*self.own.get(&format!("iso_exact_{name}_{width}"))?, arguments))
    }

    fn rewrite_block(&self, block: &mut Block, expressions: &mut naga::Arena<Expression>) {
        let mut rewritten = Block::with_capacity(block.len());
        for (statement, span) in std::mem::take(block).span_into_iter() {
            match statement {
                Statement::Emit(range) => self.rewrite_range(range, span, expressions, &mut rewritten),
                mut other => {
                    match &mut other {
                        Statement::Block(inner) => self.rewrite_block(inner, expressions),
                        Statement::If { accept, reject, .. } => {
                            self.rewrite_block(accept, expressions);
                            self.rewrite_block(reject, expressions);
                        }
                        Statement::Switch { cases, .. } => {
                            cases.iter_mut().for_each(|case| self.rewrite_block(&mut case.body, expressions));
                        }
                        Statement::Loop { body, continuing, .. } => {
                            self.rewrite_block(body, expressions);
                            self.rewrite_block(continuing, expressions);
                        }
                        _ => {}
                    }
                    rewritten.push(other, span);
                }
            }
        }
        *block = rewritten;
    }

    /// Calls are statements: they part what is computed before them from what comes after.
    fn rewrite_range(
        &self,
        range: Range<Expression>,
        span: Span,
        expressions: &mut naga::Arena<Expression>,
        rewritten: &mut Block,
    ) {
        let mut computed: Option<(Handle<Expression>, Handle<Expression>)> = None;
        let emit = |computed: &mut Option<_>, rewritten: &mut Block| {
            if let Some((first, last)) = computed.take() {
                rewritten.push(Statement::Emit(Range::new_from_bounds(first, last)), span);
            }
        };
        for handle in range {
            let Some((function, arguments)) = self.call(&expressions[handle]) else {
                computed = Some((computed.map_or(handle, |(first, _)| first), handle));
                continue;
            };
            emit(&mut computed, rewritten);
            expressions[handle] = Expression::CallResult(function);
            rewritten.push(Statement::Call { function, arguments, result: Some(handle) }, span);
        }
        emit(&mut computed, rewritten);
    }
}

#[cfg(test)]
mod tests;
