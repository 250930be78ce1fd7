//! The cases of marching tetrahedra, held against the signs of the tetrahedra's corners.

use isoforge::table::tetrahedra::{MARCHING_TETRAHEDRA, MAX_TRIANGLES};
use std::collections::{BTreeMap, BTreeSet};

/// The six orders of the axes.
const ORDERS: [[u8; 3]; 6] = [[1, 2, 4], [1, 4, 2], [2, 1, 4], [2, 4, 1], [4, 1, 2], [4, 2, 1]];

fn ends(edge: u32) -> [u8; 2] {
    let (low, direction) = ((edge & 7) as u8, (edge >> 3 & 7) as u8);
    assert_eq!(low & direction, 0, "an edge leads upwards");
    [low, low | direction]
}

fn place(edge: u32) -> [f64; 3] {
    let [a, b] = ends(edge).map(|c| [0, 1, 2].map(|k| f64::from(c >> k & 1)));
    [0, 1, 2].map(|k| (a[k] + b[k]) / 2.0)
}

#[test]
fn each_tetrahedron_is_cut_where_its_corners_differ() {
    for case in 0..=255u8 {
        let inside = |corner: u8| case >> corner & 1 == 1;
        let triangles: Vec<[u32; 3]> =
            MARCHING_TETRAHEDRA.triangles(case).iter().map(|t| [t & 63, t >> 6 & 63, t >> 12 & 63]).collect();
        assert!(triangles.len() <= MAX_TRIANGLES);
        let mut expected = 0;
        let mut crossed = BTreeSet::new();
        for order in ORDERS {
            let corners = [0, order[0], order[0] | order[1], 7];
            let count = corners.iter().filter(|&&c| inside(c)).count();
            expected += [0, 1, 2, 1, 0][count];
            for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                if inside(corners[i]) != inside(corners[j]) {
                    crossed.insert([corners[i], corners[j]]);
                }
            }
        }
        assert_eq!(triangles.len(), expected, "case {case}");
        assert_eq!(
            triangles.iter().flatten().map(|&e| ends(e)).collect::<BTreeSet<_>>(),
            crossed,
            "case {case}"
        );
        for t in &triangles {
            // All three edges are of one tetrahedron, whose inside corners are behind the triangle.
            let corners: BTreeSet<u8> = t.iter().flat_map(|&e| ends(e)).collect();
            let is_chain = corners.iter().zip(corners.iter().skip(1)).all(|(a, b)| a & b == *a);
            assert!(is_chain && corners.len() <= 4, "case {case}: {corners:?}");
            let [p, q, r] = t.map(place);
            let (u, v) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            for &corner in &corners {
                let way: f64 = (0..3).map(|k| (f64::from(corner >> k & 1) - p[k]) * normal[k]).sum();
                assert!(if inside(corner) { way < 1e-9 } else { way > -1e-9 }, "case {case}: {t:?}");
            }
        }
        // Open edges lie in faces of the cell, each once.
        let mut uses: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for [a, b, c] in triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *uses.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
            }
        }
        for ([a, b], sum) in uses {
            let in_face = (0..3).any(|k| {
                let sides: BTreeSet<u8> = [a, b].into_iter().flat_map(ends).map(|c| c >> k & 1).collect();
                sides.len() == 1
            });
            assert!(sum == 0 || (sum.abs() == 1 && in_face), "case {case}: {a}-{b}");
        }
    }
}
