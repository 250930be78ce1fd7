//! Solids, against distances that are found by looking at every edge and face.

use crate::{check, common, field, on_gpu, points, value_at, values};
use glam::{DVec2, DVec3};
use isoforge::graph::shapes::*;
use isoforge::graph::{Expr, x, y};

fn length(p: &[f64]) -> f64 {
    p.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// The distance from a box, below 0 inside.
fn from_box(p: [f64; 3], low: [f64; 3], high: [f64; 3]) -> f64 {
    let [p, low, high] = [p, low, high].map(DVec3::from);
    let outside = p.distance(p.clamp(low, high));
    if outside > 0.0 { outside } else { -(p - low).min(high - p).min_element() }
}

/// The distance from a polygon given counter-clockwise, below 0 inside.
fn from_polygon(p: DVec2, corners: &[DVec2]) -> f64 {
    let mut least = f64::INFINITY;
    let mut inside = true;
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let along = b - a;
        if along.length() == 0.0 {
            continue;
        }
        let t = ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        least = least.min(p.distance(a + along * t));
        inside &= along.perp_dot(p - a) > 0.0;
    }
    if inside { -least } else { least }
}

/// Of a cone around the z axis, by its section.
fn from_frustum(p: [f64; 3], low: f64, high: f64, height: f64) -> f64 {
    let section = [(-low, -0.5), (low, -0.5), (high, 0.5), (-high, 0.5)];
    let section = section.map(|(r, z)| DVec2::new(r, z * height));
    from_polygon(DVec2::new(p[0].hypot(p[1]), p[2]), &section)
}

