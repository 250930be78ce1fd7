//! [`Leaf`]: a function of a point that is no combination of operations, because it reads data or loops:
//! noise, lists of blobs, sampled volumes.

use super::eval::LANES;
use super::interval::Interval;
use crate::field::{LatticeValues, Points};
use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// Values and derivatives by x, y, z at some points, all of one length.
#[derive(Debug)]
pub struct DualSlices<'a> {
    /// The values.
    pub value: &'a mut [f32],
    /// The derivatives by each coordinate.
    pub derivatives: [&'a mut [f32]; 3],
}

/// A function of a point, in all the forms that the graph needs.
pub trait Leaf: Any + Send + Sync + fmt::Debug {
    /// The values at `at`.
    fn values(&self, at: Points<'_>, out: &mut [f32]);

    /// A way to the values at a lattice's points that is faster, if there is one.
    fn lattice(&self) -> Option<&dyn LatticeValues> {
        None
    }

    /// The same values, bit for bit, and the derivatives.
    fn gradients(&self, at: Points<'_>, out: DualSlices<'_>);

    /// Bounds of the values in a box.
    fn interval(&self, at: [Interval; 3]) -> Interval;

    /// A simpler leaf that is the same in a box, bit for bit, if there is one.
    fn within(&self, at: [Interval; 3]) -> Option<Arc<dyn Leaf>> {
        let _ = at;
        None
    }

    /// Whether another leaf has the same values and gradients in a box, bit for bit; `false` where that is not known. One
    /// and the same leaf is not asked.
    fn is_same(&self, other: &dyn Leaf, at: [Interval; 3]) -> bool {
        let _ = (other, at);
        false
    }

    /// The WGSL: functions `{name}(p: vec3<f32>) -> f32`, `{name}_gradient(p: vec3<f32>) -> vec4<f32>` (value
    /// and derivatives) and `{name}_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32>`, each
    /// alone in its text (with what it calls, under names that begin with `name`). The leaf's data lie in
    /// `field_data` (`array<u32>`) from `first` on.
    fn wgsl(&self, name: &str, first: usize) -> LeafWgsl;

    /// What the WGSL reads. The same at each call.
    fn data(&self) -> Vec<u32> {
        Vec::new()
    }

    /// Bytes of [`Leaf::data`].
    fn data_bytes(&self) -> u64 {
        0
    }
}

/// The WGSL of a leaf.
#[derive(Debug, Clone, PartialEq)]
pub struct LeafWgsl {
    /// `{name}`.
    pub value: String,
    /// `{name}_gradient`.
    pub gradient: String,
    /// `{name}_interval`.
    pub interval: String,
}

impl LeafWgsl {
    /// From a text in which `LEAF` stands for the name, and lines `//:` part what all need, the value, the
    /// gradient and the interval.
    pub(super) fn from_template(text: &str, name: &str) -> Self {
        let text = text.replace("LEAF", name);
        let mut parts = text.split("//:\n");
        let mut part = || parts.next().unwrap_or_default();
        let shared = part();
        let [value, gradient, interval] = [part(), part(), part()].map(|part| format!("{shared}{part}"));
        Self { value, gradient, interval }
    }
}

/// Of a leaf that is all of a field: its gradients at points.
pub(super) fn gradients_alone(leaf: &dyn Leaf, points: Points<'_>, out: &mut [[f32; 3]]) {
    for (chunk, out) in out.chunks_mut(LANES).enumerate() {
        let own = chunk * LANES..chunk * LANES + out.len();
        let [mut value, mut by_x, mut by_y, mut by_z] = [[0.0; LANES]; 4];
        let n = out.len();
        let derivatives = [&mut by_x[..n], &mut by_y[..n], &mut by_z[..n]];
        let at = Points { x: &points.x[own.clone()], y: &points.y[own.clone()], z: &points.z[own] };
        leaf.gradients(at, DualSlices { value: &mut value[..n], derivatives });
        for (i, out) in out.iter_mut().enumerate() {
            // As the sum of three terms has it, no zero is negative.
            *out = [by_x[i] + 0.0, by_y[i] + 0.0, by_z[i] + 0.0];
        }
    }
}
