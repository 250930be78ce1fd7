//! Tapes pruned to what matters in a box of points (Duff 1992, "Interval arithmetic and recursive subdivision for implicit functions and
//! constructive solid geometry").
//!
//! A minimum is decided where one operand lies above the other. Of minima of minima any operand may be what all others lie above, however
//! they are nested: so each minimum hands down to its operands how large their values may be and still matter, and maxima likewise. So do
//! comparisons with numbers, and products with positive ones hand on what they are told: of the kernels of blobs, which are 0 from their radius on,
//! no skeleton counts that is farther away. What is
//! left out never changes the value of the whole: of a value that matters its operation gives the same, of another one
//! again one that does not matter. Blends of two parts (`seam.rs`) hand down as minima and maxima do.

use super::interval::Interval;
use super::leaf::Leaf;
use super::ops::Binary;
use super::seam::Blend;
use super::tape::{Instruction, Op, Operand, Tape};
use std::sync::Arc;

/// From where to where a value matters: above and below its operation may as well give another one that lies there.
pub(super) type Matters = [f32; 2];

/// Every value matters, and NaN.
pub(super) const ALL: Matters = [f32::NEG_INFINITY, f32::INFINITY];

/// By what an operation is taken.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Taken {
    Not,
    /// By the seams of blends alone.
    BySeams,
    ByItself,
}

/// What pruning finds of an operation, from the last to the first.
#[derive(Clone, Copy)]
struct Found {
    matters: Matters,
    taken: Taken,
    /// Whether the parts of a blend meet in it: what matters of these, the blend says.
    is_meeting: bool,
    /// The operand that it stands for, if it is decided.
    stands_for: Option<Operand>,
}

impl Found {
    fn is_live(&self) -> bool {
        self.taken > Taken::Not
    }
}

impl Tape {
    /// A shorter tape that has the same values throughout a box of points, whose intervals are `all`: of each
    /// minimum, maximum, blend and choice that is decided there, only what it takes is kept. `None` if there is none.
    ///
    /// What it has in place of values that do not matter may be infinite: not, if its own interval is bounded.
    #[must_use]
    pub fn pruned(&self, uniforms: &[f32], region: [Interval; 3], all: &[Interval]) -> Option<Tape> {
        let get = |operand| match operand {
            Operand::Axis(axis) => region[usize::from(axis)],
            Operand::Uniform(i) => Interval::point(uniforms[i as usize]),
            Operand::Value(i) => all[i as usize],
        };
        let found = found(self, get);
        let leaves = self.simpler_leaves(&found, get);
        if leaves.is_none() && found.iter().all(|found| found.stands_for.is_none()) {
            return None;
        }
        // Where each operation is found in the shorter tape.
        let mut places: Vec<Operand> = Vec::with_capacity(found.len());
        let place = |places: &[Operand], operand| match operand {
            Operand::Value(i) => places[i as usize],
            other => other,
        };
        let mut instructions = Vec::new();
        for (instruction, found) in self.instructions.iter().zip(&found) {
            let here = match found.stands_for {
                Some(operand) => place(&places, operand),
                None => Operand::Value(instructions.len() as u32),
            };
            if found.is_live() && found.stands_for.is_none() {
                // Operands beyond the arity may name what is gone; they are made harmless.
                let mut operands = [Operand::Uniform(0); 3];
                for (to, &from) in operands.iter_mut().zip(instruction.operands()) {
                    *to = place(&places, from);
                }
                instructions.push(Instruction { op: instruction.op, operands });
            }
            places.push(here);
        }
        let leaves = leaves.map_or_else(|| self.leaves.clone(), Into::into);
        Some(Tape { root: place(&places, self.root), leaves, instructions })
    }

    /// The leaves, if any is simpler in a box whose bounds `get` gives.
    fn simpler_leaves(
        &self,
        found: &[Found],
        get: impl Fn(Operand) -> Interval,
    ) -> Option<Vec<Arc<dyn Leaf>>> {
        if self.leaves.is_empty() {
            return None;
        }
        let live = || self.instructions.iter().zip(found).filter(|(_, found)| found.is_live());
        let mut places = vec![0; self.leaves.len()];
        for (instruction, _) in live() {
            if let Op::Leaf(leaf) = instruction.op {
                places[leaf as usize] += 1;
            }
        }
        let mut leaves = None;
        for (instruction, _) in live() {
            // A leaf that stands in two places must be the same in both.
            if let Op::Leaf(leaf) = instruction.op
                && places[leaf as usize] == 1
                && let Some(simpler) = self.leaves[leaf as usize].within(instruction.operands.map(&get))
            {
                leaves.get_or_insert_with(|| self.leaves.to_vec())[leaf as usize] = simpler;
            }
        }
        leaves
    }
}

