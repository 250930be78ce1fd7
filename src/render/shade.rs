//! The twin of `shaders/render/mesh.wgsl`: the same functions, operation for operation.

use super::{Camera, Shade, Style};
use crate::colour::linear;
use glam::{Mat4, Vec3, Vec4};

/// The shader's uniform `Frame`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Frame {
    pub clip: Mat4,
    pub eye: Vec3,
    pub scale: f32,
    pub key: Vec3,
    pub shade: u32,
    pub fill: Vec3,
    pub line_bias: f32,
}

/// Puts lines in front of the triangles beside them; the triangles' slope is made up for by
/// [`SLOPE_BIAS`].
const LINE_BIAS: f32 = 2e-5;
/// How many pixels' worth of their slope triangles are pushed back under a wireframe: lines are
/// half a pixel wide to each side.
pub(super) const SLOPE_BIAS: f32 = 1.0;
/// Colour and opacity of lines, premultiplied.
pub(super) const LINE: Vec4 = Vec4::new(0.03, 0.045, 0.075, 0.5);

/// What the vertex shader hands on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Varyings {
    pub clip: Vec4,
    pub ray: Vec3,
    pub normal: Vec3,
    pub base: Vec3,
    pub lost: bool,
    pub bad: bool,
}

/// The neutral material, in linear light.
pub(super) const NEUTRAL: Vec3 = Vec3::new(0.42, 0.46, 0.53);

const FAR_BITS: u32 = 0x4974_2400;
const INFINITY_BITS: u32 = 0x7f80_0000;

#[inline]
fn reaches(v: Vec3, limit: u32) -> bool {
    v.to_array().iter().any(|c| c.to_bits() & 0x7fff_ffff >= limit)
}

#[inline]
pub(super) fn unit(v: Vec3) -> Vec3 {
    let square = v.dot(v);
    if square > 0.0 { v / square.sqrt() } else { Vec3::ZERO }
}

#[inline]
fn encode_channel(linear: f32) -> f32 {
    let c = linear.clamp(0.0, 1.0);
    if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

#[inline]
fn encode(linear: Vec3) -> Vec3 {
    Vec3::new(encode_channel(linear.x), encode_channel(linear.y), encode_channel(linear.z))
}

/// What a colour of 1 reflects: more, and the key light would bleach it.
const WHITE: f32 = 0.62;

/// The material of vertex `i`, in linear light.
#[inline]
pub(super) fn base(colours: &[[u8; 3]], i: usize) -> Vec3 {
    colours.get(i).map_or(NEUTRAL, |colour| WHITE * Vec3::from(colour.map(linear)))
}

impl Frame {
    pub fn new(camera: &Camera, style: &Style) -> Self {
        let (key, fill) = camera.lights();
        Self {
            clip: camera.clip,
            eye: camera.eye,
            scale: camera.scale,
            key,
            shade: style.shade as u32,
            fill,
            line_bias: LINE_BIAS,
        }
    }

    #[inline]
    pub fn vertex(&self, position: Vec3, normal: Vec3, base: Vec3) -> Varyings {
        let ray = (position - self.eye) * self.scale;
        let lost = reaches(ray, FAR_BITS);
        let bad = reaches(normal, INFINITY_BITS) || normal.dot(normal) == 0.0;
        Varyings {
            clip: if lost { Vec4::W } else { self.clip * ray.extend(1.0) },
            ray: if lost { Vec3::ZERO } else { ray },
            normal: if bad { Vec3::ZERO } else { normal },
            base,
            lost,
            bad,
        }
    }

    #[inline]
    fn lit(&self, base: Vec3, normal: Vec3, view: Vec3) -> Vec3 {
        let ground = Vec3::new(0.15, 0.14, 0.14);
        let sky = Vec3::new(0.34, 0.38, 0.45);
        let key_light = Vec3::new(1.30, 1.24, 1.15);
        let fill_light = Vec3::new(0.16, 0.19, 0.24);
        let ambient = ground + (sky - ground) * (0.5 + 0.5 * normal.z);
        let wrapped = ((normal.dot(self.key) + 0.3) / 1.3).max(0.0);
        let key = wrapped * wrapped;
        let fill = normal.dot(self.fill).max(0.0);
        let shine = normal.dot(unit(self.key + view)).max(0.0);
        let s2 = shine * shine;
        let s4 = s2 * s2;
        let s8 = s4 * s4;
        let s16 = s8 * s8;
        let edge = 1.0 - normal.dot(view).max(0.0);
        let rim = edge * edge * edge;
        base * (ambient + key_light * key + fill_light * fill) + Vec3::splat(0.16 * s16 * s16 + 0.05 * rim)
    }

    #[inline]
    pub fn colour(&self, base: Vec3, facet: Vec3, normal: Vec3, view: Vec3, front: bool, bad: bool) -> Vec3 {
        let n = unit(normal);
        if self.shade == Shade::Normals as u32 {
            return if bad { Vec3::ZERO } else { 0.5 + 0.5 * n };
        }
        if self.shade == Shade::Debug as u32 {
            if !front {
                return Vec3::new(1.0, 0.0, 1.0);
            }
            if bad {
                return Vec3::new(1.0, 0.0, 0.0);
            }
            if n.dot(facet) < 0.0 {
                return Vec3::new(1.0, 0.8, 0.0);
            }
            return Vec3::splat(0.45 + 0.45 * facet.dot(view).max(0.0));
        }
        if bad {
            return encode(self.lit(base, facet, view));
        }
        encode(self.lit(base, if n.dot(facet) < 0.0 { -n } else { n }, view))
    }
}
