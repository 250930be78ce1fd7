//! Each operation on each evaluator: against its meaning, and CPU against GPU.
//!
//! Goes red when any part of an entry of `src/graph/ops.rs` is wrong: each was broken once.

use crate::common::{self, Random};
use crate::{field, gradients, on_gpu, reference, values};
use isoforge::field::Field;
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::graph::interval::Interval;
use isoforge::graph::ops::{Binary, Unary};
use isoforge::graph::{Expr, x, y, z};

/// Points with all kinds of numbers, among them equal ones, zeros and large ones.
fn points(seed: u64) -> Vec<[f32; 3]> {
    let mut random = Random(seed);
    let special = [0.0, -0.0, 0.5, 1.0, -1.0, 2.0, 100.25, -3000.5];
    let mut number = || match random.next() % 4 {
        0 => special[random.next() as usize % special.len()],
        1 => (random.unit() - 0.5) * 50.0,
        _ => (random.unit() - 0.5) * 4.0,
    };
    (0..3000).map(|_| [number(), number(), number()]).collect()
}

fn boxes(seed: u64) -> Vec<[f32; 6]> {
    let mut random = Random(seed);
    let sizes = [0.0, 1e-6, 0.01, 0.3, 2.0, 40.0];
    let mut one = || {
        let low = (random.unit() - 0.5) * 6.0;
        let size = sizes[random.next() as usize % sizes.len()] * random.unit();
        [low, low + size]
    };
    (0..100_000).map(|_| [one(), one(), one()].as_flattened().try_into().unwrap()).collect()
}

fn same_bits(what: &str, a: &[f32], b: &[f32]) {
    assert_eq!(a.len(), b.len());
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        let same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()) || (*a == 0.0 && *b == 0.0);
        assert!(same, "{what}, item {i}: {a:?} on the GPU, {b:?} on the CPU");
    }
}

/// Checks `expr`, whose meaning is `value`, on all evaluators.
fn check(name: &str, expr: &Expr, value: impl Fn([f64; 3]) -> f64, smooth: impl Fn([f64; 3]) -> bool) {
    let field = field(expr);
    let points = points(7);
    let [own, slopes] = [values(&field, &points), gradients(&field, &points).into_flattened()];
    for (i, (&p, &own)) in points.iter().zip(&own).enumerate() {
        let p = p.map(f64::from);
        let expected = value(p);
        // Beyond the largest `f32` is infinity.
        let expected =
            if expected.abs() > f64::from(f32::MAX) { f64::INFINITY * expected.signum() } else { expected };
        let near = (f64::from(own) - expected).abs() <= 1e-5 * expected.abs().max(0.1);
        assert!(
            near || (own.is_nan() && expected.is_nan()) || f64::from(own) == expected,
            "{name} {p:?}: {own}, not {expected}"
        );
        // Derivatives against differences, where there is no kink near.
        let step = 1e-6;
        for k in 0..3 {
            let [mut low, mut high] = [p; 2];
            low[k] -= step;
            high[k] += step;
            let difference = (value(high) - value(low)) / (2.0 * step);
            if difference.abs() < 1e30 && smooth(p) {
                let slope = f64::from(slopes[3 * i + k]);
                let near = (slope - difference).abs() <= 1e-3 * difference.abs().max(1.0);
                assert!(near, "{name} at {p:?}, by {k}: {slope}, not {difference}");
            }
        }
    }
    let boxes = boxes(9);
    let mut random = Random(3);
    let mut bounds = Vec::new();
    for b in &boxes {
        let region = [0, 1, 2].map(|k| Interval::new(b[2 * k], b[2 * k + 1]));
        let range = field.within(region).range;
        bounds.push([range.lo, range.hi]);
        let mut at = || {
            region.map(|r| match random.next() % 4 {
                0 => r.lo,
                1 => r.hi,
                _ => (r.lo + random.unit() * (r.hi - r.lo)).clamp(r.lo, r.hi),
            })
        };
        let inside: Vec<[f32; 3]> = (0..8).map(|_| at()).collect();
        for (p, v) in inside.iter().zip(values(&field, &inside)) {
            let known = range.is_bounded();
            assert!(!known || (v.is_finite() && range.contains(v)), "{name} at {p:?}: {v} beyond {range:?}");
        }
    }
    let Some(gpu) = common::gpu().filter(|gpu| gpu.is_software()) else { return };
    same_bits(&format!("values of {name}"), &on_gpu::values(gpu, &field, &points), &own);
    // A gradient that is not finite is the same as any other that is not.
    let finite = |g: &[f32; 3]| if g.iter().all(|v| v.is_finite()) { *g } else { [f32::NAN; 3] };
    let [of_gpu, of_cpu] = [on_gpu::gradients(gpu, &field, &points), slopes.as_chunks().0.to_vec()]
        .map(|g| g.iter().map(finite).collect::<Vec<_>>());
    same_bits(&format!("gradients of {name}"), of_gpu.as_flattened(), of_cpu.as_flattened());
    // Bounds need only hold: Mesa reorders what widens them.
    let on_gpu = on_gpu::intervals(gpu, &field, &boxes);
    for ((a, b), region) in
        on_gpu.as_flattened().iter().zip(bounds.as_flattened()).zip(boxes.iter().flat_map(|b| [b, b]))
    {
        assert!(
            (a - b).abs() <= 1e-6 * b.abs().max(1.0) || a == b,
            "interval of {name} in {region:?}: {a} {b}"
        );
    }
}

