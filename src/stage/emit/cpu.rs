//! CPU twin of `shaders/emit.wgsl`.
//!
//! Where the shader gives a vertex to an invocation, the twin gathers the crossings of a brick into
//! arrays, `LANES` at a time, and the arithmetic of the shader runs over the arrays.

use crate::field::{Field, NoForm, Points};
use crate::mesh::Vertex;
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::{InsideRows, PlaneShape, cell_case, mixed_cells};
use crate::stage::cull::cpu::NO_SLOT;
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use crate::table::Table;
use glam::{UVec3, Vec3};
use multiversion::multiversion;

/// 2⁻⁹⁰: differences below it are taken of scaled numbers. Some drivers flush results below 2⁻¹²⁶ to zero.
const SMALL: f32 = f32::from_bits(37 << 23);
/// 2⁻¹¹⁰: a gradient below it has no direction that every driver agrees on.
const LEAST_GRADIENT: f32 = f32::from_bits(17 << 23);

/// A small number times 2¹⁰⁰; 0 for those that some drivers take for 0 (below 2⁻¹²⁶).
fn scaled(v: f32) -> f32 {
    if v.is_subnormal() { 0.0 } else { v * f32::from_bits(227 << 23) }
}

/// Where between the edge's ends the value is iso; in the middle where the ends do not tell.
fn crossing(iso: f32, a: f32, b: f32) -> f32 {
    // The ends straddle iso: where they lie this close together, all three are small.
    let t = if (b - a).abs() < SMALL {
        (scaled(iso) - scaled(a)) / (scaled(b) - scaled(a))
    } else {
        (iso - a) / (b - a)
    };
    if a.is_finite() && b.is_finite() && t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
}

/// Vertices whose arithmetic is done together.
const LANES: usize = 16;

/// One number a vertex.
type Lane = [f32; LANES];

fn largest(v: Vec3) -> f32 {
    v.x.abs().max(v.y.abs().max(v.z.abs()))
}

/// `v` at unit length, or the fallback where v has no direction. Scaling first keeps the squares from
/// overflowing and underflowing.
pub fn unit_or(v: Vec3, fallback: Vec3) -> Vec3 {
    let known = largest(v) >= LEAST_GRADIENT && v.is_finite();
    let w = if known { v } else { fallback };
    let scaled = w / largest(w);
    scaled / ((scaled.x * scaled.x + scaled.y * scaled.y) + scaled.z * scaled.z).sqrt()
}

/// Crossed edges of a brick, as many as [`LANES`], and their vertices.
struct Crossings {
    /// Grid coordinates of the edges' owners.
    owner: [Lane; 3],
    /// 1 for the edge's axis, 0 for the others.
    axis: [Lane; 3],
    /// The samples at the edges' ends.
    ends: [Lane; 2],
    /// Fractions of the edges at which the vertices lie.
    t: Lane,
    /// World positions of the vertices.
    position: [Lane; 3],
}

impl Crossings {
    #[inline(always)]
    fn new() -> Self {
        let [owner, axis, position] = [[[0.0; LANES]; 3]; 3];
        // Lanes that no edge fills must not look like the rare cases that are done one by one.
        Self { owner, axis, ends: [[0.0; LANES], [1.0; LANES]], t: [0.0; LANES], position }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, owner: [u32; 3], axis: usize, ends: [f32; 2]) {
        for (k, coordinate) in owner.into_iter().enumerate() {
            self.owner[k][i] = coordinate as f32;
            self.axis[k][i] = if k == axis { 1.0 } else { 0.0 };
        }
        self.ends[0][i] = ends[0];
        self.ends[1][i] = ends[1];
    }

