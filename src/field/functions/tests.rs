//! The functions against the library's in `f64`.

use super::*;

/// Many numbers from `from` to `to`, as dense as numbers are, in ascending order.
fn between(from: f32, to: f32) -> impl Iterator<Item = f32> {
    let place = |x: f32| if x.to_bits() < SIGN { i64::from(magnitude(x)) } else { -i64::from(magnitude(x)) };
    let (from, to) = (place(from), place(to));
    let number = |i: i64| if i < 0 { -f32::from_bits(-i as u32) } else { f32::from_bits(i as u32) };
    let step = ((to - from) / 400_000).max(1) as usize;
    (from..=to).step_by(step).map(number)
}

/// The largest error where the result is a normal number, absolute and relative.
fn errors(
    operands: impl Iterator<Item = f32>,
    f: impl Fn(f32) -> f32,
    reference: impl Fn(f64) -> f64,
) -> [f64; 2] {
    let mut worst = [0f64; 2];
    for x in operands {
        let (value, exact) = (f64::from(f(x)), reference(f64::from(flushed(x))));
        if exact.abs() < 2f64.powi(-126) || exact.abs() >= f64::from(f32::MAX) {
            assert!((value - exact).abs() <= 2f64.powi(-125) || value.abs() >= f64::from(f32::MAX), "{x}");
            continue;
        }
        let error = (value - exact).abs();
        assert!(error.is_finite(), "{value} for {exact} at {x}");
        worst = [worst[0].max(error), worst[1].max(error / exact.abs())];
    }
    worst
}

