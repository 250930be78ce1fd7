//! Values and gradients on the CPU: the code, operation by operation, over [`LANES`] points at a time.
//!
//! No operation fuses a product and a sum, and the order of operations is that of the WGSL, so that both
//! give the same bits (`src/gpu/exact.rs`).

use super::leaf::{DualSlices, Leaf, gradients_alone};
use super::ops::{VisitBinary, VisitUnary};
use super::tape::{Code, Instruction, Op, Operand};
use crate::field::Points;
use multiversion::multiversion;
use std::sync::Arc;

/// Points that an operation is applied to at a time.
pub const LANES: usize = 64;

/// One number a point.
pub type Lanes = [f32; LANES];

/// A value and its derivatives by x, y, z.
pub type Dual = [Lanes; 4];

/// What an operation reads: numbers of `N` points, or one for all.
#[derive(Clone, Copy)]
enum Argument<'a, const N: usize> {
    Lanes(&'a [f32; N]),
    One(f32),
}

struct Unary<'a, const N: usize> {
    a: Argument<'a, N>,
    out: &'a mut [f32; N],
}

impl<const N: usize> VisitUnary for Unary<'_, N> {
    #[inline(always)]
    fn visit(self, value: impl Fn(f32) -> f32, _: (impl Fn(f32, f32) -> f32,)) {
        match self.a {
            Argument::Lanes(a) => (0..N).for_each(|i| self.out[i] = value(a[i])),
            Argument::One(a) => self.out.fill(value(a)),
        }
    }
}

struct Binary<'a, const N: usize> {
    a: Argument<'a, N>,
    b: Argument<'a, N>,
    out: &'a mut [f32; N],
}

impl<const N: usize> VisitBinary for Binary<'_, N> {
    #[inline(always)]
    fn visit(
        self,
        value: impl Fn(f32, f32) -> f32,
        _: (impl Fn(f32, f32, f32) -> f32, impl Fn(f32, f32, f32) -> f32),
    ) {
        let out = self.out;
        match (self.a, self.b) {
            (Argument::Lanes(a), Argument::Lanes(b)) => (0..N).for_each(|i| out[i] = value(a[i], b[i])),
            (Argument::Lanes(a), Argument::One(b)) => (0..N).for_each(|i| out[i] = value(a[i], b)),
            (Argument::One(a), Argument::Lanes(b)) => (0..N).for_each(|i| out[i] = value(a, b[i])),
            (Argument::One(a), Argument::One(b)) => out.fill(value(a, b)),
        }
    }
}

