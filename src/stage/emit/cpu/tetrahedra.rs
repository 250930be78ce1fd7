//! emit for marching tetrahedra; the twin of `shaders/emit/tetrahedra.wgsl`.

use super::indices::{Beside, EdgeNumbers};
use crate::stage::classify::tetrahedra::{DIRECTIONS, TetraRecord};
use crate::stage::params::Params;
use crate::table::tetrahedra::MARCHING_TETRAHEDRA;

/// The numbers of the vertices on the edges of a brick's cells; scratch of [`emit_indices`]. Those of point (x, y, z), each
/// from 0 to 8, begin at `8 (x + 16 (y + 9 z))`, by direction.
fn place([x, y, z]: [usize; 3]) -> usize {
    8 * (x + 16 * (y + 9 * z))
}

/// The triangles of the brick at `origin`, as vertex numbers of the whole mesh.
pub fn emit_indices(
    params: &Params,
    origin: [u32; 3],
    beside: &Beside<'_>,
    numbers: &mut EdgeNumbers,
    triangles: &mut [[u32; 3]],
) {
    let numbers = &mut numbers.1;
    numbers.resize(place([0, 0, 9]), 0);
    for (i, owner) in beside.each().enumerate() {
        let next = [i & 1, i >> 1 & 1, i >> 2];
        let first_point = [0, 1, 2].map(|k| origin[k] + 8 * next[k] as u32);
        // Beyond the grid's end there may be any brick, and no cell asks for it.
        let (Some((record, first)), true) = (owner, (0..3).all(|k| first_point[k] < params.points[k])) else {
            continue;
        };
        let extent = [0, 1, 2].map(|k| (params.points[k] - first_point[k]).min(9) as usize);
        fill(record.tetrahedra(), extent, first, next, numbers);
    }
    let Some((record, _)) = beside.each().next().flatten() else { return };
    let record = record.tetrahedra();
    let extent = [0, 1, 2].map(|k| (params.points[k] - origin[k]).min(9) as usize);
    let mut left = triangles.iter_mut();
    for (y, z) in (0..8).flat_map(|z| (0..8).map(move |y| (y, z))) {
        let mut mixed = record.mixed_cells(extent, y, z);
        while mixed != 0 {
            let x = mixed.trailing_zeros() as usize;
            mixed &= mixed - 1;
            let lowest = place([x, y, z]);
            let number = |edge: u32| {
                let [corner, d] = [edge & 7, edge >> 3 & 7].map(|n| n as usize);
                numbers[lowest + place([corner & 1, corner >> 1 & 1, corner >> 2]) + d]
            };
            for (&edges, triangle) in
                MARCHING_TETRAHEDRA.triangles(record.case([x, y, z])).iter().zip(&mut left)
            {
                let [a, b, c] = [number(edges), number(edges >> 6), number(edges >> 12)];
                *triangle = if params.mirrored == 1 { [a, c, b] } else { [a, b, c] };
            }
        }
    }
}

/// Numbers the edges that one of the bricks beside owns and the brick's cells touch: those of its points 0–7 along axes
/// where it is the brick itself, and of its points 0 along the others.
fn fill(record: &TetraRecord, extent: [usize; 3], first: u32, next: [usize; 3], numbers: &mut [u32]) {
    let end = next.map(|next| if next == 1 { 1 } else { 8 });
    for (y, z) in (0..end[2]).flat_map(|z| (0..end[1]).map(move |y| (y, z))) {
        let mut number = first + record.vertices_before(y, z);
        for d in DIRECTIONS {
            let mut crossed = record.crossed(extent, y, z, d);
            while crossed != 0 {
                let x = crossed.trailing_zeros() as usize;
                crossed &= crossed - 1;
                if x < end[0] {
                    numbers[place([x + 8 * next[0], y + 8 * next[1], z + 8 * next[2]]) + d as usize] = number;
                }
                number += 1;
            }
        }
    }
}
