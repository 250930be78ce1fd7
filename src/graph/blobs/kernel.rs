//! The kernels: how much a component adds at a distance. Twin of `shaders/graph/blobs.wgsl`.
//!
//! All are functions of q = r²/b², r being the distance and b the component's radius, and exactly 0 from
//! q = 1 on. They fall with q in `f32` arithmetic too (the blobby up to its last bits), which the bounds use.

use crate::field::functions::exp2;
use std::f32::consts::LN_2;

/// How a component's part of the sum falls with the distance r from its centre. `b` is the component's
/// radius, beyond which it adds nothing, `w` its weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kernel {
    /// Wyvill 1986: w (1 − 4/9 (r/b)⁶ + 17/9 (r/b)⁴ − 22/9 (r/b)²). w/2 at r = b/2.
    SoftObject,
    /// Nishimura 1985: w (1 − 3 (r/b)²) up to b/3, then 3/2 w (1 − r/b)².
    Metaball,
    /// Blinn 1982: w exp(−a r²), cut off where the exponential falls below `least`: a = ln(1 / least) / b². The
    /// sum jumps by w · `least` there; it is not shifted, so that peaks keep their height.
    Blobby {
        /// The part of its peak at which a component is cut off, from 1e-30 to below 1.
        least: f32,
    },
    /// w / r², cut off at b, where it jumps by w/b²; within b/1024 it stays at its value there, so that the
    /// centre has no infinity.
    InverseSquare,
}

/// The blobby cut off where it is a thousandth of its peak.
pub const BLOBBY: Kernel = Kernel::Blobby { least: 1e-3 };

/// 2⁻²⁰: q below which the inverse square stays.
const CORE: f32 = 1.0 / 1_048_576.0;

impl Kernel {
    /// Whether [`Kernel::Blobby`]'s part can be used.
    pub(super) fn is_sound(self) -> bool {
        match self {
            Kernel::Blobby { least } => (1e-30..1.0).contains(&least),
            _ => true,
        }
    }

    /// The radius to give a component of [`Kernel::Blobby`] for w exp(−`falloff` r²).
    #[must_use]
    pub fn blobby_radius(falloff: f32, least: f32) -> f32 {
        ((1.0 / f64::from(least)).ln() / f64::from(falloff)).sqrt() as f32
    }

    /// Where between the centre and the radius (0 to 1) a lone component of weight 1 has the value `iso`: at the
    /// distance times its radius. `None` if its values pass over `iso` or never reach it, and for
    /// [`Kernel::InverseSquare`], which has no peak to measure by.
    #[must_use]
    pub fn reach_of(self, iso: f32) -> Option<f32> {
        let q = |part: f32| part * part;
        let (mut low, mut high) = (0.0f32, 1.0f32);
        if self == Kernel::InverseSquare || !(iso < self.value(0.0) && iso > self.value(q(0.999_999))) {
            return None;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.value(q(middle)) > iso { low = middle } else { high = middle }
        }
        Some(low)
    }

    /// How many of its radii a component is to reach so that a lone one's surface at `iso` lies at its radius; 3 of
    /// the inverse square, whose weight sees to that. `None` where no reach would do.
    #[must_use]
    pub fn support_for(self, iso: f32) -> Option<f32> {
        if self == Kernel::InverseSquare {
            Some(3.0).filter(|_| iso > 0.0)
        } else {
            Some(1.0 / self.reach_of(iso)?)
        }
    }

    /// The value at q for weight 1 (1/b² for the inverse square).
    pub(super) fn value(self, q: f32) -> f32 {
        match self {
            Kernel::SoftObject => SoftObject.value(q),
            Kernel::Metaball => Metaball.value(q),
            Kernel::Blobby { .. } => Blobby(self.falloff()).value(q),
            Kernel::InverseSquare => InverseSquare.value(q),
        }
    }

    /// The blobby's exponent, to base 2, at q = 1.
    pub(super) fn falloff(self) -> f32 {
        match self {
            Kernel::Blobby { least } => -f64::from(least).log2() as f32,
            _ => 0.0,
        }
    }

