//! What combines solids, against its formulas.

use crate::{check, field, points, values};
use isoforge::graph::shapes::{intersection, sphere, union};
use isoforge::graph::{Expr, x, y, z};

fn first() -> Expr {
    (x() * 1.5 - y() * 0.5) + 0.1
}

fn second() -> Expr {
    (z() - x() * 0.7) - 0.2
}

fn both(p: [f64; 3]) -> (f64, f64) {
    (1.5 * p[0] - 0.5 * p[1] + 0.1, p[2] - 0.7 * p[0] - 0.2)
}

/// Compares with a formula of the two operands.
fn agrees(name: &str, expr: &Expr, formula: impl Fn(f64, f64) -> f64) {
    check(name, &field(expr), 1.5, &|p| {
        let (a, b) = both(p);
        formula(a, b)
    });
}

#[test]
fn sharp() {
    let (a, b) = (first(), second());
    agrees("union", &a.union(&b), f64::min);
    agrees("intersection", &a.intersection(&b), f64::max);
    agrees("difference", &a.difference(&b), |a, b| a.max(-b));
    agrees("difference of several", &a.difference_of([b.clone(), &b + 1.0]), |a, b| a.max(-b));
    agrees("negation", &a.negation(), |a, _| -a);
    agrees("shell", &a.shell(0.3), |a, _| a.abs() - 0.15);
    agrees("offset", &a.offset(-0.3), |a, _| a + 0.3);
    agrees("round", &a.round(0.3), |a, _| a - 0.3);
    agrees("morph", &a.morph(&b, 0.3), |a, b| 0.3 * a + 0.7 * b);
    let many: Vec<Expr> = (0..7).map(|i| &a + f64::from(i - 3) * &b).collect();
    agrees("union of many", &union(many.clone()), |a, b| a - 3.0 * b.abs());
    agrees("intersection of many", &intersection(many), |a, b| a + 3.0 * b.abs());
    assert_eq!(values(&field(&union([])), &[[0.0; 3]]), [1.0]);
}

/// Goes red when the seam has another depth.
#[test]
fn smooth() {
    let (a, b) = (first(), second());
    for r in [0.0, 0.05, 0.8] {
        // A cubic-free quadratic blend, by its own parameter: mix(b, a, h) − r h (1 − h).
        let blend = move |a: f64, b: f64| {
            if r == 0.0 {
                return a.min(b);
            }
            let h = (0.5 + 0.5 * (b - a) / r).clamp(0.0, 1.0);
            b * (1.0 - h) + a * h - r * h * (1.0 - h)
        };
        let radius = Expr::parameter("radius", r);
        agrees("smooth union", &a.smooth_union(&b, &radius), blend);
        agrees("smooth intersection", &a.smooth_intersection(&b, &radius), |a, b| -blend(-a, -b));
        agrees("smooth difference", &a.smooth_difference(&b, r), |a, b| -blend(-a, b));
    }
}

#[test]
fn exponential() {
    let (a, b) = (first(), second());
    for r in [0.05, 0.4] {
        let blend = move |a: f64, b: f64| -r * ((-a / r).exp() + (-b / r).exp()).ln();
        let radius = Expr::parameter("radius", r);
        agrees("exponential union", &a.exponential_union(&b, &radius), blend);
        agrees("exponential intersection", &a.exponential_intersection(&b, r), |a, b| -blend(-a, -b));
        agrees("exponential difference", &a.exponential_difference(&b, r), |a, b| -blend(-a, b));
    }
    agrees("exponential union of radius 0", &a.exponential_union(&b, 0.0), f64::min);
}

/// Goes red when α is left out of the divisor, or the root's sign turned.
#[test]
fn r_functions() {
    let (a, b) = (first(), second());
    for alpha in [-0.5, 0.0, 0.4, 0.99, 1.0] {
        let root = move |a: f64, b: f64| (a * a + b * b - 2.0 * alpha * a * b).max(0.0).sqrt();
        for given in [Expr::from(alpha), Expr::parameter("alpha", alpha)] {
            agrees("R-union", &a.r_union(&b, &given).unwrap(), |a, b| (a + b - root(a, b)) / (1.0 + alpha));
            let formula = |a: f64, b: f64| (a + b + root(a, b)) / (1.0 + alpha);
            agrees("R-intersection", &a.r_intersection(&b, &given).unwrap(), formula);
            agrees("R-difference", &a.r_difference(&b, &given).unwrap(), |a, b| formula(a, -b));
        }
    }
}

/// α = 1 is min and max, but for the last bits of a sum.
#[test]
fn r_functions_of_alpha_1_are_min_and_max() {
    let (a, b) = (sphere(0.7), second());
    let points = points(2000, 1.5, 31);
    for alpha in [Expr::from(1.0), Expr::parameter("alpha", 1.0)] {
        let pairs = [
            (a.r_union(&b, &alpha).unwrap(), a.min(&b)),
            (a.r_intersection(&b, &alpha).unwrap(), a.max(&b)),
            (a.r_difference(&b, &alpha).unwrap(), a.max(-&b)),
        ];
        for (r, sharp) in pairs {
            for (r, sharp) in values(&field(&r), &points).iter().zip(values(&field(&sharp), &points)) {
                assert!((r - sharp).abs() <= 3e-7, "{r}, not {sharp}");
            }
        }
    }
}