/// The field's values at `points`, with `registers` as scratch.
pub fn values(
    code: &Code,
    uniforms: &[f32],
    points: Points<'_>,
    registers: &mut Vec<Lanes>,
    out: &mut [f32],
) {
    // A leaf alone gets all points at once.
    if let Some(leaf) = code.only_leaf() {
        return leaf.values(points, out);
    }
    if registers.len() < code.registers {
        registers.resize(code.registers, [0.0; LANES]);
    }
    run_values(code, uniforms, points, registers, out);
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn run_values(code: &Code, uniforms: &[f32], points: Points<'_>, registers: &mut [Lanes], out: &mut [f32]) {
    for (chunk, out) in out.chunks_mut(LANES).enumerate() {
        let own = chunk * LANES..chunk * LANES + out.len();
        for (register, axis) in registers.iter_mut().zip([points.x, points.y, points.z]) {
            register[..out.len()].copy_from_slice(&axis[own.clone()]);
        }
        run(&code.instructions, uniforms, &code.leaves, registers, out.len());
        take(code.root, uniforms, registers, out);
    }
}

/// Executes instructions, for the first `count` points of the registers.
#[inline(always)]
pub(super) fn run<const N: usize>(
    instructions: &[(Instruction, u32)],
    uniforms: &[f32],
    leaves: &[Arc<dyn Leaf>],
    registers: &mut [[f32; N]],
    count: usize,
) {
    for (instruction, to) in instructions {
        value_of(instruction, *to as usize, uniforms, leaves, registers, count);
    }
}

/// What the whole came to.
#[inline(always)]
pub(super) fn take<const N: usize>(root: Operand, uniforms: &[f32], registers: &[[f32; N]], out: &mut [f32]) {
    match root {
        Operand::Uniform(i) => out.fill(uniforms[i as usize]),
        Operand::Value(i) => out.copy_from_slice(&registers[i as usize][..out.len()]),
        // Code reads coordinates in their registers.
        Operand::Axis(_) => {}
    }
}

#[inline(always)]
fn value_of<const N: usize>(
    instruction: &Instruction,
    to: usize,
    uniforms: &[f32],
    leaves: &[Arc<dyn Leaf>],
    registers: &mut [[f32; N]],
    count: usize,
) {
    let register = |operand| match operand {
        Operand::Value(i) => i as usize,
        _ => usize::MAX,
    };
    let uniform = |operand| match operand {
        Operand::Uniform(i) => uniforms[i as usize],
        _ => 0.0,
    };
    let [a, b, c] = instruction.operands;
    match instruction.op {
        Op::Unary(op) => {
            // Pruning leaves operations of uniforms alone.
            if let Operand::Uniform(_) = a {
                op.visit(Unary { a: Argument::One(uniform(a)), out: &mut registers[to] });
            } else if let Ok([out, a]) = registers.get_disjoint_mut([to, register(a)]) {
                op.visit(Unary { a: Argument::Lanes(a), out });
            }
        }
        Op::Binary(op) => match (a, b) {
            (Operand::Uniform(_), Operand::Uniform(_)) => {
                let [a, b] = [a, b].map(|operand| Argument::One(uniform(operand)));
                op.visit(Binary { a, b, out: &mut registers[to] });
            }
            (Operand::Uniform(_), _) => {
                if let Ok([out, b]) = registers.get_disjoint_mut([to, register(b)]) {
                    op.visit(Binary { a: Argument::One(uniform(a)), b: Argument::Lanes(b), out });
                }
            }
            (_, Operand::Uniform(_)) => {
                if let Ok([out, a]) = registers.get_disjoint_mut([to, register(a)]) {
                    op.visit(Binary { a: Argument::Lanes(a), b: Argument::One(uniform(b)), out });
                }
            }
            _ if a == b => {
                if let Ok([out, a]) = registers.get_disjoint_mut([to, register(a)]) {
                    op.visit(Binary { a: Argument::Lanes(a), b: Argument::Lanes(a), out });
                }
            }
            _ => {
                if let Ok([out, a, b]) = registers.get_disjoint_mut([to, register(a), register(b)]) {
                    op.visit(Binary { a: Argument::Lanes(a), b: Argument::Lanes(b), out });
                }
            }
        },
        Op::Select => {
            let lanes = |registers: &[[f32; N]], operand| match operand {
                Operand::Value(i) => registers[i as usize],
                _ => [uniform(operand); N],
            };
            let [a, b, c] = [a, b, c].map(|operand| lanes(registers, operand));
            let out = &mut registers[to];
            (0..N).for_each(|i| out[i] = if a[i] == 0.0 { c[i] } else { b[i] });
        }
        Op::Leaf(leaf) => {
            let lanes = |registers: &[[f32; N]], operand| match operand {
                Operand::Value(i) => registers[i as usize],
                _ => [uniform(operand); N],
            };
            let [x, y, z] = [a, b, c].map(|operand| lanes(registers, operand));
            // Leaves get the points alone: what lies in the other lanes may be anywhere.
            let at = Points { x: &x[..count], y: &y[..count], z: &z[..count] };
            leaves[leaf as usize].values(at, &mut registers[to][..count]);
        }
    }
}

/// The gradients at `points`, with `registers` as scratch.
pub fn gradients(
    code: &Code,
    uniforms: &[f32],
    points: Points<'_>,
    registers: &mut Vec<Dual>,
    out: &mut [[f32; 3]],
) {
    if let Some(leaf) = code.only_leaf() {
        return gradients_alone(&**leaf, points, out);
    }
    if registers.len() < code.registers {
        registers.resize(code.registers, [[0.0; LANES]; 4]);
    }
    run_gradients(code, uniforms, points, registers, out);
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn run_gradients(
    code: &Code,
    uniforms: &[f32],
    points: Points<'_>,
    registers: &mut [Dual],
    out: &mut [[f32; 3]],
) {
    for (chunk, out) in out.chunks_mut(LANES).enumerate() {
        let own = chunk * LANES..chunk * LANES + out.len();
        for (k, axis) in [points.x, points.y, points.z].into_iter().enumerate() {
            registers[k] = [[0.0; LANES]; 4];
            registers[k][0][..out.len()].copy_from_slice(&axis[own.clone()]);
            registers[k][1 + k] = [1.0; LANES];
        }
        for (instruction, to) in &code.instructions {
            gradient_of(instruction, *to as usize, uniforms, &code.leaves, registers, out.len());
        }
        for (i, out) in out.iter_mut().enumerate() {
            *out = match code.root {
                Operand::Value(r) => [1, 2, 3].map(|k| registers[r as usize][k][i]),
                _ => [0.0; 3],
            };
        }
    }
}

/// A part of a derivative: 0 where either is 0, also where the other is infinite or NaN. So a branch that is not
/// taken adds nothing, and an infinite slope along x says nothing of y.
#[inline(always)]
fn term(slope: f32, derivative: f32) -> f32 {
    if slope == 0.0 || derivative == 0.0 { 0.0 } else { slope * derivative }
}

struct UnaryDual<'a> {
    a: &'a Dual,
    out: &'a mut Dual,
}

impl VisitUnary for UnaryDual<'_> {
    #[inline(always)]
    fn visit(self, value: impl Fn(f32) -> f32, (slope,): (impl Fn(f32, f32) -> f32,)) {
        one_varies(self.a, self.out, value, slope);
    }
}

