//! Expressions of naga's representation.

use super::super::Expr;
use super::run::{Frame, Lowering};
use super::state::State;
use super::truth::Truth;
use super::value::{Float, Place, Scalar, Value, Whole};
use super::{Found, What, arithmetic, math};
use naga::{BinaryOperator, Expression, Handle, Literal, ScalarKind, Type, TypeInner};

fn no_form(what: &str) -> What {
    What::NoForm { what: what.into() }
}

fn literal(literal: Literal) -> Found<Value> {
    Ok(match literal {
        Literal::F32(value) => Float::known(value).into(),
        Literal::AbstractFloat(value) => Float::known(value as f32).into(),
        Literal::U32(value) => Whole::known(true, value.into()).into(),
        Literal::I32(value) => Whole::known(false, value.into()).into(),
        Literal::AbstractInt(value) => Whole::known(false, value).into(),
        Literal::Bool(value) => Truth::Known(value).into(),
        _ => return Err(no_form("a number that is not of 32 bits")),
    })
}

impl<'a> Lowering<'a> {
    /// The value of an expression of a function.
    pub fn value(
        &mut self,
        frame: &mut Frame<'a>,
        state: &State,
        handle: Handle<Expression>,
    ) -> Found<Value> {
        if let Some(value) = &frame.values[handle.index()] {
            return Ok(value.clone());
        }
        // What is not emitted by a statement: arguments, variables, constants.
        self.evaluate(frame, state, handle)
    }

    /// Computes an expression of a function anew.
    pub fn evaluate(
        &mut self,
        frame: &mut Frame<'a>,
        state: &State,
        handle: Handle<Expression>,
    ) -> Found<Value> {
        let function = frame.function;
        match &function.expressions[handle] {
            Expression::FunctionArgument(i) => Ok(frame.arguments[*i as usize].clone()),
            Expression::LocalVariable(variable) => {
                Ok(Value::Pointer(Place { slot: frame.base + variable.index(), path: Vec::new() }))
            }
            Expression::Load { pointer } => {
                let Value::Pointer(place) = self.value(frame, state, *pointer)? else {
                    return Err(no_form("a global variable"));
                };
                self.load(&state.slots[place.slot], &place.path)
            }
            expression => self.of_parts(expression, &mut |lowering, part| lowering.value(frame, state, part)),
        }
    }

    /// The value of a constant expression of the module.
    pub fn constant(&mut self, handle: Handle<Expression>) -> Found<Value> {
        if let Some(value) = self.constants.get(&handle) {
            return Ok(value.clone());
        }
        let module = self.module;
        let value =
            self.of_parts(&module.global_expressions[handle], &mut |lowering, part| lowering.constant(part))?;
        self.constants.insert(handle, value.clone());
        Ok(value)
    }

    /// The value of an expression, given those that it is made of.
    fn of_parts(
        &mut self,
        expression: &Expression,
        get: &mut dyn FnMut(&mut Self, Handle<Expression>) -> Found<Value>,
    ) -> Found<Value> {
        match *expression {
            Expression::Literal(value) => literal(value),
            Expression::Constant(constant) => self.constant(self.module.constants[constant].init),
            Expression::ZeroValue(ty) => self.zero(ty),
            Expression::Compose { ty, ref components } => {
                let parts = components.iter().map(|&part| get(self, part)).collect::<Found<Vec<_>>>()?;
                Ok(self.composed(ty, parts))
            }
            Expression::Splat { size, value } => {
                let value = get(self, value)?;
                Ok(Value::parts(vec![value; size as usize]))
            }
            Expression::Swizzle { size, vector, pattern } => {
                let vector = get(self, vector)?;
                let part = |&at: &naga::SwizzleComponent| vector.components()[at as usize].clone();
                Ok(Value::parts(pattern[..size as usize].iter().map(part).collect()))
            }
            Expression::AccessIndex { base, index } => {
                let base = get(self, base)?;
                self.access(&base, Whole::known(true, index.into()))
            }
            Expression::Access { base, index } => {
                let (base, index) = (get(self, base)?, get(self, index)?);
                match index {
                    Value::Scalar(Scalar::Whole(index)) => self.access(&base, index),
                    _ => Err(no_form("this index")),
                }
            }
            Expression::Unary { op, expr } => {
                get(self, expr)?.map(&mut |scalar| arithmetic::unary(op, scalar))
            }
            Expression::Binary { op, left, right } => {
                let (left, right) = (get(self, left)?, get(self, right)?);
                binary(op, &left, &right)
            }
            Expression::Select { condition, accept, reject } => {
                let (condition, accept, reject) =
                    (get(self, condition)?, get(self, accept)?, get(self, reject)?);
                self.select(&condition, &accept, &reject)
            }
            Expression::Relational { fun, argument } => math::relational(fun, &get(self, argument)?),
            Expression::Math { fun, arg, arg1, arg2, arg3 } => {
                let given = [Some(arg), arg1, arg2, arg3].into_iter().flatten();
                let values = given.map(|a| get(self, a)).collect::<Found<Vec<_>>>()?;
                math::call(fun, &values.iter().collect::<Vec<_>>())
            }
            Expression::As { convert: None, .. } => Err(no_form("`bitcast`")),
            Expression::As { expr, kind, .. } => convert(&get(self, expr)?, kind),
            _ => Err(no_form("an expression")),
        }
    }

