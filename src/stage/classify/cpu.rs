//! CPU twin of `shaders/classify.wgsl` and `shaders/shared/row.wgsl`.
//!
//! Where the shader gives a row of eight points to an invocation, the twin works on a plane of a brick
//! at a time: 64 points or cells are the bits of a `u64`, eight a row, so that byte y is row y.

use super::{BrickRecord, tetrahedra};
use crate::stage::inside::Inside;
use crate::stage::method::Method;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use crate::stage::trilinear::Corners;
use crate::table::mc33::MC33;
use crate::table::{MARCHING_CUBES, Table};
use crate::volume::values::each_type;
use crate::volume::{Sample, Slice};
use multiversion::multiversion;

/// 1 in every byte: times a byte, the byte in every row; the top byte of the product is the sum of rows.
const EACH_ROW: u64 = 0x0101_0101_0101_0101;

/// Inside bits of a brick's samples; rows past the grid's end are 0.
pub struct InsideRows {
    /// Rows y = 0–7 of the nine planes: of points x = 0–7, and of x = 1–8.
    rows: [[u64; 2]; 9],
    /// Row y = 8 of the nine planes.
    last: [[u64; 2]; 9],
}

impl InsideRows {
    /// Tests every sample of the brick once.
    #[inline(always)]
    pub fn new(samples: &Samples<'_>, inside: Inside) -> Self {
        let mut bits = Self { rows: [[0; 2]; 9], last: [[0; 2]; 9] };
        each_type!(Slice, samples.data(), data => bits.fill(samples, data, inside));
        bits
    }

    /// What [`InsideRows::new`] finds, of a brick that is classified: from whether its lowest point is inside, and the crossed
    /// edges of the bricks from (0,0,0) to (1,1,1) beside it. Of points past the grid's end they say nothing.
    #[inline(always)]
    pub fn of_edges(is_inside: bool, beside: [Option<&BrickRecord>; 8]) -> Self {
        let mut bits = Self { rows: [[0; 2]; 9], last: [[0; 2]; 9] };
        let row = |brick: usize, y: usize, z: usize| beside[brick].map_or(0, |record| record.rows[y + 8 * z]);
        // Those along one axis, of the rows of a plane.
        let plane = |brick: usize, z: usize, axis: usize| {
            (0..8).fold(0, |plane, y| plane | u64::from(row(brick, y, z) >> (8 * axis) & 0xff) << (8 * y))
        };
        // The first row from its first point, then each row from the one before.
        let mut first = (plane(0, 0, 0) & 0xff) << 1 | u64::from(is_inside);
        for shift in [1, 2, 4] {
            first ^= first << shift;
        }
        let mut here = first & 0xff | plane(0, 0, 1) << 8;
        for shift in [8, 16, 32] {
            here ^= here << shift;
        }
        for z in 0..9 {
            // Of the plane, and of the row behind it.
            let ([own, next_y], low) = if z < 8 { ([0, 2], z) } else { ([4, 6], 0) };
            let last = here >> 56 ^ u64::from(row(own, 7, low) >> 8 & 0xff);
            bits.rows[z] = [here, here ^ plane(own, low, 0)];
            bits.last[z] = [last, last ^ u64::from(row(next_y, 0, low) & 0xff)];
            here ^= plane(own, low, 2);
        }
        bits
    }

    #[inline(always)]
    fn fill<T: Sample>(&mut self, samples: &Samples<'_>, data: &[T], inside: Inside) {
        let [_, ny, nz] = samples.extent;
        for z in 0..nz.min(9) {
            let mut plane = [0; 2];
            for y in 0..ny.min(8) {
                let row = u64::from(inside.row(samples.row_of(data, y, z)));
                plane[0] |= (row & 0xff) << (8 * y);
                plane[1] |= (row >> 1) << (8 * y);
            }
            self.rows[z] = plane;
            if ny > 8 {
                let row = u64::from(inside.row(samples.row_of(data, 8, z)));
                self.last[z] = [row & 0xff, row >> 1];
            }
        }
    }

