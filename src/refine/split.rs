//! How a triangle is cut whose edges are split, and which edges are split besides those that are not flat; twin
//! of `shaders/refine/marks.wgsl` and `cut.wgsl`.

use super::Settings;
use super::edges::Edges;
use crate::field::unit::length;
use crate::mesh::Vertex;
use glam::Vec3;

/// What stands for the midpoint of an edge that is not split.
pub(super) const NONE: u32 = u32::MAX;

/// The product of two vectors, in the order of additions that the shader has.
pub(super) fn dot(a: Vec3, b: Vec3) -> f32 {
    (a.x * b.x + a.y * b.y) + a.z * b.z
}

/// Whether an edge of this length runs along the surface: the normals at its ends differ little, or it lies in the
/// tangent plane at one of them. So does an edge from a vertex on a sharp edge of the solid, which has
/// the normal of one side, to one on the other side; over an arc that is not flat it is far from both planes, by the
/// sine of half the angle.
pub(super) fn is_flat(a: &Vertex, b: &Vertex, length: f32, settings: &Settings) -> bool {
    let (n, m) = (Vec3::from(a.normal), Vec3::from(b.normal));
    let along = b.at() - a.at();
    let least = (length * 0.5) * settings.least();
    dot(n, m) >= settings.flatness || dot(n, along).abs() <= least || dot(m, along).abs() <= least
}

/// Which edge of a triangle is its longest: of equal ones the one with the lower number.
pub(super) fn longest(lengths: &[f32], [a, b, c]: [u32; 3]) -> u32 {
    let longer = |a: u32, b: u32| {
        let (la, lb) = (lengths[a as usize], lengths[b as usize]);
        if lb > la || (lb == la && b < a) { b } else { a }
    };
    longer(longer(a, b), c)
}

/// Marks the longest edge of each triangle that has a marked one, until nothing changes (Rivara 1984): so no
/// angle is halved more than once, and triangles keep their shape over any number of levels. The closure of the
/// marks is the same in whatever order triangles are looked at.
pub(super) fn close(edges: &Edges, lengths: &[f32], marks: &mut [bool]) {
    loop {
        let mut changed = false;
        for of in &edges.of {
            if of.iter().any(|&edge| marks[edge as usize]) {
                let longest = longest(lengths, *of) as usize;
                changed |= !marks[longest];
                marks[longest] = true;
            }
        }
        if !changed {
            return;
        }
    }
}

/// The normal of a triangle, twice its area long.
pub(super) fn area(vertices: &[Vertex], [a, b, c]: [u32; 3]) -> Vec3 {
    let [a, b, c] = [a, b, c].map(|i| vertices[i as usize].at());
    let (u, v) = (b - a, c - a);
    Vec3::new(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x)
}

/// Whether a triangle faces the way that the normals of its corners do, or the way that the triangle did that it
/// is a part of: at a sharp edge one of them may mislead.
pub(super) fn faces_outwards(vertices: &[Vertex], triangle: [u32; 3], whole: Vec3) -> bool {
    let [a, b, c] = triangle.map(|i| Vec3::from(vertices[i as usize].normal));
    let area = area(vertices, triangle);
    dot(area, (a + b) + c) > 0.0 || dot(area, whole) > 0.0
}

/// The parts of a triangle.
pub(super) struct Parts {
    triangles: [[u32; 3]; 4],
    count: usize,
}

impl Parts {
    pub(super) fn as_slice(&self) -> &[[u32; 3]] {
        &self.triangles[..self.count]
    }
}

/// How many parts there are.
pub(super) fn part_count(middles: [u32; 3]) -> u32 {
    1 + middles.iter().map(|&m| u32::from(m != NONE)).sum::<u32>()
}

/// Cuts a triangle whose edge from corner k to the next has its midpoint at vertex `middles[k]`, or none.
///
/// Where a quadrilateral is left, it is cut along the shorter diagonal, unless only along the other
/// both halves face outwards. The parts are wound as the whole is.
pub(super) fn cut(vertices: &[Vertex], corners: [u32; 3], middles: [u32; 3]) -> Parts {
    // Turned so that an only midpoint, or an only edge without one, is the first.
    let (count, whole) = (part_count(middles), area(vertices, corners));
    let turn = match count {
        2 => middles.iter().position(|&m| m != NONE),
        3 => middles.iter().position(|&m| m == NONE),
        4 => Some(opposite_longest(vertices, corners)),
        _ => None,
    };
    let turn = turn.unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|k| corners[(k + turn) % 3]);
    let [ab, bc, ca] = [0, 1, 2].map(|k| middles[(k + turn) % 3]);
    let mut parts = Parts { triangles: [[a, b, c]; 4], count: count as usize };
    let [first, second, third, fourth] = &mut parts.triangles;
    match count {
        2 => [*first, *second] = [[a, ab, c], [ab, b, c]],
        3 => {
            [*first, *second] = halves(vertices, [a, b, bc, ca], whole);
            *third = [bc, c, ca];
        }
        4 => {
            [*first, *second] = halves(vertices, [a, ab, bc, ca], whole);
            [*third, *fourth] = [[ab, b, bc], [bc, c, ca]];
        }
        _ => {}
    }
    parts
}

/// The corner that the longest side lies opposite to; of equal sides, the one opposite to the first.
fn opposite_longest(vertices: &[Vertex], corners: [u32; 3]) -> usize {
    let at = corners.map(|i| vertices[i as usize].at());
    let side = [0, 1, 2].map(|k| length(at[(k + 2) % 3] - at[(k + 1) % 3]));
    let first = usize::from(side[1] > side[0]);
    if side[2] > side[first] { 2 } else { first }
}

/// A quadrilateral in two.
fn halves(vertices: &[Vertex], [a, b, c, d]: [u32; 4], whole: Vec3) -> [[u32; 3]; 2] {
    let at = |i: u32| vertices[i as usize].at();
    let along_ac = [[a, b, c], [a, c, d]];
    let along_bd = [[a, b, d], [b, c, d]];
    let good = |halves: &[[u32; 3]; 2]| halves.iter().all(|&t| faces_outwards(vertices, t, whole));
    let is_shorter = length(at(c) - at(a)) <= length(at(d) - at(b));
    let (preferred, other) = if is_shorter { (along_ac, along_bd) } else { (along_bd, along_ac) };
    if good(&preferred) || !good(&other) { preferred } else { other }
}
