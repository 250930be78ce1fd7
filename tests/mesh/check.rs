use std::collections::{HashMap, HashSet};

use isoforge::mesh::Mesh;
use isoforge::mesh::check::{DefectKind, Report};
use proptest::prelude::*;

use crate::shapes::{both, cube, mesh, renamed, tetrahedron, torus};

/// boundary, non-manifold edges and vertices, misoriented, degenerate, duplicate.
fn defects(r: &Report) -> [usize; 6] {
    [
        r.boundary_edges,
        r.non_manifold_edges,
        r.non_manifold_vertices,
        r.misoriented_edges,
        r.degenerate_triangles,
        r.duplicate_triangles,
    ]
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12 * b.abs().max(1.0)
}

#[test]
fn closed_shapes() {
    let r = tetrahedron().check();
    assert!(!r.has_defects() && r.is_closed_manifold() && r.defects.is_empty());
    assert_eq!((r.vertices, r.triangles, r.components, r.euler, r.genus), (4, 4, 1, 2, Some(0)));
    assert!(near(r.area, 1.5 + 3f64.sqrt() / 2.0) && near(r.volume, 1.0 / 6.0));
    assert_eq!(r.bounds, Some([[0.0; 3], [1.0; 3]]));

    let r = cube().check();
    assert_eq!((defects(&r), r.genus, r.euler), ([0; 6], Some(0), 2));
    assert!(near(r.area, 6.0) && near(r.volume, 1.0));

    let r = torus(5, 7).check();
    assert_eq!((defects(&r), r.genus, r.euler, r.components), ([0; 6], Some(1), 0, 1));
    assert!(r.volume > 0.0);

    let r = both(&torus(5, 7), &cube(), [9.0; 3]).check();
    assert_eq!((defects(&r), r.genus, r.euler, r.components), ([0; 6], Some(1), 2, 2));
}

#[test]
fn volume_keeps_its_digits_far_from_the_origin() {
    let mut far = cube();
    far.vertices.iter_mut().for_each(|v| v.position = (v.at() + 4.0e6).to_array());
    assert!(near(far.check().volume, 1.0));
}

#[test]
fn open_shapes() {
    let mut hole = cube();
    hole.triangles.remove(3);
    let r = hole.check();
    assert_eq!((defects(&r), r.genus, r.euler), ([3, 0, 0, 0, 0, 0], None, 1));
    assert!(r.has_defects());
    assert_eq!(r.defects.len(), 3);
    assert_eq!(r.defects[0].kind, DefectKind::BoundaryEdge);
    assert_eq!((&r.defects[0].vertices[..], &r.defects[0].triangles[..]), (&[4, 6][..], &[7][..]));
    assert_eq!(r.defects[0].positions, [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]]);

    // A Möbius strip of 5 quads: one rim, and wound against itself along one cut.
    let corners: Vec<[f32; 3]> = (0..10).map(|i| [i as f32, (i * i % 7) as f32, (i % 2) as f32]).collect();
    let mut strip = Vec::new();
    for i in 0..5 {
        let [a, b] = [2 * i, 2 * i + 1];
        let [c, d] = if i == 4 { [1, 0] } else { [a + 2, b + 2] };
        strip.extend([[a, c, b], [b, c, d]]);
    }
    let r = mesh(&corners, &strip).check();
    assert_eq!((defects(&r), r.euler, r.genus), ([10, 0, 0, 1, 0, 0], 0, None));
}