    /// The corners of the cells of plane `z`: corner `k` (bits zyx) of cell `x + 8 y` is bit `x + 8 y` of
    /// number `k`.
    #[inline(always)]
    pub fn corners(&self, z: usize) -> [u64; 8] {
        let [a, b] = self.rows[z];
        let [c, d] = self.next_rows(z);
        let [e, f] = self.rows[z + 1];
        let [g, h] = self.next_rows(z + 1);
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    fn next_rows(&self, z: usize) -> [u64; 2] {
        [0, 1].map(|i| self.rows[z][i] >> 8 | self.last[z][i] << 56)
    }
}

/// Which points of a plane have what; `RowShape` of the shader for eight rows.
#[derive(Debug, Clone, Copy)]
pub struct PlaneShape {
    along_x: u64,
    along_y: u64,
    along_z: u64,
    cells: u64,
}

impl PlaneShape {
    /// The shape of plane `z` of a brick with these samples.
    #[inline(always)]
    pub fn new(extent: [usize; 3], z: usize) -> Self {
        let [nx, ny, nz] = extent;
        // The first `x` points of the first `y` rows.
        let first = |x: usize, y: usize| {
            let rows = if y < 8 { (1 << (8 * y)) - 1 } else { u64::MAX };
            (EACH_ROW * ((1 << x.min(8)) - 1)) & rows
        };
        let when = |there: bool, mask: u64| if there { mask } else { 0 };
        Self {
            along_x: when(z < nz, first(nx - 1, ny)),
            along_y: when(z < nz, first(nx, ny - 1)),
            along_z: when(z + 1 < nz, first(nx, ny)),
            cells: when(z + 1 < nz, first(nx - 1, ny - 1)),
        }
    }
}

/// The plane's crossed owned edges: along x, y, z.
#[inline(always)]
pub fn crossed_edges(corners: &[u64; 8], shape: PlaneShape) -> [u64; 3] {
    let here = corners[0];
    [
        (here ^ corners[1]) & shape.along_x,
        (here ^ corners[2]) & shape.along_y,
        (here ^ corners[4]) & shape.along_z,
    ]
}

/// The case byte of cell `cell` of the plane.
#[inline(always)]
pub fn cell_case(corners: &[u64; 8], cell: u32) -> u8 {
    corners.iter().enumerate().fold(0, |case, (k, bits)| case | (bits >> cell & 1) << k) as u8
}

/// Which cells of the plane have corners on both sides.
#[inline(always)]
pub fn mixed_cells(corners: &[u64; 8], shape: PlaneShape) -> u64 {
    let any = corners.iter().fold(0, |a, b| a | b);
    let all = corners.iter().fold(u64::MAX, |a, b| a & b);
    any & !all & shape.cells
}

/// In each byte, how many bits are set.
#[inline(always)]
fn ones_of_rows(bits: u64) -> u64 {
    let pairs = bits - (bits >> 1 & 0x5555_5555_5555_5555);
    let fours = (pairs & 0x3333_3333_3333_3333) + (pairs >> 2 & 0x3333_3333_3333_3333);
    (fours + (fours >> 4)) & 0x0f0f_0f0f_0f0f_0f0f
}

/// Fills the brick's record, in the method's way; returns its vertices and triangles.
#[inline(always)]
pub fn classify(
    params: &Params,
    inside: Inside,
    samples: &Samples<'_>,
    record: &mut BrickRecord,
) -> [u32; 2] {
    match params.method {
        Method::MarchingCubes => classify_mc(&MARCHING_CUBES, inside, samples, record),
        Method::Mc33 => classify_mc33(&MARCHING_CUBES, params.iso, inside, samples, record),
        Method::Tetrahedra => tetrahedra::classify(inside, samples, record.tetrahedra_mut()),
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
fn classify_mc(table: &Table, inside: Inside, samples: &Samples<'_>, record: &mut BrickRecord) -> [u32; 2] {
    fill(inside, samples, record, |case, _| [table.triangle_count(case), 0])
}

/// Ambiguous cells have what the interpolant says.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
fn classify_mc33(
    table: &Table,
    iso: f32,
    inside: Inside,
    samples: &Samples<'_>,
    record: &mut BrickRecord,
) -> [u32; 2] {
    fill(inside, samples, record, |case, cell| {
        if MC33.is_decided(case) {
            return [table.triangle_count(case), 0];
        }
        let entry = Corners::of_cell(iso, inside, samples, cell).entry();
        [entry.triangle_count(), entry.centres()]
    })
}

/// The body of both, for every instruction set; `of_cell` tells the triangles and the centres of a cell, from its case and
/// its place in the brick.
#[inline(always)]
fn fill(
    inside: Inside,
    samples: &Samples<'_>,
    record: &mut BrickRecord,
    of_cell: impl Fn(u8, [usize; 3]) -> [u32; 2],
) -> [u32; 2] {
    let rows = InsideRows::new(samples, inside);
    let (mut vertices, mut triangles, mut centres) = (0u32, 0u32, 0u32);
    for z in 0..8 {
        record.planes[z] = vertices | triangles << 16;
        let (corners, shape) = (rows.corners(z), PlaneShape::new(samples.extent, z));
        let edges = crossed_edges(&corners, shape);
        // At most 24 a row and 192 a plane: sums of rows stay within their bytes.
        let row_vertices = edges.iter().fold(0, |sum, &bits| sum + ones_of_rows(bits));
        let up_to = row_vertices.wrapping_mul(EACH_ROW);
        let [x, y, z_] = edges.map(u64::to_le_bytes);
        let before = (up_to - row_vertices).to_le_bytes();
        for row in 0..8 {
            record.rows[8 * z + row] = u32::from_le_bytes([x[row], y[row], z_[row], before[row]]);
        }
        vertices += (up_to >> 56) as u32;

        // At most 8 cells of 14 triangles and 2 centres a row: a byte holds either.
        let (mut row_triangles, mut row_centres) = (0u64, 0u64);
        let mut mixed = mixed_cells(&corners, shape);
        while mixed != 0 {
            let cell = mixed.trailing_zeros();
            mixed &= mixed - 1;
            let place = [cell as usize % 8, cell as usize / 8, z];
            let [own_triangles, own_centres] = of_cell(cell_case(&corners, cell), place).map(u64::from);
            row_triangles += own_triangles << (cell & 56);
            row_centres += own_centres << (cell & 56);
        }
        let mut before = 0;
        let pairs = row_triangles.to_le_bytes().into_iter().zip(row_centres.to_le_bytes());
        for (row, (own_triangles, own_centres)) in pairs.enumerate() {
            let half = before | u32::from(own_centres) << 11;
            let word = &mut record.triangles[4 * z + row / 2];
            *word = if row % 2 == 0 { half } else { *word | half << 16 };
            before += u32::from(own_triangles);
            centres += u32::from(own_centres);
        }
        triangles += before;
    }
    [vertices + centres, triangles]
}
