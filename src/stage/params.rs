//! What every stage is told ([`Params`]) and what the GPU counts meanwhile ([`Work`]).

use super::inside::order_key;
use super::method::{Method, Placement};
use crate::field::Sense;
use crate::field::differences::Normals;
use crate::grid::Grid;
use bytemuck::{Pod, Zeroable};
use glam::{UVec3, Vec3};

/// The settings of one run over one slab and batch, as the CPU twins have them. The shaders have them in two parts
/// (`shaders/shared/params.wgsl`): [`Params::uniform`] and [`Params::call`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs, reason = "each field is described in the shader")]
pub struct Params {
    /// Kernels are compiled for these two.
    pub method: Method,
    pub placement: Placement,
    pub epsilon: f32,
    pub origin: [f32; 3],
    pub delta: f32,
    pub step_x: [f32; 3],
    pub iso: f32,
    pub step_y: [f32; 3],
    pub iso_key: u32,
    pub step_z: [f32; 3],
    pub flip: u32,
    pub outward_x: [f32; 3],
    pub outward_sign: f32,
    pub outward_y: [f32; 3],
    pub mirrored: u32,
    pub outward_z: [f32; 3],
    pub first_slot: u32,
    pub points: [u32; 3],
    pub own_bricks: u32,
    pub slab_first: [u32; 3],
    pub slab_bricks: u32,
    pub slab_extent: [u32; 3],
    pub margin: f32,
    pub first_triangle: u32,
    pub source_first: [u32; 3],
    pub triangle_window: u32,
    pub source_extent: [u32; 3],
    pub triangle_capacity: u32,
    pub first_vertices: [u32; 4],
    pub vertex_window: u32,
    pub vertex_capacity: u32,
    pub neighbour_window: u32,
    pub neighbour_capacity: u32,
}

/// What stays from frame to frame; `Params` of the shaders, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "each field is described in the shader")]
pub struct Uniform {
    pub origin: [f32; 3],
    pub delta: f32,
    pub step_x: [f32; 3],
    pub mirrored: u32,
    pub step_y: [f32; 3],
    pub first_triangle: u32,
    pub step_z: [f32; 3],
    pub triangle_window: u32,
    pub outward_x: [f32; 3],
    pub vertex_window: u32,
    pub outward_y: [f32; 3],
    pub neighbour_window: u32,
    pub outward_z: [f32; 3],
    pub neighbour_capacity: u32,
    pub points: [u32; 3],
    pub own_bricks: u32,
    pub slab_first: [u32; 3],
    pub slab_bricks: u32,
    pub slab_extent: [u32; 3],
    pub margin: f32,
    pub source_first: [u32; 3],
    pub nothing: u32,
    pub source_extent: [u32; 3],
    pub unused_c: u32,
    pub first_vertices: [u32; 4],
}

/// What may change from call to call; `Call` of the shaders, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "each field is described in the shader")]
pub struct Call {
    pub iso: f32,
    pub iso_key: u32,
    pub flip: u32,
    pub outward_sign: f32,
    pub first_slot: u32,
    pub vertex_capacity: u32,
    pub triangle_capacity: u32,
    pub epsilon: f32,
}

/// Differences are taken over this part of the shortest step unless the caller says.
const DELTA: f64 = 0.01;

impl Params {
    /// The settings of a run over the whole of `grid` in one slab and batch.
    pub fn new(grid: &Grid, iso: f32, sense: Sense) -> Self {
        let flip = match sense {
            Sense::Below => 0,
            Sense::Above => u32::MAX,
        };
        // The gradient points towards growing values: outwards where inside is below.
        let sign = if flip == 0 { 1.0 } else { -1.0 };
        let (step, outward) = (grid.step(), grid.gradient_to_world() * sign);
        let bricks = grid.brick_count() as u32;
        Self {
            method: Method::MarchingCubes,
            placement: Placement::Linear,
            epsilon: 0.0,
            origin: grid.domain_origin().into(),
            // GPUs may take smaller numbers for zero.
            delta: ((grid.shortest_step() * DELTA) as f32).max(f32::MIN_POSITIVE),
            step_x: step.x_axis.into(),
            iso,
            step_y: step.y_axis.into(),
            iso_key: order_key(iso.to_bits()) ^ flip,
            step_z: step.z_axis.into(),
            flip,
            outward_x: outward.x_axis.into(),
            outward_sign: sign,
            outward_y: outward.y_axis.into(),
            mirrored: grid.is_mirrored().into(),
            outward_z: outward.z_axis.into(),
            first_slot: 0,
            points: grid.points().into(),
            own_bricks: bricks,
            slab_first: [0; 3],
            slab_bricks: bricks,
            slab_extent: grid.bricks().into(),
            margin: grid.margin(),
            first_triangle: 0,
            source_first: [0; 3],
            triangle_window: 0,
            source_extent: grid.points().into(),
            triangle_capacity: u32::MAX,
            first_vertices: [0; 4],
            vertex_window: 0,
            vertex_capacity: u32::MAX,
            neighbour_window: 0,
            neighbour_capacity: 0,
        }
    }

