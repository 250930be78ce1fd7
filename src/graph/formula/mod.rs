//! Formula text as an [`Expr`]: `sqrt(x^2 + y^2 + z^2) - r`.
//!
//! | | |
//! |---|---|
//! | numbers | `1`, `.5`, `1e-3`, `pi`, `tau`, `e` |
//! | the point | `x`, `y`, `z` |
//! | parameters | any other name, given by the caller |
//! | operators, tightest first | `^` (from the right); `-a`; `*` `/`; `+` `-`; `<` `<=` `>` `>=`, which give 1 or 0 |
//! | parts | `abs sign floor ceil round trunc fract mod(a, b) min max clamp(x, low, high)`; `round` takes ties to even |
//! | choices | `select(c, a, b)` or `if(c, a, b)`: a where c is not 0; `step(edge, x) smoothstep(low, high, x) mix(a, b, t)` |
//! | roots and lengths | `square sqrt length hypot` |
//! | angles in radians | `sin cos tan asin acos atan atan2(y, x)` |
//! | exponentials | `exp ln log2 log10 pow(a, b) sinh cosh tanh` |
//!
//! A whole constant exponent is a product, 0.5 a square root; other powers of negative numbers are NaN. Line breaks are spaces. Operators wait on a
//! list, not on the stack, so that no text is too deep.

mod fault;
mod functions;
mod lexer;

use super::{Expr, compound, x, y, z};
use crate::excerpt::{Excerpt, excerpt};
pub use fault::{Fault, FormulaError};
pub(crate) use fault::{closest, listed, short};
use functions::{CONSTANTS, FUNCTIONS, Function};
use lexer::{Kind, Operator, Word};
use std::collections::HashMap;

/// The expression that `text` is. `parameters` are the names, beside those of formulas, that it may have,
/// and their values.
///
/// # Errors
/// [`FormulaError`].
pub fn parse(text: &str, parameters: &[(String, f64)]) -> Result<Expr, FormulaError> {
    let mut names = Names::default();
    for (name, value) in parameters {
        names.add(name, Expr::parameter(name, *value), *value);
    }
    Parser::new(text, &[&names]).run().map_err(|(fault, at)| {
        let Excerpt { text: excerpt, .. } = excerpt(text, at);
        FormulaError { fault, at, excerpt }
    })
}

/// The expression that `text` is, where `names` stand for other expressions; those of the last list that has a name count. An
/// error is a fault and its byte.
pub(crate) fn parse_with(text: &str, names: &[&Names]) -> Result<Expr, (Fault, usize)> {
    Parser::new(text, names).run()
}

/// Names beside those of formulas, found at once, however many they are and however many formulas look for them.
#[derive(Debug, Default)]
pub(crate) struct Names {
    /// In the caller's order.
    known: Vec<String>,
    /// Of each its expression, shared by all places, and its value.
    exprs: HashMap<String, (Expr, f64)>,
}

impl Names {
    /// Adds a name; its last value counts, as on command lines.
    fn add(&mut self, name: &str, expr: Expr, value: f64) {
        if self.exprs.insert(name.into(), (expr, value)).is_none() {
            self.known.push(name.into());
        }
    }

    /// Adds a name whose value is checked by who gives it.
    pub fn insert(&mut self, name: &str, expr: Expr) {
        self.add(name, expr, 0.0);
    }

    /// All of them.
    pub fn known(&self) -> &[String] {
        &self.known
    }
}

/// Whether a name means a coordinate or a constant in formulas.
pub(crate) fn is_reserved(name: &str) -> bool {
    ["x", "y", "z"].contains(&name) || CONSTANTS.iter().any(|(known, _)| *known == name)
}

/// Whether a text is a name that a formula can say.
pub(crate) fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(lexer::starts_name) && letters.all(lexer::continues_name)
}

/// What has been read and waits for its right side or its end.
enum Waiting {
    Negate,
    Binary(Operator, Word),
    /// A parenthesis; with a function, that before it.
    Open {
        call: Option<&'static Function>,
        /// Values before the first argument.
        values: usize,
        word: Word,
    },
}

/// A part that is complete.
struct Value {
    expr: Expr,
    /// Its number if it is constant.
    constant: Option<f64>,
}

type Outcome<T> = Result<T, (Fault, usize)>;

