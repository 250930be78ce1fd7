//! The formulas in `f64`, written apart from the crate, and components to try them on.

use crate::common::Random;
use isoforge::field::Points;
use isoforge::graph::blobs::{BLOBBY, Component, Kernel};
use isoforge::graph::leaf::{DualSlices, Leaf};

pub const KERNELS: [Kernel; 4] = [Kernel::SoftObject, Kernel::Metaball, BLOBBY, Kernel::InverseSquare];

/// The formula at distance r, for radius b and weight 1.
pub fn kernel(kernel: Kernel, r: f64, b: f64) -> f64 {
    let t = r / b;
    if t >= 1.0 {
        return 0.0;
    }
    match kernel {
        Kernel::SoftObject => 1.0 - 4.0 / 9.0 * t.powi(6) + 17.0 / 9.0 * t.powi(4) - 22.0 / 9.0 * t.powi(2),
        Kernel::Metaball if t <= 1.0 / 3.0 => 1.0 - 3.0 * t * t,
        Kernel::Metaball => 1.5 * (1.0 - t) * (1.0 - t),
        Kernel::Blobby { least } => ((f64::from(least)).ln() * t * t).exp(),
        Kernel::InverseSquare => 1.0 / r.max(b / 1024.0).powi(2),
    }
}

/// The sum at a point, and the sum of the magnitudes.
pub fn sum(of: Kernel, components: &[Component], p: [f64; 3]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for c in components {
        let r = (0..3).map(|k| (p[k] - f64::from(c.position[k])).powi(2)).sum::<f64>().sqrt();
        let part = f64::from(c.weight) * kernel(of, r, f64::from(c.radius));
        sums[0] += part;
        sums[1] += part.abs();
    }
    sums
}

/// Components of many sizes, some of them crowded far from the others, some that carve.
pub fn some(count: usize, seed: u64) -> Vec<Component> {
    let mut random = Random(seed);
    let one = |_| {
        let far = if random.next().is_multiple_of(7) { 40.0 } else { 0.0 };
        let position = [0; 3].map(|_| far + 2.0 * random.unit() - 1.0);
        let radius = 0.05 + 0.3 * random.unit() * if random.next().is_multiple_of(9) { 5.0 } else { 1.0 };
        let weight = if random.next().is_multiple_of(4) { -0.7 } else { 0.5 + random.unit() };
        Component { position, radius, weight }
    };
    (0..count).map(one).collect()
}

/// Points near the components, in no order.
pub fn points(count: usize, seed: u64) -> [Vec<f32>; 3] {
    let mut random = Random(seed);
    let mut points = [const { Vec::new() }; 3];
    for _ in 0..count {
        let far = if random.next().is_multiple_of(5) { 40.0 } else { 0.0 };
        points.iter_mut().for_each(|axis| axis.push(far + 3.0 * random.unit() - 1.5));
    }
    points
}

pub fn values(leaf: &dyn Leaf, [x, y, z]: &[Vec<f32>; 3]) -> Vec<f32> {
    let mut out = vec![f32::NAN; x.len()];
    leaf.values(Points { x, y, z }, &mut out);
    out
}

pub fn gradients(leaf: &dyn Leaf, [x, y, z]: &[Vec<f32>; 3]) -> [Vec<f32>; 4] {
    let mut out = [0; 4].map(|_| vec![f32::NAN; x.len()]);
    let [value, a, b, c] = &mut out;
    leaf.gradients(Points { x, y, z }, DualSlices { value, derivatives: [a, b, c] });
    out
}

pub fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}