    /// What the shaders have that stays from frame to frame.
    pub fn uniform(&self) -> Uniform {
        // The sign is the call's; taking it out and putting it in again changes no bit.
        let unsigned = |column: [f32; 3]| column.map(|v| v * self.outward_sign);
        Uniform {
            origin: self.origin,
            delta: self.delta,
            step_x: self.step_x,
            mirrored: self.mirrored,
            step_y: self.step_y,
            first_triangle: self.first_triangle,
            step_z: self.step_z,
            triangle_window: self.triangle_window,
            outward_x: unsigned(self.outward_x),
            vertex_window: self.vertex_window,
            outward_y: unsigned(self.outward_y),
            neighbour_window: self.neighbour_window,
            outward_z: unsigned(self.outward_z),
            neighbour_capacity: self.neighbour_capacity,
            points: self.points,
            own_bricks: self.own_bricks,
            slab_first: self.slab_first,
            slab_bricks: self.slab_bricks,
            slab_extent: self.slab_extent,
            margin: self.margin,
            source_first: self.source_first,
            nothing: 0,
            source_extent: self.source_extent,
            unused_c: 0,
            first_vertices: self.first_vertices,
        }
    }

    /// What the shaders have that may change from call to call.
    pub fn call(&self) -> Call {
        Call {
            iso: self.iso,
            iso_key: self.iso_key,
            flip: self.flip,
            outward_sign: self.outward_sign,
            first_slot: self.first_slot,
            vertex_capacity: self.vertex_capacity,
            triangle_capacity: self.triangle_capacity,
            epsilon: self.epsilon,
        }
    }

    /// The step of differences that `normals` asks for, if it does.
    #[must_use]
    pub fn with_normals(self, normals: Normals) -> Self {
        // As in `new`.
        let delta = normals.delta().map_or(self.delta, |delta| delta.max(f32::MIN_POSITIVE));
        Self { delta, ..self }
    }

    /// With cells that become triangles as `method` says, and vertices where `placement` does.
    #[must_use]
    pub fn with_method(self, method: Method, placement: Placement) -> Self {
        Self { method, placement, epsilon: placement.epsilon(), ..self }
    }

    /// Lowest point of a brick of the slab.
    #[inline(always)]
    pub fn brick_origin(&self, brick: u32) -> UVec3 {
        let [x, y, _] = self.slab_extent;
        (UVec3::from(self.slab_first) + UVec3::new(brick % x, brick / x % y, brick / (x * y))) * 8
    }

    /// Points of a brick of the slab along x, y, z: nine, at the grid's end fewer.
    #[inline(always)]
    pub fn extent(&self, brick: u32) -> [usize; 3] {
        let origin = self.brick_origin(brick).to_array();
        [0, 1, 2].map(|k| (self.points[k] - origin[k]).min(9) as usize)
    }

    /// Whether the grid's axes are those of the world.
    pub fn is_aligned(&self) -> bool {
        [self.step_x[1], self.step_x[2], self.step_y[0], self.step_y[2], self.step_z[0], self.step_z[1]]
            == [0.0; 6]
    }

    /// World position of what lies `within` a cell, in grid steps from a point of it; of points, as [`Grid::position`].
    #[inline(always)]
    pub fn grid_position(&self, point: Vec3, within: Vec3) -> Vec3 {
        self.domain_position((point - self.margin) + within)
    }

    /// World position of what lies that many grid steps in the domain.
    #[inline(always)]
    pub fn domain_position(&self, p: Vec3) -> Vec3 {
        let [x, y, z] = [self.step_x, self.step_y, self.step_z].map(Vec3::from);
        Vec3::from(self.origin) + ((x * p.x + y * p.y) + z * p.z)
    }
}

/// What the GPU counts of a slab while it works; `shaders/shared/work.wgsl`, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "each field is described in the shader")]
pub struct Work {
    pub active_bricks: u32,
    pub own_active: u32,
    pub vertices: u32,
    pub triangles: u32,
    pub non_finite: u32,
    pub runaway: u32,
    pub batch_slots: u32,
    pub batches: u32,
    pub run_slots: [u32; 4],
    pub run_vertices: [u32; 4],
    pub singular: u32,
    pub queued: u32,
    pub taken: u32,
    pub rounds: u32,
    pub slots: u32,
    pub needed_slots: u32,
    pub large_boxes: u32,
    pub small_boxes: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_difference_step_of_tiny_and_huge_grids() {
        for size in [1e-36f32, 1e-22, 1e-3, 1.0, 1e30, 1e37] {
            let grid = Grid::from_bounds([16; 3], Vec3::splat(-size), Vec3::splat(size)).unwrap();
            let delta = Params::new(&grid, 0.0, Sense::Below).delta;
            assert!((delta / (size / 800.0) - 1.0).abs() < 1e-5 || size < 1e-35, "{size}: {delta}");
            assert!(delta.is_normal(), "{size}: {delta}");
        }
    }
}
