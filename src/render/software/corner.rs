//! From clip space to pixels, and clipping for what does not fit there.

use crate::render::shade::Varyings;
use glam::{Vec2, Vec3, Vec4};

/// How far beyond the frame, in half frames, positions in 1/256 pixels still fit `i32`. Most
/// triangles at the rim of the frame need no clipping.
const GUARD: f32 = 8.0;

/// A corner of a triangle on the screen.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    /// In 1/256 pixels from the left: positions are rounded like a GPU does, so that neighbouring
    /// triangles share edges exactly.
    pub x: i32,
    /// In 1/256 pixels from the top.
    pub y: i32,
    pub z: f32,
    /// 1/w, for perspective.
    pub inv_w: f32,
    pub ray: Vec3,
    pub normal: Vec3,
    /// Colour of the material, in linear light.
    pub base: Vec3,
}

/// A projected vertex.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    pub corner: Corner,
    /// Has no usable position.
    pub lost: bool,
    /// Has no usable normal.
    pub bad: bool,
    /// Must be clipped; `corner` has no meaning.
    pub outside: bool,
}

/// The size of the picture.
#[derive(Debug, Clone, Copy)]
pub struct Viewport {
    half: Vec2,
    pub height: i32,
}

impl Viewport {
    pub fn new([width, height]: [u32; 2]) -> Self {
        Self { half: Vec2::new(width as f32, height as f32) * 0.5, height: height as i32 }
    }

    pub fn point(&self, v: &Varyings) -> Point {
        let outside = PLANES.iter().any(|plane| plane.dot(v.clip) < 0.0) || v.clip.w <= 0.0;
        let corner = if outside || v.lost { NONE } else { self.corner(v) };
        Point { corner, lost: v.lost, bad: v.bad, outside }
    }

    fn corner(&self, v: &Varyings) -> Corner {
        let inv_w = v.clip.w.recip();
        let x = (v.clip.x * inv_w + 1.0) * self.half.x;
        let y = (1.0 - v.clip.y * inv_w) * self.half.y;
        let fixed = |c: f32| (c * 256.0).round() as i32;
        let z = (v.clip.z * inv_w).clamp(0.0, 1.0);
        Corner { x: fixed(x), y: fixed(y), z, inv_w, ray: v.ray, normal: v.normal, base: v.base }
    }
}

const NONE: Corner =
    Corner { x: 0, y: 0, z: 0.0, inv_w: 1.0, ray: Vec3::ZERO, normal: Vec3::ZERO, base: Vec3::ZERO };

/// A clip position is inside if its product with each of these is not negative: near, far, guard.
const PLANES: [Vec4; 6] = [
    Vec4::new(0.0, 0.0, 1.0, 0.0),
    Vec4::new(0.0, 0.0, -1.0, 1.0),
    Vec4::new(1.0, 0.0, 0.0, GUARD),
    Vec4::new(-1.0, 0.0, 0.0, GUARD),
    Vec4::new(0.0, 1.0, 0.0, GUARD),
    Vec4::new(0.0, -1.0, 0.0, GUARD),
];

/// Where the way from `a` to `b` meets the plane, given their signed distances.
fn cut(a: &Varyings, b: &Varyings, from: f32, to: f32) -> Varyings {
    let t = from / (from - to);
    Varyings {
        clip: a.clip + (b.clip - a.clip) * t,
        ray: a.ray + (b.ray - a.ray) * t,
        normal: a.normal + (b.normal - a.normal) * t,
        base: a.base + (b.base - a.base) * t,
        lost: false,
        bad: a.bad,
    }
}

/// The part of the triangle that can be drawn: a convex polygon, empty if there is none.
pub fn clip_triangle(triangle: [Varyings; 3], viewport: &Viewport) -> Vec<Corner> {
    let mut polygon = triangle.to_vec();
    for plane in PLANES {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, b) in polygon.iter().enumerate() {
            let a = &polygon[(i + polygon.len() - 1) % polygon.len()];
            let (from, to) = (plane.dot(a.clip), plane.dot(b.clip));
            if (from < 0.0) != (to < 0.0) {
                kept.push(cut(a, b, from, to));
            }
            if to >= 0.0 {
                kept.push(*b);
            }
        }
        polygon = kept;
    }
    corners(&polygon, viewport)
}

/// The part of the line that can be drawn.
pub fn clip_line(mut a: Varyings, mut b: Varyings, viewport: &Viewport) -> Option<[Corner; 2]> {
    for plane in PLANES {
        let (from, to) = (plane.dot(a.clip), plane.dot(b.clip));
        match (from < 0.0, to < 0.0) {
            (true, true) => return None,
            (true, false) => a = cut(&a, &b, from, to),
            (false, true) => b = cut(&a, &b, from, to),
            (false, false) => {}
        }
    }
    corners(&[a, b], viewport).try_into().ok()
}

/// Empty if rounding left a corner at or behind the eye.
fn corners(polygon: &[Varyings], viewport: &Viewport) -> Vec<Corner> {
    if polygon.iter().any(|v| v.clip.w.is_nan() || v.clip.w <= 0.0) {
        return Vec::new();
    }
    polygon.iter().map(|v| viewport.corner(v)).collect()
}
