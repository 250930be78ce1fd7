//! Statements: what they do to the variables, on all ways through the function at once.
//!
//! A condition that varies forks the [`State`] and joins both by a choice.

use super::arithmetic::check_exact;
use super::expression::store;
use super::state::State;
use super::truth::Truth;
use super::value::{Scalar, Value};
use super::{Found, MOST_OPERATIONS, MOST_STEPS, Stop, What};
use naga::{Block, Expression, Function, Handle, Module, Span, Statement, SwitchValue};
use std::cell::Cell;
use std::collections::HashMap;
use std::rc::Rc;

/// A call.
pub struct Frame<'a> {
    pub function: &'a Function,
    pub arguments: Vec<Value>,
    /// Values of the expressions that were emitted.
    pub values: Vec<Option<Value>>,
    /// The slot of its first variable.
    pub base: usize,
}

/// The lowering of a module's functions.
pub struct Lowering<'a> {
    pub module: &'a Module,
    pub constants: HashMap<Handle<Expression>, Value>,
    steps: usize,
    pub made: Rc<Cell<usize>>,
    /// Whether a way out of the loop depended on no point since this was last reset.
    decided: bool,
}

type Done<T> = Result<T, Stop>;

fn at<T>(found: Found<T>, span: Span) -> Done<T> {
    found.map_err(|what| Stop { what, span })
}

impl<'a> Lowering<'a> {
    pub fn new(module: &'a Module) -> Self {
        Self { module, constants: HashMap::new(), steps: 0, made: Rc::default(), decided: false }
    }

    /// What `function` gives for `arguments`.
    pub fn call(
        &mut self,
        function: &'a Function,
        arguments: Vec<Value>,
        slots: &mut Vec<Value>,
    ) -> Done<Option<Value>> {
        let base = slots.len();
        let values = vec![None; function.expressions.len()];
        let mut frame = Frame { function, arguments, values, base };
        let mut state = State::new(std::mem::take(slots), self.made.clone());
        for (_, variable) in function.local_variables.iter() {
            let value = match variable.init {
                Some(init) => at(self.value(&mut frame, &state, init), function.expressions.get_span(init))?,
                None => at(self.zero(variable.ty), Span::UNDEFINED)?,
            };
            state.slots.push(value);
        }
        self.block(&mut frame, &mut state, &function.body)?;
        let (callers, result) = state.into_callers();
        *slots = callers;
        Ok(result)
    }

    /// Counts work done at `span`.
    fn spend(&mut self, operations: usize, span: Span) -> Done<()> {
        self.made.set(self.made.get() + operations);
        at(self.look(), span)
    }

    /// Counts a step.
    pub fn look(&mut self) -> Found<()> {
        self.steps += 1;
        if self.steps > MOST_STEPS || self.made.get() > MOST_OPERATIONS { Err(What::Long) } else { Ok(()) }
    }

    fn block(&mut self, frame: &mut Frame<'a>, state: &mut State, block: &'a Block) -> Done<()> {
        for (statement, &span) in block.span_iter() {
            if state.is_dead() {
                break;
            }
            self.statement(frame, state, statement, span)?;
        }
        Ok(())
    }

    fn condition(
        &mut self,
        frame: &mut Frame<'a>,
        state: &State,
        handle: Handle<Expression>,
    ) -> Found<Truth> {
        match self.value(frame, state, handle)? {
            Value::Scalar(Scalar::Bool(truth)) => Ok(truth),
            _ => Err(What::NoForm { what: "this condition".into() }),
        }
    }