    /// A part of a value, or a pointer to one.
    fn access(&mut self, base: &Value, index: Whole) -> Found<Value> {
        match base {
            Value::Pointer(place) => {
                let mut path = place.path.clone();
                path.push(index);
                Ok(Value::Pointer(Place { slot: place.slot, path }))
            }
            _ => self.load(base, &[index]),
        }
    }

    /// What lies at the end of a path; of an index that varies, a choice. Indices out of range count as the
    /// last part's.
    fn load(&mut self, value: &Value, path: &[Whole]) -> Found<Value> {
        let [index, rest @ ..] = path else { return Ok(value.clone()) };
        let parts = value.components();
        let Some(last) = parts.len().checked_sub(1) else { return Err(no_form("an empty array")) };
        if let Some(known) = index.value() {
            return self.load(&parts[usize::try_from(known).map_or(last, |i| i.min(last))], rest);
        }
        let (low, high) =
            (index.low.clamp(0, last as i64) as usize, index.high.clamp(0, last as i64) as usize);
        if high - low >= super::LARGEST_CHOICE {
            return Err(no_form("an array indexed by a number that varies"));
        }
        let mut chosen = self.load(&parts[high], rest)?;
        for i in (low..high).rev() {
            let truth = Truth::of(index.expr().less_equal(i as f64));
            let part = self.load(&parts[i], rest)?;
            self.look()?;
            chosen = Value::choose(&truth, &part, &chosen, &self.made);
        }
        Ok(chosen)
    }

    /// By one condition, or one for each component.
    fn select(&mut self, condition: &Value, accept: &Value, reject: &Value) -> Found<Value> {
        match (condition, accept, reject) {
            (Value::Scalar(Scalar::Bool(truth)), ..) => Ok(Value::choose(truth, accept, reject, &self.made)),
            (Value::Parts(truths), Value::Parts(a), Value::Parts(b)) => {
                let parts =
                    truths.iter().zip(a.iter().zip(&**b)).map(|(truth, (a, b))| self.select(truth, a, b));
                Ok(Value::parts(parts.collect::<Found<_>>()?))
            }
            _ => Err(no_form("this `select`")),
        }
    }

    /// Zeros of a type.
    pub fn zero(&mut self, ty: Handle<Type>) -> Found<Value> {
        let scalar = |scalar: naga::Scalar| match scalar.kind {
            ScalarKind::Float | ScalarKind::AbstractFloat => Value::from(Float::known(0.0)),
            ScalarKind::Bool => Truth::Known(false).into(),
            kind => Whole::known(kind == ScalarKind::Uint, 0).into(),
        };
        let module = self.module;
        Ok(match &module.types[ty].inner {
            TypeInner::Scalar(one) => scalar(*one),
            TypeInner::Vector { size, scalar: one } => Value::parts(vec![scalar(*one); *size as usize]),
            TypeInner::Matrix { columns, rows, scalar: one } => {
                let column = Value::parts(vec![scalar(*one); *rows as usize]);
                Value::parts(vec![column; *columns as usize])
            }
            TypeInner::Array { base, size: naga::ArraySize::Constant(count), .. } => {
                if count.get() > super::LARGEST_ARRAY {
                    return Err(no_form("an array of so many elements"));
                }
                Value::parts(vec![self.zero(*base)?; count.get() as usize])
            }
            TypeInner::Struct { members, .. } => {
                Value::parts(members.iter().map(|m| self.zero(m.ty)).collect::<Found<_>>()?)
            }
            _ => return Err(no_form("a variable of this type")),
        })
    }

