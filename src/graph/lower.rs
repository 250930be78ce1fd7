//! From an [`Expr`] to a [`Program`]: equal parts found by hashing, constants folded, and what does not
//! depend on the point set apart.
//!
//! What is computed of constants and parameters alone is computed once, in `f64`, whenever a parameter
//! changes, and rounded to `f32`: the **uniforms**. Nothing here recurses: expressions may be deep.

use super::expr::{Expr, Node};
use super::leaf::Leaf;
use super::ops::{Binary, Unary};
use super::tape::{Instruction, Op, Operand, Tape};
use std::collections::HashMap;
use std::sync::Arc;

/// A parameter of a field.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: Arc<str>,
    /// Its value unless set.
    pub default: f64,
}

/// An expression made flat.
#[derive(Debug, Clone)]
pub struct Program {
    /// Operations at each point.
    pub tape: Tape,
    /// The parameters.
    pub parameters: Vec<Parameter>,
    /// How the uniforms are computed: each of earlier ones.
    steps: Vec<Step>,
    /// The steps that are uniforms of the tape.
    uniforms: Vec<u32>,
    /// Whether a constant that is 0 in `f32` is a divisor at each point.
    divides_by_zero: bool,
}

/// Sizes of constants of which neither a product of two nor a quotient is infinite in `f32`.
const LITERALS: std::ops::RangeInclusive<f32> = 1e-18..=1e18;

/// A number that does not depend on the point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    Constant(f64),
    Parameter(u32),
    Op(Op, [u32; 3]),
}

impl Program {
    /// Flattens `expr`.
    pub fn new(expr: &Expr) -> Self {
        let mut graph = Graph::default();
        let root = graph.lower(expr, usize::MAX).expect("no bound was set");
        graph.program(root)
    }

    /// The uniforms for values of the parameters.
    pub fn uniforms(&self, parameters: &[f64]) -> Vec<f32> {
        let mut values: Vec<f64> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let value = match *step {
                Step::Constant(value) => value,
                Step::Parameter(i) => parameters[i as usize],
                Step::Op(op, operands) => {
                    fold(op, operands.map(|i| values.get(i as usize).copied().unwrap_or(0.0)))
                }
            };
            values.push(value);
        }
        self.uniforms.iter().map(|&i| to_f32(values[i as usize])).collect()
    }

    /// The uniform's value if it is a constant that can be written into source text. naga computes what text has of
    /// literals alone (slopes have `1.0 / B` and `B * B`) and refuses it unless it is finite, so others are read.
    pub fn constant(&self, uniform: u32) -> Option<f32> {
        let Step::Constant(value) = self.steps[self.uniforms[uniform as usize] as usize] else { return None };
        let value = to_f32(value);
        let is_literal = if value == 0.0 { !self.divides_by_zero } else { LITERALS.contains(&value.abs()) };
        is_literal.then_some(value)
    }

    /// What the whole is, if it is one number whatever the parameters.
    pub(super) fn whole(&self) -> Option<f64> {
        let Operand::Uniform(uniform) = self.tape.root else { return None };
        match self.steps[self.uniforms[uniform as usize] as usize] {
            Step::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// How many uniforms there are.
    pub fn uniform_count(&self) -> u32 {
        self.uniforms.len() as u32
    }
}

/// To `f32`; what some drivers take for 0 is 0.
fn to_f32(value: f64) -> f32 {
    let value = value as f32;
    if value.is_subnormal() { 0.0 } else { value }
}

fn fold(op: Op, [a, b, c]: [f64; 3]) -> f64 {
    match op {
        Op::Unary(op) => op.fold(a),
        Op::Binary(op) => op.fold(a, b),
        Op::Select => {
            if a == 0.0 {
                c
            } else {
                b
            }
        }
        // No leaf is uniform.
        Op::Leaf(_) => f64::NAN,
    }
}

/// A part of an expression, by number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Part {
    Axis(u8),
    /// The bits of an `f64`.
    Constant(u64),
    Parameter(u32),
    Op(Op, [u32; 3]),
}

impl Expr {
    /// Whether it is more than `most` operations and numbers when it is made flat, found in as many steps.
    pub(crate) fn is_longer_than(&self, most: usize) -> bool {
        Graph::default().lower(self, most).is_none()
    }
}

#[derive(Default)]
struct Graph {
    parts: Vec<Part>,
    numbers: HashMap<Part, u32>,
    /// Of each part: whether it is the same at all points.
    uniform: Vec<bool>,
    parameters: Vec<Parameter>,
    leaves: Vec<Arc<dyn Leaf>>,
}

