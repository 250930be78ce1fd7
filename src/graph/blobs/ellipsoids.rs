//! Sums of components that are turned and stretched: [`Ellipsoids`].
//!
//! As [`Blobs`](super::Blobs), but the distance is taken in the component's own axes: q = |M (p − centre)|², the rows
//! of M being the axes, each divided by how far the component reaches along it. The lookup grids know of the ball
//! around each. The shader is that of the blobs, with `LEAF_TURNED`.

use super::bounds::{LESS, MORE, Sums};
use super::grid::{self, Grid};
use super::kernel::{Blobby, InverseSquare, Kernel, Metaball, Profile, SoftObject};
use super::sum::{corners, nearest};
use super::{BlobsError, Component, Data, Stored, bounds, store};
use crate::field::Points;
use crate::graph::Expr;
use crate::graph::interval::{ALL, Interval};
use crate::graph::leaf::{DualSlices, Leaf, LeafWgsl};
use glam::{Mat3, Quat, Vec3};
use multiversion::multiversion;
use std::any::Any;
use std::ops::Range;
use std::sync::Arc;

/// A component that is stretched along its own axes, and turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    /// Its centre, radius and weight.
    pub component: Component,
    /// How its axes lie.
    pub rotation: Quat,
    /// Factors of the radius along its axes.
    pub scale: Vec3,
}

/// Centre, rows of M and weight, as the shader reads them.
type Turned = [f32; 13];

/// By how much more the balls of the grids reach than the components: rounding must not let one be missed.
const ROOM: f32 = 1.0 + 1e-5;
/// Points whose sums are kept in registers, and those that are looked at together.
const LANES: usize = 16;
/// Cells above which points are looked at apart.
const MOST_CELLS: u64 = 1000;
/// 2⁻²⁰: part of the magnitudes by which a place along an axis may be off where a driver contracts.
const OFF: f32 = 1.0 / 1_048_576.0;

/// A sum of turned and stretched components. Above iso is inside.
#[derive(Debug)]
pub struct Ellipsoids {
    kernel: Kernel,
    /// In the order of the sums.
    components: Vec<Turned>,
    /// The balls around them.
    balls: Vec<Stored>,
    grids: Vec<Grid>,
    slack: f32,
}

impl Ellipsoids {
    /// The sum of `components`; a component adds exactly 0 outside the ellipsoid of its radius times its scale.
    /// Takes time and memory in proportion to the components.
    ///
    /// # Errors
    /// [`BlobsError`] names the first component that cannot be used.
    pub fn new(kernel: Kernel, components: &[Ellipsoid]) -> Result<Arc<Self>, BlobsError> {
        super::check(kernel, components.len())?;
        let both: Result<Vec<_>, _> = components
            .iter()
            .enumerate()
            .map(|(index, ellipsoid)| turned(kernel, index, ellipsoid))
            .collect();
        let (components, balls): (Vec<Turned>, Vec<Stored>) = both?.into_iter().unzip();
        let (order, balls, grids) = grid::arrange(&balls, kernel.value(0.0));
        let components: Vec<Turned> = order.iter().map(|&i| components[i as usize]).collect();
        let slack = bounds::slack(components.len());
        Ok(Arc::new(Self { kernel, components, balls, grids, slack }))
    }

    /// As an expression.
    #[must_use]
    pub fn expr(self: &Arc<Self>) -> Expr {
        Expr::leaf(self.clone())
    }

    /// Puts the components that may reach a box into `list`; `false` if the box is better taken in parts.
    fn reaching(&self, [low, high]: [[f32; 3]; 2], single: bool, list: &mut Vec<Turned>) -> bool {
        list.clear();
        for grid in &self.grids {
            let Some([first, last]) = grid.cells(low, high) else { continue };
            let cells: u64 = [0, 1, 2].map(|k| u64::from(last[k] - first[k] + 1)).iter().product();
            if cells > MOST_CELLS && !single {
                return false;
            }
            for i in grid.runs([first, last]).flatten() {
                if nearest(&self.balls[i], low, high, 1.0) < 1.0 {
                    list.push(self.components[i]);
                }
            }
        }
        true
    }