#[test]
fn shapes_that_touch() {
    // Vertex 4 of the second becomes vertex 0 of the first.
    let two = both(&tetrahedron(), &tetrahedron(), [-1.0; 3]);
    let r = renamed(two.clone(), &[(4, 0)]).check();
    assert_eq!((defects(&r), r.components, r.unused_vertices), ([0, 0, 1, 0, 0, 0], 1, 1));
    assert_eq!((r.euler, r.genus), (3, None));
    assert_eq!((r.defects[0].kind, &r.defects[0].vertices[..]), (DefectKind::NonManifoldVertex, &[0][..]));

    let r = renamed(two, &[(4, 0), (5, 1)]).check();
    assert_eq!((defects(&r), r.components), ([0, 1, 2, 0, 0, 0], 1));
    assert_eq!((r.defects[0].kind, &r.defects[0].vertices[..]), (DefectKind::NonManifoldEdge, &[0, 1][..]));
    assert_eq!(r.defects[0].triangles, [0, 1, 4, 5]);
}

#[test]
fn broken_triangles() {
    let mut flipped = cube();
    flipped.triangles[5].swap(0, 1);
    assert_eq!(defects(&flipped.check()), [0, 0, 0, 3, 0, 0]);

    let mut doubled = tetrahedron();
    doubled.triangles.extend([[3, 1, 2], [2, 1, 3]]);
    let r = doubled.check();
    assert_eq!(defects(&r), [0, 3, 3, 0, 0, 2]);
    let places: Vec<_> = r.defects.iter().filter(|d| d.kind == DefectKind::DuplicateTriangle).collect();
    assert_eq!((places.len(), &places[0].triangles[..]), (2, &[3, 4][..]));

    // A repeated vertex leaves the rest closed; equal and collinear positions are found in their place.
    let mut repeated = tetrahedron();
    repeated.triangles.push([1, 1, 2]);
    let r = repeated.check();
    assert_eq!((defects(&r), r.genus), ([0, 0, 0, 0, 1, 0], Some(0)));
    let flat =
        mesh(&[[0.1; 3], [0.2; 3], [0.4; 3], [0.1; 3], [0.5, 0.0, 0.0]], &[[0, 1, 2], [0, 3, 4], [0, 1, 4]]);
    assert_eq!((flat.check().degenerate_triangles, flat.degenerate_count()), (2, 2));

    let mut wild = tetrahedron();
    wild.triangles.extend([[0, 1, 9], [u32::MAX, 0, 0]]);
    wild.vertices.push(wild.vertices[0]);
    wild.vertices[4].position[1] = f32::NAN;
    let r = wild.check();
    assert_eq!((r.bad_indices, r.non_finite_vertices, r.unused_vertices, r.genus), (2, 1, 1, None));
    assert!(near(r.volume, 1.0 / 6.0));
    assert!(
        r.defects.iter().any(|d| d.kind == DefectKind::BadIndex && d.vertices == [9] && d.triangles == [4])
    );
    assert!(r.to_string().contains("bad index: vertex 9, triangle 4"), "{r}");
}

#[test]
fn nothing_and_loose_vertices() {
    let r = Mesh::default().check();
    assert_eq!((r.components, r.euler, r.genus, r.bounds), (0, 0, None, None));
    assert!(!r.has_defects() && !r.is_closed_manifold());
    let r = mesh(&[[1.0, 2.0, 3.0]], &[]).check();
    assert_eq!((r.components, r.euler, r.unused_vertices), (0, 0, 1));
}

