//! CPU twin of `emit_indices` in `shaders/emit/rows.wgsl` and `shaders/emit/cells.wgsl`.
//!
//! Where the shader looks up the number of every edge of every triangle, the twin first numbers the edges
//! of a brick's cells, row by row, and then reads the numbers.

use super::edges::Edge;
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::{InsideRows, PlaneShape, cell_case, mixed_cells};
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use crate::stage::trilinear::Corners;
use crate::table::MARCHING_CUBES;
use crate::table::mc33::{FIRST_CENTRE, MC33};
use multiversion::multiversion;
use std::sync::LazyLock;

/// Where the bricks beside a brick lie in the sorted list of bricks with surface. It stands for the shader's brick map:
/// nothing of it is as large as the grid.
///
/// Bricks are asked for in the list's order, so that the place of each neighbour only moves forwards: a pass over
/// the whole list looks at every entry a few times.
#[derive(Debug)]
pub struct Nearby {
    /// From a brick to those one row, one layer, and both up. 64 bits: the sum may be more than any brick's number.
    up: [u64; 4],
    /// The first slot not before each of these.
    slots: [usize; 4],
}

impl Nearby {
    /// For bricks of `active`, which is sorted, from slot `first` on.
    pub fn new(params: &Params, active: &[u32], first: usize) -> Self {
        let [nx, ny, _] = params.slab_extent.map(u64::from);
        let up = [0, nx, nx * ny, nx * ny + nx];
        let slots = up.map(|up| {
            let Some(&brick) = active.get(first) else { return active.len() };
            active.partition_point(|&other| u64::from(other) < u64::from(brick) + up)
        });
        Self { up, slots }
    }

    /// The slots of the eight bricks from (0,0,0) to (1,1,1) beside `brick`; bricks are asked for in order.
    #[inline(always)]
    fn beside(&mut self, active: &[u32], brick: u32) -> [Option<usize>; 8] {
        let mut found = [None; 8];
        for (row, (slot, up)) in self.slots.iter_mut().zip(self.up).enumerate() {
            let wanted = u64::from(brick) + up;
            let at = |slot: usize| active.get(slot).map(|&other| u64::from(other));
            while at(*slot).is_some_and(|other| other < wanted) {
                *slot += 1;
            }
            let has_first = at(*slot) == Some(wanted);
            found[2 * row] = has_first.then_some(*slot);
            let next = *slot + usize::from(has_first);
            found[2 * row + 1] = (at(next) == Some(wanted + 1)).then_some(next);
        }
        found
    }
}