struct BinaryDual<'a> {
    a: Result<&'a Dual, f32>,
    b: Result<&'a Dual, f32>,
    out: &'a mut Dual,
}

impl VisitBinary for BinaryDual<'_> {
    #[inline(always)]
    fn visit(
        self,
        value: impl Fn(f32, f32) -> f32,
        (slope_a, slope_b): (impl Fn(f32, f32, f32) -> f32, impl Fn(f32, f32, f32) -> f32),
    ) {
        // A uniform has no derivative: its slope, which may be NaN, does not count.
        match (self.a, self.b) {
            (Ok(a), Ok(b)) => {
                let [mut slopes_a, mut slopes_b] = [[0.0; LANES]; 2];
                let [v, derivatives @ ..] = self.out;
                for i in 0..LANES {
                    v[i] = value(a[0][i], b[0][i]);
                    slopes_a[i] = slope_a(a[0][i], b[0][i], v[i]);
                    slopes_b[i] = slope_b(a[0][i], b[0][i], v[i]);
                }
                for (out, (a, b)) in derivatives.iter_mut().zip(a[1..].iter().zip(&b[1..])) {
                    (0..LANES).for_each(|i| out[i] = term(slopes_a[i], a[i]) + term(slopes_b[i], b[i]));
                }
            }
            (Ok(a), Err(b)) => {
                one_varies(a, self.out, |a| value(a, b), |a, v| slope_a(a, b, v));
            }
            (Err(a), Ok(b)) => {
                one_varies(b, self.out, |b| value(a, b), |b, v| slope_b(a, b, v));
            }
            (Err(a), Err(b)) => {
                *self.out = [[0.0; LANES]; 4];
                self.out[0].fill(value(a, b));
            }
        }
    }
}

/// An operation whose one operand alone depends on the point.
#[inline(always)]
fn one_varies(a: &Dual, out: &mut Dual, value: impl Fn(f32) -> f32, slope: impl Fn(f32, f32) -> f32) {
    let mut slopes = [0.0; LANES];
    let [v, derivatives @ ..] = out;
    for i in 0..LANES {
        v[i] = value(a[0][i]);
        slopes[i] = slope(a[0][i], v[i]);
    }
    for (out, a) in derivatives.iter_mut().zip(&a[1..]) {
        (0..LANES).for_each(|i| out[i] = term(slopes[i], a[i]));
    }
}

