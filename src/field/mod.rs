//! Density fields: what the sample stage evaluates.
//!
//! [`Field`] is the one trait between fields and extraction. A field says which side of iso is
//! inside, and gives values and gradients on the CPU over slices of points, on the GPU as WGSL
//! text, or both. [`named`] has the fields with a name, [`user`] the WGSL functions of users, [`Closure`] is a Rust
//! function.

mod closure;
pub mod differences;
mod extent;
pub mod functions;
pub mod named;
pub mod noise;
mod project;
mod surface;
pub(crate) mod unit;
pub mod user;

pub use closure::Closure;
pub use extent::{extent, sampled_extent};
pub use project::{Projection, project};
pub(crate) use project::{Search, search};
pub use surface::Surface;

use crate::graph::GraphField;
use crate::graph::interval::{ALL, Interval};
use std::fmt;
use std::sync::Arc;

/// Which side of the iso value is inside the solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// Distance-like: inside is below the iso value (spheres, tori, CSG distances).
    Below,
    /// Density-like: inside is above the iso value (blobs, CT volumes).
    Above,
}

/// Points in world units, one slice a coordinate, all of one length.
#[derive(Debug, Clone, Copy)]
pub struct Points<'a> {
    /// x of each point.
    pub x: &'a [f32],
    /// y of each point.
    pub y: &'a [f32],
    /// z of each point.
    pub z: &'a [f32],
}

impl Points<'_> {
    /// Calls `f(x, y, z)` for every point and stores what it gives in `out`.
    #[inline(always)]
    pub fn map<T>(&self, out: &mut [T], f: impl Fn(f32, f32, f32) -> T) {
        for (((out, &x), &y), &z) in out.iter_mut().zip(self.x).zip(self.y).zip(self.z) {
            *out = f(x, y, z);
        }
    }
}

/// A field as WGSL text.
#[derive(Debug, Clone, PartialEq)]
pub struct Wgsl {
    /// Defines `fn density(p: vec3<f32>) -> f32`. This and the others may read `field_parameters[i]`
    /// (`vec4<f32>`, i < [`PARAMETER_VECTORS`]), and call what [`functions`] and
    /// [`noise`] have (there `sin_turns` and `cos_turns`, the others as `iso_exp` and so on).
    ///
    /// The text stands among the crate's shaders, in one scope with them. So give every other name at its top level a
    /// prefix of your own (`my_helper`), none of `iso_`, `iv_`, `density` and `field_`, and leave out entry points, bindings,
    /// `enable` and `override`; all numbers are `f32`, `i32`, `u32` or `bool`. What does not compile fails with
    /// [`GpuError::FieldWgsl`](crate::gpu::GpuError::FieldWgsl). [`user`] takes any names: it rewrites them.
    pub value: Arc<str>,
    /// Defines `fn density_gradient(p: vec3<f32>) -> vec3<f32>`, without `value` beside it, and no name that `value`
    /// defines: the refiner has both; or `value` is a part of it. Where there is none, central differences are taken.
    pub gradient: Option<Arc<str>>,
    /// Defines `fn density_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32>`: bounds of the
    /// values over a box, lowest first ([`crate::graph::interval`]). Where there is none, no brick is culled.
    pub interval: Option<Arc<str>>,
    /// `value` in parts, by which samples are taken in grids along the world's axes. Where there are none, each sample is
    /// taken by itself.
    pub planes: Option<Planes>,
    /// What `field_data` (`array<u32>`) holds: lists and samples that the source reads.
    pub data: Arc<[u32]>,
    /// What `field_parameters` holds. Changing these compiles nothing.
    pub parameters: Vec<f32>,
    /// Whether the source counts the iterations of its loops and stops those that run away
    /// ([`user`] says how).
    pub counts_loops: bool,
}

