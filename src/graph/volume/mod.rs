//! A sampled volume as a function of the point: [`VolumeLeaf`].

mod ranges;

use super::Expr;
use super::interval::{self as iv, ALL, Interval};
use super::leaf::{DualSlices, Leaf, LeafWgsl};
use crate::field::Points;
use crate::volume::Volume;
use std::sync::Arc;

/// Where between samples a value or a gradient is taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// That of the nearest sample.
    Nearest,
    /// Linear along each axis between the eight samples around the point.
    #[default]
    Trilinear,
}

/// How the gradient is found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Gradient {
    /// Exactly that of the trilinear interpolant, which jumps from cell to cell.
    #[default]
    Exact,
    /// Central differences at the samples (one-sided at the border), between them interpolated so.
    Central(Interpolation),
    /// Sobel's: central differences, of averages over 3³ samples with the weights 1 2 1.
    Sobel(Interpolation),
}

/// The value outside the box of the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Border {
    /// That at the nearest point of the box.
    #[default]
    Clamp,
    /// This.
    Constant(f32),
}

/// How a volume is looked up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Lookup {
    /// Of values.
    pub value: Interpolation,
    /// Of gradients.
    pub gradient: Gradient,
    /// Outside.
    pub border: Border,
}

/// A volume with more samples than 32-bit numbers can address beside its tables.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the volume has {samples} samples, more than {MOST}: crop or coarsen it to use it within a field")]
pub struct VolumeLeafError {
    /// How many there are.
    pub samples: usize,
}

/// The most samples.
pub const MOST: usize = 1 << 31;
const HEADER: usize = 18;
const WGSL: &str = include_str!("../../../shaders/graph/volume.wgsl");

/// A volume as a leaf. Its world position is that of its grid: rotated, sheared, mirrored as the file says.
#[derive(Debug)]
pub struct VolumeLeaf {
    volume: Arc<Volume>,
    lookup: Lookup,
    points: [u32; 3],
    origin: [f32; 3],
    /// Rows of the inverse of the grid's steps.
    to_grid: [[f32; 3]; 3],
    /// Lowest and highest sample of blocks of 4³ cells, then of 8³ and so on, down to no more than 4 blocks along
    /// each axis.
    ranges: Vec<[f32; 2]>,
}

impl VolumeLeaf {
    /// The volume, looked up so.
    ///
    /// # Errors
    /// [`VolumeLeafError`].
    pub fn new(volume: Arc<Volume>, lookup: Lookup) -> Result<Arc<Self>, VolumeLeafError> {
        let samples = volume.values().len();
        if samples > MOST {
            return Err(VolumeLeafError { samples });
        }
        let grid = volume.grid();
        let points = grid.points().to_array();
        let inverse = grid.step().as_dmat3().inverse().as_mat3();
        let to_grid = [0, 1, 2].map(|k| inverse.row(k).to_array());
        let ranges = ranges::ranges(points, volume.values());
        Ok(Arc::new(Self { lookup, points, origin: grid.origin().to_array(), to_grid, ranges, volume }))
    }

    /// As an expression.
    #[must_use]
    pub fn expr(self: &Arc<Self>) -> Expr {
        Expr::leaf(self.clone())
    }

    /// Grid coordinates, and whether the point is inside along each axis.
    #[inline(always)]
    fn place(&self, p: [f32; 3]) -> ([f32; 3], [bool; 3]) {
        let d = [0, 1, 2].map(|k| p[k] - self.origin[k]);
        let mut q = self.to_grid.map(|row| (row[0] * d[0] + row[1] * d[1]) + row[2] * d[2]);
        let mut inside = [true; 3];
        for k in 0..3 {
            let last = (self.points[k] - 1) as f32;
            inside[k] = q[k] >= 0.0 && q[k] <= last;
            // NaN is at the lowest sample.
            q[k] = if q[k] > 0.0 { q[k] } else { 0.0 };
            q[k] = if q[k] < last { q[k] } else { last };
        }
        (q, inside)
    }

    #[inline(always)]
    fn sample(&self, [x, y, z]: [u32; 3]) -> f32 {
        let [nx, ny, _] = self.points.map(|n| n as usize);
        self.volume.values().get(x as usize + nx * (y as usize + ny * z as usize))
    }