#[test]
fn json_has_the_promised_keys_in_order() {
    let json = serde_json::to_string(&Mesh::default().check()).unwrap();
    let keys: Vec<&str> = json.split(['{', ',']).filter_map(|part| part.split('"').nth(1)).collect();
    let promised = [
        "vertices",
        "triangles",
        "boundary_edges",
        "non_manifold_edges",
        "non_manifold_vertices",
        "misoriented_edges",
        "degenerate_triangles",
        "duplicate_triangles",
        "components",
        "euler",
        "genus",
        "area",
        "volume",
        "bounds",
    ];
    assert_eq!(keys[..14], promised);
    assert!(json.contains(r#""genus":null"#) && json.contains(r#""bounds":null"#), "{json}");
    let json: serde_json::Value = serde_json::to_value(cube().check()).unwrap();
    assert_eq!(json["bounds"], serde_json::json!([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]));
    assert_eq!(json["genus"], 0);
}

/// The same questions answered with maps and searches.
fn by_hand(mesh: &Mesh) -> ([usize; 6], usize, i64) {
    let count = mesh.vertices.len() as u32;
    let proper: Vec<[u32; 3]> = mesh
        .triangles
        .iter()
        .copied()
        .filter(|t| t.iter().collect::<HashSet<_>>().len() == 3 && t.iter().all(|&v| v < count))
        .collect();
    let mut edges: HashMap<[u32; 2], Vec<bool>> = HashMap::new();
    let mut sets: HashMap<Vec<u32>, usize> = HashMap::new();
    for t in &proper {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            edges.entry([a.min(b), a.max(b)]).or_default().push(a < b);
        }
        let mut set = t.to_vec();
        set.sort();
        *sets.entry(set).or_default() += 1;
    }
    let crowded: HashSet<[u32; 2]> = edges.iter().filter(|e| e.1.len() > 2).map(|e| *e.0).collect();
    let reach = |from: usize, linked: &dyn Fn(&[u32; 3], &[u32; 3]) -> bool, among: &[[u32; 3]]| {
        let (mut seen, mut waiting) = (HashSet::from([from]), vec![from]);
        while let Some(i) = waiting.pop() {
            for j in 0..among.len() {
                if linked(&among[i], &among[j]) && seen.insert(j) {
                    waiting.push(j);
                }
            }
        }
        seen
    };
    let mut pinched = 0;
    for v in 0..count {
        let ring: Vec<[u32; 3]> = proper.iter().copied().filter(|t| t.contains(&v)).collect();
        let share = |a: &[u32; 3], b: &[u32; 3]| a.iter().any(|x| *x != v && b.contains(x));
        let bad = crowded.iter().any(|e| e.contains(&v));
        pinched += usize::from(!ring.is_empty() && (bad || reach(0, &share, &ring).len() < ring.len()));
    }
    let share = |a: &[u32; 3], b: &[u32; 3]| a.iter().any(|x| b.contains(x));
    let pieces: HashSet<usize> =
        (0..proper.len()).map(|i| *reach(i, &share, &proper).iter().min().unwrap()).collect();
    let used: HashSet<u32> = proper.iter().flatten().copied().collect();
    let flat = |t: &&[u32; 3]| {
        if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
            return true;
        }
        if t.iter().any(|&v| v >= count) {
            return false;
        }
        // Small integers: exact in i64.
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize].position.map(|x| x as i64));
        let (u, w) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        (0..3).all(|k| u[k] * w[(k + 1) % 3] == u[(k + 1) % 3] * w[k])
    };
    let counts = [
        edges.values().filter(|e| e.len() == 1).count(),
        crowded.len(),
        pinched,
        edges.values().filter(|e| e.len() == 2 && e[0] == e[1]).count(),
        mesh.triangles.iter().filter(flat).count(),
        sets.values().map(|n| n - 1).sum(),
    ];
    (counts, pieces.len(), used.len() as i64 - edges.len() as i64 + proper.len() as i64)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn counts_as_by_hand(
        corners in prop::collection::vec(prop::array::uniform3(0i8..3), 1..9),
        triangles in prop::collection::vec(prop::array::uniform3(0u32..9), 0..14),
    ) {
        let corners: Vec<[f32; 3]> = corners.iter().map(|p| p.map(f32::from)).collect();
        let soup = mesh(&corners, &triangles);
        let r = soup.check();
        prop_assert_eq!((defects(&r), r.components, r.euler), by_hand(&soup));
        prop_assert_eq!(r.degenerate_triangles, soup.degenerate_count());
        let named: usize = defects(&r).iter().map(|n| n.min(&5)).sum();
        prop_assert_eq!(r.defects.len(), named + r.bad_indices.min(5));
    }
}