struct Parser<'a> {
    text: &'a str,
    names: &'a [&'a Names],
    values: Vec<Value>,
    waiting: Vec<Waiting>,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str, names: &'a [&'a Names]) -> Self {
        Self { text, names, values: Vec::new(), waiting: Vec::new() }
    }

    fn given(&self, name: &str) -> Option<&'a (Expr, f64)> {
        self.names.iter().rev().find_map(|names| names.exprs.get(name))
    }

    fn run(mut self) -> Outcome<Expr> {
        let mut wants_value = true;
        let mut before: Option<Word> = None;
        let mut at = 0;
        loop {
            let word = lexer::next(self.text, at)?;
            at = word.end;
            wants_value = match (wants_value, word.kind) {
                (true, Kind::Number(number)) => {
                    self.values.push(Value { expr: number.into(), constant: Some(number) });
                    false
                }
                (true, Kind::Name) => {
                    let next = lexer::next(self.text, at).ok().filter(|next| next.kind == Kind::Open);
                    if let Some(open) = next {
                        at = self.open_call(word, open)?;
                        // `f()` has no argument.
                        self.waits_for_value(at)
                    } else {
                        let value = self.name(word)?;
                        self.values.push(value);
                        false
                    }
                }
                (true, Kind::Open) => {
                    let values = self.values.len();
                    self.waiting.push(Waiting::Open { call: None, values, word });
                    true
                }
                (true, Kind::Operator(Operator::Sub)) => {
                    self.waiting.push(Waiting::Negate);
                    true
                }
                (true, Kind::Operator(Operator::Add)) => true,
                (true, Kind::End) if before.is_none() => return Err((Fault::Empty, word.start)),
                (true, Kind::End | Kind::Close | Kind::Comma | Kind::Operator(_)) => {
                    let end = word.kind == Kind::End;
                    let before = if end { "the end".into() } else { format!("`{}`", self.word(word)) };
                    return Err((Fault::NoValue { before }, word.start));
                }
                (false, Kind::Operator(operator)) => {
                    self.operator(operator, word)?;
                    true
                }
                (false, Kind::Comma) => {
                    self.reduce(0, false)?;
                    match self.waiting.last() {
                        Some(Waiting::Open { call: Some(_), .. }) => true,
                        _ => return Err((Fault::Comma, word.start)),
                    }
                }
                (false, Kind::Close) => {
                    self.close(word)?;
                    false
                }
                (false, Kind::Number(_) | Kind::Name | Kind::Open) => {
                    let left = before.map_or(String::new(), |word| self.word(word));
                    return Err((Fault::NoOperator { left, right: self.word(word) }, word.start));
                }
                (false, Kind::End) => {
                    self.reduce(0, false)?;
                    if let Some(Waiting::Open { word, .. }) = self.waiting.last() {
                        return Err((Fault::NotClosed, word.start));
                    }
                    // One value is left: each operator took two and gave one.
                    return self.values.pop().map(|v| v.expr).ok_or((Fault::Empty, 0));
                }
            };
            before = Some(word);
        }
    }

    fn word(&self, word: Word) -> String {
        short(&self.text[word.start..word.end])
    }

    /// Whether what follows byte `at` is not the end of an empty list of arguments.
    fn waits_for_value(&self, at: usize) -> bool {
        !lexer::next(self.text, at).is_ok_and(|next| next.kind == Kind::Close)
    }

    fn open_call(&mut self, word: Word, open: Word) -> Outcome<usize> {
        let name = &self.text[word.start..word.end];
        let Some(function) = FUNCTIONS.iter().find(|f| f.name == name) else {
            let name = short(name);
            let fault = if self.is_number(&self.text[word.start..word.end]) {
                Fault::NotAFunction { name }
            } else {
                let closest = closest(&name, FUNCTIONS.iter().map(|f| f.name));
                Fault::UnknownFunction { name, closest }
            };
            return Err((fault, word.start));
        };
        let values = self.values.len();
        self.waiting.push(Waiting::Open { call: Some(function), values, word });
        Ok(open.end)
    }

    fn is_number(&self, name: &str) -> bool {
        is_reserved(name) || self.given(name).is_some()
    }

    fn name(&self, word: Word) -> Outcome<Value> {
        let name = &self.text[word.start..word.end];
        let err = |fault| Err((fault, word.start));
        let given = self.given(name);
        if given.is_some() && is_reserved(name) {
            return err(Fault::Reserved { name: name.into() });
        }
        if let Some((_, value)) = CONSTANTS.iter().find(|(known, _)| *known == name) {
            return Ok(Value { expr: (*value).into(), constant: Some(*value) });
        }
        let expr = match (name, given) {
            ("x", _) => x(),
            ("y", _) => y(),
            ("z", _) => z(),
            (_, Some((_, value))) if !(*value as f32).is_finite() => {
                return err(Fault::Parameter { name: name.into(), value: *value });
            }
            (_, Some((expr, _))) => expr.clone(),
            _ => {
                if let Some(function) = FUNCTIONS.iter().find(|f| f.name == name) {
                    return err(Fault::NoArguments { name: function.name });
                }
                let known: Vec<String> =
                    self.names.iter().flat_map(|names| names.known().iter().cloned()).collect();
                let closest = closest(name, known.iter().map(String::as_str).chain(["pi", "tau"]));
                return err(Fault::UnknownName { name: short(name), closest, known });
            }
        };
        Ok(Value { expr, constant: None })
    }

    fn operator(&mut self, operator: Operator, word: Word) -> Outcome<()> {
        // `^` waits for one that follows it, the others do not.
        self.reduce(operator.precedence(), operator == Operator::Power)?;
        if let (1, Some(Waiting::Binary(before, _))) = (operator.precedence(), self.waiting.last())
            && before.precedence() == 1
        {
            return Err((Fault::Chain, word.start));
        }
        self.waiting.push(Waiting::Binary(operator, word));
        Ok(())
    }

    /// Applies what waits and binds tighter than `precedence`, or as tight unless `strictly`.
    fn reduce(&mut self, precedence: u8, strictly: bool) -> Outcome<()> {
        loop {
            let own = match self.waiting.last() {
                Some(Waiting::Negate) => 4,
                // Comparisons are left waiting for one that follows, which is an error.
                Some(Waiting::Binary(o, _)) if o.precedence() == 1 && precedence == 1 => return Ok(()),
                Some(Waiting::Binary(operator, _)) => operator.precedence(),
                Some(Waiting::Open { .. }) | None => return Ok(()),
            };
            if own < precedence || (own == precedence && strictly) {
                return Ok(());
            }
            match self.waiting.pop() {
                Some(Waiting::Negate) => {
                    if let Some(a) = self.values.pop() {
                        self.values.push(Value { expr: -a.expr, constant: a.constant.map(|a| -a) });
                    }
                }
                Some(Waiting::Binary(operator, word)) => {
                    if let (Some(b), Some(a)) = (self.values.pop(), self.values.pop()) {
                        let value = apply(operator, a, b).map_err(|fault| (fault, word.start))?;
                        self.values.push(value);
                    }
                }
                _ => {}
            }
        }
    }

    fn close(&mut self, word: Word) -> Outcome<()> {
        self.reduce(0, false)?;
        let Some(Waiting::Open { call, values, word }) = self.waiting.pop() else {
            return Err((Fault::NotOpen, word.start));
        };
        let Some(&Function { name, least, most, build }) = call else { return Ok(()) };
        let given: Vec<Expr> = self.values.drain(values..).map(|v| v.expr).collect();
        if given.len() < least || given.len() > most {
            return Err((Fault::ArgumentCount { name, found: given.len(), least, most }, word.start));
        }
        self.values.push(Value { expr: build(&given), constant: None });
        Ok(())
    }
}

