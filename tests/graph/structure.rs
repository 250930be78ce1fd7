//! What the graph does with an expression before anything is evaluated.

use crate::{field, gradients, values};
use isoforge::field::Field;
use isoforge::graph::lower::Program;
use isoforge::graph::tape::Code;
use isoforge::graph::{Expr, ParameterError, x, y, z};

#[test]
fn equal_parts_are_done_once_and_constants_folded() {
    let r = || (x().square() + y().square()).sqrt();
    assert_eq!(field(&(r() * 2.0 + r() * 2.0)).operations(), 6);
    // All but the last addition is the same at all points.
    let p = Expr::parameter("p", 2.0);
    let folded = x() + ((&p * 3.0).square() - Expr::from(4.0) * 5.0 + p.sin_turns());
    assert_eq!(field(&folded).operations(), 1);
    assert_eq!(field(&((x() + 0.0) * 1.0)).operations(), 0);
}

#[test]
fn ten_thousand_deep_nesting_is_no_trouble() {
    let mut deep = x();
    for i in 0..100_000 {
        deep = if i % 3 == 0 { -(deep + 0.5) } else { deep.abs().min(y() + f64::from(i)) };
    }
    let own = field(&deep);
    assert!(own.operations() > 50_000);
    assert!(values(&own, &[[0.3, 0.1, 0.0]])[0].is_finite());
    drop(deep);
    let mut nested = x();
    for _ in 0..10_000 {
        nested = nested.at([x() + 0.001, y(), z()]);
    }
    assert!((values(&field(&nested), &[[0.0; 3]])[0] - 10.0).abs() < 0.1);
}

#[test]
fn parameters_change_values_and_no_source() {
    let radius = Expr::parameter("radius", 1.0);
    let sphere = (x().square() + y().square() + z().square()).sqrt() - &radius * 2.0;
    let mut own = field(&sphere);
    let before = own.wgsl().unwrap();
    assert_eq!(values(&own, &[[3.0, 0.0, 0.0]]), [1.0]);
    own.set("radius", 1.25).unwrap();
    assert_eq!(values(&own, &[[3.0, 0.0, 0.0]]), [0.5]);
    let after = own.wgsl().unwrap();
    assert_eq!(before.value, after.value);
    assert_ne!(before.parameters, after.parameters);
    assert!(matches!(own.set("radios", 1.0), Err(ParameterError::Unknown { .. })));
    assert!(matches!(own.set("radius", f64::NAN), Err(ParameterError::NotFinite { .. })));
}

#[test]
fn what_has_no_derivative_has_none() {
    // A uniform's slope is NaN here; it does not count.
    let power = x() / Expr::parameter("zero", 0.0).max(0.5);
    assert_eq!(gradients(&field(&power), &[[1.0, 0.0, 0.0]]), [[2.0, 0.0, 0.0]]);
    assert_eq!(gradients(&field(&Expr::from(3.0)), &[[1.0, 0.0, 0.0]]), [[0.0; 3]]);
    // The branch that is not taken has an infinite slope at 0.
    let branch = (x() + 1.0).min(x().abs().sqrt() + 5.0);
    assert_eq!(gradients(&field(&branch), &[[0.0, 0.0, 0.0]]), [[1.0, 0.0, 0.0]]);
}

/// However the joins of a long union are nested, few values are kept at once: a register for each of its parts
/// would not fit the cache. Goes red when the operand that needs fewer registers comes first.
#[test]
fn long_chains_need_few_registers() {
    let ball = |i: usize| ((x() - i as f64).square() + (y() + 0.5 * i as f64).square()).sqrt() - 1.0;
    let right = (0..200).map(ball).reduce(|all, next| all.min(next)).unwrap();
    let left = (0..200).map(ball).reduce(|all, next| next.min(all)).unwrap();
    for expr in [right, left, isoforge::graph::shapes::union((0..200).map(ball))] {
        let code = Code::new(&Program::new(&expr).tape);
        assert!(code.registers < 16, "{}", code.registers);
    }
}