#[inline(always)]
fn gradient_of(
    instruction: &Instruction,
    to: usize,
    uniforms: &[f32],
    leaves: &[Arc<dyn Leaf>],
    registers: &mut [Dual],
    count: usize,
) {
    let register = |operand| match operand {
        Operand::Value(i) => i as usize,
        _ => usize::MAX,
    };
    let uniform = |operand| match operand {
        Operand::Uniform(i) => uniforms[i as usize],
        _ => 0.0,
    };
    // Of choices and leaves, which are few: copies keep them simple.
    let dual = |registers: &[Dual], operand| match operand {
        Operand::Value(i) => Ok(registers[i as usize]),
        other => Err(uniform(other)),
    };
    let [a, b, c] = instruction.operands;
    match instruction.op {
        Op::Unary(op) => {
            if let Operand::Uniform(_) = a {
                registers[to] = [[0.0; LANES]; 4];
                op.visit(Unary { a: Argument::One(uniform(a)), out: &mut registers[to][0] });
            } else if let Ok([out, a]) = registers.get_disjoint_mut([to, register(a)]) {
                op.visit(UnaryDual { a, out });
            }
        }
        Op::Binary(op) => match (a, b) {
            (Operand::Uniform(_), Operand::Uniform(_)) => {
                op.visit(BinaryDual { a: Err(uniform(a)), b: Err(uniform(b)), out: &mut registers[to] });
            }
            (Operand::Uniform(_), _) => {
                if let Ok([out, b]) = registers.get_disjoint_mut([to, register(b)]) {
                    op.visit(BinaryDual { a: Err(uniform(a)), b: Ok(b), out });
                }
            }
            (_, Operand::Uniform(_)) => {
                if let Ok([out, a]) = registers.get_disjoint_mut([to, register(a)]) {
                    op.visit(BinaryDual { a: Ok(a), b: Err(uniform(b)), out });
                }
            }
            _ if a == b => {
                if let Ok([out, a]) = registers.get_disjoint_mut([to, register(a)]) {
                    op.visit(BinaryDual { a: Ok(a), b: Ok(a), out });
                }
            }
            _ => {
                if let Ok([out, a, b]) = registers.get_disjoint_mut([to, register(a), register(b)]) {
                    op.visit(BinaryDual { a: Ok(a), b: Ok(b), out });
                }
            }
        },
        Op::Select => {
            let full = |registers: &[Dual], operand| {
                dual(registers, operand)
                    .unwrap_or_else(|v| [[v; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]])
            };
            let [a, b, c] = [a, b, c].map(|operand| full(registers, operand));
            for k in 0..4 {
                for i in 0..LANES {
                    registers[to][k][i] = if a[0][i] == 0.0 { c[k][i] } else { b[k][i] };
                }
            }
        }
        Op::Leaf(leaf) => {
            let inner = [a, b, c].map(|operand| dual(registers, operand));
            let [x, y, z] = [0, 1, 2].map(|k| match &inner[k] {
                Ok(dual) => dual[0],
                Err(uniform) => [*uniform; LANES],
            });
            let [mut value, mut by_x, mut by_y, mut by_z] = [[0.0; LANES]; 4];
            let derivatives = [&mut by_x[..count], &mut by_y[..count], &mut by_z[..count]];
            let out = DualSlices { value: &mut value[..count], derivatives };
            let at = Points { x: &x[..count], y: &y[..count], z: &z[..count] };
            leaves[leaf as usize].gradients(at, out);
            let part = |slopes: &Lanes, at: &Result<Dual, f32>, k: usize, i: usize| match at {
                Ok(dual) => term(slopes[i], dual[k][i]),
                Err(_) => 0.0,
            };
            let out = &mut registers[to];
            out[0] = value;
            for (k, out) in out.iter_mut().enumerate().skip(1) {
                for (i, out) in out.iter_mut().enumerate() {
                    *out = (part(&by_x, &inner[0], k, i) + part(&by_y, &inner[1], k, i))
                        + part(&by_z, &inner[2], k, i);
                }
            }
        }
    }
}
