//! CPU twin of `shaders/emit.wgsl`.

use crate::field::{Field, NoForm, Points};
use crate::mesh::Vertex;
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::{InsideRows, RowShape, cell_case, mixed_cells};
use crate::stage::cull::cpu::NO_SLOT;
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use crate::table::Table;
use glam::{UVec3, Vec3};

/// 2⁻⁹⁰: differences below it are taken of scaled numbers. Some drivers flush results below 2⁻¹²⁶ to zero.
const SMALL: f32 = f32::from_bits(37 << 23);
/// 2⁻¹¹⁰: a gradient below it has no direction that every driver agrees on.
const LEAST_GRADIENT: f32 = f32::from_bits(17 << 23);

/// A small number times 2¹⁰⁰; 0 for those that some drivers take for 0 (below 2⁻¹²⁶).
#[inline(always)]
fn scaled(v: f32) -> f32 {
    if v.is_subnormal() { 0.0 } else { v * f32::from_bits(227 << 23) }
}

/// Where between the edge's ends the value is iso; in the middle where the ends do not tell.
#[inline(always)]
pub fn crossing(iso: f32, a: f32, b: f32) -> f32 {
    // The ends straddle iso: where they lie this close together, all three are small.
    let t = if (b - a).abs() < SMALL {
        (scaled(iso) - scaled(a)) / (scaled(b) - scaled(a))
    } else {
        (iso - a) / (b - a)
    };
    if a.is_finite() && b.is_finite() && t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
}

fn largest(v: Vec3) -> f32 {
    v.x.abs().max(v.y.abs().max(v.z.abs()))
}

/// `v` at unit length, or the fallback where v has no direction. Scaling first keeps the squares from
/// overflowing and underflowing.
#[inline(always)]
pub fn unit_or(v: Vec3, fallback: Vec3) -> Vec3 {
    let known = largest(v) >= LEAST_GRADIENT && v.is_finite();
    let w = if known { v } else { fallback };
    let scaled = w / largest(w);
    scaled / ((scaled.x * scaled.x + scaled.y * scaled.y) + scaled.z * scaled.z).sqrt()
}

/// A vertex before its normal is known.
struct Crossing {
    owner: UVec3,
    axis: UVec3,
    t: f32,
    position: Vec3,
    /// Along the edge, out of the solid: the normal where the gradient says nothing.
    outwards: Vec3,
}

/// Calls `found` for every crossed owned edge of the brick, in the order of its vertices.
#[inline(always)]
fn crossings(
    params: &Params,
    inside: Inside,
    origin: UVec3,
    samples: &Samples<'_>,
    record: &BrickRecord,
    mut found: impl FnMut(Crossing),
) {
    let steps = [params.step_x, params.step_y, params.step_z].map(Vec3::from);
    for (row, word) in record.rows.iter().enumerate() {
        let (y, z) = (row % 8, row / 8);
        let mut edges = word & 0xff_ffff;
        while edges != 0 {
            let bit = edges.trailing_zeros() as usize;
            edges &= edges - 1;
            let (x, axis) = (bit % 8, bit / 8);
            let a = samples.at(x, y, z);
            let b = samples.at(
                x + usize::from(axis == 0),
                y + usize::from(axis == 1),
                z + usize::from(axis == 2),
            );
            let t = crossing(params.iso, a, b);
            let owner = origin + UVec3::new(x as u32, y as u32, z as u32);
            let axis_vector = UVec3::from([0, 1, 2].map(|i| u32::from(i == axis)));
            let position = params.grid_position(owner.as_vec3() + axis_vector.as_vec3() * t);
            let along = steps[axis];
            let outwards = if inside.test(a) { along } else { -along };
            found(Crossing { owner, axis: axis_vector, t, position, outwards });
        }
    }
}

/// The vertices of a brick of a volume: normals from central differences at both ends of the edge,
/// interpolated as the vertex is (Lorensen & Cline 1987).
#[inline(always)]
pub fn emit_volume_vertices(
    params: &Params,
    inside: Inside,
    values: &[f32],
    origin: UVec3,
    record: &BrickRecord,
    vertices: &mut [Vertex],
) {
    let samples = Samples::of_volume(values, params.points, origin);
    let outward = [params.outward_x, params.outward_y, params.outward_z].map(Vec3::from);
    let mut out = vertices.iter_mut();
    crossings(params, inside, origin, &samples, record, |c| {
        let a = volume_gradient(params.points, values, c.owner);
        let b = volume_gradient(params.points, values, c.owner + c.axis);
        let g = a + (b - a) * c.t;
        let vector = (outward[0] * g.x + outward[1] * g.y) + outward[2] * g.z;
        if let Some(vertex) = out.next() {
            let normal = unit_or(vector, c.outwards);
            *vertex = Vertex { position: c.position.into(), normal: normal.into() };
        }
    });
}