    /// From ends to fractions and positions. The fraction is where between the edge's ends the value
    /// is iso; in the middle where the ends do not tell.
    #[inline(always)]
    fn place(&mut self, params: &Params) {
        let [a, b] = &self.ends;
        let mut small = false;
        for i in 0..LANES {
            // `crossing`, without its rare case.
            let t = (params.iso - a[i]) / (b[i] - a[i]);
            small |= (b[i] - a[i]).abs() < SMALL;
            let sure =
                (a[i].abs() < f32::INFINITY) & (b[i].abs() < f32::INFINITY) & (t.abs() < f32::INFINITY);
            let t = if t < 0.0 { 0.0 } else { t };
            let t = if t > 1.0 { 1.0 } else { t };
            self.t[i] = if sure { t } else { 0.5 };
        }
        if small {
            for i in 0..LANES {
                self.t[i] = crossing(params.iso, a[i], b[i]);
            }
        }
        for k in 0..3 {
            let [x, y, z] = [params.step_x[k], params.step_y[k], params.step_z[k]];
            for i in 0..LANES {
                let t = self.t[i];
                let qx = self.owner[0][i] + self.axis[0][i] * t;
                let qy = self.owner[1][i] + self.axis[1][i] * t;
                let qz = self.owner[2][i] + self.axis[2][i] * t;
                self.position[k][i] = params.origin[k] + ((x * qx + y * qy) + z * qz);
            }
        }
    }

    /// Along the edge, out of the solid: the normal where the gradient says nothing.
    fn outwards(&self, params: &Params, inside: Inside, i: usize) -> Vec3 {
        let steps = [params.step_x, params.step_y, params.step_z].map(Vec3::from);
        let axis = (0..3).find(|&axis| self.axis[axis][i] == 1.0).unwrap_or(0);
        if inside.test(self.ends[0][i]) { steps[axis] } else { -steps[axis] }
    }

    /// Writes the vertices with `vectors`, at unit length, as normals.
    #[inline(always)]
    fn write(&self, params: &Params, inside: Inside, vectors: &[Lane; 3], vertices: &mut [Vertex]) {
        let mut normals = [[0.0; LANES]; 3];
        let mut unknown = 0u32;
        let [x, y, z] = vectors;
        for i in 0..LANES {
            // `unit_or`, without its fallback.
            let larger = |a: f32, b: f32| if a > b { a } else { b };
            let most = larger(x[i].abs(), larger(y[i].abs(), z[i].abs()));
            let [sx, sy, sz] = [x[i] / most, y[i] / most, z[i] / most];
            let length = ((sx * sx + sy * sy) + sz * sz).sqrt();
            [normals[0][i], normals[1][i], normals[2][i]] = [sx / length, sy / length, sz / length];
        }
        for i in 0..LANES {
            let finite =
                (x[i].abs() < f32::INFINITY) & (y[i].abs() < f32::INFINITY) & (z[i].abs() < f32::INFINITY);
            let long = (x[i].abs() >= LEAST_GRADIENT)
                | (y[i].abs() >= LEAST_GRADIENT)
                | (z[i].abs() >= LEAST_GRADIENT);
            unknown |= u32::from(!(finite & long));
        }
        for (i, vertex) in vertices.iter_mut().take(LANES).enumerate() {
            let position = [self.position[0][i], self.position[1][i], self.position[2][i]];
            *vertex = Vertex { position, normal: [normals[0][i], normals[1][i], normals[2][i]] };
        }
        if unknown != 0 {
            for (i, vertex) in vertices.iter_mut().take(LANES).enumerate() {
                let vector = Vec3::new(x[i], y[i], z[i]);
                vertex.normal = unit_or(vector, self.outwards(params, inside, i)).into();
            }
        }
    }
}

/// The crossed owned edges of a brick, in the order of its vertices.
struct Edges<'a> {
    rows: &'a [u32; 64],
    /// Rows begun.
    begun: usize,
    /// What is left of the last two of them: two rows a word, since branches on how many edges a row
    /// has are often mispredicted.
    left: u64,
}

impl<'a> Edges<'a> {
    #[inline(always)]
    fn new(record: &'a BrickRecord) -> Self {
        Self { rows: &record.rows, begun: 0, left: 0 }
    }
}

impl Iterator for Edges<'_> {
    /// x, y, z of the owner in the brick, and the axis.
    type Item = ([u32; 3], usize);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        while self.left == 0 {
            let pair = self.rows.get(self.begun..self.begun + 2)?;
            self.left = u64::from(pair[0] & 0xff_ffff) | u64::from(pair[1] & 0xff_ffff) << 32;
            self.begun += 2;
        }
        let bit = self.left.trailing_zeros();
        self.left &= self.left - 1;
        let row = self.begun as u32 - 2 + bit / 32;
        Some(([bit % 8, row % 8, row / 8], (bit % 32 / 8) as usize))
    }
}