/// A field's value in parts: what takes x and y alone is the same in all planes of a grid along the world's axes, what
/// takes z alone in all of a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Planes {
    /// Defines, without [`Wgsl::value`] beside it, `struct DensityPlane`, `fn density_plane(p: vec3<f32>) -> DensityPlane`,
    /// which reads no z, `struct DensityLevel`, `fn density_level(p: vec3<f32>) -> DensityLevel`, which reads z alone, and `fn
    /// density_in_plane(plane: DensityPlane, level: DensityLevel) -> f32`, which gives what `value` does.
    pub text: Arc<str>,
    /// Bytes of a `DensityPlane` and of a `DensityLevel`.
    pub bytes: [u32; 2],
}

/// Vectors of parameters that a field may have on the GPU.
pub const PARAMETER_VECTORS: usize = 1024;

/// Why a field cannot be evaluated in a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoForm {
    /// Nothing evaluates the field on the CPU.
    #[error("this field is a WGSL function, which only a GPU evaluates: extract it with an `Extractor`")]
    Cpu,
    /// The field has no WGSL.
    #[error("this field has no WGSL form: give it WGSL (`Closure::with_wgsl`), or extract on the CPU")]
    Gpu,
    /// The field has no gradient of its own.
    #[error("this field has no exact gradient: take differences of its values")]
    Gradient,
}

/// What is known of a field in a box.
#[derive(Debug, Clone)]
pub struct Within {
    /// Bounds of the values that its own arithmetic gives there.
    pub range: Interval,
    /// A simpler field that has the same values and gradients there, bit for bit.
    pub field: Option<Arc<dyn Field>>,
}

/// Values at many points at once that lie in a lattice.
pub trait LatticeValues {
    /// The values at every x of `axes` with every y and every z, x fastest; those that [`Field::values`] gives, bit for
    /// bit. `false`, and nothing known of `out`, where the axes are not made for it.
    fn lattice_values(&self, axes: [&[f32]; 3], out: &mut [f32]) -> bool;

    /// About how many points, taken by [`Field::values`], are as much work as a lattice of the 9³ of a brick, where they are
    /// sure to be more than a brick's crossed edges have; else 0.
    fn points_as_a_brick(&self) -> usize {
        0
    }
}

/// A density field over world space.
///
/// Either of [`Field::values`] and [`Field::wgsl`] may be missing, not both.
pub trait Field: Send + Sync + fmt::Debug {
    /// Which side of iso is inside.
    fn sense(&self) -> Sense;

    /// The values at `points`, into `out` (as long as each slice of `points`).
    ///
    /// # Errors
    /// [`NoForm::Cpu`] if only a GPU evaluates the field.
    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm>;

    /// A way to the values at a lattice's points that is faster, if there is one.
    fn lattice(&self) -> Option<&dyn LatticeValues> {
        None
    }

    /// The exact gradients at `points`, of any length: only the direction is used. By default there are none,
    /// and [`differences`] stand in.
    ///
    /// # Errors
    /// [`NoForm::Gradient`] if the field has none; as [`Field::values`].
    fn gradients(&self, points: Points<'_>, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        let _ = (points, out);
        Err(NoForm::Gradient)
    }

    /// What is known of the field in a box of points (x, y, z): bounds of its values, and a simpler field
    /// that is the same there. By default nothing.
    fn within(&self, region: [Interval; 3]) -> Within {
        let _ = region;
        Within { range: ALL, field: None }
    }

    /// The bounds of [`Field::within`] alone.
    fn range(&self, region: [Interval; 3]) -> Interval {
        self.within(region).range
    }

    /// The expression that the field is, if it is one: two of them can be compared, so that an edit takes only what it
    /// changed ([`Incremental`](crate::extract::Incremental)).
    fn as_graph(&self) -> Option<&GraphField> {
        None
    }

    /// The field as WGSL.
    ///
    /// # Errors
    /// [`NoForm::Gpu`] if only the CPU evaluates the field.
    fn wgsl(&self) -> Result<Wgsl, NoForm>;
}
