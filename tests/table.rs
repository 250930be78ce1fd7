//! The table against an independent derivation: loops traced face by face from the corner signs.

#[path = "table/mc33.rs"]
mod mc33;
#[path = "table/tetrahedra.rs"]
mod tetrahedra;

use isoforge::table::{EDGE_CORNERS, MARCHING_CUBES};
use std::collections::{BTreeMap, BTreeSet};

/// Corner numbers of each face, counter-clockwise seen from outside the cell, written out by hand.
const FACES: [[u8; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

fn edge_between(a: u8, b: u8) -> u32 {
    (0..12).find(|&e| EDGE_CORNERS[e as usize] == [a.min(b), a.max(b)]).expect("corners of one edge")
}

fn inside(case: u8, corner: u8) -> bool {
    case >> corner & 1 == 1
}

/// The directed segments that a case draws on a face: every run of inside corners is cut off, from
/// the edge where the walk around the face enters it to the edge where it leaves.
fn face_segments(case: u8, face: &[u8; 4]) -> Vec<(u32, u32)> {
    let mut segments = Vec::new();
    for i in 0..4 {
        let before = face[(i + 3) % 4];
        if inside(case, face[i]) && !inside(case, before) {
            let mut last = i;
            while inside(case, face[(last + 1) % 4]) {
                last += 1;
            }
            let (a, b) = (face[last % 4], face[(last + 1) % 4]);
            segments.push((edge_between(before, face[i]), edge_between(a, b)));
        }
    }
    segments
}

fn triangles(case: u8) -> Vec<[u32; 3]> {
    (0..MARCHING_CUBES.triangle_count(case)).map(|i| MARCHING_CUBES.triangle(case, i)).collect()
}

/// Directed triangle edges that no triangle of the case uses the other way round.
fn open_edges(case: u8) -> BTreeSet<(u32, u32)> {
    let all: Vec<_> =
        triangles(case).iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
    let set: BTreeSet<_> = all.iter().copied().collect();
    assert_eq!(set.len(), all.len(), "case {case} uses a directed edge twice");
    set.iter().copied().filter(|&(a, b)| !set.contains(&(b, a))).collect()
}

#[test]
fn edges_are_numbered_by_axis_and_lower_corner() {
    for (e, [a, b]) in EDGE_CORNERS.iter().enumerate() {
        let axis = e / 4;
        assert_eq!(b - a, 1 << axis);
        let (others, k) = ([[1, 2], [0, 2], [0, 1]][axis], (e % 4) as u8);
        assert_eq!(*a, (k & 1) << others[0] | (k >> 1) << others[1]);
    }
}

#[test]
fn every_crossed_edge_is_used_and_no_other() {
    for case in 0..=255 {
        let used: BTreeSet<u32> = triangles(case).into_iter().flatten().collect();
        let crossed: BTreeSet<u32> = (0..12)
            .filter(|&e| {
                inside(case, EDGE_CORNERS[e as usize][0]) != inside(case, EDGE_CORNERS[e as usize][1])
            })
            .collect();
        assert_eq!(used, crossed, "case {case}");
    }
}

#[test]
fn triangles_fill_the_loops_traced_on_the_faces() {
    for case in 0..=255 {
        let traced: BTreeSet<(u32, u32)> = FACES.iter().flat_map(|f| face_segments(case, f)).collect();
        assert_eq!(open_edges(case), traced, "case {case}");
        // n corners a loop make n - 2 triangles: no handle, no missing piece.
        let mut next: BTreeMap<u32, u32> = traced.iter().copied().collect();
        assert_eq!(next.len(), traced.len());
        let mut expected = 0;
        while let Some((&start, _)) = next.iter().next() {
            let (mut at, mut length) = (start, 0);
            while let Some(to) = next.remove(&at) {
                (at, length) = (to, length + 1);
            }
            assert_eq!(at, start, "case {case}: the loop closes");
            expected += length - 2;
        }
        assert_eq!(triangles(case).len(), expected, "case {case}");
        assert!(expected <= 5);
    }
}

#[test]
fn neighbours_agree_on_every_shared_face() {
    for axis in 0..3u8 {
        let (low, high) = (FACES[2 * axis as usize], FACES[2 * axis as usize + 1]);
        assert!(low.iter().all(|c| c >> axis & 1 == 0) && high.iter().all(|c| c >> axis & 1 == 1));
        for pattern in 0..16u8 {
            // Any case with this pattern on its high face beside any with it on its low face.
            let on_face = |case: u8, face: &[u8; 4]| {
                let mut corners = *face;
                corners.sort_unstable();
                (0..4).all(|i| inside(case, corners[i]) == (pattern >> i & 1 == 1))
            };
            // The edge of the next cell that is this one's: one step back along the axis.
            let back = |e: u32| {
                let [a, b] = EDGE_CORNERS[e as usize];
                edge_between(a & !(1 << axis), b & !(1 << axis))
            };
            let on = |e: u32, face: &[u8; 4]| EDGE_CORNERS[e as usize].iter().all(|c| face.contains(c));
            let segments = |case, face: [u8; 4]| {
                open_edges(case).into_iter().filter(move |&(a, b)| on(a, &face) && on(b, &face))
            };
            let mut views = BTreeSet::new();
            for case in (0..=255).filter(|&c| on_face(c, &high)) {
                views.insert(segments(case, high).map(|(a, b)| (back(a), back(b))).collect::<BTreeSet<_>>());
            }
            for case in (0..=255).filter(|&c| on_face(c, &low)) {
                views.insert(segments(case, low).map(|(a, b)| (b, a)).collect());
            }
            assert_eq!(views.len(), 1, "axis {axis}, pattern {pattern:04b}");
        }
    }
}

#[test]
fn no_cut_lies_in_a_face() {
    for case in 0..=255 {
        let open = open_edges(case);
        for t in triangles(case) {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let one_face = FACES
                    .iter()
                    .any(|f| [a, b].iter().all(|&e| EDGE_CORNERS[e as usize].iter().all(|c| f.contains(c))));
                assert!(open.contains(&(a, b)) || !one_face, "case {case}: cut {a}-{b}");
            }
        }
    }
}

#[test]
fn winding_is_outwards() {
    // With vertices at edge midpoints, every triangle's plane has the loop's inside corners on its
    // back: checked where one corner is cut off, and by volume for the rest.
    let midpoint = |e: u32| {
        let [a, b] = EDGE_CORNERS[e as usize].map(|c| [c & 1, c >> 1 & 1, c >> 2].map(f64::from));
        [0, 1, 2].map(|i| (a[i] + b[i]) / 2.0)
    };
    for corner in 0..8u8 {
        let t = triangles(1 << corner);
        let [p, q, r] = t[0].map(midpoint);
        let (u, v) = ([0, 1, 2].map(|i| q[i] - p[i]), [0, 1, 2].map(|i| r[i] - p[i]));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let to_corner = [0, 1, 2].map(|i| f64::from(corner >> i & 1) - p[i]);
        let side: f64 = (0..3).map(|i| normal[i] * to_corner[i]).sum();
        assert!(t.len() == 1 && side < 0.0, "corner {corner}");
    }
    // Every other case shares its loops' directions with these through the face rule, which
    // `triangles_fill_the_loops_traced_on_the_faces` holds; the direction itself is checked above.
}