/// The vertices of a brick of a volume: normals from central differences at both ends of the edge,
/// interpolated as the vertex is (Lorensen & Cline 1987).
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
pub fn emit_volume_vertices(
    params: &Params,
    inside: Inside,
    values: &[f32],
    origin: UVec3,
    record: &BrickRecord,
    vertices: &mut [Vertex],
) {
    let (first, points) = (origin.to_array(), params.points);
    let interior = first.iter().zip(points).all(|(&first, n)| first > 0 && first + 9 < n);
    if interior {
        volume_vertices::<true>(params, inside, values, first, record, vertices);
    } else {
        volume_vertices::<false>(params, inside, values, first, record, vertices);
    }
}

#[inline(always)]
fn volume_vertices<const INTERIOR: bool>(
    params: &Params,
    inside: Inside,
    values: &[f32],
    origin: [u32; 3],
    record: &BrickRecord,
    vertices: &mut [Vertex],
) {
    let [nx, ny, _] = params.points.map(|n| n as usize);
    let pitch = [1, nx, nx * ny];
    let mut edges = Edges::new(record);
    let mut batch = Crossings::new();
    // At both ends of the edges, along the axes.
    let mut slopes = [[[1.0; LANES]; 3]; 2];
    for vertices in vertices.chunks_mut(LANES) {
        for (i, ([x, y, z], axis)) in (0..vertices.len()).zip(&mut edges) {
            let mut point = [origin[0] + x, origin[1] + y, origin[2] + z];
            let at = point[0] as usize + nx * (point[1] as usize + ny * point[2] as usize);
            let next = at + pitch[axis];
            batch.set(i, point, axis, [values[at], values[next]]);
            for k in 0..3 {
                slopes[0][k][i] = slope::<INTERIOR>(params, values, at, pitch[k], k, point[k]);
            }
            point[axis] += 1;
            for k in 0..3 {
                slopes[1][k][i] = slope::<INTERIOR>(params, values, next, pitch[k], k, point[k]);
            }
        }
        batch.place(params);
        let mut vectors = [[0.0; LANES]; 3];
        let [a, b] = &slopes;
        for (k, vector) in vectors.iter_mut().enumerate() {
            let [x, y, z] = [params.outward_x[k], params.outward_y[k], params.outward_z[k]];
            for i in 0..LANES {
                let t = batch.t[i];
                let gx = a[0][i] + (b[0][i] - a[0][i]) * t;
                let gy = a[1][i] + (b[1][i] - a[1][i]) * t;
                let gz = a[2][i] + (b[2][i] - a[2][i]) * t;
                vector[i] = (x * gx + y * gy) + z * gz;
            }
        }
        batch.write(params, inside, &vectors, vertices);
    }
}

/// The difference per grid step along axis `k` at the value `at`, whose coordinate along the axis is
/// `coordinate`: central inside, one-sided at the border.
#[inline(always)]
fn slope<const INTERIOR: bool>(
    params: &Params,
    values: &[f32],
    at: usize,
    pitch: usize,
    k: usize,
    coordinate: u32,
) -> f32 {
    if INTERIOR {
        return (values[at + pitch] - values[at - pitch]) * 0.5;
    }
    let lower = coordinate > 0;
    let upper = coordinate < params.points[k] - 1;
    let low = values[at - if lower { pitch } else { 0 }];
    let high = values[at + if upper { pitch } else { 0 }];
    if lower && upper { (high - low) * 0.5 } else { high - low }
}

/// The vertices of a brick of a field: normals from the field's gradients at the vertices.
///
/// # Errors
/// [`NoForm::Cpu`].
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
pub fn emit_field_vertices(
    params: &Params,
    inside: Inside,
    field: &dyn Field,
    origin: UVec3,
    samples: &Samples<'_>,
    record: &BrickRecord,
    vertices: &mut [Vertex],
) -> Result<(), NoForm> {
    field_vertices(params, inside, field, origin.to_array(), samples, record, vertices)
}