type Case = (&'static str, fn(f32) -> f32, fn(f64) -> f64, f32, f32);

/// Goes red when the last coefficient of the arc sine is 0.0426, say, or [`upper`] leaves 16 bits.
#[test]
fn errors_are_as_stated() {
    let relative: [(Case, f64); 13] = [
        (("exp2", exp2, f64::exp2, -126.0, 127.999_99), 1e-7),
        (("exp2 by zero", exp2, f64::exp2, -0.5, 0.5), 1e-7),
        (("exp", exp, f64::exp, -87.336_54, 88.722_83), 1.7e-7),
        (("exp by zero", exp, f64::exp, -0.5, 0.5), 1.1e-7),
        (("log2", log2, f64::log2, f32::MIN_POSITIVE, f32::MAX), 1.2e-7),
        (("log2 by one", log2, f64::log2, 0.7, 1.42), 1.2e-7),
        (("ln", ln, f64::ln, f32::MIN_POSITIVE, f32::MAX), 1.1e-7),
        (("ln by one", ln, f64::ln, 0.7, 1.42), 1.1e-7),
        (("asin", asin, f64::asin, -1.0, 1.0), 2.8e-7),
        (("acos", acos, f64::acos, -1.0, 1.0), 1.4e-7),
        (("atan", atan, f64::atan, -f32::MAX, f32::MAX), 1.8e-7),
        (("atan by one", atan, f64::atan, 0.1, 10.0), 1.8e-7),
        (("tanh", tanh, f64::tanh, -10.0, 10.0), 1.7e-7),
    ];
    let absolute: [(Case, f64); 7] = [
        (("sin_turns", sin_turns, |u| (u * std::f64::consts::TAU).sin(), 1e-3, 4.0), 3e-7),
        (("cos_turns", cos_turns, |u| (u * std::f64::consts::TAU).cos(), -4.0, 4.0), 4e-7),
        (("sin", sin, f64::sin, -4.0, 4.0), 5e-7),
        (("cos", cos, f64::cos, -4.0, 4.0), 5e-7),
        (("sin to 1000", sin, f64::sin, 1.0, 1000.0), 5e-7),
        (("cos to 1000", cos, f64::cos, 1.0, 1000.0), 5e-7),
        (("tan", tan, f64::tan, -0.785, 0.785), 7e-7),
    ];
    for (kind, cases) in [(1, &relative[..]), (0, &absolute[..])] {
        for &((name, f, reference, from, to), bound) in cases {
            let error = errors(between(from, to), f, reference)[kind];
            println!("{name}: {error:.2e}");
            assert!(error < bound, "{name}: {error:e}");
        }
    }
}

/// All that [`pow`] and [`atan2`] have over a plane.
#[test]
fn errors_of_two_operands() {
    let mut power_error = 0f64;
    for x in between(1e-30, 1e30).step_by(97) {
        // Exponents that reach the ends of the results.
        for part in [-1.0f32, -0.731, -0.1, 0.013, 0.377, 0.999] {
            let y = (f64::from(part) * 125.0 / f64::from(x).log2()) as f32;
            let exact = f64::from(x).powf(f64::from(y));
            power_error = power_error.max((f64::from(pow(x, y)) - exact).abs() / exact);
        }
    }
    println!("pow: {power_error:.2e}");
    assert!(power_error < 5e-6, "{power_error:e}");
    for y in [2.0, 3.0, 0.5, -1.0, 2.2] {
        let error = errors(between(1e-3, 1e3), |x| pow(x, y), |x| x.powf(f64::from(y)))[1];
        assert!(error < 2e-7, "x^{y}: {error:e}");
    }
    for y in between(-1e30, 1e30).step_by(997) {
        let exact = |x: f64| f64::from(flushed(y)).atan2(x);
        let [error, _] = errors(between(-f32::MAX, f32::MAX).step_by(797), |x| atan2(y, x), exact);
        assert!(error < 3e-7, "atan2 of {y}: {error:e}");
    }
}

/// Goes red when the last coefficient of [`tanh`] is -0.0058.
#[test]
fn monotone_where_stated() {
    let rising: [Case; 5] = [
        ("log2", log2, f64::log2, 0.5, 2.0),
        ("ln", ln, f64::ln, 0.5, 2.0),
        ("asin", asin, f64::asin, 0.49, 0.51),
        ("atan", atan, f64::atan, 0.4, 2.5),
        ("tanh", tanh, f64::tanh, 0.59, 0.61),
    ];
    for (name, f, _, from, to) in rising {
        let place = |x: f32| x.to_bits() as usize;
        for i in place(from)..place(to) {
            let [a, b] = [i, i + 1].map(|i| f(f32::from_bits(i as u32)));
            assert!(a <= b, "{name}: {a} and {b} at {}", f32::from_bits(i as u32));
        }
    }
}

const INF: f32 = f32::INFINITY;
const NAN: f32 = f32::NAN;

/// The bits are the same, or both are NaN.
fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

#[test]
fn edges_of_one_operand() {
    type Edges = (&'static str, fn(f32) -> f32, &'static [(f32, f32)]);
    let all: [Edges; 11] = [
        ("exp2", exp2, &[(INF, INF), (-INF, 0.0), (128.0, INF), (-126.0, f32::MIN_POSITIVE), (-126.1, 0.0)]),
        ("exp2", exp2, &[(0.0, 1.0), (1.0, 2.0), (-1e-40, 1.0), (1e30, INF), (-1e30, 0.0), (7.0, 128.0)]),
        ("exp", exp, &[(INF, INF), (-INF, 0.0), (0.0, 1.0), (88.8, INF), (-87.4, 0.0), (1e38, INF)]),
        ("log2", log2, &[(INF, INF), (-INF, NAN), (0.0, -INF), (-0.0, -INF), (1e-40, -INF), (-1.0, NAN)]),
        ("ln", ln, &[(INF, INF), (-INF, NAN), (0.0, -INF), (-1e-40, -INF), (1.0, 0.0), (-1e-30, NAN)]),
        ("sin", sin, &[(0.0, 0.0), (-0.0, -0.0), (-1e-40, -0.0), (1e-30, 1e-30), (INF, NAN), (-INF, NAN)]),
        ("cos", cos, &[(0.0, 1.0), (1e-40, 1.0), (INF, NAN), (-INF, NAN)]),
        ("tan", tan, &[(0.0, 0.0), (-0.0, -0.0), (-1e-30, -1e-30), (INF, NAN)]),
        ("asin", asin, &[(0.0, 0.0), (-0.0, -0.0), (1e-30, 1e-30), (1.000_000_1, NAN), (-INF, NAN)]),
        ("acos", acos, &[(1.0, 0.0), (-1.0, PI), (0.0, 0.5 * PI), (-1.000_000_1, NAN), (INF, NAN)]),
        ("atan", atan, &[(INF, 0.5 * PI), (-INF, -0.5 * PI), (-0.0, -0.0), (1.0, 0.25 * PI)]),
    ];
    for (name, f, edges) in all {
        for &(x, expected) in edges {
            assert!(same(f(x), expected), "{name} of {x:e}: {:e}", f(x));
        }
        assert!(f(NAN).is_nan() && f(-NAN).is_nan(), "{name} of NaN");
    }
    for (x, expected) in [(INF, 1.0), (-INF, -1.0), (-0.0, -0.0), (1e-30, 1e-30), (NAN, NAN)] {
        assert!(same(tanh(x), expected), "tanh of {x:e}");
    }
}

#[test]
fn edges_of_powers() {
    for (x, y, expected) in [
        (0.0, 2.0, 0.0),
        (-0.0, 3.0, 0.0),
        (0.0, 0.0, 1.0),
        (0.0, -0.5, INF),
        (-0.0, -1.0, INF),
        (1e-40, 0.5, 0.0),
        (-2.0, 3.0, -8.0),
        (-2.0, -2.0, 0.25),
        (-2.0, 0.5, NAN),
        (-2.0, 16_777_217.0, INF),
        (-0.5, 8_388_609.0, -0.0),
        (-1.0, 8_388_607.0, -1.0),
        (-1.0, 8_388_606.5, NAN),
        (-1.0, INF, 1.0),
        (-3.0, -0.0, 1.0),
        (1.0, -INF, 1.0),
        (1.000_000_1, INF, INF),
        (0.999_999_9, INF, 0.0),
        (0.999_999_9, -1e30, INF),
        (2.0, -INF, 0.0),
        (INF, 0.1, INF),
        (INF, -0.1, 0.0),
        (INF, 0.0, 1.0),
        (-INF, 3.0, -INF),
        (-INF, -3.0, -0.0),
        (-INF, 0.5, NAN),
        (NAN, 0.0, NAN),
        (1.0, NAN, NAN),
        (f32::MAX, f32::MAX, INF),
        (f32::MAX, -f32::MAX, 0.0),
        (f32::MIN_POSITIVE, 1e30, 0.0),
    ] {
        assert!(same(pow(x, y), expected), "{x:e}^{y:e}: {:e}", pow(x, y));
    }
    // The zeros, the infinities and the quadrants; denormal numbers as zeros.
    let special = [0.0, -0.0, 1.0, -2.0, INF, -INF, 1e30, -1e30, 1e-30, f32::MAX, f32::MIN_POSITIVE, 1e-40];
    for (y, x) in special.iter().flat_map(|&y| special.map(|x| (y, x))) {
        let (value, exact) = (atan2(y, x), f64::from(flushed(y)).atan2(f64::from(flushed(x))));
        let right =
            (f64::from(value) - exact).abs() < 3e-7 && value.is_sign_negative() == (y.to_bits() >= SIGN);
        assert!(right, "atan2 of {y:e}, {x:e}: {value:e}");
    }
    assert!(atan2(NAN, 1.0).is_nan() && atan2(1.0, NAN).is_nan() && atan2(INF, NAN).is_nan());
}
