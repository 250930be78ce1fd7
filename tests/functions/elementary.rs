//! Elementary functions.

use crate::check;
use crate::common::Random;
use isoforge::field::functions as f;
use isoforge::stage::shaders::FUNCTIONS;

/// Numbers that are treated apart somewhere, or lie beside a place where a function changes its formula.
fn edges() -> Vec<f32> {
    let mut edges =
        vec![0.0, f32::INFINITY, f32::NAN, f32::MAX, f32::MIN_POSITIVE, 1e-40, 1e-45, 1e-20, 1e20];
    edges.extend([0.5, 0.6, 1.0, 2.0, 3.0, 10.0, 255.0, 256.0, 16_777_215.0, 16_777_217.0, 4_294_967_296.0]);
    edges.extend([std::f32::consts::FRAC_PI_2, std::f32::consts::PI, std::f32::consts::TAU, 8_388_607.5]);
    edges.extend([
        0.414_213_57,
        2.414_213_7,
        1.0 / 4096.0,
        87.336_55,
        88.722_84,
        126.0,
        126.75,
        127.5,
        128.0,
    ]);
    let near = |x: f32| (-2i32..3).map(move |d| f32::from_bits(x.to_bits().wrapping_add_signed(d)));
    let both = |x: f32| [x, -x];
    edges.into_iter().flat_map(near).flat_map(both).collect()
}

/// Every pair of edges, numbers over all exponents, and moderate ones.
fn operands() -> Vec<[f32; 4]> {
    let edges = edges();
    let pairs = edges.iter().flat_map(|&a| edges.iter().map(move |&b| [a, b, 0.0, 0.0]));
    let mut random = Random(7);
    let any = (0..60_000).map(|_| [0; 4].map(|_| f32::from_bits(random.next() as u32)));
    let mut random = Random(8);
    let scales = [0.51, 1.01, 4.0, 130.0, 1000.0];
    let moderate =
        (0..80_000).map(|i| [0; 4].map(|_| (2.0 * random.unit() - 1.0) * scales[i % scales.len()]));
    pairs.chain(any).chain(moderate).collect()
}

/// The functions of one operand and those of two.
type Unary = (&'static str, fn(f32) -> f32);
type Binary = (&'static str, fn(f32, f32) -> f32);

const UNARY: [Unary; 13] = [
    ("sin_turns", f::sin_turns),
    ("cos_turns", f::cos_turns),
    ("iso_exp2", f::exp2),
    ("iso_log2", f::log2),
    ("iso_exp", f::exp),
    ("iso_ln", f::ln),
    ("iso_sin", f::sin),
    ("iso_cos", f::cos),
    ("iso_tan", f::tan),
    ("iso_asin", f::asin),
    ("iso_acos", f::acos),
    ("iso_atan", f::atan),
    ("iso_tanh", f::tanh),
];

const BINARY: [Binary; 2] = [("iso_pow", f::pow), ("iso_atan2", f::atan2)];

/// Goes red when the second coefficient of `iso_exp2_of_sum` differs from its twin's in the last bit.
#[test]
fn as_the_twin() {
    let operands = operands();
    for (name, twin) in UNARY {
        check(FUNCTIONS, name, &format!("{name}(o.x)"), &operands, |o| [twin(o[0])]);
    }
    for (name, twin) in BINARY {
        check(FUNCTIONS, name, &format!("{name}(o.x, o.y)"), &operands, |o| [twin(o[0], o[1])]);
    }
}
