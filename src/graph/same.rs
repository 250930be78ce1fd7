//! Whether two tapes give the same values and gradients throughout a box, bit for bit: what incremental extraction asks
//! of a field before and after an edit.

use super::interval::Interval;
use super::ops::{Binary, VisitBinary, VisitUnary};
use super::prune::{ALL, decided};
use super::tape::{Instruction, Op, Operand, Tape};
use std::sync::Arc;

/// A tape with the values of its uniforms.
pub type Valued<'a> = (&'a Tape, &'a [f32]);

/// What an operand is in a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Atom {
    Axis(u8),
    /// The bits of a uniform.
    Uniform(u32),
    /// Those of an operation on such alone. Kept apart from uniforms: their derivatives may be zeros of another sign.
    Folded(u32),
    /// The value of an operation that varies from point to point.
    Varying(u32),
}

/// Whether both are made of the same operations on the same numbers, once of each minimum, maximum and choice that is
/// decided in the box only what it takes is looked at. Operations on numbers alone count as what they give: so the
/// seam of a blend is nothing wherever it is decided to be 0, whatever its radius. Not all that is the same is found so.
pub fn is_same(a: Valued<'_>, b: Valued<'_>, region: [Interval; 3]) -> bool {
    let [resolved_a, resolved_b] = [a, b].map(|valued| Resolved::new(valued, region));
    // Of each operation of `a` that counts, the one of `b` that it must be.
    let mut partners = vec![u32::MAX; a.0.instructions.len()];
    let meet = |partners: &mut [u32], of_a: Operand, of_b: Operand| match (
        resolved_a.atom(a, of_a),
        resolved_b.atom(b, of_b),
    ) {
        (Atom::Varying(i), Atom::Varying(j)) => {
            let partner = &mut partners[i as usize];
            let is_first = *partner == u32::MAX;
            if is_first {
                *partner = j;
            }
            is_first || *partner == j
        }
        (of_a, of_b) => of_a == of_b,
    };
    if resolved_a.hash(a, a.0.root) != resolved_b.hash(b, b.0.root)
        || !meet(&mut partners, a.0.root, b.0.root)
    {
        return false;
    }
    // Operands come before what they are operands of.
    for (i, of_a) in a.0.instructions.iter().enumerate().rev() {
        let Some(of_b) = b.0.instructions.get(partners[i] as usize) else { continue };
        let is_same_op = match (of_a.op, of_b.op) {
            (Op::Leaf(i), Op::Leaf(j)) => {
                let (leaf, other) = (&a.0.leaves[i as usize], &b.0.leaves[j as usize]);
                let at = || of_a.operands.map(|operand| resolved_a.range(a, region, operand));
                Arc::ptr_eq(leaf, other) || leaf.is_same(&**other, at())
            }
            (op, other) => op == other,
        };
        let [in_a, in_b] = [resolved_a.ordered(a, of_a), resolved_b.ordered(b, of_b)];
        let mut operands = in_a.into_iter().zip(in_b).take(of_a.op.arity());
        if !is_same_op || !operands.all(|(of_a, of_b)| meet(&mut partners, of_a, of_b)) {
            return false;
        }
    }
    true
}

/// What the operations of a tape are in a box.
struct Resolved {
    atoms: Vec<Atom>,
    ranges: Vec<Interval>,
    /// Of operations that are the same these are the same.
    hashes: Vec<u64>,
}

fn mixed(hash: u64, with: u64) -> u64 {
    (hash ^ with).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
}

