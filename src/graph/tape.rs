//! The flat form of an expression: one list of operations, each on earlier ones (SSA).
//!
//! [`Tape`] is what intervals are computed on, pruned by, and WGSL is written from. Its operands are the
//! point's coordinates, **uniforms** (numbers that are the same at all points: constants, parameters and
//! what is computed of them alone, see [`super::lower`]) and earlier operations. [`Code`] is a tape whose
//! values were given registers, for the CPU's evaluators.

use super::interval::Interval;
use super::leaf::Leaf;
use super::ops::{Binary, Unary};
use std::sync::Arc;

/// An operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Op {
    /// Of one operand.
    Unary(Unary),
    /// Of two.
    Binary(Binary),
    /// The second where the first is not 0, else the third.
    Select,
    /// A leaf of the tape, of the point that is the operands.
    Leaf(u32),
}

impl Op {
    /// How many operands it has.
    pub fn arity(self) -> usize {
        match self {
            Op::Unary(_) => 1,
            Op::Binary(_) => 2,
            Op::Select | Op::Leaf(_) => 3,
        }
    }
}

/// Where an operation finds a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Operand {
    /// A coordinate of the point.
    Axis(u8),
    /// A uniform.
    Uniform(u32),
    /// The value of an operation of a tape; a register of code.
    Value(u32),
}

/// An operation with its operands; of those beyond its arity nothing is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instruction {
    /// What is done.
    pub op: Op,
    /// With what.
    pub operands: [Operand; 3],
}

impl Instruction {
    /// The operands that count.
    pub fn operands(&self) -> &[Operand] {
        &self.operands[..self.op.arity()]
    }
}

/// A list of operations, each on earlier ones.
#[derive(Debug, Clone)]
pub struct Tape {
    /// What [`Op::Leaf`] means.
    pub leaves: Arc<[Arc<dyn Leaf>]>,
    /// The operations.
    pub instructions: Vec<Instruction>,
    /// What the whole is.
    pub root: Operand,
}

impl Tape {
    /// The interval of the whole, and those of all operations (in `all`), over a box of points.
    pub fn interval(&self, uniforms: &[f32], region: [Interval; 3], all: &mut Vec<Interval>) -> Interval {
        all.clear();
        let get = |all: &[Interval], operand| match operand {
            Operand::Axis(axis) => region[usize::from(axis)],
            Operand::Uniform(i) => Interval::point(uniforms[i as usize]),
            Operand::Value(i) => all[i as usize],
        };
        for instruction in &self.instructions {
            let [a, b, c] = instruction.operands;
            let interval = match instruction.op {
                Op::Unary(op) => op.interval(get(all, a)),
                Op::Binary(op) => op.interval(get(all, a), get(all, b)),
                Op::Select => super::interval::select(get(all, a), get(all, b), get(all, c)),
                Op::Leaf(leaf) => self.leaves[leaf as usize].interval([a, b, c].map(|o| get(all, o))),
            };
            all.push(interval);
        }
        get(all, self.root)
    }

    /// The leaf that the whole is, at the point itself, if it is one and no more.
    pub fn only_leaf(&self) -> Option<&Arc<dyn Leaf>> {
        match self.instructions[..] {
            [Instruction { op: Op::Leaf(leaf), operands }]
                if operands == [0, 1, 2].map(Operand::Axis) && self.root == Operand::Value(0) =>
            {
                Some(&self.leaves[leaf as usize])
            }
            _ => None,
        }
    }
}

/// A tape with registers: [`Operand::Value`] is a register, and the first three hold the coordinates.
#[derive(Debug, Clone)]
pub struct Code {
    /// What [`Op::Leaf`] means.
    pub leaves: Arc<[Arc<dyn Leaf>]>,
    /// The operations, and the register that each fills; never one that it reads.
    pub instructions: Vec<(Instruction, u32)>,
    /// Where the whole's value is in the end.
    pub root: Operand,
    /// Registers in use.
    pub registers: usize,
}

