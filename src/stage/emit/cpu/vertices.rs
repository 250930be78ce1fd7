//! CPU twin of `emit_vertices` in `shaders/emit/cubes.wgsl` and `shaders/emit/tetrahedra.wgsl`.
//!
//! Where the shader gives a vertex to an invocation, the twin gathers the crossings of a brick into
//! arrays, `LANES` at a time, and the arithmetic of the shader runs over the arrays.

use super::snap::snap;
use super::tetrahedra;
use crate::field::differences::{Normals, central, forward};
use crate::field::{Field, NoForm, Points};
use crate::mesh::Vertex;
use crate::stage::classify::BrickRecord;
use crate::stage::inside::Inside;
use crate::stage::method::{Method, Placement};
use crate::stage::normals::cpu::{LEAST_GRADIENT, mark};
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use crate::volume::values::each_type;
use crate::volume::{Sample, Values};
use glam::{UVec3, Vec3};
use multiversion::multiversion;

/// 2⁻⁹⁰: differences below it are taken of scaled numbers. Some drivers flush results below 2⁻¹²⁶ to zero.
const SMALL: f32 = f32::from_bits(37 << 23);

/// 2¹⁰⁰, of either sign: the sample of a point beyond a closed border (src/extract/cap.rs). The vertex lies at the edge's other end.
pub const FAR: f32 = f32::from_bits(227 << 23);

/// A small number times 2¹⁰⁰; 0 for those that some drivers take for 0 (below 2⁻¹²⁶).
fn scaled(v: f32) -> f32 {
    if v.is_subnormal() { 0.0 } else { v * f32::from_bits(227 << 23) }
}

pub(super) fn is_beyond(a: f32, b: f32) -> bool {
    a.abs() == FAR || b.abs() == FAR
}

/// Where between the edge's ends the value is iso; in the middle where the ends do not tell.
pub(super) fn crossing(iso: f32, a: f32, b: f32) -> f32 {
    if is_beyond(a, b) {
        return if a.abs() == FAR { 1.0 } else { 0.0 };
    }
    // The ends straddle iso: where they lie this close together, all three are small.
    let t = if (b - a).abs() < SMALL {
        (scaled(iso) - scaled(a)) / (scaled(b) - scaled(a))
    } else if (b - a).is_infinite() {
        // Both are large, and of either sign.
        (0.5 * iso - 0.5 * a) / (0.5 * b - 0.5 * a)
    } else {
        (iso - a) / (b - a)
    };
    if a.is_finite() && b.is_finite() && t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
}

/// Where on its edge the samples at the ends place a vertex.
pub(super) fn unsnapped(params: &Params, a: f32, b: f32) -> f32 {
    match params.placement {
        Placement::Midpoint if !is_beyond(a, b) => 0.5,
        Placement::Linear | Placement::Midpoint | Placement::Snapped { .. } => crossing(params.iso, a, b),
    }
}

/// Vertices whose arithmetic is done together.
const LANES: usize = 16;
/// Of fields: as many as their evaluators take at a time.
const FIELD_LANES: usize = crate::graph::eval::LANES;

/// Crossed edges of a brick, as many as `N`, and their vertices.
pub(super) struct Crossings<const N: usize> {
    /// Where the edges, or lines of any direction, begin, in grid steps in the domain.
    start: [[f32; N]; 3],
    /// 1 for the axes that the edge goes along, 0 for the others; or how far a line goes along each.
    pub(super) axis: [[f32; N]; 3],
    /// The samples at the edges' ends.
    pub(super) ends: [[f32; N]; 2],
    /// Fractions of the edges at which the vertices lie.
    pub(super) t: [f32; N],
    /// World positions of the vertices.
    pub(super) position: [[f32; N]; 3],
}

