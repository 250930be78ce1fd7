//! Gradient noise as a leaf of the graph.

use super::interval::Interval;
use super::leaf::{DualSlices, Leaf, LeafWgsl};
use super::{Expr, x, y, z};
use crate::field::Points;
use crate::field::noise::{NOISE_BOUND, NOISE_SLOPE, noise, noise_gradient};
use std::any::Any;
use std::sync::Arc;

/// Noise of one seed.
#[derive(Debug)]
struct Noise {
    seed: u32,
}

impl Expr {
    /// Gradient noise (Perlin 2002) with features of about the length 1, from −1 to 1; the same on every
    /// backend.
    pub fn noise(seed: u32) -> Self {
        Self::leaf(Arc::new(Noise { seed }))
    }

    /// Noise on noise (fBm): so many octaves, each of half the length and `gain` times the height of the one
    /// before.
    pub fn fbm(seed: u32, octaves: u32, gain: f64) -> Self {
        let octave = |i: u32| {
            let scale = f64::from(i).exp2();
            let at = [x() * scale, y() * scale, z() * scale];
            Self::noise(seed.wrapping_add(i)).at(at) * gain.powi(i as i32)
        };
        (0..octaves).map(octave).reduce(|a, b| a + b).unwrap_or_else(|| 0.0.into())
    }
}

impl Leaf for Noise {
    fn values(&self, at: Points<'_>, out: &mut [f32]) {
        at.map(out, |x, y, z| noise([x, y, z], self.seed));
    }

    fn gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        for i in 0..out.value.len() {
            let jet = noise_gradient([at.x[i], at.y[i], at.z[i]], self.seed);
            out.value[i] = jet[0];
            for k in 0..3 {
                out.derivatives[k][i] = jet[1 + k];
            }
        }
    }

    /// From the middle of the box it can rise and fall by its steepest slope.
    fn interval(&self, [x, y, z]: [Interval; 3]) -> Interval {
        let known = x.is_bounded() && y.is_bounded() && z.is_bounded();
        let middle = [x, y, z].map(|r| 0.5 * r.lo + 0.5 * r.hi);
        let value = noise(middle, self.seed);
        let reach = NOISE_SLOPE * (0.5 * (((x.hi - x.lo) + (y.hi - y.lo)) + (z.hi - z.lo)));
        // Beyond 2²² noise is 0, and near it the middle is rounded.
        let near = [x, y, z].iter().all(|r| r.lo > -1e6 && r.hi < 1e6);
        let (lo, hi) = if near { (value - reach, value + reach) } else { (-NOISE_BOUND, NOISE_BOUND) };
        Interval::new(lo.max(-NOISE_BOUND), hi.min(NOISE_BOUND)).grown(known, 1e-5, 1e-5)
    }

    fn is_same(&self, other: &dyn Leaf, _: [Interval; 3]) -> bool {
        (other as &dyn Any).downcast_ref().is_some_and(|other: &Self| other.seed == self.seed)
    }

    fn wgsl(&self, name: &str, _first: usize) -> LeafWgsl {
        let seed = self.seed;
        LeafWgsl {
            value: format!("fn {name}(p: vec3<f32>) -> f32 {{ return iso_noise(p, {seed}u); }}\n"),
            gradient: format!(
                "fn {name}_gradient(p: vec3<f32>) -> vec4<f32> {{ return iso_noise_gradient(p, {seed}u); }}\n"
            ),
            interval: format!(
                "fn {name}_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {{
    let known = iv_bounded(x) && iv_bounded(y) && iv_bounded(z);
    let middle = vec3<f32>(0.5 * x.x + 0.5 * x.y, 0.5 * y.x + 0.5 * y.y, 0.5 * z.x + 0.5 * z.y);
    let value = iso_noise(middle, {seed}u);
    let reach = {NOISE_SLOPE:?}f * (0.5 * (((x.y - x.x) + (y.y - y.x)) + (z.y - z.x)));
    let near = min(x.x, min(y.x, z.x)) > -1e6f && max(x.y, max(y.y, z.y)) < 1e6f;
    let lo = select(-{NOISE_BOUND:?}f, value - reach, near);
    let hi = select({NOISE_BOUND:?}f, value + reach, near);
    return iv_grown(vec2<f32>(max(lo, -{NOISE_BOUND:?}f), min(hi, {NOISE_BOUND:?}f)), known, 1e-5f, 1e-5f);
}}
"
            ),
        }
    }
}