impl Graph {
    /// The number of the whole; `None` if it takes more than `most` steps.
    fn lower(&mut self, root: &Expr, most: usize) -> Option<u32> {
        // What x, y and z are where an expression stands; frame 0 is the point itself.
        let own = [0, 1, 2].map(|axis| self.part(Part::Axis(axis)));
        let mut frames = vec![own];
        let mut frame_numbers = HashMap::from([(own, 0u32)]);
        let mut done: HashMap<(*const Node, u32), u32> = HashMap::new();
        let mut open = vec![(root, 0u32)];
        let key = |expr: &Expr, frame| (Arc::as_ptr(&expr.0), frame);
        while let Some(&(expr, frame)) = open.last() {
            if done.contains_key(&key(expr, frame)) {
                open.pop();
                continue;
            }
            // First the parts; of `At` first the coordinates, then the inner expression where they lead.
            let skip = usize::from(matches!(*expr.0, Node::At(..)));
            let before = open.len();
            open.extend(
                expr.0.parts().skip(skip).filter(|e| !done.contains_key(&key(e, frame))).map(|e| (e, frame)),
            );
            if open.len() > before {
                continue;
            }
            let get = |e: &Expr| done[&key(e, frame)];
            let number = match &*expr.0 {
                Node::Axis(axis) => frames[frame as usize][usize::from(*axis)],
                Node::Constant(value) => self.part(Part::Constant(value.to_bits())),
                Node::Parameter { name, default } => self.parameter(name, *default),
                Node::Unary(op, a) => self.op(Op::Unary(*op), [get(a), 0, 0]),
                Node::Binary(op, a, b) => self.op(Op::Binary(*op), [get(a), get(b), 0]),
                Node::Select(a, b, c) => self.op(Op::Select, [get(a), get(b), get(c)]),
                Node::Leaf(leaf) => self.leaf(leaf, frames[frame as usize]),
                Node::At(inner, at) => {
                    let at = [get(&at[0]), get(&at[1]), get(&at[2])];
                    let next = *frame_numbers.entry(at).or_insert_with(|| {
                        frames.push(at);
                        frames.len() as u32 - 1
                    });
                    let Some(&number) = done.get(&key(inner, next)) else {
                        open.push((inner, next));
                        continue;
                    };
                    number
                }
            };
            done.insert(key(expr, frame), number);
            open.pop();
            if done.len() > most {
                return None;
            }
        }
        Some(done[&(Arc::as_ptr(&root.0), 0)])
    }

    fn parameter(&mut self, name: &Arc<str>, default: f64) -> u32 {
        let known = self.parameters.iter().position(|p| p.name == *name);
        let number = known.unwrap_or_else(|| {
            self.parameters.push(Parameter { name: name.clone(), default });
            self.parameters.len() - 1
        });
        self.part(Part::Parameter(number as u32))
    }

    fn leaf(&mut self, leaf: &Arc<dyn Leaf>, at: [u32; 3]) -> u32 {
        let known = self.leaves.iter().position(|l| Arc::ptr_eq(l, leaf));
        let number = known.unwrap_or_else(|| {
            self.leaves.push(leaf.clone());
            self.leaves.len() - 1
        });
        self.part(Part::Op(Op::Leaf(number as u32), at))
    }

    fn part(&mut self, part: Part) -> u32 {
        if let Some(&number) = self.numbers.get(&part) {
            return number;
        }
        let number = self.parts.len() as u32;
        let uniform = match part {
            Part::Axis(_) => false,
            Part::Constant(_) | Part::Parameter(_) => true,
            // A leaf is computed at points alone.
            Part::Op(Op::Leaf(_), _) => false,
            Part::Op(op, parts) => parts[..op.arity()].iter().all(|&p| self.uniform[p as usize]),
        };
        self.parts.push(part);
        self.uniform.push(uniform);
        self.numbers.insert(part, number);
        number
    }

