//! The rows of topologically correct marching cubes, each held against the loops that its faces' decisions draw.

use isoforge::table::EDGE_CORNERS;
use isoforge::table::mc33::{FACE_CORNERS, FIRST_CENTRE, MAX_TRIANGLES, MC33, Tunnel};
use std::collections::{BTreeMap, BTreeSet};

fn inside(case: u8, corner: u8) -> bool {
    case >> corner & 1 == 1
}

fn edge_between(a: u8, b: u8) -> u32 {
    (0..12).find(|&e| EDGE_CORNERS[e as usize] == [a.min(b), a.max(b)]).expect("corners of one edge")
}

fn is_ambiguous(case: u8, face: usize) -> bool {
    let [a, b, c, d] = FACE_CORNERS[face].map(|corner| inside(case, corner));
    a == c && b == d && a != b
}

/// The segments on a face, in no direction: each cuts off a run of corners.
fn segments(case: u8, face: usize, joined: bool) -> Vec<BTreeSet<u32>> {
    let corners = FACE_CORNERS[face];
    let edge = |i: usize| edge_between(corners[i % 4], corners[(i + 1) % 4]);
    if is_ambiguous(case, face) {
        // Those that are not joined are cut off one by one.
        let lone = (0..4).filter(|&i| inside(case, corners[i]) != joined);
        return lone.map(|i| BTreeSet::from([edge(i + 3), edge(i)])).collect();
    }
    let crossed: BTreeSet<u32> = (0..4)
        .filter(|&i| inside(case, corners[i]) != inside(case, corners[(i + 1) % 4]))
        .map(edge)
        .collect();
    if crossed.is_empty() { Vec::new() } else { vec![crossed] }
}

/// Groups of corners that are joined on the surface of the cell.
fn groups(case: u8, faces: u32) -> [usize; 8] {
    let mut group = [0, 1, 2, 3, 4, 5, 6, 7];
    let mut join = |a: u8, b: u8| {
        let (from, to) = (group[usize::from(a)], group[usize::from(b)]);
        group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
    };
    for [a, b] in EDGE_CORNERS.into_iter().filter(|[a, b]| inside(case, *a) == inside(case, *b)) {
        join(a, b);
    }
    for face in (0..6).filter(|&face| is_ambiguous(case, face)) {
        let [a, b, c, d] = FACE_CORNERS[face];
        for (one, other) in [(a, c), (b, d)] {
            if inside(case, one) == (faces >> face & 1 == 1) {
                join(one, other);
            }
        }
    }
    group
}

/// What a row says, its open edges, and how its triangles hang together.
#[test]
fn every_row_fills_its_loops() {
    let mut rows = 0;
    for case in 0..=255u8 {
        let ambiguous: Vec<usize> = (0..6).filter(|&face| is_ambiguous(case, face)).collect();
        let opposite = case.count_ones() == 2 || case.count_ones() == 6;
        assert!(
            MC33.is_decided(case) == (ambiguous.is_empty() && !(opposite && is_body_diagonal(case))),
            "case {case}"
        );
        // What emit relies on, which knows cases but for which side is inside (src/stage/emit/cpu/ends.rs).
        assert_eq!(MC33.is_decided(case), MC33.is_decided(!case), "{case:08b}");
        if MC33.is_decided(case) {
            continue;
        }
        for decisions in 0..1u32 << ambiguous.len() {
            let faces =
                ambiguous.iter().enumerate().fold(0, |faces, (i, face)| faces | (decisions >> i & 1) << face);
            let mut seen = Vec::new();
            for tunnel in [Tunnel::None, Tunnel::Inside, Tunnel::Outside] {
                let entry = MC33.entry(
                    case,
                    |face| faces >> face & 1 == 1,
                    |told| {
                        assert_eq!(told, faces);
                        tunnel
                    },
                );
                let triangles: Vec<[u32; 3]> =
                    (0..entry.triangle_count()).map(|i| entry.triangle(i)).collect();
                // A tunnel that cannot be has the row of none.
                let is_new = !seen.contains(&triangles);
                if is_new {
                    check_row(case, faces, tunnel, &triangles, entry.centres(), |i| entry.around(i));
                    rows += 1;
                    seen.push(triangles);
                }
            }
        }
    }
    assert_eq!(rows, 676);
}

fn is_body_diagonal(case: u8) -> bool {
    let lone = if case.count_ones() == 2 { case } else { !case };
    lone.trailing_zeros() + (7 - lone.leading_zeros()) == 7
}

