//! [`Closure`]: a Rust function as a field.

use super::user::UserField;
use super::{Field, NoForm, Points, Sense, Wgsl};
use glam::Vec3;
use std::fmt;

/// A Rust function of the point as a field, for the CPU, and for a GPU if it is given as WGSL too. Normals are
/// central differences, and no brick is culled: what can be written as an [`Expr`](crate::graph::Expr) has more.
///
/// ```
/// use glam::Vec3;
/// use isoforge::{extract::*, field::{Closure, Sense, user::UserField}, grid::Grid};
///
/// let wavy = Closure::new(Sense::Below, |p: Vec3| p.z - (p.x * 4.0).sin() * 0.25);
/// let wgsl = "fn density(p: vec3<f32>) -> f32 { return p.z - sin(p.x * 4.0) * 0.25; }";
/// let wavy = wavy.with_wgsl(UserField::new(wgsl, "wavy", Sense::Below)?); // may be left out
/// let grid = Grid::from_bounds([32; 3], Vec3::NEG_ONE, Vec3::ONE)?;
/// let (mesh, _) = extract_on_cpu(&Source::Field(&wavy, grid), &Options::new(0.0), &|_| {})?;
/// assert!(mesh.triangles.len() > 1000);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Closure<F> {
    function: F,
    sense: Sense,
    wgsl: Option<UserField>,
}

impl<F> fmt::Debug for Closure<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Closure")
            .field("sense", &self.sense)
            .field("wgsl", &self.wgsl)
            .finish_non_exhaustive()
    }
}

impl<F: Fn(Vec3) -> f32 + Send + Sync> Closure<F> {
    /// The function; the same point must always give the same value, from any thread.
    pub fn new(sense: Sense, function: F) -> Self {
        Self { function, sense, wgsl: None }
    }

    /// The same function as WGSL, for GPUs. That both are the same is the caller's word: `isoforge::compare` tells.
    #[must_use]
    pub fn with_wgsl(self, wgsl: UserField) -> Self {
        Self { wgsl: Some(wgsl.as_written()), ..self }
    }
}

impl<F: Fn(Vec3) -> f32 + Send + Sync> Field for Closure<F> {
    fn sense(&self) -> Sense {
        self.sense
    }

    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        points.map(out, |x, y, z| (self.function)(Vec3::new(x, y, z)));
        Ok(())
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        self.wgsl.as_ref().ok_or(NoForm::Gpu)?.wgsl()
    }
}
