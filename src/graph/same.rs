//! Whether two tapes give the same values and gradients, bit for bit: what incremental extraction asks of a field
//! before and after an edit, in a box to which both have been pruned.

use super::interval::Interval;
use super::ops::{VisitBinary, VisitUnary};
use super::tape::{Instruction, Op, Operand, Tape};
use std::sync::Arc;

/// A tape with the values of its uniforms.
pub type Valued<'a> = (&'a Tape, &'a [f32]);

/// An operand without numbers that differ from tape to tape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Atom {
    Axis(u8),
    /// The bits of a uniform.
    Uniform(u32),
    /// Those of an operation on such alone. Kept apart from uniforms: their derivatives may be zeros of another sign.
    Folded(u32),
    /// An operation that varies, by its number among them.
    Varying(u32),
    /// Beyond the arity.
    None,
}

/// Whether both are made of the same operations on the same numbers, where operations on numbers alone count as what
/// they give: so the seam of a blend is nothing wherever it is pruned to 0, whatever its radius. Not all tapes that
/// are the same are found so. `region` is the box of points that it is asked for: leaves may be the same there alone.
pub fn is_same(a: Valued<'_>, b: Valued<'_>, region: [Interval; 3]) -> bool {
    let [plain_a, plain_b] = [a, b].map(Plain::new);
    if plain_a.root != plain_b.root || plain_a.varying.len() != plain_b.varying.len() {
        return false;
    }
    // What the leaves' operands can be, once they are asked for.
    let mut ranges: Option<Vec<Interval>> = None;
    plain_a.varying.iter().zip(&plain_b.varying).all(|(of_a, of_b)| {
        if of_a.operands != of_b.operands {
            return false;
        }
        let (Op::Leaf(i), Op::Leaf(j)) = (of_a.op, of_b.op) else { return of_a.op == of_b.op };
        let (leaf, other) = (&a.0.leaves[i as usize], &b.0.leaves[j as usize]);
        Arc::ptr_eq(leaf, other) || {
            let all = ranges.get_or_insert_with(|| {
                let mut all = Vec::with_capacity(a.0.instructions.len());
                a.0.interval(a.1, region, &mut all);
                all
            });
            let at = a.0.instructions[of_a.place].operands.map(|operand| match operand {
                Operand::Axis(axis) => region[usize::from(axis)],
                Operand::Uniform(i) => Interval::point(a.1[i as usize]),
                Operand::Value(i) => all[i as usize],
            });
            leaf.is_same(&**other, at)
        }
    })
}

/// An operation that varies from point to point.
struct Varying {
    op: Op,
    operands: [Atom; 3],
    /// On the tape.
    place: usize,
}

/// A tape without its numbering.
struct Plain {
    varying: Vec<Varying>,
    root: Atom,
}

impl Plain {
    fn new((tape, uniforms): Valued<'_>) -> Self {
        let mut atoms: Vec<Atom> = Vec::with_capacity(tape.instructions.len());
        let mut varying = Vec::with_capacity(tape.instructions.len());
        let atom = |atoms: &[Atom], operand| match operand {
            Operand::Axis(axis) => Atom::Axis(axis),
            Operand::Uniform(i) => Atom::Uniform(uniforms[i as usize].to_bits()),
            Operand::Value(i) => atoms[i as usize],
        };
        for (place, instruction) in tape.instructions.iter().enumerate() {
            let mut operands = [Atom::None; 3];
            for (to, &operand) in operands.iter_mut().zip(instruction.operands()) {
                *to = atom(&atoms, operand);
            }
            atoms.push(match folded(instruction, operands) {
                Some(value) => Atom::Folded(value.to_bits()),
                None => {
                    varying.push(Varying { op: instruction.op, operands, place });
                    Atom::Varying(varying.len() as u32 - 1)
                }
            });
        }
        Self { root: atom(&atoms, tape.root), varying }
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

/// The value of an operation on numbers alone. Choices are left: pruning has decided those.
fn folded(instruction: &Instruction, operands: [Atom; 3]) -> Option<f32> {
    let number = |atom| match atom {
        Atom::Uniform(bits) | Atom::Folded(bits) => Some(f32::from_bits(bits)),
        _ => None,
    };
    match instruction.op {
        Op::Unary(op) => {
            let mut number = Number([number(operands[0])?], 0.0);
            op.visit(&mut number);
            Some(number.1)
        }
        Op::Binary(op) => {
            let mut number = Number([number(operands[0])?, number(operands[1])?], 0.0);
            op.visit(&mut number);
            Some(number.1)
        }
        Op::Select | Op::Leaf(_) => None,
    }
}