impl<const N: usize> Crossings<N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let [start, axis, position] = [[[0.0; N]; 3]; 3];
        // Lanes that no edge fills must not look like the rare cases that are done one by one.
        Self { start, axis, ends: [[0.0; N], [1.0; N]], t: [0.0; N], position }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, margin: f32, owner: [u32; 3], direction: usize, ends: [f32; 2]) {
        for (k, coordinate) in owner.into_iter().enumerate() {
            self.start[k][i] = coordinate as f32 - margin;
            self.axis[k][i] = if direction >> k & 1 == 1 { 1.0 } else { 0.0 };
        }
        self.ends[0][i] = ends[0];
        self.ends[1][i] = ends[1];
    }

    /// A line of any direction: from `q` on, `way` along the grid's axes.
    pub(super) fn set_line(&mut self, i: usize, p: Vec3, way: Vec3) {
        for k in 0..3 {
            self.start[k][i] = p[k];
            self.axis[k][i] = way[k];
        }
    }

    /// From ends to fractions and positions.
    #[inline(always)]
    fn place(&mut self, params: &Params) {
        match params.placement {
            Placement::Midpoint => {
                for i in 0..N {
                    self.t[i] = unsnapped(params, self.ends[0][i], self.ends[1][i]);
                }
            }
            Placement::Linear | Placement::Snapped { .. } => self.cross(params),
        }
        self.position(params);
    }

    /// From ends to fractions: where between the edge's ends the value is iso; in the middle where the ends do not tell.
    #[inline(always)]
    fn cross(&mut self, params: &Params) {
        let [a, b] = &self.ends;
        let mut rare = false;
        for i in 0..N {
            // `crossing`, without its rare cases.
            let t = (params.iso - a[i]) / (b[i] - a[i]);
            let way = (b[i] - a[i]).abs();
            rare |= (way < SMALL) | (way == f32::INFINITY) | (a[i].abs() == FAR) | (b[i].abs() == FAR);
            let sure =
                (a[i].abs() < f32::INFINITY) & (b[i].abs() < f32::INFINITY) & (t.abs() < f32::INFINITY);
            let t = if t < 0.0 { 0.0 } else { t };
            let t = if t > 1.0 { 1.0 } else { t };
            self.t[i] = if sure { t } else { 0.5 };
        }
        if rare {
            for i in 0..N {
                self.t[i] = crossing(params.iso, a[i], b[i]);
            }
        }
    }

    /// From fractions to positions.
    #[inline(always)]
    pub(super) fn position(&mut self, params: &Params) {
        for k in 0..3 {
            let [x, y, z] = [params.step_x[k], params.step_y[k], params.step_z[k]];
            for i in 0..N {
                let t = self.t[i];
                let qx = self.start[0][i] + self.axis[0][i] * t;
                let qy = self.start[1][i] + self.axis[1][i] * t;
                let qz = self.start[2][i] + self.axis[2][i] * t;
                self.position[k][i] = params.origin[k] + ((x * qx + y * qy) + z * qz);
            }
        }
    }

    /// The mark of a vertex whose gradient says nothing.
    fn mark(&self, inside: Inside, i: usize) -> [f32; 3] {
        let axis = (0..3).find(|&axis| self.axis[axis][i] == 1.0).unwrap_or(0);
        mark(axis, !inside.test(self.ends[0][i]))
    }

    /// Writes the vertices with `vectors`, at unit length, as normals; tells whether any had to be marked.
    #[inline(always)]
    fn write(&self, inside: Inside, vectors: &[[f32; N]; 3], vertices: &mut [Vertex]) -> bool {
        let mut normals = [[0.0; N]; 3];
        let mut unknown = 0u64;
        let [x, y, z] = vectors;
        for i in 0..N {
            // `unit`.
            let larger = |a: f32, b: f32| if a > b { a } else { b };
            let most = larger(x[i].abs(), larger(y[i].abs(), z[i].abs()));
            let [sx, sy, sz] = [x[i] / most, y[i] / most, z[i] / most];
            let length = ((sx * sx + sy * sy) + sz * sz).sqrt();
            // Plus 0: −0 becomes +0.
            [normals[0][i], normals[1][i], normals[2][i]] =
                [sx / length + 0.0, sy / length + 0.0, sz / length + 0.0];
        }
        for i in 0..N {
            let finite =
                (x[i].abs() < f32::INFINITY) & (y[i].abs() < f32::INFINITY) & (z[i].abs() < f32::INFINITY);
            let long = (x[i].abs() >= LEAST_GRADIENT)
                | (y[i].abs() >= LEAST_GRADIENT)
                | (z[i].abs() >= LEAST_GRADIENT);
            unknown |= u64::from(!(finite & long)) << i;
        }
        for (i, vertex) in vertices.iter_mut().take(N).enumerate() {
            let position = [self.position[0][i], self.position[1][i], self.position[2][i]];
            *vertex = Vertex { position, normal: [normals[0][i], normals[1][i], normals[2][i]] };
        }
        let mut marked = false;
        if unknown != 0 {
            for (i, vertex) in vertices.iter_mut().take(N).enumerate() {
                if unknown >> i & 1 == 1 {
                    vertex.normal = self.mark(inside, i);
                    marked = true;
                }
            }
        }
        marked
    }
}

/// The crossed owned edges of a brick, in the order of its vertices.
pub(super) struct Edges<'a> {
    rows: &'a [u32; 64],
    /// Rows begun.
    begun: usize,
    /// What is left of the last two of them: two rows a word, since branches on how many edges a row
    /// has are often mispredicted.
    left: u64,
}

