//! Differences of a field's values in place of its gradient; twin of `shaders/source/central.wgsl` and
//! `forward.wgsl`.

use super::{Field, NoForm, Points};

/// What the normals of a field's vertices are made of. Volumes have central differences of their samples,
/// whatever is chosen here.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Normals {
    /// The field's own gradient; of a field that has none, [`Normals::Central`] with the step of its default.
    #[default]
    Exact,
    /// From the value at the vertex to those at one step along +x, +y, +z: an error in proportion to the step.
    Forward {
        /// The step in world units, finite and over 0; a hundredth of the grid's shortest step if it is none.
        delta: Option<f32>,
    },
    /// Between the values at one step to both sides: an error in proportion to the step's square.
    Central {
        /// As for [`Normals::Forward`].
        delta: Option<f32>,
    },
}

impl Normals {
    /// The step that was asked for, in world units.
    pub fn delta(self) -> Option<f32> {
        match self {
            Self::Exact => None,
            Self::Forward { delta } | Self::Central { delta } => delta,
        }
    }
}

/// The values at `points`, each moved by `offset` along `axis`, through `moved`.
fn values_beside(
    field: &dyn Field,
    points: Points<'_>,
    (axis, offset): (usize, f32),
    moved: &mut [f32],
    out: &mut [f32],
) -> Result<(), NoForm> {
    let base = [points.x, points.y, points.z][axis];
    moved.iter_mut().zip(base).for_each(|(m, b)| *m = b + offset);
    let mut at = points;
    *[&mut at.x, &mut at.y, &mut at.z][axis] = moved;
    field.values(at, out)
}

/// Forward differences over `delta` world units: the gradients at `points`, `delta` times as long.
///
/// # Errors
/// As [`Field::values`].
pub fn forward(
    field: &dyn Field,
    points: Points<'_>,
    delta: f32,
    out: &mut [[f32; 3]],
) -> Result<(), NoForm> {
    let n = out.len();
    let (mut moved, mut here, mut there) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    field.values(points, &mut here)?;
    for axis in 0..3 {
        values_beside(field, points, (axis, delta), &mut moved, &mut there)?;
        out.iter_mut().zip(there.iter().zip(&here)).for_each(|(g, (t, h))| g[axis] = t - h);
    }
    Ok(())
}

/// Central differences over ± `delta` world units: the gradients at `points`, 2 `delta` times as long.
///
/// # Errors
/// As [`Field::values`].
pub fn central(
    field: &dyn Field,
    points: Points<'_>,
    delta: f32,
    out: &mut [[f32; 3]],
) -> Result<(), NoForm> {
    let n = out.len();
    let (mut moved, mut high, mut low) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for axis in 0..3 {
        values_beside(field, points, (axis, delta), &mut moved, &mut high)?;
        values_beside(field, points, (axis, -delta), &mut moved, &mut low)?;
        out.iter_mut().zip(high.iter().zip(&low)).for_each(|(g, (h, l))| g[axis] = h - l);
    }
    Ok(())
}