    /// Hands on groups of points with what reaches them.
    fn each(&self, at: Points<'_>, mut take: impl FnMut(&[Turned], Range<usize>)) {
        let mut list = Vec::new();
        for start in (0..at.x.len()).step_by(LANES) {
            let group = start..(start + LANES).min(at.x.len());
            if self.reaching(corners(at, &group), group.len() == 1, &mut list) {
                take(&list, group);
                continue;
            }
            for i in group {
                self.reaching(corners(at, &(i..i + 1)), true, &mut list);
                take(&list, i..i + 1);
            }
        }
    }
}

/// How a component is stored, and the ball around it.
fn turned(kernel: Kernel, index: usize, ellipsoid: &Ellipsoid) -> Result<(Turned, Stored), BlobsError> {
    let Ellipsoid { component, rotation, scale } = *ellipsoid;
    if !(scale.is_finite() && scale.min_element() > 0.0) {
        return Err(BlobsError::Scale { index, scale: scale.to_array() });
    }
    if !(rotation.is_finite() && rotation.length() > 1e-3) {
        return Err(BlobsError::Rotation { index, rotation: rotation.to_array() });
    }
    let own = store(kernel, index, &component)?;
    // Both ends must be in range.
    store(kernel, index, &Component { radius: component.radius * scale.min_element(), ..component })?;
    let ball = Component { radius: component.radius * scale.max_element() * ROOM, ..component };
    let mut ball = store(kernel, index, &ball)?;
    ball[4] = own[4];
    let axes = Mat3::from_quat(rotation.normalize());
    let [x, y, z] = component.position;
    let mut stored = [x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, own[4]];
    for k in 0..3 {
        let row = axes.col(k) / (component.radius * scale[k]);
        stored[3 + 3 * k..6 + 3 * k].copy_from_slice(&row.to_array());
    }
    Ok((stored, ball))
}

/// A row of M.
#[inline(always)]
fn row(component: &Turned, k: usize) -> [f32; 3] {
    [component[3 + 3 * k], component[4 + 3 * k], component[5 + 3 * k]]
}

/// The point in the component's axes.
#[inline(always)]
fn place(component: &Turned, [x, y, z]: [f32; 3]) -> [f32; 3] {
    let (dx, dy, dz) = (x - component[0], y - component[1], z - component[2]);
    let along = |k: usize| {
        let [a, b, c] = row(component, k);
        (a * dx + b * dy) + c * dz
    };
    [along(0), along(1), along(2)]
}