impl<'a> Edges<'a> {
    #[inline(always)]
    pub(super) fn new(record: &'a BrickRecord) -> Self {
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

/// Edges with their directions as numbers of the corner they lead to, as all methods have them.
struct Directed<'a>(Edges<'a>);

impl Iterator for Directed<'_> {
    type Item = ([u32; 3], usize);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        self.0.next().map(|(owner, axis)| (owner, 1 << axis))
    }
}

/// The vertices on the edges of a brick of a volume: normals from central differences at both ends of the edge,
/// interpolated as the vertex is (Lorensen & Cline 1987). Tells whether any had to be marked for the normals stage.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
pub fn emit_volume_vertices(
    params: &Params,
    inside: Inside,
    values: &Values,
    origin: UVec3,
    record: &BrickRecord,
    vertices: &mut [Vertex],
) -> bool {
    let first = origin.to_array();
    match params.method {
        Method::MarchingCubes | Method::Mc33 => {
            of_volume(params, inside, values, first, Directed(Edges::new(record)), vertices)
        }
        Method::Tetrahedra => {
            let extent = [0, 1, 2].map(|k| (params.points[k] - first[k]).min(9) as usize);
            let edges = tetrahedra::Edges::new(record.tetrahedra(), extent);
            of_volume(params, inside, values, first, edges, vertices)
        }
    }
}

#[inline(always)]
fn of_volume(
    params: &Params,
    inside: Inside,
    values: &Values,
    first: [u32; 3],
    edges: impl Iterator<Item = ([u32; 3], usize)>,
    vertices: &mut [Vertex],
) -> bool {
    let interior = first.iter().zip(params.points).all(|(&first, n)| first > 0 && first + 9 < n);
    each_type!(Values, values, samples => if interior {
        volume_vertices::<_, true>(params, inside, samples, first, edges, vertices)
    } else {
        volume_vertices::<_, false>(params, inside, samples, first, edges, vertices)
    })
}

#[inline(always)]
fn volume_vertices<T: Sample, const INTERIOR: bool>(
    params: &Params,
    inside: Inside,
    values: &[T],
    origin: [u32; 3],
    mut edges: impl Iterator<Item = ([u32; 3], usize)>,
    vertices: &mut [Vertex],
) -> bool {
    let [nx, ny, _] = params.source_extent.map(|n| n as usize);
    let first = params.source_first;
    let pitch = [1, nx, nx * ny];
    // To the other end of an edge, by its direction.
    let across: [usize; 8] = std::array::from_fn(|d| (d & 1) + (d >> 1 & 1) * nx + (d >> 2) * (nx * ny));
    let mut batch = Crossings::<LANES>::new();
    // At both ends of the edges, along the axes.
    let mut slopes = [[[1.0; LANES]; 3]; 2];
    let mut marked = false;
    for vertices in vertices.chunks_mut(LANES) {
        for (i, ([x, y, z], direction)) in (0..vertices.len()).zip(&mut edges) {
            let mut point = [origin[0] + x, origin[1] + y, origin[2] + z];
            let [x, y, z] = [0, 1, 2].map(|k| (point[k] - first[k]) as usize);
            let at = x + nx * (y + ny * z);
            let next = at + across[direction];
            batch.set(i, params.margin, point, direction, [values[at].to_f32(), values[next].to_f32()]);
            for k in 0..3 {
                slopes[0][k][i] = slope::<T, INTERIOR>(params, values, at, pitch[k], k, point[k]);
            }
            for (k, coordinate) in point.iter_mut().enumerate() {
                *coordinate += (direction >> k & 1) as u32;
            }
            for k in 0..3 {
                slopes[1][k][i] = slope::<T, INTERIOR>(params, values, next, pitch[k], k, point[k]);
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
        marked |= batch.write(inside, &vectors, vertices);
    }
    marked
}

/// The difference per grid step along axis `k` at the value `at`, whose coordinate along the axis is
/// `coordinate`: central inside, one-sided at the border.
#[inline(always)]
fn slope<T: Sample, const INTERIOR: bool>(
    params: &Params,
    values: &[T],
    at: usize,
    pitch: usize,
    k: usize,
    coordinate: u32,
) -> f32 {
    if INTERIOR {
        return (values[at + pitch].to_f32() - values[at - pitch].to_f32()) * 0.5;
    }
    let lower = coordinate > 0;
    let upper = coordinate < params.points[k] - 1;
    let low = values[at - if lower { pitch } else { 0 }].to_f32();
    let high = values[at + if upper { pitch } else { 0 }].to_f32();
    if lower && upper { (high - low) * 0.5 } else { high - low }
}

/// Where the normals of a brick of a field come from.
#[derive(Debug, Clone, Copy)]
pub struct Gradients<'a> {
    /// How.
    pub normals: Normals,
    /// The field as it is within the brick.
    pub here: &'a dyn Field,
    /// The field as it is everywhere: differences reach out of the brick.
    pub whole: &'a dyn Field,
}

impl Gradients<'_> {
    pub(super) fn at(&self, points: Points<'_>, delta: f32, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        match self.normals {
            Normals::Exact => match self.here.gradients(points, out) {
                Err(NoForm::Gradient) => central(self.whole, points, delta, out),
                done => done,
            },
            Normals::Central { .. } => central(self.whole, points, delta, out),
            Normals::Forward { .. } => forward(self.whole, points, delta, out),
        }
    }
}

