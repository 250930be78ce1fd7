//! classify for marching tetrahedra; the twin of `shaders/classify/tetrahedra.wgsl` and `shaders/shared/tetra_record.wgsl`.
//!
//! Each point owns seven edges, to the other corners of the cell above it: their directions are corner numbers, 1 to 7. Which
//! of them are crossed follows from the inside bits of four rows, so the record keeps these and not the edges:
//! 356 bytes a brick in the 416 of [`BrickRecord`].

use super::BrickRecord;
use crate::stage::inside::Inside;
use crate::stage::samples::Samples;
use crate::table::tetrahedra::MARCHING_TETRAHEDRA;
use bytemuck::{Pod, Zeroable};

/// The directions of the edges that a point owns.
pub const DIRECTIONS: std::ops::Range<u32> = 1..8;

/// What classify leaves of a brick; `shaders/shared/tetra_record.wgsl` describes the words.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[allow(missing_docs, reason = "each field is described in the shader")]
pub struct TetraRecord {
    pub rows: [u32; 81],
    pub planes: [u32; 8],
    /// So that it is as long as the record of marching cubes, and lies in the same buffers.
    pub unused: [u32; 15],
}

impl BrickRecord {
    /// The record as marching tetrahedra has it.
    #[inline(always)]
    pub fn tetrahedra(&self) -> &TetraRecord {
        bytemuck::cast_ref(self)
    }

    /// As [`tetrahedra`](Self::tetrahedra).
    #[inline(always)]
    pub fn tetrahedra_mut(&mut self) -> &mut TetraRecord {
        bytemuck::cast_mut(self)
    }
}

/// The inside bits of the corners of a row of cells: of rows (y, z), (y+1, z), (y, z+1), (y+1, z+1).
type Corners = [u32; 4];

impl TetraRecord {
    /// The inside bits around row (y, z), both from 0 to 7.
    #[inline(always)]
    fn corners(&self, y: usize, z: usize) -> Corners {
        [0, 1, 9, 10].map(|next| self.rows[y + 9 * z + next] & 0x1ff)
    }

    /// The row's crossed edges in direction `d`, a bit each of its eight points.
    #[inline(always)]
    pub fn crossed(&self, extent: [usize; 3], y: usize, z: usize, d: u32) -> u32 {
        crossed(&self.corners(y, z), extent, y, z, d)
    }

    /// The vertices of the brick before row (y, z).
    #[inline(always)]
    pub fn vertices_before(&self, y: usize, z: usize) -> u32 {
        (self.planes[z] & 0xffff) + (self.rows[y + 9 * z] >> 9 & 0x1ff)
    }

    /// Which cells of row (y, z) have corners on both sides.
    #[inline(always)]
    pub fn mixed_cells(&self, extent: [usize; 3], y: usize, z: usize) -> u32 {
        mixed_cells(&self.corners(y, z), extent, y, z)
    }

    /// The case of a cell.
    #[inline(always)]
    pub fn case(&self, [x, y, z]: [usize; 3]) -> u8 {
        case(&self.corners(y, z), x)
    }
}

#[inline(always)]
fn crossed(corners: &Corners, [nx, ny, nz]: [usize; 3], y: usize, z: usize, d: u32) -> u32 {
    let [dx, dy, dz] = [d & 1, d >> 1 & 1, d >> 2].map(|n| n as usize);
    // Points that have the edge: its other end is in the grid.
    let points = if y + dy < ny && z + dz < nz { (1 << (nx - dx).min(8)) - 1 } else { 0 };
    (corners[0] ^ corners[dy + 2 * dz] >> dx) & points
}

#[inline(always)]
fn mixed_cells(corners: &Corners, [nx, ny, nz]: [usize; 3], y: usize, z: usize) -> u32 {
    let cells = if y + 1 < ny && z + 1 < nz { (1 << (nx - 1)) - 1 } else { 0 };
    let some = corners.iter().fold(0, |a, b| a | b);
    let every = corners.iter().fold(u32::MAX, |a, b| a & b);
    (some | some >> 1) & !(every & every >> 1) & cells
}

#[inline(always)]
fn case(corners: &Corners, x: usize) -> u8 {
    corners.iter().enumerate().fold(0, |case, (i, row)| case | (row >> x & 3) << (2 * i)) as u8
}

/// Fills the brick's record; returns its vertices and triangles.
pub fn classify(inside: Inside, samples: &Samples<'_>, record: &mut TetraRecord) -> [u32; 2] {
    let extent = samples.extent;
    *record = TetraRecord::zeroed();
    for z in 0..extent[2] {
        for y in 0..extent[1] {
            record.rows[y + 9 * z] = samples.row_inside(inside, y, z);
        }
    }
    let [mut vertices, mut triangles] = [0; 2];
    for z in 0..8 {
        record.planes[z] = vertices | triangles << 16;
        let [mut in_plane, mut triangles_in_plane] = [0; 2];
        for y in 0..8 {
            let corners = record.corners(y, z);
            record.rows[y + 9 * z] |= in_plane << 9 | triangles_in_plane << 18;
            if corners == [0; 4] || corners == [0x1ff; 4] {
                continue;
            }
            in_plane += DIRECTIONS.map(|d| crossed(&corners, extent, y, z, d).count_ones()).sum::<u32>();
            let mut mixed = mixed_cells(&corners, extent, y, z);
            while mixed != 0 {
                let case = case(&corners, mixed.trailing_zeros() as usize);
                mixed &= mixed - 1;
                triangles_in_plane += MARCHING_TETRAHEDRA.triangles(case).len() as u32;
            }
        }
        vertices += in_plane;
        triangles += triangles_in_plane;
    }
    [vertices, triangles]
}