/// Which operations matter to the whole, and how, in a box whose bounds `get` gives.
fn found(tape: &Tape, get: impl Fn(Operand) -> Interval) -> Vec<Found> {
    let none = Found {
        matters: [f32::INFINITY, f32::NEG_INFINITY],
        taken: Taken::Not,
        is_meeting: false,
        stands_for: None,
    };
    let mut found = vec![none; tape.instructions.len()];
    let take_by = |found: &mut [Found], by: Taken, operand, [low, high]: Matters| {
        if let Operand::Value(i) = operand {
            let known = &mut found[i as usize];
            known.taken = known.taken.max(by);
            known.matters = [known.matters[0].min(low), known.matters[1].max(high)];
        }
    };
    let take = |found: &mut [Found], operand, matters| take_by(found, Taken::ByItself, operand, matters);
    take(&mut found, tape.root, ALL);
    for (i, instruction) in tape.instructions.iter().enumerate().rev() {
        let Found { matters, taken, is_meeting, .. } = found[i];
        if taken == Taken::Not {
            continue;
        }
        if let Some(operand) = decided(instruction, matters, &get) {
            found[i].stands_for = Some(operand);
            take_by(&mut found, taken, operand, matters);
            continue;
        }
        if taken == Taken::BySeams {
            for &operand in instruction.operands().iter().filter(|_| !is_meeting) {
                take_by(&mut found, taken, operand, ALL);
            }
            continue;
        }
        if let Some(blend) = Blend::of(tape, instruction, &get) {
            if let Some(operand) = blend.decided(matters, &get) {
                found[i].stands_for = Some(operand);
                take(&mut found, operand, matters);
                continue;
            }
            for (operand, matters) in blend.hands_down(matters, &get) {
                take(&mut found, operand, matters);
            }
            for meeting in blend.meetings {
                found[meeting as usize].is_meeting = true;
            }
            for &operand in instruction.operands() {
                take_by(&mut found, Taken::BySeams, operand, ALL);
            }
            continue;
        }
        let [low, high] = matters;
        let [a, b, _] = instruction.operands;
        match instruction.op {
            Op::Binary(op @ (Binary::Min | Binary::Max)) if get(a).is_bounded() && get(b).is_bounded() => {
                for (operand, other) in [(a, get(b)), (b, get(a))] {
                    let matters = match op {
                        Binary::Min => [f32::NEG_INFINITY, high.min(other.hi)],
                        _ => [low.max(other.lo), f32::INFINITY],
                    };
                    take(&mut found, operand, matters);
                }
            }
            // With a number alone: of two operands that both may give others, a comparison or a product may not be what it was.
            Op::Binary(op @ (Binary::Less | Binary::LessEqual | Binary::Mul))
                if matches!((a, b), (Operand::Uniform(_), _) | (_, Operand::Uniform(_)))
                    && get(a).is_bounded()
                    && get(b).is_bounded() =>
            {
                for (operand, number) in [(a, get(b)), (b, get(a))] {
                    let matters = match op {
                        Binary::Mul => of_factor(matters, number),
                        _ => [number.lo, number.hi],
                    };
                    take(&mut found, operand, matters);
                }
            }
            _ => instruction.operands().iter().for_each(|&operand| take(&mut found, operand, ALL)),
        }
    }
    found
}

/// Where the values of a factor matter of which the product with a number matters from `low` to `high`; a little more, since products are
/// rounded.
fn of_factor([low, high]: Matters, number: Interval) -> Matters {
    /// 2⁻²⁰, of the limit itself.
    const ROUNDING: f32 = 1.0 / 1_048_576.0;
    /// Of a limit that is 0; its product with any number that is let through is no denormal.
    const LEAST: f32 = 1e-20;
    if number.lo < 1e-12 || number.hi > 1e12 {
        return ALL;
    }
    // The product of every larger factor is over `high`.
    let over = |high: f32| {
        let quotient = high / number.lo;
        quotient + quotient.abs() * ROUNDING + LEAST
    };
    [-over(-low), over(high)]
}

/// What an operation stands for throughout a box, if that is decided there: one of its operands, whose bounds `get` gives.
/// NaN is excluded where both intervals are bounded.
#[inline(always)]
pub(super) fn decided(
    instruction: &Instruction,
    [low, high]: Matters,
    get: impl Fn(Operand) -> Interval,
) -> Option<Operand> {
    let [a, b, c] = instruction.operands;
    match instruction.op {
        Op::Binary(op @ (Binary::Min | Binary::Max)) => {
            let [in_a, in_b] = [get(a), get(b)];
            let is_left_out = |one: Interval, other: Interval| match op {
                Binary::Min => one.lo > high.min(other.hi),
                _ => one.hi < low.max(other.lo),
            };
            if !in_a.is_bounded() || !in_b.is_bounded() {
                None
            } else if is_left_out(in_a, in_b) {
                Some(b)
            } else if is_left_out(in_b, in_a) {
                Some(a)
            } else {
                None
            }
        }
        Op::Select => {
            let condition = get(a);
            if !condition.is_bounded() {
                None
            } else if condition.lo > 0.0 || condition.hi < 0.0 {
                Some(b)
            } else if condition.lo == 0.0 && condition.hi == 0.0 {
                Some(c)
            } else {
                None
            }
        }
        _ => None,
    }
}
