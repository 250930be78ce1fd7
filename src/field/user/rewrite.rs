//! What is done to a user's function that runs as it was written.

use super::{Fault, MAX_ITERATIONS};
use naga::{Block, Expression, Handle, Literal, Module, Span, Statement};

/// naga's SPIR-V writer takes pointers to whole variables alone as arguments, and panics on others.
pub fn check_pointers(module: &Module) -> Result<(), Fault> {
    for (_, function) in module.functions.iter() {
        let mut blocks = vec![&function.body];
        while let Some(block) = blocks.pop() {
            for (statement, span) in block.span_iter() {
                match statement {
                    Statement::Call { arguments, .. } => {
                        let is_part = |a: &Handle<Expression>| is_pointer_to_part(module, function, *a);
                        if arguments.iter().any(is_part) {
                            let message = "an argument points to a part of a variable, which GPU drivers do not take: \
                                           copy the part into a `var` of its own";
                            return Err((Some(*span), message.into()));
                        }
                    }
                    Statement::Block(inner) => blocks.push(inner),
                    Statement::If { accept, reject, .. } => blocks.extend([accept, reject]),
                    Statement::Switch { cases, .. } => blocks.extend(cases.iter().map(|c| &c.body)),
                    Statement::Loop { body, continuing, .. } => blocks.extend([body, continuing]),
                    _ => {}
                }
            }
        }
    }
    Ok(())
}

fn is_pointer_to_part(module: &Module, function: &naga::Function, mut of: Handle<Expression>) -> bool {
    let given = of;
    loop {
        match function.expressions[of] {
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => of = base,
            Expression::LocalVariable(_) => return of != given,
            Expression::FunctionArgument(i) => {
                let ty = function.arguments[i as usize].ty;
                return of != given && matches!(module.types[ty].inner, naga::TypeInner::Pointer { .. });
            }
            _ => return false,
        }
    }
}

/// Puts a count and a way out in front of every loop body, and a return behind every body.
pub fn count_loops(module: &mut Module) {
    let u32_type = module.types.insert(
        naga::Type { name: None, inner: naga::TypeInner::Scalar(naga::Scalar::U32) },
        Span::UNDEFINED,
    );
    let counter = module.global_variables.append(
        naga::GlobalVariable {
            name: Some("isoforge_iterations".into()),
            space: naga::AddressSpace::Private,
            binding: None,
            ty: u32_type,
            init: None,
            memory_decorations: naga::MemoryDecorations::empty(),
        },
        Span::UNDEFINED,
    );
    for (_, function) in module.functions.iter_mut() {
        let mut body = std::mem::take(&mut function.body);
        count_in_block(&mut body, &mut function.expressions, counter);
        // A loop that ended only by `return` now also ends by the count.
        if let Some(result) = &function.result
            && !matches!(body.last(), Some(Statement::Return { .. }))
        {
            let zero = function.expressions.append(Expression::ZeroValue(result.ty), Span::UNDEFINED);
            body.push(Statement::Return { value: Some(zero) }, Span::UNDEFINED);
        }
        function.body = body;
    }
}

fn count_in_block(
    block: &mut Block,
    expressions: &mut naga::Arena<Expression>,
    counter: Handle<naga::GlobalVariable>,
) {
    for statement in block.iter_mut() {
        match statement {
            Statement::Block(inner) => count_in_block(inner, expressions, counter),
            Statement::If { accept, reject, .. } => {
                count_in_block(accept, expressions, counter);
                count_in_block(reject, expressions, counter);
            }
            Statement::Switch { cases, .. } => {
                for case in cases {
                    count_in_block(&mut case.body, expressions, counter);
                }
            }
            Statement::Loop { body, continuing, .. } => {
                count_in_block(body, expressions, counter);
                count_in_block(continuing, expressions, counter);
                let mut counted = guard(expressions, counter);
                counted.extend_block(std::mem::take(body));
                *body = counted;
            }
            _ => {}
        }
    }
}

/// `if isoforge_iterations >= MAX { break; } isoforge_iterations += 1;`
fn guard(expressions: &mut naga::Arena<Expression>, counter: Handle<naga::GlobalVariable>) -> Block {
    let at = Span::UNDEFINED;
    let pointer = expressions.append(Expression::GlobalVariable(counter), at);
    let limit = expressions.append(Expression::Literal(Literal::U32(MAX_ITERATIONS)), at);
    let one = expressions.append(Expression::Literal(Literal::U32(1)), at);
    let start = expressions.len();
    let count = expressions.append(Expression::Load { pointer }, at);
    let op = naga::BinaryOperator::GreaterEqual;
    let condition = expressions.append(Expression::Binary { op, left: count, right: limit }, at);
    let op = naga::BinaryOperator::Add;
    let next = expressions.append(Expression::Binary { op, left: count, right: one }, at);
    let mut block = Block::new();
    block.push(Statement::Emit(expressions.range_from(start)), at);
    block.push(Statement::Store { pointer, value: next }, at);
    let mut leave = Block::new();
    leave.push(Statement::Break, at);
    block.push(Statement::If { condition, accept: leave, reject: Block::new() }, at);
    block
}

/// Gives every name of the user a prefix, except the function `density` itself.
pub fn rename(module: &mut Module) {
    let prefix = |name: &mut Option<String>| {
        if let Some(name) = name.as_mut().filter(|n| *n != "density") {
            *name = format!("user_{name}");
        }
    };
    let always = |name: &mut Option<String>| {
        if let Some(name) = name {
            *name = format!("user_{name}");
        }
    };
    for (_, function) in module.functions.iter_mut() {
        prefix(&mut function.name);
        // These may be named like a function of ours, or like `density`, in a scope of their own; the
        // writer would rename the later of the two.
        function.arguments.iter_mut().for_each(|a| always(&mut a.name));
        function.local_variables.iter_mut().for_each(|(_, v)| always(&mut v.name));
        function.named_expressions.values_mut().for_each(|name| *name = format!("user_{name}"));
    }
    module.constants.iter_mut().for_each(|(_, c)| prefix(&mut c.name));
    let named: Vec<_> = module.types.iter().filter(|(_, t)| t.name.is_some()).map(|(h, _)| h).collect();
    for handle in named {
        let mut ty = module.types[handle].clone();
        prefix(&mut ty.name);
        module.types.replace(handle, ty);
    }
}