#[inline(always)]
fn field_vertices(
    params: &Params,
    inside: Inside,
    field: &dyn Field,
    origin: [u32; 3],
    samples: &Samples<'_>,
    record: &BrickRecord,
    vertices: &mut [Vertex],
) -> Result<(), NoForm> {
    let mut edges = Edges::new(record);
    let mut batch = Crossings::new();
    for vertices in vertices.chunks_mut(LANES) {
        for (i, (local, axis)) in (0..vertices.len()).zip(&mut edges) {
            let [x, y, z] = local.map(|n| n as usize);
            let a = samples.at(x, y, z);
            let b = samples.at(
                x + usize::from(axis == 0),
                y + usize::from(axis == 1),
                z + usize::from(axis == 2),
            );
            let owner = [origin[0] + local[0], origin[1] + local[1], origin[2] + local[2]];
            batch.set(i, owner, axis, [a, b]);
        }
        batch.place(params);
        let count = vertices.len();
        let mut gradients = [[1.0; 3]; LANES];
        let [x, y, z] = &batch.position;
        let points = Points { x: &x[..count], y: &y[..count], z: &z[..count] };
        field.gradients(points, params.delta, &mut gradients[..count])?;
        let mut vectors = [[0.0; LANES]; 3];
        for (k, vector) in vectors.iter_mut().enumerate() {
            for i in 0..LANES {
                vector[i] = gradients[i][k] * params.outward_sign;
            }
        }
        batch.write(params, inside, &vectors, vertices);
    }
    Ok(())
}

/// A brick's record and first vertex, for each of the eight bricks from (0,0,0) to (1,1,1) beside a
/// brick: the owners of its cells' edges.
pub struct Beside<'a>([Option<(&'a BrickRecord, u32)>; 8]);

impl<'a> Beside<'a> {
    /// Looks the bricks up in the brick map.
    #[inline(always)]
    pub fn new(
        params: &Params,
        slots: &[u32],
        records: &'a [BrickRecord],
        offsets: &[[u32; 2]],
        brick: u32,
    ) -> Self {
        let [nx, ny, _] = params.slab_extent;
        Self([0, 1, 2, 3, 4, 5, 6, 7].map(|i: u32| {
            let beside = brick + (i & 1) + nx * ((i >> 1 & 1) + ny * (i >> 2));
            let slot = *slots.get(beside as usize)?;
            (slot != NO_SLOT).then(|| (&records[slot as usize], offsets[slot as usize][0]))
        }))
    }
}

/// The numbers of the vertices on the edges of a brick's cells; scratch of [`emit_indices`].
///
/// The edges of row (y, z), y and z from 0 to 8, begin at `ROW * (y + 9 z)`: those along x of points
/// 0–7, then those along y and those along z of points 0–8. Only crossed edges have a number, others
/// what an earlier brick left there.
pub struct EdgeNumbers(Box<[u32; 4096]>);

/// Entries a row of points: along x, y and z at [`ALONG`].
const ROW: u32 = 32;
const ALONG: [u32; 3] = [0, 8, 17];

/// From the entry of a cell's lowest corner to that of its edge.
const EDGES: [u32; 16] = {
    let mut places = [0; 16];
    let mut edge = 0;
    while edge < 12 {
        let (axis, one, two) = (edge >> 2, edge & 1, edge >> 1 & 1);
        let [dx, dy, dz] = match axis {
            0 => [0, one, two],
            1 => [one, 0, two],
            _ => [one, two, 0],
        };
        places[edge as usize] = ROW * (dy + 9 * dz) + ALONG[axis as usize] + dx;
        edge += 1;
    }
    places
};

impl Default for EdgeNumbers {
    fn default() -> Self {
        Self::new()
    }
}

impl EdgeNumbers {
    /// Room for one brick.
    pub fn new() -> Self {
        Self(Box::new([0; 4096]))
    }

    /// The number on an edge (the low four bits of `edge`) of the cell at `place`.
    #[inline(always)]
    fn of(&self, place: u32, edge: u64) -> u32 {
        self.0[(place + EDGES[(edge & 15) as usize]) as usize % 4096]
    }

    #[inline(always)]
    fn at(&mut self, place: u32) -> &mut u32 {
        &mut self.0[place as usize % 4096]
    }