#[test]
fn of_one_operand() {
    for &op in Unary::ALL {
        let smooth = |p: [f64; 3]| match op {
            Unary::Floor => (p[0] - p[0].round()).abs() > 1e-3,
            Unary::Sqrt => p[0] > 1e-3,
            Unary::Abs | Unary::Sign => p[0].abs() > 1e-3,
            Unary::SinTurns | Unary::CosTurns | Unary::Sin | Unary::Cos => p[0].abs() < 100.0,
            Unary::Ln => p[0] > 1e-3,
            Unary::Asin | Unary::Acos => p[0].abs() < 0.99,
            Unary::Exp => p[0] < 20.0,
            _ => true,
        };
        check(&format!("{op:?}"), &Expr::unary(op, x()), |p| reference::unary(op, p[0]), smooth);
    }
}

#[test]
fn of_two_operands() {
    for &op in Binary::ALL {
        let smooth = |p: [f64; 3]| match op {
            Binary::Min | Binary::Max | Binary::Less | Binary::LessEqual => (p[0] - p[1]).abs() > 1e-3,
            Binary::Div => p[1].abs() > 1e-2,
            Binary::Pow => p[0] > 1e-2 && p[0] < 10.0 && p[1].abs() < 5.0,
            Binary::Atan2 => p[0].hypot(p[1]) > 1e-2 && p[0].abs() > 1e-3,
            _ => true,
        };
        let name = format!("{op:?}");
        check(&name, &Expr::binary(op, x(), y()), |p| reference::binary(op, p[0], p[1]), smooth);
        // With a number on either side, and with itself.
        let constant = |a: f64, b: f64| (a - b).abs() > 1e-3 && b.abs() > 1e-2;
        let with = Expr::binary(op, x(), 0.75);
        check(&name, &with, |p| reference::binary(op, p[0], 0.75), |p| constant(p[0], 0.75));
        let with = Expr::binary(op, 0.75, y());
        check(&name, &with, |p| reference::binary(op, 0.75, p[1]), |p| constant(0.75, p[1]));
        if !matches!(op, Binary::Less | Binary::LessEqual) {
            let own = Expr::binary(op, z(), z());
            check(&name, &own, |p| reference::binary(op, p[2], p[2]), |p| p[2].abs() > 1e-2);
        }
    }
}

#[test]
fn choice_and_change_of_place() {
    let choice = (x().less(y())).select(z().square(), x());
    let means = |p: [f64; 3]| if p[0] < p[1] { p[2] * p[2] } else { p[0] };
    check("select", &choice, means, |p| (p[0] - p[1]).abs() > 1e-3);
    let moved = (x() * y() + z()).at([y() + 1.0, x() * 0.5, z().abs()]);
    check("at", &moved, |p| (p[1] + 1.0) * (p[0] * 0.5) + p[2].abs(), |p| p[2].abs() > 1e-3);
}

/// Goes red where a driver takes `(a * b) * c`, a function's or a leaf's last product and what follows it, as `(a * c) * b`:
/// Mesa does, unless each result is kept from it (src/gpu/exact.rs).
#[test]
fn what_follows_a_function_or_a_leaf() {
    let blob = |x| Component { position: [x, 0.2, -0.1], radius: 2.5, weight: 0.7 };
    let blobs = Blobs::new(Kernel::SoftObject, vec![blob(-0.4), blob(0.9)]).unwrap();
    let mut of = vec![("noise", Expr::noise(48)), ("blobs", blobs.expr())];
    of.extend(Unary::ALL.iter().map(|op| ("a function", Expr::unary(*op, x() * 0.61))));
    of.extend(Binary::ALL.iter().map(|op| ("a function of two", Expr::binary(*op, x(), y()))));
    let Some(gpu) = common::gpu() else { return };
    let mut random = Random(5);
    let points: Vec<[f32; 3]> = (0..2000).map(|_| (random.in_ball() * 2.0).to_array()).collect();
    for (name, part) in of {
        let ball = (x().square() + y().square() + z().square()).sqrt() - 1.0;
        let times = &part * 0.37 - z() * 0.31;
        let moved = ball.at([(x() + &times) + y() * 0.3, y() + x() * z(), z()]);
        for expr in [&times, &times.exponential_union(&ball, 0.3), &moved] {
            let field = field(expr);
            same_bits(name, &on_gpu::values(gpu, &field, &points), &values(&field, &points));
            if field.wgsl().unwrap().planes.is_some() {
                let by_planes = on_gpu::values_by_planes(gpu, &field, &points);
                same_bits(name, &by_planes, &values(&field, &points));
            }
            let finite = |g: [f32; 3]| if g.iter().all(|v| v.is_finite()) { g } else { [f32::NAN; 3] };
            let [of_gpu, of_cpu] = [on_gpu::gradients(gpu, &field, &points), gradients(&field, &points)]
                .map(|g| g.into_iter().flat_map(finite).collect::<Vec<_>>());
            same_bits(&format!("gradient of {name}"), &of_gpu, &of_cpu);
        }
    }
}
