//! The points of a brick whose samples emit asks for: the ends of its crossed edges, few of 9³.

use super::indices::Beside;
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::{PlaneShape, cell_case, mixed_cells};
use crate::stage::classify::tetrahedra::DIRECTIONS;
use crate::stage::method::Method;
use crate::table::mc33::MC33;

/// Both ends of each crossed edge that the brick owns, a bit each of row y + 9 z. `None` where emit asks for more: of a cell that its
/// case does not decide all corners count.
pub fn ends(
    method: Method,
    extent: [usize; 3],
    record: &BrickRecord,
    beside: &Beside<'_>,
) -> Option<[u16; 81]> {
    let mut points = [0; 81];
    match method {
        Method::Tetrahedra => {
            for (row, direction) in (0..64).flat_map(|row| DIRECTIONS.map(move |d| (row, d))) {
                let (y, z) = (row % 8, row / 8);
                let crossed = record.tetrahedra().crossed(extent, y, z, direction) as u16;
                let [dx, dy, dz] = [0, 1, 2].map(|k| (direction >> k & 1) as usize);
                points[y + 9 * z] |= crossed;
                points[y + dy + 9 * (z + dz)] |= crossed << dx;
            }
        }
        Method::Mc33 if has_undecided(extent, beside) => return None,
        Method::MarchingCubes | Method::Mc33 => {
            for (i, edges) in record.rows.iter().enumerate() {
                let row = i % 8 + 9 * (i / 8);
                let [x, y, z] = [0, 8, 16].map(|shift| (edges >> shift & 0xff) as u16);
                points[row] |= x | x << 1 | y | z;
                points[row + 1] |= y;
                points[row + 9] |= z;
            }
        }
    }
    Some(points)
}

/// How many points these are.
pub fn count(points: &[u16; 81]) -> usize {
    points.iter().map(|row| row.count_ones() as usize).sum()
}

/// Whether there is a cell that its case does not decide.
fn has_undecided(extent: [usize; 3], beside: &Beside<'_>) -> bool {
    let rows = beside.inside_rows();
    (0..8).any(|z| {
        let corners = rows.corners(z);
        let mut mixed = mixed_cells(&corners, PlaneShape::new(extent, z));
        while mixed != 0 {
            if !MC33.is_decided(cell_case(&corners, mixed.trailing_zeros())) {
                return true;
            }
            mixed &= mixed - 1;
        }
        false
    })
}