/// An expression, and what it means.
type Pair = (&'static str, Expr, Box<dyn Fn([f64; 3]) -> f64>);

fn all() -> Vec<Pair> {
    let (low, high) = ([-0.5, -0.8, 0.1], [0.7, 0.4, 1.1]);
    let (a, b) = ([0.2, -0.6, 0.5], [-0.7, 0.3, -0.1]);
    let triangle = [(-0.6, -0.5), (0.7, -0.3), (0.1, 0.8)].map(DVec2::from);
    // The triangle as the largest of three half-planes, exact inside.
    let edge = |i: usize| {
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        let out = -(b - a).perp().normalize();
        (x() - a.x) * out.x + (y() - a.y) * out.y
    };
    let edges = [0, 1, 2].map(edge);
    let largest = move |p: DVec2| {
        (0..3).fold(f64::MIN, |m, i| {
            let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
            m.max((p - a).perp_dot(b - a) / a.distance(b))
        })
    };
    let disc = (((x() - 0.9).square() + y().square()).sqrt() - 0.3).clone();
    vec![
        ("sphere", sphere(0.8), Box::new(|p| length(&p) - 0.8)),
        (
            "ellipsoid",
            ellipsoid([0.5, 0.9, 0.7]).unwrap(),
            Box::new(|p| (length(&[p[0] / 0.5, p[1] / 0.9, p[2] / 0.7]) - 1.0) * 0.5),
        ),
        ("box", box_(low, high), Box::new(move |p| from_box(p, low, high))),
        (
            "rounded box",
            rounded_box(low, high, 0.2),
            Box::new(move |p| from_box(p, low.map(|c| c + 0.2), high.map(|c| c - 0.2)) - 0.2),
        ),
        (
            "half-space",
            half_space([1.0, -2.0, 2.0], 0.3).unwrap(),
            Box::new(|p| (p[0] - 2.0 * p[1] + 2.0 * p[2]) / 3.0 - 0.3),
        ),
        ("cylinder", cylinder(0.6, 1.0), Box::new(|p| from_frustum(p, 0.6, 0.6, 1.0))),
        ("infinite cylinder", infinite_cylinder(0.6), Box::new(|p| p[0].hypot(p[1]) - 0.6)),
        (
            "capsule",
            capsule(a, b, 0.25),
            Box::new(move |p| {
                let [p, a, b] = [p, a, b].map(DVec3::from);
                let (u, v) = (b - a, p - a);
                let t = u.dot(v) / u.dot(u);
                let beside = u.cross(v).length() / u.length();
                let away = if t < 0.0 { p.distance(a) } else { p.distance(b) };
                (if (0.0..=1.0).contains(&t) { beside } else { away }) - 0.25
            }),
        ),
        ("cone", cone(0.7, 1.2).unwrap(), Box::new(|p| from_frustum(p, 0.7, 0.0, 1.2))),
        ("frustum", frustum(0.4, 0.8, 0.9).unwrap(), Box::new(|p| from_frustum(p, 0.4, 0.8, 0.9))),
        ("torus", torus_distance(0.7, 0.25), Box::new(|p| (p[0].hypot(p[1]) - 0.7).hypot(p[2]) - 0.25)),
        (
            "superellipsoid",
            superellipsoid([0.9, 0.7, 1.2], 0.5, 1.3).unwrap(),
            Box::new(|p| {
                let s = (p[0] / 0.9).abs().powf(2.0 / 1.3) + (p[1] / 0.7).abs().powf(2.0 / 1.3);
                (s.powf(1.3 / 0.5) + (p[2] / 1.2).abs().powi(4)).powf(0.25) - 1.0
            }),
        ),
        (
            "extruded",
            extrude(&intersection(edges), 0.8),
            Box::new(move |p| {
                let (side, end) = (largest(DVec2::new(p[0], p[1])), p[2].abs() - 0.4);
                let outside = side.max(0.0).hypot(end.max(0.0));
                if outside > 0.0 { outside } else { side.max(end) }
            }),
        ),
        ("revolved", revolve(&disc), Box::new(|p| (p[0].hypot(p[1]) - 0.9).hypot(p[2]) - 0.3)),
    ]
}

/// Goes red when a wall of a box is `max(q)` outside too, when a cone's rim is left out, and when a capsule
/// does not end.
#[test]
fn are_their_distances() {
    for (name, expr, reference) in all() {
        check(name, &field(&expr), 1.5, &*reference);
    }
}

#[test]
fn parameters_give_what_constants_give() {
    let p = |name: &str| Expr::parameter(name, 1.0);
    let pairs: [(Expr, Expr); 6] = [
        (box_((p("a"), -0.8, 0.1), (0.9, p("b"), 1.1)), box_([-0.5, -0.8, 0.1], [0.9, 0.7, 1.1])),
        (ellipsoid((p("a"), p("b"), 0.7)).unwrap(), ellipsoid([-0.5, 0.7, 0.7].map(f64::abs)).unwrap()),
        (half_space((p("a"), p("b"), 0.0), 0.1).unwrap(), half_space([-0.5, 0.7, 0.0], 0.1).unwrap()),
        (capsule([0.0; 3], (p("a"), 0.0, p("b")), 0.2), capsule([0.0; 3], [-0.5, 0.0, 0.7], 0.2)),
        (frustum(0.4, p("b"), 0.9).unwrap(), frustum(0.4, 0.7, 0.9).unwrap()),
        (sphere(1.0).rotate((0.0, p("b"), p("a")), p("b")).unwrap(), sphere(1.0)),
    ];
    for (i, (with, without)) in pairs.into_iter().enumerate() {
        let mut with = field(&with);
        // The ellipsoid has no negative half axes.
        let values_of = if i == 1 { [0.5, 0.7] } else { [-0.5, 0.7] };
        for (name, value) in ["a", "b"].into_iter().zip(values_of) {
            let known = with.parameters().any(|(n, _)| n == name);
            assert!(!known || with.set(name, value).is_ok());
        }
        let points = points(500, 1.5, 3);
        for (p, (a, b)) in
            points.iter().zip(values(&with, &points).iter().zip(values(&field(&without), &points)))
        {
            assert!((a - b).abs() < 2e-6, "pair {i} at {p:?}: {a}, not {b}");
        }
    }
}

/// On the surface and inside, where a length is 0, too: a normal for every vertex.
#[test]
fn gradients_are_finite_on_and_in_a_box() {
    let solid = field(&box_([-1.0; 3], [1.0; 3]));
    let at = [[0.3, 0.2, 1.0], [0.3, 0.2, 0.9], [0.1, -1.0, 0.2], [0.0, 0.0, 1.0], [0.5, 0.1, 1.25]];
    let expected = [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
    assert_eq!(crate::gradients(&solid, &at), expected);
    let ball = field(&revolve(&sphere(1.0)));
    assert_eq!(crate::gradients(&ball, &[[0.0, 0.0, 1.0]]), [[0.0, 0.0, 1.0]]);
}

/// Ends that are one make a ball, whether known beforehand or not.
#[test]
fn a_capsule_without_length_is_a_ball() {
    let end = Expr::parameter("end", 0.3);
    for expr in [capsule([0.3; 3], [0.3; 3], 0.5), capsule([0.3; 3], [end.clone(), end.clone(), end], 0.5)] {
        assert!((value_at(&expr, [0.3, 0.3, 1.3]) - 0.5).abs() < 1e-6);
    }
}

/// On a software adapter the bits of the CPU, but for the sign of zeros.
#[test]
fn same_on_the_gpu() {
    let Some(gpu) = common::gpu().filter(|gpu| gpu.is_software()) else { return };
    for (name, expr, _) in all() {
        let field = field(&expr);
        let points = points(2000, 1.5, 5);
        let (own, theirs) = (values(&field, &points), on_gpu::values(gpu, &field, &points));
        assert!(own.iter().zip(&theirs).all(|(a, b)| a == b), "values of {name}");
        let (own, theirs) = (crate::gradients(&field, &points), on_gpu::gradients(gpu, &field, &points));
        assert!(own.iter().zip(&theirs).all(|(a, b)| a == b), "gradients of {name}");
    }
}
