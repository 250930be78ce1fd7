//! CPU twin of `shaders/normals.wgsl` and `shaders/shared/unit.wgsl`.

use crate::field::unit::largest;
pub use crate::field::unit::{LEAST_GRADIENT, unit};
use crate::mesh::Vertex;
use crate::stage::params::Params;
use glam::Vec3;
use rayon::prelude::*;

/// What the words of a mark are, but for the code of its edge and the sum of neighbours: as floats they lie
/// far above 1, so that no normal is taken for one.
const MARK: u32 = 0x6000_0000;
/// Normals are summed in these parts of 1. A vertex lies in at most 24 triangles (by mc33 six in each of four cells; by mc 14, by mt 12): a
/// sum of 48 is below 2²⁴, a whole number as a float.
const PARTS: f32 = 262_144.0;
/// What rounding can make of 48 normals that cancel lies below.
const LEAST_SUM: f32 = 32.0;
/// Triangles whose sums are gathered at once.
const BLOCK: usize = 1 << 16;

/// The mark of a vertex on an edge along `axis`, which leaves the solid forwards or backwards.
pub fn mark(axis: usize, backwards: bool) -> [f32; 3] {
    let code = axis as u32 + if backwards { 4 } else { 0 };
    [MARK + code, MARK, MARK].map(f32::from_bits)
}

/// Sums of neighbours stay within this range.
fn is_marked(vertex: &Vertex) -> bool {
    (0x5000_0000..0x7000_0000).contains(&vertex.normal[0].to_bits())
}

/// The normal of a vertex in parts, times 8; nothing of one that is marked.
fn parts(vertex: &Vertex) -> [u32; 3] {
    if is_marked(vertex) {
        return [0; 3];
    }
    vertex.normal.map(|n| ((n * PARTS + 0.5).floor() as i32 as u32).wrapping_mul(8))
}

/// Adds to each marked vertex the normals of the other corners of its triangles.
pub fn add_neighbours(vertices: &mut [Vertex], triangles: &[[u32; 3]]) {
    let marks = marks(vertices);
    let has_mark = |corner: u32| marks[corner as usize / 64] >> (corner % 64) & 1 == 1;
    for block in triangles.chunks(BLOCK) {
        let at = |corner: u32| &vertices[corner as usize];
        let some = block.par_iter().filter(|[a, b, c]| has_mark(*a) | has_mark(*b) | has_mark(*c));
        let beside = some.flat_map_iter(|&[a, b, c]| {
            let around = [(a, [b, c]), (b, [c, a]), (c, [a, b])];
            let marked = around.into_iter().filter(|&(corner, _)| has_mark(corner));
            marked.flat_map(|(corner, others)| others.map(|other| (corner, parts(at(other)))))
        });
        let beside: Vec<(u32, [u32; 3])> = beside.collect();
        for (corner, parts) in beside {
            let normal = &mut vertices[corner as usize].normal;
            *normal = [0, 1, 2].map(|k| f32::from_bits(normal[k].to_bits().wrapping_add(parts[k])));
        }
    }
}

/// Which vertices are marked, a bit each: few are, and triangles find these sooner than the vertices.
fn marks(vertices: &[Vertex]) -> Vec<u64> {
    let word =
        |some: &[Vertex]| some.iter().rev().fold(0, |bits, vertex| bits << 1 | u64::from(is_marked(vertex)));
    vertices.par_chunks(64).with_min_len(64).map(word).collect()
}

/// Turns marks, with what was added to them, into normals.
pub fn average(params: &Params, vertices: &mut [Vertex]) {
    vertices.par_iter_mut().filter(|vertex| is_marked(vertex)).for_each(|vertex| {
        let words = vertex.normal.map(f32::to_bits);
        let sum = Vec3::from(words.map(|word| (word.wrapping_sub(MARK) as i32 >> 3) as f32));
        // Where the neighbours say nothing, the normal runs along the edge, out of the solid.
        let along = match words[0] & 3 {
            0 => params.step_x,
            1 => params.step_y,
            _ => params.step_z,
        };
        let outwards = if words[0] & 4 == 0 { Vec3::from(along) } else { -Vec3::from(along) };
        vertex.normal = unit(if largest(sum) >= LEAST_SUM { sum } else { outwards }).into();
    });
}