/// Coordinates of up to [`LANES`] points; what is left repeats the first.
#[inline(always)]
fn lanes(at: Points<'_>, own: &Range<usize>) -> [[f32; LANES]; 3] {
    [at.x, at.y, at.z].map(|axis| {
        let mut lanes = [axis[own.start]; LANES];
        lanes[..own.len()].copy_from_slice(&axis[own.clone()]);
        lanes
    })
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn values(kernel: Kernel, list: &[Turned], at: &[[f32; LANES]; 3]) -> [f32; LANES] {
    match kernel {
        Kernel::SoftObject => values_of(SoftObject, list, at),
        Kernel::Metaball => values_of(Metaball, list, at),
        Kernel::Blobby { .. } => values_of(Blobby(kernel.falloff()), list, at),
        Kernel::InverseSquare => values_of(InverseSquare, list, at),
    }
}

#[inline(always)]
fn values_of(profile: impl Profile, list: &[Turned], [x, y, z]: &[[f32; LANES]; 3]) -> [f32; LANES] {
    let mut sums = [0.0; LANES];
    for component in list {
        for i in 0..LANES {
            let [a, b, c] = place(component, [x[i], y[i], z[i]]);
            sums[i] += component[12] * profile.value((a * a + b * b) + c * c);
        }
    }
    sums
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn gradients(kernel: Kernel, list: &[Turned], at: &[[f32; LANES]; 3]) -> [[f32; LANES]; 4] {
    match kernel {
        Kernel::SoftObject => gradients_of(SoftObject, list, at),
        Kernel::Metaball => gradients_of(Metaball, list, at),
        Kernel::Blobby { .. } => gradients_of(Blobby(kernel.falloff()), list, at),
        Kernel::InverseSquare => gradients_of(InverseSquare, list, at),
    }
}

#[inline(always)]
fn gradients_of(profile: impl Profile, list: &[Turned], [x, y, z]: &[[f32; LANES]; 3]) -> [[f32; LANES]; 4] {
    let mut sums = [[0.0; LANES]; 4];
    for component in list {
        let rows = [0, 1, 2].map(|k| row(component, k));
        for i in 0..LANES {
            let [a, b, c] = place(component, [x[i], y[i], z[i]]);
            let q = (a * a + b * b) + c * c;
            if q < 1.0 {
                let slope = component[12] * profile.slope(q);
                let twice = slope + slope;
                sums[0][i] += component[12] * profile.value(q);
                for k in 0..3 {
                    sums[k + 1][i] += twice * ((rows[0][k] * a + rows[1][k] * b) + rows[2][k] * c);
                }
            }
        }
    }
    sums
}

/// The least and the largest q of a component over a box, and a little to either side.
#[inline(always)]
fn range(component: &Turned, low: [f32; 3], high: [f32; 3]) -> [f32; 2] {
    let (mut least, mut most) = ([0.0; 3], [0.0; 3]);
    for k in 0..3 {
        let row = row(component, k);
        let [mut lows, mut highs, mut sizes] = [[0.0f32; 3]; 3];
        for axis in 0..3 {
            let a = row[axis] * (low[axis] - component[axis]);
            let b = row[axis] * (high[axis] - component[axis]);
            lows[axis] = a.min(b);
            highs[axis] = a.max(b);
            sizes[axis] = a.abs().max(b.abs());
        }
        let off = ((sizes[0] + sizes[1]) + sizes[2]) * OFF;
        let lo = ((lows[0] + lows[1]) + lows[2]) - off;
        let hi = ((highs[0] + highs[1]) + highs[2]) + off;
        least[k] = if lo > 0.0 {
            lo * lo
        } else if hi < 0.0 {
            hi * hi
        } else {
            0.0
        };
        most[k] = (lo * lo).max(hi * hi);
    }
    [((least[0] + least[1]) + least[2]) * LESS, ((most[0] + most[1]) + most[2]) * MORE]
}

impl Leaf for Ellipsoids {
    fn values(&self, at: Points<'_>, out: &mut [f32]) {
        self.each(at, |list, own| {
            let sums = values(self.kernel, list, &lanes(at, &own));
            out[own.clone()].copy_from_slice(&sums[..own.len()]);
        });
    }

    fn gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        let DualSlices { value, derivatives: [by_x, by_y, by_z] } = out;
        self.each(at, |list, own| {
            let sums = gradients(self.kernel, list, &lanes(at, &own));
            for (out, sums) in [&mut *value, &mut *by_x, &mut *by_y, &mut *by_z].into_iter().zip(&sums) {
                out[own.clone()].copy_from_slice(&sums[..own.len()]);
            }
        });
    }

    fn interval(&self, at: [Interval; 3]) -> Interval {
        let Some([low, high]) = bounds::corners(at) else { return ALL };
        let mut sums = Sums::default();
        for grid in &self.grids {
            let Some(cells) = grid.cells(low, high) else { continue };
            if bounds::is_coarse(cells) {
                sums.add_peaks(grid, cells);
                continue;
            }
            for component in grid.runs(cells).flat_map(|run| &self.components[run]) {
                let [least, most] = range(component, low, high);
                if least < 1.0 {
                    sums.add(
                        component[12] * self.kernel.value(least),
                        component[12] * self.kernel.value(most),
                    );
                }
            }
        }
        sums.interval(self.slack)
    }

    fn is_same(&self, other: &dyn Leaf, at: [Interval; 3]) -> bool {
        let Some(other) = (other as &dyn Any).downcast_ref::<Self>() else { return false };
        let Some(around @ [low, high]) = bounds::corners(at) else { return false };
        let is_coarse =
            |of: &Self| of.grids.iter().any(|grid| grid.cells(low, high).is_some_and(bounds::is_coarse));
        if self.kernel != other.kernel || is_coarse(self) || is_coarse(other) {
            return false;
        }
        let [mut own, mut others] = [Vec::new(), Vec::new()];
        self.reaching(around, true, &mut own);
        other.reaching(around, true, &mut others);
        let [own, others]: [&[[u32; 13]]; 2] = [&own[..], &others[..]].map(bytemuck::cast_slice);
        own == others
    }

    fn wgsl(&self, name: &str, first: usize) -> LeafWgsl {
        super::wgsl(self.kernel, true, name, first)
    }

    fn data(&self) -> Vec<u32> {
        Data::of(&self.grids, self.slack, &self.components).words()
    }

    fn data_bytes(&self) -> u64 {
        Data::of(&self.grids, self.slack, &self.components).bytes()
    }
}
