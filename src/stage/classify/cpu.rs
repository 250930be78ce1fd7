//! CPU twin of `shaders/classify.wgsl` and `shaders/shared/row.wgsl`.

use super::BrickRecord;
use crate::stage::inside::Inside;
use crate::stage::samples::Samples;
use crate::table::Table;

/// Inside bits of a brick's rows: `rows[y + 9 z]`, bit x; rows past the grid's end are 0.
pub struct InsideRows([u16; 81]);

impl InsideRows {
    /// Tests every sample of the brick once.
    #[inline(always)]
    pub fn new(samples: &Samples<'_>, inside: Inside) -> Self {
        let mut rows = [0; 81];
        let [_, ny, nz] = samples.extent;
        for z in 0..nz {
            for y in 0..ny {
                let row = samples.row(y, z);
                rows[y + 9 * z] = match <&[f32; 9]>::try_from(row) {
                    Ok(row) => inside.row(row) as u16,
                    Err(_) => inside.row(row) as u16,
                };
            }
        }
        Self(rows)
    }

    /// The bits of the rows (y, z), (y+1, z), (y, z+1), (y+1, z+1).
    #[inline(always)]
    pub fn four(&self, y: usize, z: usize) -> [u32; 4] {
        let i = y + 9 * z;
        [self.0[i], self.0[i + 1], self.0[i + 9], self.0[i + 10]].map(u32::from)
    }
}

/// Which points of a row have what; `RowShape` of the shader.
#[derive(Debug, Clone, Copy)]
pub struct RowShape {
    along_x: u32,
    along_y: u32,
    along_z: u32,
    /// Cells of the row.
    pub cells: u32,
}

impl RowShape {
    /// The shape of row (y, z) of a brick with these samples.
    #[inline(always)]
    pub fn new(extent: [usize; 3], y: usize, z: usize) -> Self {
        let [nx, ny, nz] = extent;
        let exists = y < ny && z < nz;
        let (has_y, has_z) = (exists && y + 1 < ny, exists && z + 1 < nz);
        let low_bits = |count: usize| (1u32 << count.min(8)) - 1;
        let (points, cells) = (low_bits(nx), low_bits(nx - 1));
        Self {
            along_x: if exists { cells } else { 0 },
            along_y: if has_y { points } else { 0 },
            along_z: if has_z { points } else { 0 },
            cells: if has_y && has_z { (nx - 1).min(8) as u32 } else { 0 },
        }
    }
}

/// The row's crossed owned edges: +x in bits 0–7, +y in 8–15, +z in 16–23.
#[inline(always)]
pub fn crossed_edges(bits: [u32; 4], shape: RowShape) -> u32 {
    let x = (bits[0] ^ (bits[0] >> 1)) & shape.along_x;
    let y = (bits[0] ^ bits[1]) & shape.along_y;
    let z = (bits[0] ^ bits[2]) & shape.along_z;
    x | y << 8 | z << 16
}

/// The case byte of cell x of the row.
#[inline(always)]
pub fn cell_case(bits: [u32; 4], x: u32) -> u8 {
    let [a, b, c, d] = bits.map(|row| row >> x & 3);
    (a | b << 2 | c << 4 | d << 6) as u8
}

/// Which cells of the row have corners on both sides.
#[inline(always)]
pub fn mixed_cells(bits: [u32; 4], shape: RowShape) -> u32 {
    let any = bits[0] | bits[1] | bits[2] | bits[3];
    let all = bits[0] & bits[1] & bits[2] & bits[3];
    ((any | any >> 1) & !(all & all >> 1)) & ((1 << shape.cells) - 1)
}

/// Fills the brick's record; returns its vertices and triangles.
#[inline(always)]
pub fn classify(table: &Table, inside: Inside, samples: &Samples<'_>, record: &mut BrickRecord) -> [u32; 2] {
    let rows = InsideRows::new(samples, inside);
    let (mut vertices, mut triangles) = (0u32, 0u32);
    for z in 0..8 {
        record.planes[z] = vertices | triangles << 16;
        let (plane_vertices, plane_triangles) = (vertices, triangles);
        for y in 0..8 {
            let row = y + 8 * z;
            let (bits, shape) = (rows.four(y, z), RowShape::new(samples.extent, y, z));
            let edges = crossed_edges(bits, shape);
            record.rows[row] = edges | (vertices - plane_vertices) << 24;
            let before = triangles - plane_triangles;
            if row % 2 == 0 {
                record.triangles[row / 2] = before;
            } else {
                record.triangles[row / 2] |= before << 16;
            }
            vertices += edges.count_ones();
            let mut mixed = mixed_cells(bits, shape);
            while mixed != 0 {
                triangles += table.triangle_count(cell_case(bits, mixed.trailing_zeros()));
                mixed &= mixed - 1;
            }
        }
    }
    [vertices, triangles]
}