/// Differences per grid step along each axis: central inside, one-sided at the border.
#[inline(always)]
fn volume_gradient(points: [u32; 3], values: &[f32], point: UVec3) -> Vec3 {
    let [nx, ny, _] = points.map(|n| n as usize);
    let pitch = [1, nx, nx * ny];
    let point = point.to_array();
    let at = point[0] as usize + nx * (point[1] as usize + ny * point[2] as usize);
    Vec3::from([0, 1, 2].map(|axis| {
        let lower = point[axis] > 0;
        let upper = point[axis] < points[axis] - 1;
        let low = values[at - if lower { pitch[axis] } else { 0 }];
        let high = values[at + if upper { pitch[axis] } else { 0 }];
        if lower && upper { (high - low) * 0.5 } else { high - low }
    }))
}

/// The vertices of a brick of a field: normals from the field's gradients at the vertices.
///
/// # Errors
/// [`NoForm::Cpu`].
pub fn emit_field_vertices(
    params: &Params,
    inside: Inside,
    field: &dyn Field,
    origin: UVec3,
    samples: &Samples<'_>,
    record: &BrickRecord,
    vertices: &mut [Vertex],
) -> Result<(), NoForm> {
    let count = vertices.len();
    let mut at = [0; 3].map(|_| Vec::with_capacity(count));
    let mut fallbacks = Vec::with_capacity(count);
    crossings(params, inside, origin, samples, record, |c| {
        at.iter_mut().zip(c.position.to_array()).for_each(|(list, v)| list.push(v));
        fallbacks.push(c.outwards);
    });
    let mut gradients = vec![[0.0; 3]; count];
    let points = Points { x: &at[0], y: &at[1], z: &at[2] };
    field.gradients(points, params.delta, &mut gradients)?;
    for (i, vertex) in vertices.iter_mut().enumerate() {
        let vector = Vec3::from(gradients[i]) * params.outward_sign;
        let normal = unit_or(vector, fallbacks[i]).into();
        *vertex = Vertex { position: [at[0][i], at[1][i], at[2][i]], normal };
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
        let [nx, ny, _] = params.bricks;
        Self([0, 1, 2, 3, 4, 5, 6, 7].map(|i: u32| {
            let beside = brick + (i & 1) + nx * ((i >> 1 & 1) + ny * (i >> 2));
            let slot = *slots.get((beside - params.first_brick) as usize)?;
            (slot != NO_SLOT).then(|| (&records[slot as usize], offsets[slot as usize][0]))
        }))
    }

    /// Number of the vertex on edge `edge` of the cell at (x, y, z) of the brick.
    #[inline(always)]
    fn vertex_on(&self, edge: u32, x: u32, y: u32, z: u32) -> u32 {
        let (axis, one, two) = (edge >> 2, edge & 1, edge >> 1 & 1);
        let [dx, dy, dz] = match axis {
            0 => [0, one, two],
            1 => [one, 0, two],
            _ => [one, two, 0],
        };
        let (x, y, z) = (x + dx, y + dy, z + dz);
        let owner = (x >> 3) + (y >> 3) * 2 + (z >> 3) * 4;
        // A crossed edge's owner is always active: its two ends straddle iso.
        let Some((record, first)) = self.0[owner as usize] else { return 0 };
        let (x, y, z) = (x & 7, y & 7, z & 7);
        let row = record.rows[(y + 8 * z) as usize];
        let earlier = row & ((1 << (8 * axis + x)) - 1);
        first + (record.planes[z as usize] & 0xffff) + (row >> 24) + earlier.count_ones()
    }
}

/// The triangles of a brick, as vertex numbers of the whole mesh.
#[inline(always)]
pub fn emit_indices(
    params: &Params,
    table: &Table,
    inside: Inside,
    samples: &Samples<'_>,
    beside: &Beside<'_>,
    triangles: &mut [[u32; 3]],
) {
    let rows = InsideRows::new(samples, inside);
    let mut out = triangles.iter_mut();
    for z in 0..8 {
        for y in 0..8 {
            let (bits, shape) = (rows.four(y, z), RowShape::new(samples.extent, y, z));
            let mut mixed = mixed_cells(bits, shape);
            while mixed != 0 {
                let x = mixed.trailing_zeros();
                mixed &= mixed - 1;
                let mut packed = table.packed(cell_case(bits, x));
                let count = packed & 15;
                packed >>= 4;
                for _ in 0..count {
                    let [a, b, c] = [packed & 15, packed >> 4 & 15, packed >> 8 & 15]
                        .map(|edge| beside.vertex_on(edge as u32, x, y as u32, z as u32));
                    packed >>= 12;
                    if let Some(triangle) = out.next() {
                        *triangle = if params.mirrored == 1 { [a, c, b] } else { [a, b, c] };
                    }
                }
            }
        }
    }
}