/// A brick's record and first vertex, for each of the eight bricks from (0,0,0) to (1,1,1) beside a
/// brick: the owners of its cells' edges.
pub struct Beside<'a> {
    own: &'a BrickRecord,
    bricks: [Option<(&'a BrickRecord, u32)>; 8],
    /// The number of the brick's first vertex, and the one behind its last.
    numbers: [u32; 2],
    /// Whether the brick's first point is inside.
    first_inside: bool,
}

impl<'a> Beside<'a> {
    /// Those beside the brick of slot `slot` of `active`, where `nearby` has got to.
    #[inline(always)]
    pub fn new(
        nearby: &mut Nearby,
        active: &[u32],
        records: &'a [BrickRecord],
        offsets: &[[u32; 2]],
        first_inside: bool,
        slot: usize,
    ) -> Self {
        let slots = nearby.beside(active, active[slot]);
        let bricks = slots.map(|slot| slot.map(|slot| (&records[slot], offsets[slot][0])));
        let numbers = [offsets[slot][0], offsets[slot + 1][0]];
        Self { own: &records[slot], bricks, numbers, first_inside }
    }

    /// The brick's own record.
    pub(super) fn own(&self) -> &'a BrickRecord {
        self.own
    }

    /// Which of the brick's points are inside: the edges tell, and no sample is asked once more.
    #[inline(always)]
    pub(super) fn inside_rows(&self) -> InsideRows {
        InsideRows::of_edges(self.first_inside, self.bricks.map(|brick| brick.map(|(record, _)| record)))
    }

    /// One after the other, x fastest.
    pub(super) fn each(&self) -> impl Iterator<Item = Option<(&'a BrickRecord, u32)>> + '_ {
        self.bricks.iter().copied()
    }
}

/// The numbers of the vertices on the edges of a brick's cells; scratch of [`emit`](super::emit).
///
/// The edges of row (y, z), y and z from 0 to 8, begin at `ROW * (y + 9 z)`: those along x of points
/// 0–7, then those along y and those along z of points 0–8. Only crossed edges have a number, others
/// what an earlier brick left there. Those of marching tetrahedra lie beside them.
pub struct EdgeNumbers(Box<[u32; 4096]>, pub(super) Vec<u32>);

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

/// The corners of a case's triangles as places from that of the cell, wound as the table has them and the other way round; the last
/// word says how many triangles there are.
static CORNERS: LazyLock<[[[u16; 16]; 256]; 2]> = LazyLock::new(|| {
    [false, true].map(|mirrored| {
        std::array::from_fn(|case| {
            let case = case as u8;
            let mut words = [0; 16];
            let count = MARCHING_CUBES.triangle_count(case);
            for (i, corners) in (0..count).zip(words.as_chunks_mut().0) {
                let [a, b, c] = MARCHING_CUBES.triangle(case, i).map(|edge| EDGES[edge as usize] as u16);
                *corners = if mirrored { [a, c, b] } else { [a, b, c] };
            }
            words[15] = count as u16;
            words
        })
    })
});

impl Default for EdgeNumbers {
    fn default() -> Self {
        Self::new()
    }
}

impl EdgeNumbers {
    /// Room for one brick.
    pub fn new() -> Self {
        Self(Box::new([0; 4096]), Vec::new())
    }

    /// The number on an edge of the cell at `place`.
    #[inline(always)]
    fn of(&self, place: u32, edge: u32) -> u32 {
        self.0[(place + EDGES[edge as usize]) as usize % 4096]
    }

    /// The numbers at a triangle's corners, of the cell at `place`.
    #[inline(always)]
    fn triangle(&self, place: u32, corners: [u16; 3]) -> [u32; 3] {
        corners.map(|corner| self.0[(place + u32::from(corner)) as usize % 4096])
    }

    #[inline(always)]
    fn at(&mut self, place: u32) -> &mut u32 {
        &mut self.0[place as usize % 4096]
    }

    /// Numbers the edges that a brick's cells touch.
    #[inline(always)]
    fn fill(&mut self, edges: &[Edge], beside: &Beside<'_>) {
        // A crossed edge's owner is always active: its two ends straddle iso.
        for (edge, number) in edges.iter().zip(beside.numbers[0]..) {
            let [x, y, z] = [0, 1, 2].map(|k| edge.coordinate(k));
            *self.at(ROW * (y + 9 * z) + x + edge.way(1) * ALONG[1] + edge.way(2) * ALONG[2]) = number;
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
        let Some((record, first)) = beside.bricks[i] else { return };
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
        let Some((record, first)) = beside.bricks[i] else { return };
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
    extent: [usize; 3],
    edges: &[Edge],
    beside: &Beside<'_>,
    numbers: &mut EdgeNumbers,
    triangles: &mut [[u32; 3]],
) {
    numbers.fill(edges, beside);
    indices(params, extent, beside, numbers, triangles, |_, _, _, _| None);
}

/// [`emit_indices`] for topologically correct marching cubes; centres are counted backwards from the brick's last vertex.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
pub fn emit_indices_mc33(
    params: &Params,
    inside: Inside,
    samples: &Samples<'_>,
    edges: &[Edge],
    beside: &Beside<'_>,
    numbers: &mut EdgeNumbers,
    triangles: &mut [[u32; 3]],
) {
    numbers.fill(edges, beside);
    let [_, mut end] = beside.numbers;
    let of_cell = |case, [x, y, z]: [usize; 3], numbers: &EdgeNumbers, left: &mut [[u32; 3]]| {
        if MC33.is_decided(case) {
            return None;
        }
        let entry = Corners::of_cell(params.iso, inside, samples, [x, y, z]).entry();
        let place = ROW * (y as u32 + 9 * z as u32) + x as u32;
        for (i, triangle) in (0..entry.triangle_count()).zip(left) {
            let [a, b, c] = entry.triangle(i).map(|corner| match corner.checked_sub(FIRST_CENTRE) {
                Some(centre) => end - 1 - centre,
                None => numbers.of(place, corner),
            });
            *triangle = if params.mirrored == 1 { [a, c, b] } else { [a, b, c] };
        }
        end -= entry.centres();
        Some(entry.triangle_count() as usize)
    };
    indices(params, samples.extent, beside, numbers, triangles, of_cell);
}

/// The body of both, for a brick of so many samples; `of_cell` may write the triangles of a cell in its own way, from its case and
/// its place in the brick, and tells how many.
#[inline(always)]
fn indices(
    params: &Params,
    extent: [usize; 3],
    beside: &Beside<'_>,
    numbers: &EdgeNumbers,
    triangles: &mut [[u32; 3]],
    mut of_cell: impl FnMut(u8, [usize; 3], &EdgeNumbers, &mut [[u32; 3]]) -> Option<usize>,
) {
    let table = &CORNERS[params.mirrored as usize & 1];
    let rows = beside.inside_rows();
    let mut left = triangles;
    for z in 0..8 {
        let corners = rows.corners(z);
        let mut mixed = mixed_cells(&corners, PlaneShape::new(extent, z));
        while mixed != 0 {
            let cell = mixed.trailing_zeros();
            mixed &= mixed - 1;
            let case = cell_case(&corners, cell);
            if let Some(count) = of_cell(case, [cell as usize % 8, cell as usize / 8, z], numbers, left) {
                let done = count.min(left.len());
                left = std::mem::take(&mut left).split_at_mut(done).1;
                continue;
            }
            let place = ROW * (cell / 8 + 9 * z as u32) + cell % 8;
            let words = &table[case as usize];
            let (corners, count) = (words.as_chunks().0, usize::from(words[15]));
            // Most cells have one or two triangles: two are written without asking, and the second
            // is overwritten by the next cell where it is none of this one's.
            if count <= 2
                && let Some(two) = left.first_chunk_mut()
            {
                *two = [0, 1].map(|i| numbers.triangle(place, corners[i]));
            } else {
                let own = corners.iter().take(count);
                left.iter_mut()
                    .zip(own)
                    .for_each(|(triangle, &own)| *triangle = numbers.triangle(place, own));
            }
            let done = count.min(left.len());
            left = std::mem::take(&mut left).split_at_mut(done).1;
        }
    }
}