impl Resolved {
    fn new(valued: Valued<'_>, region: [Interval; 3]) -> Self {
        let count = valued.0.instructions.len();
        let mut resolved = Self {
            atoms: Vec::with_capacity(count),
            ranges: Vec::with_capacity(count),
            hashes: Vec::with_capacity(count),
        };
        valued.0.interval(valued.1, region, &mut resolved.ranges);
        for (i, instruction) in valued.0.instructions.iter().enumerate() {
            let atom = match decided(instruction, ALL, |operand| resolved.range(valued, region, operand)) {
                Some(operand) => resolved.atom(valued, operand),
                None => {
                    let folded = folded(instruction, |operand| resolved.atom(valued, operand));
                    folded.map_or(Atom::Varying(i as u32), |value| Atom::Folded(value.to_bits()))
                }
            };
            resolved.atoms.push(atom);
            let first = match instruction.op {
                Op::Unary(op) => op as u64,
                Op::Binary(op) => 1 << 8 | op as u64,
                Op::Select => 2 << 8,
                Op::Leaf(_) => 3 << 8,
            };
            let operands = resolved.ordered(valued, instruction).into_iter().take(instruction.op.arity());
            let hash = operands.fold(first, |hash, operand| mixed(hash, resolved.hash(valued, operand)));
            resolved.hashes.push(hash);
        }
        resolved
    }

    #[inline(always)]
    fn hash(&self, valued: Valued<'_>, operand: Operand) -> u64 {
        match self.atom(valued, operand) {
            Atom::Axis(axis) => axis.into(),
            Atom::Uniform(bits) => mixed(1, bits.into()),
            Atom::Folded(bits) => mixed(2, bits.into()),
            Atom::Varying(i) => self.hashes[i as usize],
        }
    }

    /// The operands; of sums and products, which are the same either way round, in an order that does not depend on the tape.
    #[inline(always)]
    fn ordered(&self, valued: Valued<'_>, instruction: &Instruction) -> [Operand; 3] {
        let [a, b, c] = instruction.operands;
        let either_way = matches!(instruction.op, Op::Binary(Binary::Add | Binary::Mul));
        if either_way && self.hash(valued, a) > self.hash(valued, b) { [b, a, c] } else { [a, b, c] }
    }

    #[inline(always)]
    fn atom(&self, (_, uniforms): Valued<'_>, operand: Operand) -> Atom {
        match operand {
            Operand::Axis(axis) => Atom::Axis(axis),
            Operand::Uniform(i) => Atom::Uniform(uniforms[i as usize].to_bits()),
            Operand::Value(i) => self.atoms[i as usize],
        }
    }

    #[inline(always)]
    fn range(&self, (_, uniforms): Valued<'_>, region: [Interval; 3], operand: Operand) -> Interval {
        match operand {
            Operand::Axis(axis) => region[usize::from(axis)],
            Operand::Uniform(i) => Interval::point(uniforms[i as usize]),
            Operand::Value(i) => self.ranges[i as usize],
        }
    }
}

struct Number<const N: usize>([f32; N], f32);

impl VisitUnary for &mut Number<1> {
    fn visit(self, value: impl Fn(f32) -> f32, _: (impl Fn(f32, f32) -> f32,)) {
        self.1 = value(self.0[0]);
    }
}

impl VisitBinary for &mut Number<2> {
    fn visit(
        self,
        value: impl Fn(f32, f32) -> f32,
        _: (impl Fn(f32, f32, f32) -> f32, impl Fn(f32, f32, f32) -> f32),
    ) {
        self.1 = value(self.0[0], self.0[1]);
    }
}

/// The value of an operation on numbers alone. Choices on numbers are decided, or NaN.
#[inline(always)]
fn folded(instruction: &Instruction, atom: impl Fn(Operand) -> Atom) -> Option<f32> {
    let number = |operand| match atom(operand) {
        Atom::Uniform(bits) | Atom::Folded(bits) => Some(f32::from_bits(bits)),
        _ => None,
    };
    let [a, b, _] = instruction.operands;
    match instruction.op {
        Op::Unary(op) => {
            let mut number = Number([number(a)?], 0.0);
            op.visit(&mut number);
            Some(number.1)
        }
        Op::Binary(op) => {
            let mut number = Number([number(a)?, number(b)?], 0.0);
            op.visit(&mut number);
            Some(number.1)
        }
        Op::Select | Op::Leaf(_) => None,
    }
}
