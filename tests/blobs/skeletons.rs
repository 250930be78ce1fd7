//! Blobs around skeletons, as expressions.

use crate::reference::{KERNELS, bits, kernel, points};
use isoforge::field::{Field, Points, Sense};
use isoforge::graph::blobs::skeleton::*;
use isoforge::graph::blobs::{BLOBBY, Blobs, Component, Kernel};
use isoforge::graph::interval::Interval;
use isoforge::graph::{Expr, GraphField, x, y, z};

fn values(expr: &Expr, [x, y, z]: &[Vec<f32>; 3]) -> Vec<f32> {
    let mut out = vec![0.0; x.len()];
    GraphField::new(expr, Sense::Above).values(Points { x, y, z }, &mut out).unwrap();
    out
}

fn segment(p: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    // By search: independent of the projection.
    let at = |t: f64| (0..3).map(|k| (p[k] - a[k] - t * (b[k] - a[k])).powi(2)).sum::<f64>();
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..80 {
        let [l, h] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if at(l) < at(h) { high = h } else { low = l }
    }
    at(low).sqrt()
}

#[test]
fn distances() {
    let at = points(2000, 4);
    let corners = [[0.0, 0.1, 0.2], [1.0, 0.5, -0.3], [0.4, -1.0, 0.9], [0.4, -1.0, 0.9]];
    type Reference = Box<dyn Fn([f64; 3]) -> f64>;
    let cases: Vec<(Expr, Reference)> = vec![
        (point_square(corners[0]), Box::new(move |p| segment(p, corners[0], corners[0]))),
        (segment_square(corners[0], corners[1]), Box::new(move |p| segment(p, corners[0], corners[1]))),
        (
            polyline_square(corners).unwrap(),
            Box::new(move |p| segment(p, corners[0], corners[1]).min(segment(p, corners[1], corners[2]))),
        ),
        (circle_square(0.7), Box::new(|[x, y, z]| (x.hypot(y) - 0.7).hypot(z))),
        (superellipsoid_square(8), Box::new(|p| p.iter().map(|v| v.abs().powi(8)).sum::<f64>().powf(0.125))),
    ];
    for (n, (square, reference)) in cases.into_iter().enumerate() {
        for (i, value) in values(&square, &at).iter().enumerate() {
            let expected = reference([0, 1, 2].map(|k| f64::from(at[k][i]))).powi(2);
            assert!(
                (f64::from(*value) - expected).abs() <= 2e-5 * (1.0 + expected),
                "{n} {i}: {value}, {expected}"
            );
        }
    }
    assert!(polyline_square(&[]).is_none());
}

#[test]
fn kernels_are_those_of_points() {
    let at = points(2000, 5);
    for of in KERNELS {
        let expr = kernel_expr(of, &point_square([0.1, 0.2, 0.3]), 1.3);
        let component = Component { position: [0.1, 0.2, 0.3], radius: 1.3, weight: 1.0 };
        let leaf = Blobs::new(of, vec![component]).unwrap().expr();
        let (a, b) = (values(&expr, &at), values(&leaf, &at));
        for i in 0..a.len() {
            assert!((a[i] - b[i]).abs() <= 1e-5 * (1.0 + b[i].abs()), "{of:?} {i}: {} {}", a[i], b[i]);
        }
    }
}

#[test]
fn equipotentials() {
    let at = points(2000, 6);
    let g = x().square() * 2.0 - y() * 20.0 + z();
    for (i, value) in values(&equipotential(1.5, 0.8, &g), &at).iter().enumerate() {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(at[k][i]));
        let exponent = 0.8 * (2.0 * x * x - 20.0 * y + z);
        let expected = 1.5 * (-exponent).exp();
        // Beyond what `f32` holds it is 0 or infinite.
        let near = match exponent {
            80.0.. => (0.0..1e-34).contains(value),
            ..-80.0 => *value > 1e34,
            _ => (f64::from(*value) / expected - 1.0).abs() < 2e-4,
        };
        assert!(near, "{i}: {value}, {expected} {exponent}");
    }
}

/// Turned, scaled, carved; bounds hold and are close.
#[test]
fn combined() {
    let (sine, cosine) = 0.4f64.sin_cos();
    let turned = [x() * cosine + y() * sine, (y() * cosine - x() * sine) * 2.0, z() * 0.5];
    let bar =
        kernel_expr(Kernel::Metaball, &segment_square([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]), 0.6).at(turned);
    let ring = kernel_expr(BLOBBY, &circle_square(0.8), 0.5);
    let field = GraphField::new(&(ring - bar * 0.5), Sense::Above);
    let at = points(4000, 8);
    let mut out = vec![0.0; 4000];
    field.values(Points { x: &at[0], y: &at[1], z: &at[2] }, &mut out).unwrap();
    for i in 0..4000 {
        let side = 2f32.powi(-(i as i32 % 8));
        let over = [0, 1, 2].map(|k| Interval::new(at[k][i] - side * 0.3, at[k][i] + side * 0.7));
        let range = field.range(over);
        assert!(range.is_bounded() && range.contains(out[i]), "{over:?}: {range:?} {}", out[i]);
        assert!(range.lo >= -1.5 && range.hi <= 1.5, "{range:?}");
    }
    let middle = kernel(BLOBBY, 0.0, 0.5) - 0.5 * kernel(Kernel::Metaball, 0.0, 0.6);
    let one = [vec![0.8 * cosine as f32], vec![0.8 * sine as f32], vec![0.0]];
    assert!((f64::from(values(&kernel_expr(BLOBBY, &circle_square(0.8), 0.5), &one)[0]) - 1.0).abs() < 1e-5);
    assert!((middle - 0.5).abs() < 1e-9);
    assert_eq!(bits(&[0.0]), [0]);
}