    /// The weight as the sums take it.
    pub(super) fn scaled_weight(self, weight: f32, inverse_square: f32) -> f32 {
        match self {
            Kernel::InverseSquare => weight * inverse_square,
            _ => weight,
        }
    }

    /// Its number in the shader.
    pub(super) fn number(self) -> u32 {
        match self {
            Kernel::SoftObject => 0,
            Kernel::Metaball => 1,
            Kernel::Blobby { .. } => 2,
            Kernel::InverseSquare => 3,
        }
    }
}

/// A kernel of its own type, for loops over lanes.
pub(super) trait Profile: Copy {
    /// The value at q.
    fn value(self, q: f32) -> f32;
    /// The derivative by q.
    fn slope(self, q: f32) -> f32;
}

#[derive(Clone, Copy)]
pub(super) struct SoftObject;
#[derive(Clone, Copy)]
pub(super) struct Metaball;
/// With its falloff.
#[derive(Clone, Copy)]
pub(super) struct Blobby(pub f32);
#[derive(Clone, Copy)]
pub(super) struct InverseSquare;

/// 1 − q, and 0 from 1 on. NaN is far away.
#[inline(always)]
fn rest(q: f32) -> f32 {
    if q < 1.0 { 1.0 - q } else { 0.0 }
}

/// The polynomial in q is (1 − q)² (1 − 4/9 q): so it cannot fall below 0 by rounding.
impl Profile for SoftObject {
    #[inline(always)]
    fn value(self, q: f32) -> f32 {
        let u = rest(q);
        (u * u) * (0.555_555_6 + 0.444_444_45 * u)
    }

    #[inline(always)]
    fn slope(self, q: f32) -> f32 {
        let u = rest(q);
        -u * (1.111_111_2 + 1.333_333_4 * u)
    }
}

/// A constant times a product is written as a product with the constant: drivers do it in that order.
impl Profile for Metaball {
    #[inline(always)]
    fn value(self, q: f32) -> f32 {
        let u = rest(q.sqrt());
        if q < 1.0 / 9.0 { 1.0 - 3.0 * q } else { (1.5 * u) * u }
    }

    #[inline(always)]
    fn slope(self, q: f32) -> f32 {
        let t = q.sqrt();
        let u = rest(t);
        if q < 1.0 / 9.0 { -3.0 } else { (-1.5 * u) / t }
    }
}

impl Profile for Blobby {
    #[inline(always)]
    fn value(self, q: f32) -> f32 {
        let near = if q < 1.0 { q } else { 1.0 };
        let value = exp2(-self.0 * near);
        if q < 1.0 { value } else { 0.0 }
    }

    #[inline(always)]
    fn slope(self, q: f32) -> f32 {
        -(self.0 * LN_2) * self.value(q)
    }
}

impl Profile for InverseSquare {
    #[inline(always)]
    fn value(self, q: f32) -> f32 {
        let value = 1.0 / if q < CORE { CORE } else { q };
        if q < 1.0 { value } else { 0.0 }
    }

    #[inline(always)]
    fn slope(self, q: f32) -> f32 {
        let value = 1.0 / q;
        if (CORE..1.0).contains(&q) { -value * value } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reaches() {
        assert!((Kernel::SoftObject.reach_of(0.5).unwrap() - 0.5).abs() < 1e-6);
        assert!((Kernel::Metaball.reach_of(0.5).unwrap() - (1.0 - 1.0 / 3f32.sqrt())).abs() < 1e-6);
        let expected = (2f32.ln() / 1000f32.ln()).sqrt();
        assert!((BLOBBY.reach_of(0.5).unwrap() - expected).abs() < 1e-6);
        assert!(BLOBBY.reach_of(1e-4).is_none() && Kernel::SoftObject.reach_of(1.0).is_none());
        assert!(Kernel::Metaball.reach_of(0.0).is_none() && Kernel::Metaball.reach_of(f32::NAN).is_none());
    }
}