fn apply(operator: Operator, a: Value, b: Value) -> Result<Value, Fault> {
    if let (Some(a), Some(b)) = (a.constant, b.constant) {
        let of = |truth: bool| f64::from(u8::from(truth));
        let value = match operator {
            Operator::Add => a + b,
            Operator::Sub => a - b,
            Operator::Mul => a * b,
            Operator::Div => a / b,
            Operator::Power => a.powf(b),
            Operator::Less => of(a < b),
            Operator::LessEqual => of(a <= b),
            Operator::Greater => of(a > b),
            Operator::GreaterEqual => of(a >= b),
        };
        if !value.is_finite() {
            return Err(Fault::NotFinite { value });
        }
        return Ok(Value { expr: value.into(), constant: Some(value) });
    }
    if operator == Operator::Div && b.constant == Some(0.0) {
        return Err(Fault::NotFinite { value: f64::INFINITY });
    }
    let exponent = b.constant;
    let (a, b) = (a.expr, b.expr);
    let expr = match operator {
        Operator::Add => a + b,
        Operator::Sub => a - b,
        Operator::Mul => a * b,
        Operator::Div => a / b,
        Operator::Power => compound::power(&a, &b, exponent),
        Operator::Less => a.less(b),
        Operator::LessEqual => a.less_equal(b),
        Operator::Greater => b.less(a),
        Operator::GreaterEqual => b.less_equal(a),
    };
    Ok(Value { expr, constant: None })
}
