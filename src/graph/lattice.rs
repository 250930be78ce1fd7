//! Values at the points of a lattice, plane by plane: what does not depend on z is computed once for all planes, and what
//! depends on z alone for all planes at once, where it is one number for all points. The operations are those of [`super::eval`],
//! and so are the bits.

use super::eval::{run, take};
use super::tape::{Code, Op, Operand, Tape, few_live};
use multiversion::multiversion;
use std::cell::RefCell;
use std::collections::HashMap;

/// Points of a plane that are done together: the 9² of a brick, in whole vectors.
const LANES: usize = 88;

/// A tape in three parts.
#[derive(Debug, Clone)]
pub(super) struct LatticeCode {
    /// First what takes no x and y, then what takes no z, then the rest, to which the first part's values are uniforms.
    code: Code,
    /// Where the second and the third part begin.
    parts: [usize; 2],
    /// The registers of the values that are uniforms of the third part, behind those of the field.
    by_plane: Vec<u32>,
    /// Whether there are leaves, which cost more than all else.
    pub(super) has_leaves: bool,
}

/// What a value is computed for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// Each plane: of x and y it takes nothing.
    Planes,
    /// Each point of one plane: of z it takes nothing.
    OnePlane,
    /// Each point.
    Points,
}

thread_local! {
    /// Registers and uniforms; taken out while they are in use, since a leaf may evaluate another field within.
    static SCRATCH: RefCell<(Vec<[f32; LANES]>, Vec<f32>)> = const { RefCell::new((Vec::new(), Vec::new())) };
}

/// What an operand is computed for, if it is no uniform.
pub(super) fn part_of(parts: &[Part], operand: Operand) -> Option<Part> {
    match operand {
        Operand::Uniform(_) => None,
        Operand::Axis(2) => Some(Part::Planes),
        Operand::Axis(_) => Some(Part::OnePlane),
        Operand::Value(i) => Some(parts[i as usize]),
    }
}

/// What each value of a tape is computed for.
pub(super) fn parts(tape: &Tape) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::with_capacity(tape.instructions.len());
    for instruction in &tape.instructions {
        let mut operands = instruction.operands().iter().filter_map(|&operand| part_of(&parts, operand));
        // Of uniforms alone, which pruning leaves, it is one number, too.
        let first = operands.next().unwrap_or(Part::Planes);
        parts.push(if operands.all(|part| part == first) { first } else { Part::Points });
    }
    parts
}

impl LatticeCode {
    /// `None` where nothing would be saved. `uniforms` is how many the field has.
    pub(super) fn new(tape: &Tape, uniforms: usize) -> Option<Self> {
        let parts = parts(tape);
        if parts.iter().all(|&part| part == Part::Points) {
            return None;
        }

        // The third part's operands that are numbers of planes become uniforms.
        let mut tape = tape.clone();
        let (mut by_plane, mut places) = (Vec::new(), HashMap::new());
        let mut to_uniform = |operand: &mut Operand| {
            if part_of(&parts, *operand) == Some(Part::Planes) {
                let place = *places.entry(*operand).or_insert_with(|| {
                    by_plane.push(*operand);
                    by_plane.len() - 1
                });
                *operand = Operand::Uniform((uniforms + place) as u32);
            }
        };
        let mut order = few_live(&tape);
        for (i, instruction) in tape.instructions.iter_mut().enumerate() {
            if parts[i] == Part::Points {
                instruction.operands[..instruction.op.arity()].iter_mut().for_each(&mut to_uniform);
            }
        }
        to_uniform(&mut tape.root);
        let mut kept = vec![false; parts.len()];
        let points = tape.instructions.iter().zip(&parts).filter(|(_, part)| **part == Part::Points);
        for operand in points.flat_map(|(instruction, _)| instruction.operands()).chain(&by_plane) {
            if let Operand::Value(i) = *operand {
                kept[i as usize] = true;
            }
        }
        order.sort_by_key(|&i| parts[i as usize]);
        let begin = |part| order.partition_point(|&i| parts[i as usize] < part);
        let (code, register_of) =
            Code::in_order(&tape, &order, |i| kept[i as usize] && parts[i as usize] != Part::Points);
        let by_plane = by_plane.into_iter().map(|operand| match operand {
            Operand::Value(i) => register_of[i as usize],
            // The coordinate itself.
            _ => 2,
        });
        let has_leaves = tape.instructions.iter().any(|instruction| matches!(instruction.op, Op::Leaf(_)));
        let parts = [Part::OnePlane, Part::Points].map(begin);
        Some(Self { code, parts, by_plane: by_plane.collect(), has_leaves })
    }

    /// The values at every x with every y and every z, x fastest; `false` for more planes than are done together.
    pub(super) fn values(&self, uniforms: &[f32], axes: [&[f32]; 3], out: &mut [f32]) -> bool {
        if axes[2].len() > LANES {
            return false;
        }
        let (mut registers, mut all) = SCRATCH.take();
        if registers.len() < self.code.registers {
            registers.resize(self.code.registers, [0.0; LANES]);
        }
        all.clear();
        all.extend(uniforms);
        all.resize(uniforms.len() + self.by_plane.len(), 0.0);
        run_parts(self, axes, &mut registers, &mut all, out);
        SCRATCH.set((registers, all));
        true
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn run_parts(
    lattice: &LatticeCode,
    [x, y, z]: [&[f32]; 3],
    registers: &mut [[f32; LANES]],
    uniforms: &mut [f32],
    out: &mut [f32],
) {
    let (leaves, instructions) = (&lattice.code.leaves, &lattice.code.instructions);
    let [one_plane, points] = lattice.parts;
    registers[2][..z.len()].copy_from_slice(z);
    run(&instructions[..one_plane], uniforms, leaves, registers, z.len());
    let first_by_plane = uniforms.len() - lattice.by_plane.len();
    let plane = x.len() * y.len();
    for start in (0..plane).step_by(LANES) {
        let count = (plane - start).min(LANES);
        for i in 0..count {
            registers[0][i] = x[(start + i) % x.len()];
            registers[1][i] = y[(start + i) / x.len()];
        }
        run(&instructions[one_plane..points], uniforms, leaves, registers, count);
        for k in 0..z.len() {
            for (uniform, &register) in uniforms[first_by_plane..].iter_mut().zip(&lattice.by_plane) {
                *uniform = registers[register as usize][k];
            }
            run(&instructions[points..], uniforms, leaves, registers, count);
            take(lattice.code.root, uniforms, registers, &mut out[k * plane + start..][..count]);
        }
    }
}
