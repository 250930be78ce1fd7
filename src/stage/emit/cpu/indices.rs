//! CPU twin of `emit_indices` in `shaders/emit.wgsl`.
//!
//! Where the shader looks up the number of every edge of every triangle, the twin first numbers the edges
//! of a brick's cells, row by row, and then reads the numbers.

use super::vertices::Edges;
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::{InsideRows, PlaneShape, cell_case, mixed_cells};
use crate::stage::cull::cpu::NO_SLOT;
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use crate::table::Table;
use multiversion::multiversion;

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
