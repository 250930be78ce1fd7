//! Bulk evaluation of the same CSG tree by isoforge and by fidget's interpreter (no JIT), one thread each,
//! interleaved; prints points/s, best of the rounds, and the ratio.

use fidget_core::context::Tree;
use fidget_core::shape::EzShape;
use fidget_core::vm::VmShape;
use isoforge::field::{Field, Points, Sense};
use isoforge::graph::{Expr, GraphField, x, y, z};
use std::time::Instant;

/// Centres and radii of so many balls, the same for both.
fn balls(count: usize) -> Vec<([f64; 3], f64)> {
    (0..count)
        .map(|i| {
            let i = i as f64;
            let centre = [(i * 0.618_034).fract(), (i * 0.754_878).fract(), (i * 0.569_84).fract()];
            (centre.map(|c| 2.0 * c - 1.0), 0.1 + 0.05 * (i * 0.3).fract())
        })
        .collect()
}

fn ours(balls: &[([f64; 3], f64)]) -> Expr {
    let ball = |&([a, b, c], r): &([f64; 3], f64)| {
        ((x() - a).square() + (y() - b).square() + (z() - c).square()).sqrt() - r
    };
    balls.iter().map(ball).reduce(|a, b| a.min(b)).unwrap()
}

fn theirs(balls: &[([f64; 3], f64)]) -> Tree {
    let (x, y, z) = Tree::axes();
    let ball = |&([a, b, c], r): &([f64; 3], f64)| {
        ((x.clone() - a as f32).square() + (y.clone() - b as f32).square() + (z.clone() - c as f32).square()).sqrt() - r as f32
    };
    balls.iter().map(ball).reduce(|a, b| a.min(b)).unwrap()
}

fn main() {
    const POINTS: usize = 729 * 16;
    let axis = |k: f64| (0..POINTS).map(|i| ((i as f64 * k).fract() * 2.0 - 1.0) as f32).collect::<Vec<_>>();
    let [px, py, pz] = [0.618_034, 0.414_214, 0.732_051].map(axis);
    println!("{:>10} {:>14} {:>14} {:>7}", "operations", "isoforge", "fidget VM", "ratio");
    for count in [1, 10, 111] {
        let balls = balls(count);
        let field = GraphField::new(&ours(&balls), Sense::Below);
        let shape = VmShape::from(theirs(&balls));
        let tape = shape.ez_float_slice_tape();
        let mut evaluator = VmShape::new_float_slice_eval();
        let mut out = vec![0.0; POINTS];
        let mut best = [f64::INFINITY; 2];
        let rounds = 20_000 / field.operations().max(20) + 5;
        for _ in 0..rounds {
            let since = Instant::now();
            for first in (0..POINTS).step_by(729) {
                let part = first..first + 729;
                let points = Points { x: &px[part.clone()], y: &py[part.clone()], z: &pz[part.clone()] };
                field.values(points, &mut out[part]).unwrap();
            }
            best[0] = best[0].min(since.elapsed().as_secs_f64());
            let since = Instant::now();
            let mut last = 0.0;
            for first in (0..POINTS).step_by(729) {
                let part = first..first + 729;
                let values =
                    evaluator.eval(&tape, &px[part.clone()], &py[part.clone()], &pz[part.clone()]).unwrap();
                last = values[728];
                for (ours, theirs) in out[part].iter().zip(values) {
                    assert!((ours - theirs).abs() < 1e-5, "{ours} {theirs}");
                }
            }
            std::hint::black_box(last);
            // The comparison is part of the first rounds' time only in theory: it is a few percent.
            best[1] = best[1].min(since.elapsed().as_secs_f64());
        }
        let [a, b] = best.map(|t| POINTS as f64 / t);
        println!("{:>10} {:>14.3e} {:>14.3e} {:>7.2}", field.operations(), a, b, a / b);
    }
}