    fn constant(&self, number: u32) -> Option<f64> {
        match self.parts[number as usize] {
            Part::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    fn number(&mut self, value: f64) -> u32 {
        self.part(Part::Constant(value.to_bits()))
    }

    /// What a part is the negative of.
    fn negated(&self, number: u32) -> Option<u32> {
        match self.parts[number as usize] {
            Part::Op(Op::Unary(Unary::Neg), [inner, ..]) => Some(inner),
            _ => None,
        }
    }

    /// An operation, folded and simplified where that changes no value (but for zeros' signs and NaN).
    fn op(&mut self, op: Op, mut parts: [u32; 3]) -> u32 {
        let constants = parts.map(|p| self.constant(p));
        if constants[..op.arity()].iter().all(Option::is_some) {
            let value = fold(op, constants.map(|c| c.unwrap_or(0.0)));
            return self.part(Part::Constant(value.to_bits()));
        }
        let [a, b, c] = parts;
        let [ka, kb, _] = constants;
        match op {
            Op::Binary(Binary::Add) if ka == Some(0.0) => return b,
            Op::Binary(Binary::Add | Binary::Sub) if kb == Some(0.0) => return a,
            Op::Binary(Binary::Mul) if ka == Some(1.0) => return b,
            Op::Binary(Binary::Mul | Binary::Div) if kb == Some(1.0) => return a,
            // Drivers take NaN for impossible here, so that 0 times NaN must be 0 on the CPU, too.
            Op::Binary(Binary::Mul) if ka == Some(0.0) || kb == Some(0.0) => return self.number(0.0),
            Op::Binary(Binary::Div) if ka == Some(0.0) => return self.number(0.0),
            Op::Binary(Binary::Sub) if a == b => return self.number(0.0),
            Op::Binary(Binary::Add) if self.negated(a) == Some(b) || self.negated(b) == Some(a) => {
                return self.number(0.0);
            }
            Op::Binary(Binary::Pow) if kb == Some(0.0) => return self.number(1.0),
            Op::Binary(Binary::Mul) if a == b => return self.op(Op::Unary(Unary::Square), [a, 0, 0]),
            Op::Binary(Binary::Min | Binary::Max) if a == b => return a,
            Op::Select if ka.is_some() => return if ka == Some(0.0) { c } else { b },
            Op::Select if b == c => return b,
            Op::Unary(Unary::Neg) => {
                if let Some(inner) = self.negated(a) {
                    return inner;
                }
            }
            Op::Unary(Unary::Abs) => {
                if let Some(inner) = self.negated(a) {
                    return self.op(op, [inner, 0, 0]);
                }
            }
            _ => {}
        }
        if matches!(op, Op::Binary(Binary::Add | Binary::Mul)) && a > b {
            parts.swap(0, 1);
        }
        parts[op.arity()..].fill(0);
        self.part(Part::Op(op, parts))
    }

    fn program(self, root: u32) -> Program {
        let mut live = vec![false; self.parts.len()];
        live[root as usize] = true;
        for number in (0..self.parts.len()).rev() {
            if let (true, Part::Op(op, parts)) = (live[number], self.parts[number]) {
                parts[..op.arity()].iter().for_each(|&p| live[p as usize] = true);
            }
        }
        let (mut steps, mut uniforms, mut instructions) = (Vec::new(), Vec::new(), Vec::new());
        // Of each part: its step or its place on the tape; and its uniform, once it has one.
        let mut place = vec![0; self.parts.len()];
        let mut uniform_of = vec![None; self.parts.len()];
        let mut operand = |place: &[u32], number: u32| {
            let n = number as usize;
            match self.parts[n] {
                Part::Axis(axis) => Operand::Axis(axis),
                _ if self.uniform[n] => Operand::Uniform(*uniform_of[n].get_or_insert_with(|| {
                    uniforms.push(place[n]);
                    uniforms.len() as u32 - 1
                })),
                _ => Operand::Value(place[n]),
            }
        };
        for (number, part) in self.parts.iter().enumerate().filter(|(n, _)| live[*n]) {
            if self.uniform[number] {
                place[number] = steps.len() as u32;
                steps.push(match *part {
                    Part::Constant(bits) => Step::Constant(f64::from_bits(bits)),
                    Part::Parameter(i) => Step::Parameter(i),
                    Part::Op(op, parts) => Step::Op(op, parts.map(|p| place[p as usize])),
                    Part::Axis(_) => continue,
                });
            } else if let Part::Op(op, parts) = *part {
                let mut operands = [Operand::Axis(0); 3];
                for (to, &from) in operands.iter_mut().zip(&parts[..op.arity()]) {
                    *to = operand(&place, from);
                }
                place[number] = instructions.len() as u32;
                instructions.push(Instruction { op, operands });
            }
        }
        let root = operand(&place, root);
        let is_zero = |step: &Step| matches!(step, Step::Constant(value) if to_f32(*value) == 0.0);
        let divides_by_zero = instructions.iter().any(|i| match (i.op, i.operands[1]) {
            (Op::Binary(Binary::Div), Operand::Uniform(n)) => is_zero(&steps[uniforms[n as usize] as usize]),
            _ => false,
        });
        let tape = Tape { leaves: self.leaves.into(), instructions, root };
        Program { tape, parameters: self.parameters, steps, uniforms, divides_by_zero }
    }
}
