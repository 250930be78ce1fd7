//! Blends with rounded seams (`shapes/blend.rs`), found again among the operations of a tape: `min(a, b) − s` and `max(a, b) + s`, where
//! `s = max(r − |a − b|, 0)² c` is 0 from a distance r of the values on.
//!
//! From where on a part matters, minima say each by itself; of the seam, which takes both parts, nothing can be said alone. Of the two together:
//! let a union matter up to h. A part a > h + r does not matter:
//! - if b ≤ h, the union is b, without a seam;
//! - if b > h, the union is over h: where both differ by r or more it is the smaller one. Else the smaller one is over h + r − d, d their difference,
//!   and the seam (r − d)² c ≤ (r − d) r c, less than the r − d that is left: r c is 1/4, and 1/2 is let through.
//!
//! Neither does a part that is over the other's largest value + r. If both do not matter, both are over h + r, and the union is over h whatever they are.
//! Of what is nothing but a part, intersections add a zero, which makes 0 of −0: they are not decided as a whole.

use super::interval::Interval;
use super::ops::{Binary, Unary};
use super::prune::Matters;
use super::tape::{Instruction, Op, Operand, Tape};

/// A blend of two parts.
pub(super) struct Blend {
    parts: [Operand; 2],
    /// How far apart the parts' values are where the seam ends.
    radius: Interval,
    /// Whether it is a union: below the smaller part.
    is_union: bool,
    /// The operations on both parts: the smaller (or larger) one, and their difference.
    pub meetings: [u32; 2],
}

/// How much a limit is widened for rounding: 2⁻²⁰ of the numbers in it.
const ROUNDING: f32 = 1.0 / 1_048_576.0;

impl Blend {
    /// The blend that an operation ends, if all that it is made of has bounds.
    pub fn of(tape: &Tape, last: &Instruction, get: impl Fn(Operand) -> Interval) -> Option<Self> {
        let at = |operand| match operand {
            Operand::Value(i) => Some((i, &tape.instructions[i as usize])),
            _ => None,
        };
        // The operand of an operation of one, and the other operand where one is a number.
        let unary = |operand, op: Unary| {
            at(operand).filter(|(_, i)| i.op == Op::Unary(op)).map(|(_, i)| i.operands[0])
        };
        let with_number = |operand, op: Binary| {
            let (_, i) = at(operand).filter(|(_, i)| i.op == Op::Binary(op))?;
            let [a, b, _] = i.operands;
            match (a, b) {
                (Operand::Uniform(_), Operand::Value(_)) => Some((get(a), b)),
                (Operand::Value(_), Operand::Uniform(_)) => Some((get(b), a)),
                _ => None,
            }
        };
        let [a, b, _] = last.operands;
        let joins = |operand, op| at(operand).filter(|(_, i)| i.op == Op::Binary(op));
        let ((joined, both), seam, is_union) = match last.op {
            Op::Binary(Binary::Sub) => (joins(a, Binary::Min)?, b, true),
            Op::Binary(Binary::Add) => match joins(a, Binary::Max) {
                Some(found) => (found, b, false),
                None => (joins(b, Binary::Max)?, a, false),
            },
            _ => return None,
        };
        let (factor, square) = with_number(seam, Binary::Mul)?;
        let (zero, rest) = with_number(unary(square, Unary::Square)?, Binary::Max)?;
        let (_, Instruction { op: Op::Binary(Binary::Sub), operands: [radius, apart, _] }) = at(rest)? else {
            return None;
        };
        let (difference, Instruction { op: Op::Binary(Binary::Sub), operands }) =
            at(unary(*apart, Unary::Abs)?)?
        else {
            return None;
        };
        let [u, v, _] = both.operands;
        let radius = matches!(radius, Operand::Uniform(_)).then(|| get(*radius))?;
        let is_seam = operands[..2] == [u, v]
            && zero == Interval::new(0.0, 0.0)
            && radius.lo > 1e-18
            && radius.hi < 1e18
            && factor.lo >= 0.0
            && radius.hi * factor.hi <= 0.5
            // Where the seam has no end in the box, its square may come without the maximum, and grow again farther apart.
            && get(rest).lo <= 0.0
            && get(u).is_bounded()
            && get(v).is_bounded();
        is_seam.then_some(Self { parts: [u, v], radius, is_union, meetings: [joined, difference] })
    }

    /// Up to where one part matters where the whole matters up to `high`, and the other part is `other`; both negated for intersections.
    fn up_to(&self, high: f32, other: f32) -> f32 {
        let (high, radius) = (high.min(other), self.radius.hi);
        high + radius + (high.abs() + radius) * ROUNDING
    }

    /// The parts, and from where to where each matters.
    pub fn hands_down(
        &self,
        [low, high]: Matters,
        get: impl Fn(Operand) -> Interval,
    ) -> [(Operand, Matters); 2] {
        let [a, b] = self.parts;
        [(a, b), (b, a)].map(|(part, other)| {
            let other = get(other);
            let matters = if self.is_union {
                [f32::NEG_INFINITY, self.up_to(high, other.hi)]
            } else {
                [-self.up_to(-low, -other.lo), f32::INFINITY]
            };
            (part, matters)
        })
    }

    /// The part that a union is, if the other matters nowhere in the box.
    pub fn decided(&self, matters: Matters, get: impl Fn(Operand) -> Interval) -> Option<Operand> {
        let [(a, of_a), (b, of_b)] = self.hands_down(matters, &get);
        let is_left_out = |part, [_, high]: Matters| get(part).lo > high;
        if !self.is_union {
            None
        } else if is_left_out(a, of_a) {
            Some(b)
        } else if is_left_out(b, of_b) {
            Some(a)
        } else {
            None
        }
    }
}