    /// Of what `at` gives at the samples.
    #[inline(always)]
    fn interpolate(&self, by: Interpolation, q: [f32; 3], at: impl Fn([u32; 3]) -> f32) -> f32 {
        if by == Interpolation::Nearest {
            return at([0, 1, 2].map(|k| ((q[k] + 0.5).floor() as u32).min(self.points[k] - 1)));
        }
        let (i, f) = self.cell(q);
        let corner = |x, y, z| at([i[0] + x, i[1] + y, i[2] + z]);
        let along_x = |y, z| mix(corner(0, y, z), corner(1, y, z), f[0]);
        let along_y = |z| mix(along_x(0, z), along_x(1, z), f[1]);
        mix(along_y(0), along_y(1), f[2])
    }

    /// The cell, and where in it.
    #[inline(always)]
    fn cell(&self, q: [f32; 3]) -> ([u32; 3], [f32; 3]) {
        let i = [0, 1, 2].map(|k| (q[k] as u32).min(self.points[k] - 2));
        (i, [0, 1, 2].map(|k| q[k] - i[k] as f32))
    }

    fn value(&self, p: [f32; 3]) -> f32 {
        let (q, inside) = self.place(p);
        match self.lookup.border {
            Border::Constant(value) if inside != [true; 3] => value,
            _ => self.interpolate(self.lookup.value, q, |at| self.sample(at)),
        }
    }

    /// By the world's coordinates.
    fn gradient(&self, p: [f32; 3]) -> [f32; 3] {
        let (q, inside) = self.place(p);
        if matches!(self.lookup.border, Border::Constant(_)) && inside != [true; 3] {
            return [0.0; 3];
        }
        let slopes = match self.lookup.gradient {
            Gradient::Exact => self.exact(q),
            Gradient::Central(by) => [0, 1, 2]
                .map(|axis| self.interpolate(by, q, |at| self.difference(at, axis, |at| self.sample(at)))),
            Gradient::Sobel(by) => [0, 1, 2].map(|axis| {
                let other = [(axis + 1) % 3, (axis + 2) % 3];
                let average =
                    |at| self.average(at, other[0], |at| self.average(at, other[1], |at| self.sample(at)));
                self.interpolate(by, q, |at| self.difference(at, axis, average))
            }),
        };
        // Where the value stays as it is, it has no slope.
        let [a, b, c] = [0, 1, 2].map(|k| if inside[k] { slopes[k] } else { 0.0 });
        let [x, y, z] = self.to_grid;
        [0, 1, 2].map(|k| (x[k] * a + y[k] * b) + z[k] * c)
    }

    fn exact(&self, q: [f32; 3]) -> [f32; 3] {
        let (i, f) = self.cell(q);
        let corner = |x, y, z| self.sample([i[0] + x, i[1] + y, i[2] + z]);
        let slope_x = |y, z| corner(1, y, z) - corner(0, y, z);
        let along_x = |y, z| mix(corner(0, y, z), corner(1, y, z), f[0]);
        let slope_y = |z| along_x(1, z) - along_x(0, z);
        let along_y = |z| mix(along_x(0, z), along_x(1, z), f[1]);
        [
            mix(mix(slope_x(0, 0), slope_x(1, 0), f[1]), mix(slope_x(0, 1), slope_x(1, 1), f[1]), f[2]),
            mix(slope_y(0), slope_y(1), f[2]),
            along_y(1) - along_y(0),
        ]
    }

    #[inline(always)]
    fn beside(&self, at: [u32; 3], axis: usize) -> [[u32; 3]; 2] {
        let (mut low, mut high) = (at, at);
        low[axis] = at[axis].saturating_sub(1);
        high[axis] = (at[axis] + 1).min(self.points[axis] - 1);
        [low, high]
    }

    /// Per step of the grid.
    #[inline(always)]
    fn difference(&self, at: [u32; 3], axis: usize, value: impl Fn([u32; 3]) -> f32) -> f32 {
        let [low, high] = self.beside(at, axis);
        let difference = value(high) - value(low);
        if high[axis] - low[axis] == 2 { difference * 0.5 } else { difference }
    }

