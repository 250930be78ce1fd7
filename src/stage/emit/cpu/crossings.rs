//! Where on edges vertices lie, and how they are written: what `emit_vertices` in `shaders/emit/cubes.wgsl` and
//! `shaders/emit/tetrahedra.wgsl` does for fields and volumes alike.
//!
//! Where the shader gives a vertex to an invocation, the twin gathers the crossings of a brick into arrays, some at a time, and the
//! arithmetic of the shader runs over the arrays.

use super::edges::Edge;
use crate::mesh::Vertex;
use crate::stage::inside::Inside;
use crate::stage::method::Placement;
use crate::stage::normals::cpu::{LEAST_GRADIENT, mark};
use crate::stage::params::Params;
use glam::Vec3;

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

    /// Begins with edges of the brick at `origin`, at most `N`.
    #[inline(always)]
    pub(super) fn set(&mut self, params: &Params, origin: [u32; 3], edges: &[Edge]) {
        let mut own = [Edge::default(); N];
        match edges.first_chunk() {
            Some(edges) => own = *edges,
            None => own[..edges.len()].copy_from_slice(edges),
        }
        for (k, first) in origin.into_iter().enumerate() {
            for (i, edge) in own.iter().enumerate() {
                // Less than 2²¹ points along an axis.
                self.start[k][i] = (first + edge.coordinate(k)) as i32 as f32 - params.margin;
                self.axis[k][i] = edge.way(k) as i32 as f32;
            }
        }
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
    pub(super) fn place(&mut self, params: &Params) {
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
    pub(super) fn write(&self, inside: Inside, vectors: &[[f32; N]; 3], vertices: &mut [Vertex]) -> bool {
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