/// The vertices on the edges of a brick of a field: normals from the field's gradients at the vertices. Tells whether any
/// had to be marked for the normals stage.
///
/// # Errors
/// [`NoForm::Cpu`].
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
pub fn emit_field_vertices(
    params: &Params,
    inside: Inside,
    field: &Gradients<'_>,
    origin: UVec3,
    samples: &Samples<'_>,
    record: &BrickRecord,
    vertices: &mut [Vertex],
) -> Result<bool, NoForm> {
    let origin = origin.to_array();
    match params.method {
        Method::MarchingCubes | Method::Mc33 => {
            field_vertices(params, inside, field, origin, samples, Directed(Edges::new(record)), vertices)
        }
        Method::Tetrahedra => {
            let edges = tetrahedra::Edges::new(record.tetrahedra(), samples.extent);
            field_vertices(params, inside, field, origin, samples, edges, vertices)
        }
    }
}

#[inline(always)]
fn field_vertices(
    params: &Params,
    inside: Inside,
    field: &Gradients<'_>,
    origin: [u32; 3],
    samples: &Samples<'_>,
    mut edges: impl Iterator<Item = ([u32; 3], usize)>,
    vertices: &mut [Vertex],
) -> Result<bool, NoForm> {
    let mut batch = Crossings::<FIELD_LANES>::new();
    let mut marked = false;
    for vertices in vertices.chunks_mut(FIELD_LANES) {
        for (i, (local, direction)) in (0..vertices.len()).zip(&mut edges) {
            let [x, y, z] = local.map(|n| n as usize);
            let a = samples.at(x, y, z);
            let b = samples.at(x + (direction & 1), y + (direction >> 1 & 1), z + (direction >> 2));
            let owner = [origin[0] + local[0], origin[1] + local[1], origin[2] + local[2]];
            batch.set(i, params.margin, owner, direction, [a, b]);
        }
        batch.place(params);
        let count = vertices.len();
        if matches!(params.placement, Placement::Snapped { .. }) {
            snap(&mut batch, params, inside, field.here, count)?;
        }
        let mut gradients = [[1.0; 3]; FIELD_LANES];
        let [x, y, z] = &batch.position;
        let points = Points { x: &x[..count], y: &y[..count], z: &z[..count] };
        field.at(points, params.delta, &mut gradients[..count])?;
        let mut vectors = [[0.0; FIELD_LANES]; 3];
        for (k, vector) in vectors.iter_mut().enumerate() {
            for i in 0..FIELD_LANES {
                vector[i] = gradients[i][k] * params.outward_sign;
            }
        }
        marked |= batch.write(inside, &vectors, vertices);
    }
    Ok(marked)
}

/// Of a brick of `extent` samples with one record before and another after: the number that each vertex before has after,
/// `first` being that of the brick's first vertex; nothing of those on edges that are no longer crossed, and of those
/// within cells.
pub fn renumber_brick(
    method: Method,
    extent: [usize; 3],
    [before, after]: [&BrickRecord; 2],
    first: u32,
    numbers: &mut [u32],
) {
    match method {
        Method::MarchingCubes | Method::Mc33 => {
            renumber(Directed(Edges::new(before)), Directed(Edges::new(after)), first, numbers);
        }
        Method::Tetrahedra => {
            let [before, after] =
                [before, after].map(|record| tetrahedra::Edges::new(record.tetrahedra(), extent));
            renumber(before, after, first, numbers);
        }
    }
}

fn renumber<E: Iterator<Item = ([u32; 3], usize)>>(before: E, after: E, first: u32, numbers: &mut [u32]) {
    let mut now = (first..).zip(after).peekable();
    let place = |([x, y, z], direction): ([u32; 3], usize)| (z, y, direction, x);
    for (to, edge) in numbers.iter_mut().zip(before) {
        while now.next_if(|(_, other)| place(*other) < place(edge)).is_some() {}
        if let Some((number, _)) = now.next_if(|(_, other)| *other == edge) {
            *to = number;
        }
    }
}