fn check_row(
    case: u8,
    faces: u32,
    tunnel: Tunnel,
    triangles: &[[u32; 3]],
    centres: u32,
    around: impl Fn(u32) -> u32,
) {
    let name = format!("case {case}, faces {faces:06b}, {tunnel:?}");
    assert!(triangles.len() <= MAX_TRIANGLES, "{name}");
    let mut directed = BTreeSet::new();
    for [a, b, c] in triangles {
        for edge in [(*a, *b), (*b, *c), (*c, *a)] {
            assert!(directed.insert(edge), "{name}: {edge:?} twice");
        }
    }
    // Open edges are the faces' segments.
    let open: Vec<(u32, u32)> =
        directed.iter().copied().filter(|&(a, b)| !directed.contains(&(b, a))).collect();
    let drawn: BTreeSet<BTreeSet<u32>> =
        (0..6).flat_map(|face| segments(case, face, faces >> face & 1 == 1)).collect();
    assert_eq!(open.iter().map(|&(a, b)| BTreeSet::from([a, b])).collect::<BTreeSet<_>>(), drawn, "{name}");
    assert_eq!(open.len(), drawn.len(), "{name}");
    // No cut lies in a face: the cell beside could use it, too.
    for &(a, b) in directed.iter().filter(|edge| !open.contains(edge) && edge.0 < 12 && edge.1 < 12) {
        let in_face = |face: &[u8; 4]| {
            [a, b].iter().all(|&e| EDGE_CORNERS[e as usize].iter().all(|c| face.contains(c)))
        };
        assert!(!FACE_CORNERS.iter().any(in_face), "{name}: cut {a}-{b}");
    }
    // Inside lies to the right of a segment, seen from outside the cell: as in the marching cubes table.
    for &(a, b) in &open {
        let face = FACE_CORNERS.iter().position(|face| {
            [a, b].iter().all(|&e| EDGE_CORNERS[e as usize].iter().all(|c| face.contains(c)))
        });
        let (axis, side) = (face.unwrap() / 2, face.unwrap() % 2);
        let middle = |e: u32| {
            let [low, high] = EDGE_CORNERS[e as usize].map(|c| [0, 1, 2].map(|k| f64::from(c >> k & 1)));
            [0, 1, 2].map(|k| (low[k] + high[k]) / 2.0)
        };
        let [low, high] = EDGE_CORNERS[a as usize];
        let solid = if inside(case, low) { low } else { high };
        let (p, q) = (middle(a), middle(b));
        let (u, v) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| f64::from(solid >> k & 1) - p[k]));
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let across = (u[i] * v[j] - u[j] * v[i]) * if side == 1 { 1.0 } else { -1.0 };
        assert!(across < 0.0, "{name}: segment {a}-{b}");
    }
    // Components by their triangles, with their open loops: a disc has one, a tube two.
    let mut part: BTreeMap<u32, u32> = triangles.iter().flatten().map(|&corner| (corner, corner)).collect();
    let mut join = |a: u32, b: u32| {
        let (from, to) = (part[&a], part[&b]);
        part.values_mut().filter(|p| **p == from).for_each(|p| *p = to);
    };
    triangles.iter().for_each(|[a, b, c]| {
        join(*a, *b);
        join(*b, *c);
    });
    let mut next: BTreeMap<u32, u32> = open.iter().copied().collect();
    let mut loops: BTreeMap<u32, i64> = BTreeMap::new();
    while let Some((&start, _)) = next.iter().next() {
        let mut at = start;
        while let Some(to) = next.remove(&at) {
            at = to;
        }
        assert_eq!(at, start, "{name}: the loop closes");
        *loops.entry(part[&start]).or_default() += 1;
    }
    for (&component, &loops) in &loops {
        let vertices = part.values().filter(|p| **p == component).count() as i64;
        let own = triangles.iter().filter(|t| part[&t[0]] == component).count() as i64;
        let outer = open.iter().filter(|(a, _)| part[a] == component).count() as i64;
        // 2 edges = 3 triangles + the open edges.
        assert_eq!(vertices - (3 * own + outer) / 2 + own, 2 - loops, "{name}");
    }
    assert!(part.values().all(|component| loops.contains_key(component)), "{name}: a part without border");
    // Loops are of one component where the corners on both sides of them are joined.
    let mut group = groups(case, faces);
    let sign = |tunnel| match tunnel {
        Tunnel::None => None,
        Tunnel::Inside => Some(true),
        Tunnel::Outside => Some(false),
    };
    if let Some(sign) = sign(tunnel) {
        let own: BTreeSet<usize> =
            (0..8).filter(|&c| inside(case, c) == sign).map(|c| group[usize::from(c)]).collect();
        assert_eq!(own.len(), 2, "{name}: a tunnel joins two groups");
        let (from, to) = (own.first().copied(), own.last().copied());
        group.iter_mut().filter(|g| Some(**g) == from).for_each(|g| *g = to.unwrap_or(*g));
    }
    let sides: BTreeSet<BTreeSet<usize>> = part
        .keys()
        .filter(|&&e| e < FIRST_CENTRE)
        .map(|&e| EDGE_CORNERS[e as usize].map(|c| group[usize::from(c)]).into())
        .collect();
    assert_eq!(sides.len(), loops.len(), "{name}: components");
    // Centres: as many as are named, each in the middle of what is around it.
    let used: BTreeSet<u32> = part.keys().copied().filter(|&corner| corner >= FIRST_CENTRE).collect();
    assert_eq!(used, (FIRST_CENTRE..FIRST_CENTRE + centres).collect(), "{name}");
    for i in 0..centres {
        let fan = triangles.iter().filter(|t| t.contains(&(FIRST_CENTRE + i))).flatten();
        let edges = fan.filter(|&&c| c < FIRST_CENTRE).fold(0, |mask, edge| mask | 1 << edge);
        assert_eq!(around(i), edges, "{name}: centre {i}");
        assert!(edges.count_ones() >= 3, "{name}: centre {i}");
    }
    // Beyond a closed border there is none, where a search of the field would find nothing but the border.
    let is_outside = |face: &[u8; 4]| face.iter().all(|&corner| !inside(case, corner));
    assert!(centres == 0 || !FACE_CORNERS.iter().any(is_outside), "{name}");
    // Four cells of 8 triangles at an edge: what sums of neighbours' normals hold (shaders/normals.wgsl).
    for edge in 0..FIRST_CENTRE {
        assert!(triangles.iter().filter(|t| t.contains(&edge)).count() <= 8, "{name}: edge {edge}");
    }
}
