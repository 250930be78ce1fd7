//! Whether a node needs splitting, by the polygon that its corners make: Bloomenthal 1988, § 3.
//!
//! It does if the corners make more than one polygon, if the polygon's vertices are not in a plane, or if the surface
//! turns too far between them and the middle. The plane is the tangent plane at the middle; that in addition the
//! middle is near the surface bounds the polygon's distance to it.

use super::super::criterion::Criterion;
use super::super::fields::Fields;
use super::super::tree::{Sampled, Verdict};
use super::super::vertices::unit;
use crate::field::NoForm;
use crate::table::EDGE_CORNERS;
use glam::{UVec3, Vec3};

/// Times ε that a vertex may be away from the plane, and the middle from the surface: triangles between them are
/// nearer, and those that are not are measured later.
const SLACK: f32 = 2.0;
/// The cosine of the largest angle between the normals at a vertex and at the middle: 30°.
const TURN: f32 = 0.866;

/// See [`super::super::tree::Tree::grow`].
///
/// # Errors
/// [`NoForm`] as [`crate::field::Surface::values`].
pub fn verdicts(
    criterion: &Criterion<'_>,
    fields: &Fields,
    nodes: &[Sampled<'_>],
) -> Result<Vec<Verdict>, NoForm> {
    let mut verdicts = Vec::with_capacity(nodes.len());
    // Points on the edges of those nodes that are in question, and where each one's end.
    let (mut points, mut of) = (Vec::new(), Vec::new());
    let mut asked = Vec::new();
    for (i, Sampled { node, lattice }) in nodes.iter().enumerate() {
        let verdict = criterion.by_signs(fields, node, lattice);
        verdicts.push(verdict.unwrap_or(Verdict::Split));
        if verdict.is_some() || !is_one_polygon(&node.values) {
            continue;
        }
        let crossing = |a: u8, b: u8| {
            let lattice_point = |c: u8| {
                let at = UVec3::new(u32::from(c) & 1, u32::from(c) >> 1 & 1, u32::from(c) >> 2);
                (at.x + 3 * at.y + 9 * at.z) as usize
            };
            // Through the edge's middle, whose sign is that of an end.
            let (low, high) = (2 * lattice_point(a), 2 * lattice_point(b));
            let ends = [low, (low + high) / 2, high];
            let half = usize::from((lattice[ends[0]] < 0.0) == (lattice[ends[1]] < 0.0));
            let (from, to) = (lattice[ends[half]], lattice[ends[half + 1]]);
            let t = from / (from - to);
            let t = if t.is_finite() { t } else { 0.5 };
            let position = |i: usize| {
                let at = UVec3::new(i as u32 % 3, i as u32 / 3 % 3, i as u32 / 9);
                criterion.grid.position((node.low + at * (node.size / 2)).as_vec3())
            };
            position(ends[half]).lerp(position(ends[half + 1]), t)
        };
        let is_crossed =
            |[a, b]: &[u8; 2]| (node.values[usize::from(*a)] < 0.0) != (node.values[usize::from(*b)] < 0.0);
        points.extend(EDGE_CORNERS.iter().filter(|e| is_crossed(e)).map(|[a, b]| crossing(*a, *b)));
        of.resize(points.len(), node.field);
        asked.push((i, points.len()));
    }
    let mut normals = on_surface(criterion, fields, &of, &mut points)?;
    let mut begin = 0;
    let mut middles = Vec::with_capacity(asked.len());
    for &(_, end) in &asked {
        middles.push(points[begin..end].iter().sum::<Vec3>() / (end - begin) as f32);
        begin = end;
    }
    let feet_of: Vec<u32> = asked.iter().map(|&(i, _)| nodes[i].node.field).collect();
    let mut feet = middles.clone();
    let middle_normals = on_surface(criterion, fields, &feet_of, &mut feet)?;
    let most = SLACK * criterion.error;
    let mut vertices = points.iter().zip(normals.drain(..));
    begin = 0;
    for (k, &(i, end)) in asked.iter().enumerate() {
        let (middle, normal) = (middles[k], middle_normals[k]);
        let is_flat = vertices.by_ref().take(end - begin).fold(true, |flat, (p, n)| {
            flat && (*p - middle).dot(normal).abs() <= most && n.dot(normal) >= TURN
        });
        begin = end;
        if is_flat && feet[k].distance(middle) <= most {
            verdicts[i] = Verdict::Keep;
        }
    }
    Ok(verdicts)
}

/// Moves points by one step to the surface, and gives its unit normals there: zero where there are none.
fn on_surface(
    criterion: &Criterion<'_>,
    fields: &Fields,
    of: &[u32],
    points: &mut [Vec3],
) -> Result<Vec<Vec3>, NoForm> {
    let (mut values, mut gradients) = (vec![0.0; points.len()], vec![Vec3::ZERO; points.len()]);
    fields.values(criterion.surface, of, points, &mut values)?;
    fields.gradients(criterion.surface, of, points, &mut gradients)?;
    for ((point, value), gradient) in points.iter_mut().zip(values).zip(&gradients) {
        *point -= *gradient * (value / gradient.length_squared());
    }
    Ok(gradients.into_iter().map(unit).collect())
}

/// Whether the corners make one polygon and no ambiguous face: just if the corners inside hang together along edges,
/// and those outside, too. (The edges between them are a bond of the cube's graph, its dual is a simple cycle.)
fn is_one_polygon(values: &[f32; 8]) -> bool {
    let inside = (0..8).fold(0u8, |bits, c| bits | u8::from(values[c] < 0.0) << c);
    let hangs_together = |set: u8| {
        let mut reached = set & set.wrapping_neg();
        loop {
            let r = reached;
            let along_x = (r & 0x55) << 1 | (r & 0xAA) >> 1;
            let along_y = (r & 0x33) << 2 | (r & 0xCC) >> 2;
            let next = (r | along_x | along_y | r << 4 | r >> 4) & set;
            if next == r {
                return r == set;
            }
            reached = next;
        }
    };
    hangs_together(inside) && hangs_together(!inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::MARCHING_CUBES;

    /// A case of k polygons has 2 k triangles fewer than crossed edges.
    #[test]
    fn one_polygon_as_in_the_table() {
        let mut one = 0;
        for case in 1..255u8 {
            let values = std::array::from_fn(|c| if case >> c & 1 == 1 { -1.0 } else { 1.0 });
            let inside = |c: u8| case >> c & 1 == 1;
            let crossed = EDGE_CORNERS.iter().filter(|[a, b]| inside(*a) != inside(*b)).count() as u32;
            let is_ambiguous = |f: [u8; 4]| {
                inside(f[0]) == inside(f[3]) && inside(f[1]) == inside(f[2]) && inside(f[0]) != inside(f[1])
            };
            let faces = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 3, 6, 7], [0, 2, 4, 6], [1, 3, 5, 7]];
            let expected =
                MARCHING_CUBES.triangle_count(case) + 2 == crossed && !faces.into_iter().any(is_ambiguous);
            assert_eq!(is_one_polygon(&values), expected, "case {case}");
            one += u32::from(expected);
        }
        assert!((100..200).contains(&one), "{one}");
    }
}
