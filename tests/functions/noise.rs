//! Gradient noise.

use crate::check;
use crate::common::Random;
use isoforge::field::noise::{noise, noise_gradient};
use isoforge::stage::shaders::NOISE;

/// Points, and a seed whose bits are those of the fourth number.
fn operands() -> Vec<[f32; 4]> {
    let special =
        [0.0, -0.0, 0.5, -0.5, 1.0, 3.0, -7.0, 1e-40, -1e-40, 1e-30, -1e-30, -1e-9, 0.999_999_94, 12.25];
    let large = [4_194_303.5, -4_194_303.5, 4_194_304.0, -4_194_304.0, 1e30, f32::INFINITY, f32::NAN];
    let special: Vec<f32> = special.into_iter().chain(large).collect();
    let special = special.as_slice();
    let at = |a: f32| special.iter().flat_map(move |&b| special.iter().map(move |&c| [a, b, c, 0.0]));
    let mut random = Random(3);
    let scales = [0.01, 1.0, 20.0, 3000.0, 4_500_000.0];
    let spread = (0..120_000).map(|i| {
        let [x, y, z] = [0; 3].map(|_| (2.0 * random.unit() - 1.0) * scales[i % scales.len()]);
        [x, y, z, f32::from_bits(random.next() as u32 & 0x3fff_ffff)]
    });
    special.iter().flat_map(|&a| at(a)).chain(spread).collect()
}

/// Goes red when the weights' constant 15 is 15.000001 in the shader.
#[test]
fn as_the_twin() {
    let operands = operands();
    let point = |o: &[f32; 4]| ([o[0], o[1], o[2]], o[3].to_bits());
    check(NOISE, "iso_noise", "iso_noise(o.xyz, bitcast<u32>(o.w))", &operands, |o| {
        let (p, seed) = point(o);
        [noise(p, seed)]
    });
    check(NOISE, "iso_noise_gradient", "iso_noise_gradient(o.xyz, bitcast<u32>(o.w))", &operands, |o| {
        let (p, seed) = point(o);
        noise_gradient(p, seed)
    });
}
