//! What the refiner's shaders are told ([`Refining`]) and what they count ([`Counted`]).

use crate::field::{Sense, Surface};
use crate::refine::Settings;
use bytemuck::{Pod, Zeroable};

/// The settings of a level; `shaders/refine/shared.wgsl`, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "each field is described in the shader")]
pub struct Refining {
    pub low: [f32; 3],
    pub delta: f32,
    pub high: [f32; 3],
    pub iso: f32,
    pub near: [f32; 3],
    pub sign: f32,
    pub slope: f32,
    pub epsilon: f32,
    pub longest: f32,
    pub flatness: f32,
    pub least: f32,
    pub has_border: u32,
    pub nothing: u32,
    pub twice: u32,
    pub vertices: u32,
    pub triangles: u32,
    pub first: u32,
    pub tasks: u32,
}

impl Refining {
    /// The settings for a surface whose field has a gradient of its own on the GPU, or none.
    pub(super) fn new(surface: &Surface<'_>, settings: &Settings, has_gradient: bool) -> Self {
        let sign = if surface.sense() == Sense::Below { 1.0 } else { -1.0 };
        let delta = surface.delta();
        let [low, high] = settings.border.unwrap_or_default();
        Self {
            low: low.into(),
            delta,
            high: high.into(),
            iso: surface.iso(),
            near: settings.near().into(),
            sign,
            slope: if has_gradient { sign } else { sign / (2.0 * delta) },
            epsilon: settings.epsilon,
            longest: settings.step.unwrap_or(f32::MAX),
            flatness: settings.flatness,
            least: settings.least(),
            has_border: settings.border.is_some().into(),
            nothing: 0,
            twice: 2,
            vertices: 0,
            triangles: 0,
            first: 0,
            tasks: 0,
        }
    }
}

/// What the GPU counts of a level; `shaders/refine/shared.wgsl`, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[allow(missing_docs, reason = "each field is described in the shader")]
pub struct Counted {
    pub changed: u32,
    pub bent: u32,
    pub crowded: u32,
    pub cut_short: u32,
    pub runaway: u32,
    pub not_converged: u32,
    pub singular: u32,
    pub astray: u32,
    pub taken_back: u32,
    pub improper: u32,
    pub not_finite: u32,
    pub without_normal: u32,
    pub bad_triangle: u32,
}

impl Counted {
    /// Nothing counted.
    pub(super) const NONE: Self = Self {
        changed: 0,
        bent: 0,
        crowded: 0,
        cut_short: 0,
        runaway: 0,
        not_converged: 0,
        singular: 0,
        astray: 0,
        taken_back: 0,
        improper: 0,
        not_finite: u32::MAX,
        without_normal: u32::MAX,
        bad_triangle: u32::MAX,
    };
}