    /// A value of type `ty` of its parts; vectors may be given as shorter vectors.
    fn composed(&self, ty: Handle<Type>, parts: Vec<Value>) -> Value {
        let flat = |parts: &[Value]| parts.iter().flat_map(|p| p.components().to_vec()).collect::<Vec<_>>();
        match self.module.types[ty].inner {
            TypeInner::Vector { .. } => Value::parts(flat(&parts)),
            TypeInner::Matrix { rows, .. } => {
                let columns = flat(&parts);
                Value::parts(columns.chunks(rows as usize).map(|c| Value::parts(c.to_vec())).collect())
            }
            _ => Value::parts(parts),
        }
    }
}

fn convert(value: &Value, kind: ScalarKind) -> Found<Value> {
    value.map(&mut |scalar| arithmetic::convert(scalar, kind))
}

/// Puts `new` at the end of a path.
pub fn store(into: &mut Value, path: &[Whole], new: Value) -> Found<()> {
    let [index, rest @ ..] = path else {
        *into = new;
        return Ok(());
    };
    let Some(known) = index.value() else {
        return Err(no_form("an assignment to an element whose index varies"));
    };
    let Value::Parts(parts) = into else { return Err(no_form("this assignment")) };
    let parts = std::rc::Rc::make_mut(parts);
    let last = parts.len().saturating_sub(1);
    let at = usize::try_from(known).map_or(last, |i| i.min(last));
    match parts.get_mut(at) {
        Some(part) => store(part, rest, new),
        None => Err(no_form("this assignment")),
    }
}

fn is_matrix(value: &Value) -> bool {
    matches!(value, Value::Parts(parts) if matches!(parts.first(), Some(Value::Parts(_))))
}

/// An operator of scalars, vectors or matrices.
fn binary(op: BinaryOperator, a: &Value, b: &Value) -> Found<Value> {
    if op == BinaryOperator::Multiply && !matches!((a, b), (Value::Scalar(_), _) | (_, Value::Scalar(_))) {
        match (is_matrix(a), is_matrix(b)) {
            (true, true) => {
                let columns = b.components().iter().map(|column| transformed(a, column));
                return Ok(Value::parts(columns.collect::<Found<_>>()?));
            }
            (true, false) => return transformed(a, b),
            (false, true) => {
                let dots = b.components().iter().map(|column| dot(a.components(), column.components()));
                return Ok(Value::parts(dots.collect::<Found<_>>()?));
            }
            (false, false) => {}
        }
    }
    match (a, b) {
        (Value::Scalar(a), Value::Scalar(b)) => arithmetic::binary(op, a, b).map(Value::Scalar),
        (Value::Parts(a), Value::Parts(b)) => {
            let parts = a.iter().zip(&**b).map(|(a, b)| binary(op, a, b));
            Ok(Value::parts(parts.collect::<Found<_>>()?))
        }
        (Value::Parts(a), b @ Value::Scalar(_)) => {
            Ok(Value::parts(a.iter().map(|a| binary(op, a, b)).collect::<Found<_>>()?))
        }
        (a @ Value::Scalar(_), Value::Parts(b)) => {
            Ok(Value::parts(b.iter().map(|b| binary(op, a, b)).collect::<Found<_>>()?))
        }
        _ => Err(no_form("an operation on pointers")),
    }
}

fn dot(a: &[Value], b: &[Value]) -> Found<Value> {
    let mut sum: Option<Value> = None;
    for (a, b) in a.iter().zip(b) {
        let product = binary(BinaryOperator::Multiply, a, b)?;
        sum = Some(match sum {
            Some(sum) => binary(BinaryOperator::Add, &sum, &product)?,
            None => product,
        });
    }
    sum.ok_or_else(|| no_form("an empty vector"))
}

/// A matrix times a vector.
fn transformed(matrix: &Value, vector: &Value) -> Found<Value> {
    let columns = matrix.components();
    let rows = columns.first().map_or(0, |c| c.components().len());
    let row = |i: usize| {
        let row: Vec<Value> = columns.iter().map(|c| c.components()[i].clone()).collect();
        dot(&row, vector.components())
    };
    Ok(Value::parts((0..rows).map(row).collect::<Found<_>>()?))
}

/// The point as the argument of `density`.
pub fn point() -> Value {
    let axes: [Expr; 3] = [super::super::x(), super::super::y(), super::super::z()];
    Value::parts(axes.into_iter().map(|axis| Float::unknown(axis).into()).collect())
}