    /// With the weights 1 2 1; beyond the border the last sample counts.
    #[inline(always)]
    fn average(&self, at: [u32; 3], axis: usize, value: impl Fn([u32; 3]) -> f32) -> f32 {
        let [low, high] = self.beside(at, axis);
        let middle = value(at);
        ((value(low) + value(high)) + (middle + middle)) * 0.25
    }
}

#[inline(always)]
fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

impl Leaf for VolumeLeaf {
    fn values(&self, at: Points<'_>, out: &mut [f32]) {
        at.map(out, |x, y, z| self.value([x, y, z]));
    }

    fn gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        let DualSlices { value, derivatives } = out;
        self.values(at, value);
        for (i, ((&x, &y), &z)) in at.x.iter().zip(at.y).zip(at.z).enumerate() {
            let gradient = self.gradient([x, y, z]);
            (0..3).for_each(|k| derivatives[k][i] = gradient[k]);
        }
    }

    fn interval(&self, at: [Interval; 3]) -> Interval {
        let d = [0, 1, 2].map(|k| iv::sub(at[k], Interval::point(self.origin[k])));
        let along = |row: [f32; 3], k: usize| iv::mul(Interval::point(row[k]), d[k]);
        let q = self.to_grid.map(|row| iv::add(iv::add(along(row, 0), along(row, 1)), along(row, 2)));
        if !q.iter().all(|q| q.is_bounded()) {
            return ALL;
        }
        let mut cells = [[0; 3]; 2];
        let (mut outside, mut none) = (false, false);
        for k in 0..3 {
            let last = (self.points[k] - 1) as f32;
            outside |= q[k].lo < 0.0 || q[k].hi > last;
            none |= q[k].hi < 0.0 || q[k].lo > last;
            let cell = |q: f32| (q.max(0.0).min(last) as u32).min(self.points[k] - 2);
            (cells[0][k], cells[1][k]) = (cell(q[k].lo), cell(q[k].hi));
        }
        match self.lookup.border {
            Border::Constant(value) if none => Interval::point(value),
            Border::Constant(value) if outside => Interval::point(value).hull(self.bounds(cells)),
            _ => self.bounds(cells),
        }
    }

    fn wgsl(&self, name: &str, first: usize) -> LeafWgsl {
        let nearest = |by: Interpolation| by == Interpolation::Nearest;
        let (kind, gradient_nearest) = match self.lookup.gradient {
            Gradient::Exact => (0, false),
            Gradient::Central(by) => (1, nearest(by)),
            Gradient::Sobel(by) => (2, nearest(by)),
        };
        let head = format!(
            "const LEAF_FIRST = {first}u;\nconst LEAF_NEAREST = {};\nconst LEAF_CONSTANT = {};\n\
             const LEAF_KIND = {kind}u;\nconst LEAF_GRADIENT_NEAREST = {gradient_nearest};\n",
            nearest(self.lookup.value),
            matches!(self.lookup.border, Border::Constant(_)),
        );
        LeafWgsl::from_template(&(head + WGSL), name)
    }

    fn data(&self) -> Vec<u32> {
        let mut data = Vec::with_capacity(self.data_bytes() as usize / 4);
        data.extend(self.points);
        data.extend(self.origin.map(f32::to_bits));
        data.extend(self.to_grid.as_flattened().iter().map(|v| v.to_bits()));
        let Border::Constant(border) = self.lookup.border else { return self.fill(data, 0.0) };
        self.fill(data, border)
    }

    fn data_bytes(&self) -> u64 {
        4 * (HEADER + 2 * self.ranges.len() + self.volume.values().len()) as u64
    }
}

impl VolumeLeaf {
    fn fill(&self, mut data: Vec<u32>, border: f32) -> Vec<u32> {
        data.extend([border.to_bits(), HEADER as u32, (HEADER + 2 * self.ranges.len()) as u32]);
        data.extend_from_slice(bytemuck::cast_slice(&self.ranges));
        data.extend(self.volume.values().iter().map(f32::to_bits));
        data
    }
}
