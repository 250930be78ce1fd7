//! Polygons to triangles.

use super::TASK;
use super::dual::{Dual, Polygon};
use super::tree::Tree;
use super::vertices::Crossing;
use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::HashMap;

/// A triangle and the polygon it is of.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Counter-clockwise seen from outside.
    pub vertices: [u32; 3],
    /// Its polygon.
    pub polygon: u32,
}

/// The triangles, and the positions with those of vertices that had to be put between.
///
/// A quad is cut such that no triangle is flipped, else along the diagonal nearer to the tangent plane at its crossing. Two quads may have the
/// same ends of a diagonal only if the edge is shorter than both their leaves: such a diagonal is never taken. Where neither
/// may be, and where two sides of a leaf's face join the same vertices, vertices are put between and the polygon
/// becomes a fan around its crossing.
pub fn triangles(
    tree: &Tree,
    dual: &Dual,
    crossings: &[Crossing],
    mut positions: Vec<Vec3>,
) -> (Vec<Vec3>, Vec<Triangle>) {
    // By the lower of the two joined sides.
    let mut between: HashMap<u32, u32> = HashMap::new();
    let mut split: Vec<u32> = dual.doubled.iter().map(|&side| side.min(dual.joined[side as usize])).collect();
    split.sort_unstable();
    split.dedup();
    for side in split {
        let (a, b) = (side as usize / 4, dual.joined[side as usize] as usize / 4);
        between.insert(side, positions.len() as u32);
        positions.push((crossings[a].at + crossings[b].at) * 0.5);
    }
    let between_at = |side: u32| {
        if between.is_empty() {
            return None;
        }
        between.get(&side.min(dual.joined[side as usize])).copied()
    };
    let of = |p: usize, polygon: &Polygon, out: &mut Vec<Triangle>, fans: &mut Vec<u32>| {
        let count = polygon.count as usize;
        let vertex: [u32; 4] = std::array::from_fn(|c| dual.vertex[4 * p + c % count]);
        let sides = || (0..count).map(|s| (4 * p + s) as u32);
        if sides().any(|side| between_at(side).is_some()) {
            return fans.push(p as u32);
        }
        let cut = |order: [usize; 3]| Triangle { vertices: order.map(|c| vertex[c]), polygon: p as u32 };
        if count == 3 {
            return out.push(cut([0, 1, 2]));
        }
        let size = |c: usize| tree.nodes[polygon.corners[c].leaf as usize].size;
        let allowed = |a: usize, b: usize| size(a) == polygon.length || size(b) == polygon.length;
        let Crossing { at, normal } = crossings[p];
        let height = |a: usize, b: usize| {
            let middle = (positions[vertex[a] as usize] + positions[vertex[b] as usize]) * 0.5;
            (middle - at).dot(normal).abs()
        };
        let (first, second) = ([cut([0, 1, 2]), cut([0, 2, 3])], [cut([0, 1, 3]), cut([1, 2, 3])]);
        let flipped =
            |two: &[Triangle; 2]| two.iter().filter(|t| is_flipped(t, &positions, crossings)).count();
        let first_is_better = || match flipped(&first).cmp(&flipped(&second)) {
            Ordering::Equal => height(0, 2) <= height(1, 3),
            order => order == Ordering::Less,
        };
        match (allowed(0, 2), allowed(1, 3)) {
            (true, other) if !other || first_is_better() => out.extend(first),
            (_, true) => out.extend(second),
            _ => fans.push(p as u32),
        }
    };
    let parts: Vec<(Vec<Triangle>, Vec<u32>)> = dual
        .polygons
        .par_chunks(TASK)
        .enumerate()
        .map(|(chunk, polygons)| {
            let (mut out, mut fans) = (Vec::with_capacity(2 * polygons.len()), Vec::new());
            for (i, polygon) in polygons.iter().enumerate() {
                of(chunk * TASK + i, polygon, &mut out, &mut fans);
            }
            (out, fans)
        })
        .collect();
    let mut all = Vec::with_capacity(2 * dual.polygons.len());
    parts.iter().for_each(|part| all.extend_from_slice(&part.0));
    for &p in parts.iter().flat_map(|part| &part.1) {
        let count = dual.polygons[p as usize].count as usize;
        let mut rim = Vec::new();
        for s in 0..count {
            let side = 4 * p + s as u32;
            rim.push(dual.vertex[side as usize]);
            rim.extend(between_at(side));
        }
        let centre = positions.len() as u32;
        positions.push(crossings[p as usize].at);
        let spokes = rim.iter().zip(rim.iter().cycle().skip(1));
        all.extend(spokes.map(|(&a, &b)| Triangle { vertices: [centre, a, b], polygon: p }));
    }
    (positions, all)
}

/// Whether a triangle faces away from the surface where its polygon's edge crosses it.
pub fn is_flipped(triangle: &Triangle, positions: &[Vec3], crossings: &[Crossing]) -> bool {
    let [a, b, c] = triangle.vertices.map(|v| positions[v as usize]);
    (b - a).cross(c - a).dot(crossings[triangle.polygon as usize].normal) < 0.0
}