impl Code {
    /// The leaf that the whole is, at the point itself, if it is one and no more.
    pub fn only_leaf(&self) -> Option<&Arc<dyn Leaf>> {
        match self.instructions[..] {
            [(Instruction { op: Op::Leaf(leaf), operands }, to)]
                if operands == [0, 1, 2].map(Operand::Value) && self.root == Operand::Value(to) =>
            {
                Some(&self.leaves[leaf as usize])
            }
            _ => None,
        }
    }

    /// Gives the tape's values registers; one is free again after its value's last use.
    pub fn new(tape: &Tape) -> Self {
        Self::in_order(tape, &few_live(tape), |_| false).0
    }

    /// As [`new`](Self::new), the operations in that order, and the values' registers. Those that are `kept` have theirs for
    /// themselves to the end.
    pub(super) fn in_order(tape: &Tape, order: &[u32], kept: impl Fn(u32) -> bool) -> (Self, Vec<u32>) {
        let in_order = || order.iter().map(|&i| (i as usize, &tape.instructions[i as usize]));
        let mut last_use = vec![usize::MAX; tape.instructions.len()];
        for (at, (_, instruction)) in in_order().enumerate() {
            for operand in instruction.operands() {
                if let Operand::Value(i) = operand {
                    last_use[*i as usize] = at;
                }
            }
        }
        if let Operand::Value(i) = tape.root {
            last_use[i as usize] = usize::MAX;
        }
        order.iter().filter(|&&i| kept(i)).for_each(|&i| last_use[i as usize] = usize::MAX);
        let mut register_of = vec![0; tape.instructions.len()];
        let (mut free, mut registers) = (Vec::new(), 3);
        let register = |register_of: &[u32], operand| match operand {
            Operand::Axis(axis) => Operand::Value(axis.into()),
            Operand::Value(i) => Operand::Value(register_of[i as usize]),
            uniform => uniform,
        };
        let mut instructions = Vec::with_capacity(order.len());
        for (at, (value, instruction)) in in_order().enumerate() {
            let out = free.pop().unwrap_or_else(|| {
                registers += 1;
                registers - 1
            });
            register_of[value] = out;
            let mut operands = instruction.operands;
            operands[..instruction.op.arity()].iter_mut().for_each(|o| *o = register(&register_of, *o));
            instructions.push((Instruction { op: instruction.op, operands }, out));
            for (n, operand) in instruction.operands().iter().enumerate() {
                if let Operand::Value(i) = *operand
                    && last_use[i as usize] == at
                    && !instruction.operands()[..n].contains(operand)
                {
                    free.push(register_of[i as usize]);
                }
            }
        }
        let code = Self {
            leaves: tape.leaves.clone(),
            root: register(&register_of, tape.root),
            instructions,
            registers: registers as usize,
        };
        (code, register_of)
    }
}

/// The operations that the whole needs, in an order that keeps few values at once: the operand that needs more
/// registers comes first (Sethi & Ullman 1970). A register is 256 bytes: a hundred fill the first cache.
pub(super) fn few_live(tape: &Tape) -> Vec<u32> {
    let mut needs: Vec<u32> = Vec::with_capacity(tape.instructions.len());
    // The values that an operation takes, the neediest last.
    let values = |needs: &[u32], instruction: &Instruction| {
        let mut values = [None; 3];
        for (value, operand) in values.iter_mut().zip(instruction.operands()) {
            *value = if let Operand::Value(i) = *operand { Some(i as usize) } else { None };
        }
        values.sort_by_key(|value| value.map(|i| needs[i]));
        values
    };
    for instruction in &tape.instructions {
        let kept = (0..).zip(values(&needs, instruction).into_iter().rev().flatten());
        needs.push(kept.map(|(before, i)| needs[i] + before).max().unwrap_or(0).max(1));
    }
    let mut order = Vec::with_capacity(needs.len());
    let (mut begun, mut done) = (vec![false; needs.len()], vec![false; needs.len()]);
    let mut open: Vec<usize> =
        if let Operand::Value(root) = tape.root { vec![root as usize] } else { Vec::new() };
    while let Some(&i) = open.last() {
        if begun[i] {
            open.pop();
            if !std::mem::replace(&mut done[i], true) {
                order.push(i as u32);
            }
        } else {
            begun[i] = true;
            open.extend(values(&needs, &tape.instructions[i]).into_iter().flatten().filter(|&v| !done[v]));
        }
    }
    order
}
