//! Solids, deformations and named surfaces against formulas in `f64` that are written here, not taken from the
//! crate: values, gradients, bounds, meshes.

mod common;
#[path = "graph/on_gpu.rs"]
#[allow(dead_code, reason = "a part of it is used here")]
mod on_gpu;

#[path = "shapes/blends.rs"]
mod blends;
#[path = "shapes/deformed.rs"]
mod deformed;
#[path = "shapes/meshes.rs"]
mod meshes;
#[path = "shapes/named.rs"]
mod named;
#[path = "shapes/refused.rs"]
mod refused;
#[path = "shapes/solids.rs"]
mod solids;

use common::Random;
use isoforge::field::{Field, Points, Sense};
use isoforge::graph::interval::Interval;
use isoforge::graph::{Expr, GraphField};

/// The field that an expression is.
fn field(expr: &Expr) -> GraphField {
    GraphField::new(expr, Sense::Below)
}

fn coordinates(points: &[[f32; 3]]) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|k| points.iter().map(|p| p[k]).collect())
}

fn values(field: &dyn Field, points: &[[f32; 3]]) -> Vec<f32> {
    let [x, y, z] = coordinates(points);
    let mut out = vec![0.0; points.len()];
    field.values(Points { x: &x, y: &y, z: &z }, &mut out).unwrap();
    out
}

fn gradients(field: &dyn Field, points: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let [x, y, z] = coordinates(points);
    let mut out = vec![[0.0; 3]; points.len()];
    field.gradients(Points { x: &x, y: &y, z: &z }, &mut out).unwrap();
    out
}

fn value_at(expr: &Expr, p: [f64; 3]) -> f64 {
    values(&field(expr), &[p.map(|c| c as f32)])[0].into()
}

/// Points in the cube from −`half` to `half`.
fn points(count: usize, half: f32, seed: u64) -> Vec<[f32; 3]> {
    let mut random = Random(seed);
    (0..count).map(|_| [0; 3].map(|_| (2.0 * random.unit() - 1.0) * half)).collect()
}

/// Checks a field whose meaning is `reference` in the cube from −`half` to `half`: values within 3e-6 of the
/// largest there; derivatives within a part in 500 and 1e-5 of the largest, where the reference is smooth, which
/// is nearly everywhere; bounds of 10⁵ boxes.
fn check(name: &str, field: &dyn Field, half: f32, reference: &dyn Fn([f64; 3]) -> f64) {
    let points = points(4000, half, 17);
    let expected: Vec<f64> = points.iter().map(|p| reference(p.map(f64::from))).collect();
    let most = expected.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for ((p, own), expected) in points.iter().zip(values(field, &points)).zip(&expected) {
        let error = (f64::from(own) - expected).abs();
        assert!(error <= 3e-6 * most, "{name} at {p:?}: {own}, not {expected}");
    }

    let mut slopes = Vec::new();
    for (p, own) in points.iter().zip(gradients(field, &points)) {
        for k in 0..3 {
            let difference = |step: f64| {
                let [mut low, mut high] = [p.map(f64::from); 2];
                low[k] -= step;
                high[k] += step;
                (reference(high) - reference(low)) / (2.0 * step)
            };
            let (near, far) = (difference(1e-5), difference(1e-3));
            // What two steps see alike is smooth.
            if (near - far).abs() <= 1e-3 * near.abs() + 1e-6 {
                slopes.push((p, k, f64::from(own[k]), near));
            }
        }
    }
    assert!(slopes.len() > points.len() * 3 / 2, "{name}: smooth in {} places alone", slopes.len());
    let steepest = slopes.iter().fold(0.0f64, |m, s| m.max(s.3.abs()));
    for (p, k, own, expected) in slopes {
        let error = (own - expected).abs();
        assert!(
            error <= 2e-3 * expected.abs() + 1e-5 * steepest,
            "{name} at {p:?}, by {k}: {own}, not {expected}"
        );
    }
    bounds(name, field, half);
}

/// No value in any of 10⁵ boxes lies beyond the box's interval, and most intervals say something.
fn bounds(name: &str, field: &dyn Field, half: f32) {
    let mut random = Random(23);
    let mut bounded = 0;
    for _ in 0..100_000 {
        let size = [1e-4, 0.02, 0.2, 1.0][random.next() as usize % 4] * half;
        let region = [0; 3].map(|_| {
            let low = (2.0 * random.unit() - 1.0) * half;
            Interval::new(low, low + random.unit() * size)
        });
        let range = field.within(region).range;
        if !range.is_bounded() {
            continue;
        }
        bounded += 1;
        let mut at = || {
            region.map(|r| match random.next() % 4 {
                0 => r.lo,
                1 => r.hi,
                _ => (r.lo + random.unit() * (r.hi - r.lo)).clamp(r.lo, r.hi),
            })
        };
        let inside: Vec<[f32; 3]> = (0..8).map(|_| at()).collect();
        for (p, v) in inside.iter().zip(values(field, &inside)) {
            assert!(v.is_finite() && range.contains(v), "{name} at {p:?}: {v} beyond {range:?}");
        }
    }
    assert!(bounded > 90_000, "{name}: bounds for {bounded} boxes alone");
}