    fn statement(
        &mut self,
        frame: &mut Frame<'a>,
        state: &mut State,
        statement: &'a Statement,
        span: Span,
    ) -> Done<()> {
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    let span = frame.function.expressions.get_span(handle);
                    let value = at(self.evaluate(frame, state, handle), span)?;
                    let is_operation = matches!(
                        frame.function.expressions[handle],
                        Expression::Unary { .. }
                            | Expression::Binary { .. }
                            | Expression::Select { .. }
                            | Expression::Math { .. }
                            | Expression::As { .. }
                            | Expression::Relational { .. }
                    );
                    self.spend(if is_operation { value.unknown_count() } else { 0 }, span)?;
                    frame.values[handle.index()] = Some(value);
                }
            }
            Statement::Block(block) => self.block(frame, state, block)?,
            Statement::If { condition, accept, reject } => {
                let truth = at(self.condition(frame, state, *condition), span)?;
                let leaves = |block: &Block| matches!(block.last(), Some(Statement::Break));
                self.decided |= truth.known().is_some() && (leaves(accept) || leaves(reject));
                match truth.known() {
                    Some(true) => self.block(frame, state, accept)?,
                    Some(false) => self.block(frame, state, reject)?,
                    None => {
                        let (mut yes, mut no) = (state.clone(), state.clone());
                        self.block(frame, &mut yes, accept)?;
                        self.block(frame, &mut no, reject)?;
                        *state = State::join(&truth, yes, no);
                        self.spend(1, span)?;
                    }
                }
            }
            Statement::Switch { selector, cases } => self.switch(frame, state, *selector, cases, span)?,
            Statement::Loop { body, continuing, break_if } => {
                self.repeat(frame, state, [body, continuing], *break_if, span)?;
            }
            Statement::Break => state.leave(&Truth::Known(true)),
            Statement::Continue => {
                let exit = state.continued.take();
                state.continued = state.with_exit(exit, &Truth::Known(true));
                state.live = Truth::Known(false);
            }
            Statement::Return { value } => {
                if let Some(value) = value {
                    let value = at(self.value(frame, state, *value), span)?;
                    state.result = Some(match &state.result {
                        Some(before) => Value::choose(&state.live, &value, before, &state.made),
                        None => value,
                    });
                }
                state.leave_function();
            }
            Statement::Store { pointer, value } => {
                let value = at(self.value(frame, state, *value), span)?;
                let Value::Pointer(place) = at(self.value(frame, state, *pointer), span)? else {
                    return Err(Stop { what: What::NoForm { what: "this assignment".into() }, span });
                };
                at(store(&mut state.slots[place.slot], &place.path, value), span)?;
            }
            Statement::Call { function, arguments, result } => {
                let given = arguments.iter().map(|&a| self.value(frame, state, a)).collect::<Found<_>>();
                self.spend(1, span)?;
                let value =
                    self.call(&self.module.functions[*function], at(given, span)?, &mut state.slots)?;
                if let Some(result) = result {
                    frame.values[result.index()] = value;
                }
            }
            _ => return Err(Stop { what: What::NoForm { what: "a statement".into() }, span }),
        }
        Ok(())
    }

    fn switch(
        &mut self,
        frame: &mut Frame<'a>,
        state: &mut State,
        selector: Handle<Expression>,
        cases: &'a [naga::SwitchCase],
        span: Span,
    ) -> Done<()> {
        let Value::Scalar(Scalar::Whole(selector)) = at(self.value(frame, state, selector), span)? else {
            return Err(Stop { what: What::NoForm { what: "this `switch`".into() }, span });
        };
        at(check_exact(&selector), span)?;
        // Selectors that share a body come as empty cases that fall through to it.
        let mut groups: Vec<(Truth, &'a Block)> = Vec::new();
        let (mut default, mut any, mut has_default) = (None, Truth::Known(false), false);
        for case in cases {
            match case.value {
                SwitchValue::Default => has_default = true,
                SwitchValue::I32(_) | SwitchValue::U32(_) => {
                    let value = match case.value {
                        SwitchValue::I32(value) => i64::from(value),
                        SwitchValue::U32(value) => i64::from(value),
                        SwitchValue::Default => 0,
                    };
                    let known = if value < selector.low || value > selector.high {
                        Some(false)
                    } else {
                        selector.value().map(|selector| selector == value)
                    };
                    let equal = || Truth::equal(&selector.expr(), &(value as f64).into());
                    any = any.or(&known.map_or_else(equal, Truth::Known));
                }
            }
            if case.fall_through && case.body.is_empty() {
                continue;
            }
            if case.fall_through {
                return Err(Stop { what: What::NoForm { what: "`fallthrough`".into() }, span });
            }
            if has_default {
                default = Some(&case.body);
                has_default = false;
            } else {
                groups.push((any, &case.body));
            }
            any = Truth::Known(false);
        }
        let outer = state.broken.take();
        let entry = state.clone();
        let mut others = Truth::Known(true);
        groups.iter().for_each(|(truth, _)| others = others.and(&truth.not()));
        let mut joined = None;
        if let Some(body) = default.filter(|_| others.known() != Some(false)) {
            joined = Some(self.case(frame, &entry, body)?);
        }
        for (truth, body) in groups.into_iter().rev().filter(|(truth, _)| truth.known() != Some(false)) {
            let own = self.case(frame, &entry, body)?;
            joined = Some(match joined {
                Some(others) => State::join(&truth, own, others),
                None => own,
            });
            self.spend(1, span)?;
        }
        *state = joined.unwrap_or(entry);
        state.broken = outer;
        Ok(())
    }

    fn case(&mut self, frame: &mut Frame<'a>, entry: &State, body: &'a Block) -> Done<State> {
        let mut state = entry.clone();
        self.block(frame, &mut state, body)?;
        let broken = state.broken.take();
        state.rejoin(broken);
        Ok(state)
    }

    fn repeat(
        &mut self,
        frame: &mut Frame<'a>,
        state: &mut State,
        [body, continuing]: [&'a Block; 2],
        break_if: Option<Handle<Expression>>,
        span: Span,
    ) -> Done<()> {
        let outer = (state.broken.take(), state.continued.take(), self.decided);
        let (live, returned_before) =
            (state.live.clone(), state.returned.as_ref().map(|exit| exit.taken.clone()));
        while !state.is_dead() {
            self.decided = false;
            let iterated = self.iterate(frame, state, [body, continuing], span);
            // The loop that ends too late or never is the reason, the innermost of them.
            let decided = self.decided || state.live.known().is_some();
            iterated.map_err(|stop| match stop.what {
                What::Long => Stop { what: What::Unbounded { decided }, span },
                _ => stop,
            })?;
            if let Some(condition) = break_if.filter(|_| !state.is_dead()) {
                let truth = at(self.condition(frame, state, condition), span)?;
                state.leave(&truth);
            }
        }
        let broken = state.broken.take();
        state.rejoin(broken);
        // If nothing was returned in it, all ways into the loop lead out of it.
        let returned = match (&returned_before, &state.returned) {
            (None, None) => false,
            (Some(before), Some(now)) => !before.same(&now.taken),
            _ => true,
        };
        if !returned {
            state.live = live;
        }
        (state.broken, state.continued, self.decided) = outer;
        Ok(())
    }

    fn iterate(
        &mut self,
        frame: &mut Frame<'a>,
        state: &mut State,
        [body, continuing]: [&'a Block; 2],
        span: Span,
    ) -> Done<()> {
        self.spend(0, span)?;
        self.block(frame, state, body)?;
        let continued = state.continued.take();
        state.rejoin(continued);
        self.block(frame, state, continuing)
    }
}