    /// Numbers the edges that a brick's cells touch.
    #[inline(always)]
    fn fill(&mut self, beside: &Beside<'_>) {
        // A crossed edge's owner is always active: its two ends straddle iso.
        if let Some((record, first)) = beside.0[0] {
            for (([x, y, z], axis), number) in Edges::new(record).zip(first..) {
                *self.at(ROW * (y + 9 * z) + ALONG[axis] + x) = number;
            }
        }
        for z in 0..8 {
            self.row(beside, 2, 8, z);
        }
        for y in 0..8 {
            self.row(beside, 4, y, 8);
        }
        self.row(beside, 6, 8, 8);
        for z in 0..8 {
            for y in 0..8 {
                self.next_along_x(beside, 1, y, z);
            }
            self.next_along_x(beside, 3, 8, z);
        }
        for y in 0..8 {
            self.next_along_x(beside, 5, y, 8);
        }
    }

    /// Numbers the edges of points 0–7 of row (y, z), which lies in brick `i` of those beside.
    #[inline(always)]
    fn row(&mut self, beside: &Beside<'_>, i: usize, y: u32, z: u32) {
        let Some((record, first)) = beside.0[i] else { return };
        let (mut edges, mut number) = row_start(record, first, y, z);
        while edges != 0 {
            let bit = edges.trailing_zeros();
            edges &= edges - 1;
            *self.at(ROW * (y + 9 * z) + ALONG[(bit / 8) as usize] + bit % 8) = number;
            number += 1;
        }
    }

    /// Numbers the edges of point 8 of row (y, z), which lies in brick `i` of those beside.
    #[inline(always)]
    fn next_along_x(&mut self, beside: &Beside<'_>, i: usize, y: u32, z: u32) {
        let Some((record, first)) = beside.0[i] else { return };
        let (edges, number) = row_start(record, first, y, z);
        let place = ROW * (y + 9 * z) + 8;
        *self.at(place + ALONG[1]) = number + (edges & 0xff).count_ones();
        *self.at(place + ALONG[2]) = number + (edges & 0xffff).count_ones();
    }
}

/// The crossed edges of a row, and the number of the vertex on the first of them.
#[inline(always)]
fn row_start(record: &BrickRecord, first: u32, y: u32, z: u32) -> (u32, u32) {
    let (y, z) = (y as usize % 8, z as usize % 8);
    let row = record.rows[y + 8 * z];
    (row & 0xff_ffff, first + (record.planes[z] & 0xffff) + (row >> 24))
}

/// The triangles of a brick, as vertex numbers of the whole mesh.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
pub fn emit_indices(
    params: &Params,
    table: &Table,
    inside: Inside,
    samples: &Samples<'_>,
    beside: &Beside<'_>,
    numbers: &mut EdgeNumbers,
    triangles: &mut [[u32; 3]],
) {
    indices(params, table, inside, samples, beside, numbers, triangles);
}

#[inline(always)]
fn indices(
    params: &Params,
    table: &Table,
    inside: Inside,
    samples: &Samples<'_>,
    beside: &Beside<'_>,
    numbers: &mut EdgeNumbers,
    triangles: &mut [[u32; 3]],
) {
    let rows = InsideRows::new(samples, inside);
    numbers.fill(beside);
    let mut left = triangles;
    for z in 0..8 {
        let corners = rows.corners(z);
        let mut mixed = mixed_cells(&corners, PlaneShape::new(samples.extent, z));
        while mixed != 0 {
            let cell = mixed.trailing_zeros();
            mixed &= mixed - 1;
            let place = ROW * (cell / 8 + 9 * z as u32) + cell % 8;
            let packed = table.packed(cell_case(&corners, cell));
            let count = (packed & 15) as usize;
            let mut edges = packed >> 4;
            let mut next = || {
                let [a, b, c] =
                    [numbers.of(place, edges), numbers.of(place, edges >> 4), numbers.of(place, edges >> 8)];
                edges >>= 12;
                if params.mirrored == 1 { [a, c, b] } else { [a, b, c] }
            };
            // Most cells have one or two triangles: two are written without asking, and the second
            // is overwritten by the next cell where it is none of this one's.
            if count <= 2
                && let Some(two) = left.first_chunk_mut()
            {
                *two = [next(), next()];
            } else {
                left.iter_mut().take(count).for_each(|triangle| *triangle = next());
            }
            let done = count.min(left.len());
            left = std::mem::take(&mut left).split_at_mut(done).1;
        }
    }
}
