//! Lengths and directions of vectors of any size; twin of `shaders/shared/unit.wgsl`.

use glam::Vec3;

/// 2⁻¹¹⁰: a gradient below it has no direction that every driver agrees on.
pub const LEAST_GRADIENT: f32 = f32::from_bits(17 << 23);

/// The largest coordinate without its sign.
pub fn largest(v: Vec3) -> f32 {
    v.x.abs().max(v.y.abs().max(v.z.abs()))
}

/// Whether a vector is long enough to have a direction, and finite.
pub fn has_direction(v: Vec3) -> bool {
    largest(v) >= LEAST_GRADIENT && v.is_finite()
}

/// A vector that has a direction, at unit length. Scaling first keeps the squares from overflowing and
/// underflowing.
pub fn unit(v: Vec3) -> Vec3 {
    let scaled = v / largest(v);
    // Plus 0: −0 becomes +0.
    scaled / ((scaled.x * scaled.x + scaled.y * scaled.y) + scaled.z * scaled.z).sqrt() + Vec3::ZERO
}

/// The length of a vector, scaled as in [`unit`]; 0 below [`LEAST_GRADIENT`].
pub fn length(v: Vec3) -> f32 {
    let most = largest(v);
    if most < LEAST_GRADIENT {
        return 0.0;
    }
    let scaled = v / most;
    most * ((scaled.x * scaled.x + scaled.y * scaled.y) + scaled.z * scaled.z).sqrt()
}
