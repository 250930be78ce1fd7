//! Triangles whose distinct corners lie on a line: flipped where that can be, without a trace in what the mesh encloses.

use std::collections::HashSet;

use glam::{DVec3, Vec3};
use isoforge::extract::{Capped, Method, Options, Source, extract_on_cpu};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::volume::Volume;
use proptest::prelude::*;

use crate::common::Random;
use crate::shapes::mesh;

fn at(mesh: &Mesh, v: u32) -> DVec3 {
    mesh.vertices[v as usize].at().as_dvec3()
}

/// Twice the area, as a vector.
fn area(mesh: &Mesh, [a, b, c]: [u32; 3]) -> DVec3 {
    (at(mesh, b) - at(mesh, a)).cross(at(mesh, c) - at(mesh, a))
}

/// Thin triangles that could be flipped with one that has area, found by looking through the mesh.
fn missed(mesh: &Mesh) -> Vec<[u32; 3]> {
    let edges = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
    let all: Vec<(u32, u32)> = mesh.triangles.iter().flat_map(edges).collect();
    let is_open = |&t: &[u32; 3]| {
        let length = |(a, b): (u32, u32)| at(mesh, a).distance_squared(at(mesh, b));
        let (c, a) = edges(&t).into_iter().max_by(|&s, &t| length(s).total_cmp(&length(t))).unwrap();
        let b = t.into_iter().find(|&v| v != a && v != c).unwrap();
        let over: Vec<[u32; 3]> =
            mesh.triangles.iter().copied().filter(|s| edges(s).contains(&(a, c))).collect();
        let [other] = over[..] else { return false };
        let d = other.into_iter().find(|&v| v != a && v != c).unwrap();
        let is_single = all.iter().filter(|&&edge| edge == (c, a)).count() == 1;
        let is_free = !all.contains(&(b, d)) && !all.contains(&(d, b)) && b != d;
        is_single && is_free && area(mesh, other) != DVec3::ZERO
    };
    mesh.triangles.iter().copied().filter(|&t| area(mesh, t) == DVec3::ZERO && is_open(&t)).collect()
}

/// Cleans a closed manifold and holds the result against every promise.
fn cleaned(before: &Mesh) -> Mesh {
    let mut after = before.clone();
    let removed = after.remove_degenerate();
    let (old, new) = (before.check(), after.check());
    let context = format!("{removed:?}\n{old}\n{new}\n{before:?}\n{after:?}");
    assert!(new.is_closed_manifold() && new.unused_vertices == 0, "{context}");
    assert_eq!(removed.triangles, before.triangles.len() - after.triangles.len(), "{context}");
    // Nothing is turned over: that would leave the volume, but not the area.
    assert!((old.volume - new.volume).abs() <= 1e-9 * old.volume, "{context}");
    assert!((old.area - new.area).abs() <= 1e-9 * old.area, "{context}");
    assert_eq!(missed(&after), <[[u32; 3]; 0]>::default(), "{context}");
    let mut again = after.clone();
    assert_eq!(again.remove_degenerate(), Default::default(), "not idempotent: {context}");
    after
}

/// A tetrahedron with `along` more vertices on its first edge. On one side of it all of them have triangles; on the other
/// the whole edge has one, and between is a polygon of no area, cut at random.
fn seam(along: u32, seed: u64) -> Mesh {
    let end = along as f32 + 1.0;
    let mut positions = vec![[0.0; 3], [end, end, 2.0 * end], [0.0, 4.0, 0.0], [4.0, 0.0, 0.0]];
    positions.extend((1..=along).map(|i| [i as f32, i as f32, 2.0 * i as f32]));
    let mut line: Vec<u32> = (4..4 + along).collect();
    line.insert(0, 0);
    line.push(1);
    let mut triangles = vec![[0, 1, 2], [0, 2, 3], [1, 3, 2]];
    triangles.extend(line.windows(2).map(|side| [side[1], side[0], 3]));
    let mut random = Random(seed);
    while line.len() > 2 {
        let i = random.below(line.len());
        let n = line.len();
        triangles.push([line[(i + n - 1) % n], line[i], line[(i + 1) % n]]);
        line.remove(i);
    }
    // In any order.
    for i in (1..triangles.len()).rev() {
        triangles.swap(i, random.below(i + 1));
    }
    let normal = [0.0, 0.0, 1.0];
    let mut seam = mesh(&positions, &triangles);
    seam.vertices.iter_mut().for_each(|vertex| vertex.normal = normal);
    seam
}

#[test]
fn one_on_an_edge() {
    let mut seam = seam(1, 1);
    seam.triangles = vec![[0, 1, 2], [0, 2, 3], [1, 3, 2], [4, 0, 3], [0, 4, 1], [1, 4, 3]];
    assert_eq!(seam.degenerate_count(), 1);
    let removed = seam.remove_degenerate();
    assert_eq!((removed.triangles, removed.vertices, removed.flipped), (0, 0, 1));
    // In the places of the two that were there.
    assert_eq!(seam.triangles, [[4, 1, 2], [0, 2, 3], [1, 3, 2], [4, 0, 3], [0, 4, 2], [1, 4, 3]]);
}

/// A tetrahedron with a flap on an edge: two triangles back to back, and a thin one between them and the edge.
#[test]
fn flaps_go() {
    let p = [
        [0.0, 0.0, 0.0],
        [0.0, 4.0, 0.0],
        [4.0, 0.0, 0.0],
        [0.0, 0.0, 4.0],
        [2.0, 0.0, 0.0],
        [6.0, 0.0, 0.0],
    ];
    // Corner 4 on the edge from 0 to 2; the flap sticks out from 2 to 5, in the plane of 0, 2 and 3.
    let flap = [[0, 1, 4], [4, 1, 2], [0, 3, 1], [1, 3, 2], [4, 2, 5], [4, 5, 3], [2, 3, 5], [0, 4, 3]];
    for turn in [[0, 1, 2], [0, 2, 1]] {
        let before = mesh(&p, &flap.map(|t| turn.map(|k| t[k])));
        let old = before.check();
        assert!(old.is_closed_manifold() && old.degenerate_triangles == 1, "{old}");
        let mut after = before.clone();
        let removed = after.remove_degenerate();
        assert_eq!((removed.triangles, removed.vertices, removed.flipped), (2, 1, 0));
        let new = after.check();
        assert!(new.is_closed_manifold() && new.degenerate_triangles == 0, "{new}");
        assert_eq!((new.volume, new.area < old.area), (old.volume, true));

        // With another thin triangle on the edge from 4 to 3, which is looked at later.
        let mut more = flap[..7].to_vec();
        more.extend([[0, 4, 6], [0, 6, 3], [4, 3, 6]]);
        let mut positions = p.to_vec();
        positions.push([1.0, 0.0, 2.0]);
        let turned: Vec<[u32; 3]> = more.iter().map(|t| turn.map(|k| t[k])).collect();
        let mut after = mesh(&positions, &turned);
        assert_eq!(after.degenerate_count(), 2);
        let removed = after.remove_degenerate();
        assert_eq!((removed.triangles, removed.vertices, removed.flipped), (2, 1, 1));
        let new = after.check();
        assert!(new.is_closed_manifold() && new.degenerate_triangles == 0, "{new}");
        assert_eq!(new.volume, old.volume);
    }
}

#[test]
fn whole_chains_in_any_order() {
    for along in 1..9 {
        for seed in 0..200 {
            let before = seam(along, seed);
            assert_eq!(before.degenerate_count(), along as usize);
            let after = cleaned(&before);
            assert_eq!(after.degenerate_count(), 0, "{along} {seed}: {before:?}");
            assert_eq!(after.vertices, before.vertices);
        }
    }
    let mut long = seam(20_000, 1);
    assert_eq!((long.remove_degenerate().flipped, long.degenerate_count()), (20_000, 0));
}

/// A box whose lid has vertices at whole places that wandered as long as no triangle was turned over.
fn wandered(n: usize, seed: u64) -> Mesh {
    let mut random = Random(seed);
    let width = n as u32 + 1;
    let number = |x: usize, y: usize| y as u32 * width + x as u32;
    let mut positions: Vec<[f32; 3]> =
        (0..width * width).map(|i| [(3 * (i % width)) as f32, (3 * (i / width)) as f32, 1.0]).collect();
    let mut lid = Vec::new();
    for (x, y) in (0..n * n).map(|i| (i % n, i / n)) {
        let [a, b, c, d] = [number(x, y), number(x + 1, y), number(x + 1, y + 1), number(x, y + 1)];
        lid.extend(if random.below(2) == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
    }
    for _ in 0..60 * n * n {
        let (x, y) = (1 + random.below(n - 1), 1 + random.below(n - 1));
        let v = number(x, y);
        let old = positions[v as usize];
        let step = [random.below(3), random.below(3)].map(|step| step as f32 - 1.0);
        positions[v as usize] = [old[0] + step[0], old[1] + step[1], 1.0];
        let p = |v: u32| Vec3::from(positions[v as usize]);
        let is_up = |&[a, b, c]: &[u32; 3]| {
            // Corners at one place may lie to either side when they have come apart.
            (p(b) - p(a)).cross(p(c) - p(a)).z >= 0.0 && p(a) != p(b) && p(b) != p(c) && p(c) != p(a)
        };
        if !lid.iter().filter(|t| t.contains(&v)).all(is_up) {
            positions[v as usize] = old;
        }
    }
    let count = positions.len() as u32;
    // The sides and the floor: a fan from one vertex below.
    positions.push([1.5 * n as f32, 1.5 * n as f32, -5.0]);
    let mut rim: Vec<u32> = (0..n).map(|i| number(i, 0)).collect();
    rim.extend((0..n).map(|i| number(n, i)));
    rim.extend((0..n).map(|i| number(n - i, n)));
    rim.extend((0..n).map(|i| number(0, n - i)));
    lid.extend((0..rim.len()).map(|i| [rim[(i + 1) % rim.len()], rim[i], count]));
    mesh(&positions, &lid)
}

#[test]
fn wandering_lids() {
    let (mut thin, mut left) = (0, 0);
    for seed in 0..400 {
        let before = wandered(2 + seed as usize % 6, seed);
        assert!(before.check().is_closed_manifold());
        thin += before.degenerate_count();
        left += cleaned(&before).degenerate_count();
    }
    // Of the others the new edge would be a second one between its ends.
    assert!(thin > 1000 && left < thin / 20, "{left} of {thin}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    /// Triangles between vertices at few places, as they come: nothing gets worse, no vertex moves, and it ends.
    #[test]
    fn any_triangles(
        faces in prop::collection::vec(prop::array::uniform3(0u32..14), 0..40),
        lost in prop::option::of(0usize..14),
    ) {
        let mut positions: Vec<[f32; 3]> = (0..12).map(|i| [(i % 4) as f32, (i / 4) as f32, 0.0]).collect();
        positions.extend([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]);
        if let Some(lost) = lost {
            positions[lost][0] = f32::NAN;
        }
        let mut before = mesh(&positions, &faces);
        before.triangles.retain(|&[a, b, c]| a != b && b != c && c != a);
        let mut after = before.clone();
        let removed = after.remove_degenerate();
        prop_assert_eq!(removed.triangles, before.triangles.len() - after.triangles.len());
        let (old, new) = (before.check(), after.check());
        let worst = |r: &isoforge::mesh::check::Report| {
            [r.non_manifold_edges, r.non_manifold_vertices, r.misoriented_edges, r.duplicate_triangles, r.degenerate_triangles]
        };
        for (new, old) in worst(&new).into_iter().zip(worst(&old)) {
            prop_assert!(new <= old, "{removed:?}, {old} → {new}:\n{before:?}\n{after:?}");
        }
        let places = |mesh: &Mesh| -> HashSet<[u32; 3]> {
            mesh.vertices.iter().map(|v| v.position.map(f32::to_bits)).collect()
        };
        prop_assert!(places(&after).is_subset(&places(&before)));
        let mut again = after.clone();
        prop_assert_eq!(again.remove_degenerate(), Default::default());
    }
}

#[test]
fn borders_run_by_the_middle() {
    // A square whose lower side has a thin triangle under it.
    let p = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]];
    let mut square = mesh(&p, &[[0, 4, 3], [4, 1, 2], [4, 2, 3], [0, 1, 4]]);
    let old = square.check();
    let removed = square.remove_degenerate();
    assert_eq!((removed.triangles, removed.vertices, removed.flipped), (1, 0, 0));
    assert_eq!(square.triangles, [[0, 4, 3], [4, 1, 2], [4, 2, 3]]);
    let new = square.check();
    assert_eq!((new.boundary_edges, new.boundary_loops, new.non_manifold_vertices), (5, 1, 0));
    assert_eq!(new.area, old.area);

    // One that ends in a point on the border: the point goes.
    let mut spike = mesh(&p, &[[4, 1, 2], [4, 2, 3], [4, 0, 1]]);
    let removed = spike.remove_degenerate();
    assert_eq!((removed.triangles, removed.vertices), (1, 1));
    assert_eq!(spike.triangles, [[3, 0, 1], [3, 1, 2]]);
    // And one alone.
    let mut alone = mesh(&p, &[[0, 1, 4]]);
    alone.remove_degenerate();
    assert_eq!(alone, Mesh::default());
}

#[test]
fn what_would_harm_stays() {
    // The middle corner is on another border already: without the thin triangle only it would hold both sides together.
    let p = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]];
    let bridge = mesh(&p, &[[0, 4, 3], [4, 1, 2], [0, 1, 4]]);
    // Nor where the longest edge has three triangles, or two that are wound against each other.
    let three = mesh(&p, &[[0, 4, 3], [4, 1, 2], [4, 2, 3], [0, 1, 4], [1, 0, 2], [1, 0, 3]]);
    let against = mesh(&p, &[[0, 4, 3], [4, 1, 2], [4, 2, 3], [0, 1, 4], [0, 1, 2]]);
    // The new edge is there already.
    let mut twice = p.to_vec();
    twice.push([1.0, -2.0, 0.0]);
    let twice = mesh(&twice, &[[0, 1, 4], [1, 0, 5], [4, 5, 3]]);
    // Four triangles around as many corners, and others at three of their edges.
    let p = [p[0], p[4], p[1], p[2], [1.0, -2.0, 0.0]];
    let more = mesh(&p, &[[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 3], [0, 2, 4], [1, 0, 4], [2, 1, 4]]);
    for (name, before) in
        [("bridge", bridge), ("three", three), ("against", against), ("twice", twice), ("more", more)]
    {
        let mut after = before.clone();
        // Vertices without a triangle go.
        let removed = after.remove_degenerate();
        assert_eq!((removed.triangles, removed.flipped, after.degenerate_count()), (0, 0, 1), "{name}");
    }
}

/// Four triangles that are all there is, as marching tetrahedra leave them where noise is equal to iso, go; and nothing else, though it
/// may have a corner of theirs.
///
/// Goes red when `flip` (src/mesh/flip.rs) does not call `vanish`.
#[test]
fn flat_components_vanish() {
    let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [1.0, 1.0, 5.0]];
    let flat = [[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 3]];
    for turn in [[0, 1, 2], [0, 2, 1]] {
        let mut alone = mesh(&p[..4], &flat.map(|t| turn.map(|k| t[k])));
        assert!(alone.check().is_closed_manifold() && alone.degenerate_count() == 1);
        assert_eq!(alone.remove_degenerate().triangles, 4);
        assert_eq!(alone, Mesh::default());

        let mut touched = flat.to_vec();
        touched.extend([[3, 4, 5], [3, 5, 6], [3, 6, 4], [4, 6, 5]]);
        let mut positions = p.to_vec();
        positions.extend([[5.0, 1.0, 1.0], [1.0, 5.0, 1.0]]);
        let mut touched = mesh(&positions, &touched);
        let removed = touched.remove_degenerate();
        assert_eq!((removed.triangles, removed.vertices, touched.degenerate_count()), (4, 3, 0));
        assert!(touched.check().is_closed_manifold());
    }
}

/// Noise up to the largest floats, closed or not: no triangle without area is left.
#[test]
fn huge_noise_leaves_none() {
    let mut random = Random(1);
    for i in 0..40 {
        let grid = Grid::from_bounds([5 + i % 7; 3], Vec3::ZERO, Vec3::splat((5 + i % 7) as f32)).unwrap();
        let values = [-1e38, 1e38, 3e38, -3e38, 2.9e38, 0.0];
        let values = (0..grid.point_count()).map(|_| values[random.below(6)]).collect();
        let volume = Volume::new(grid, values).unwrap();
        for method in Method::ALL {
            let options = Options { method, ..Options::new(0.0) };
            let source = Source::Volume(&volume);
            let capped = Capped::new(&source, &options).unwrap();
            for (source, is_closed) in [(source, false), (capped.source(), true)] {
                let mut mesh = extract_on_cpu(&source, &options, &|_| {}).unwrap().0;
                mesh.remove_degenerate();
                let report = mesh.check();
                assert_eq!(report.degenerate_triangles, 0, "{i}, {method:?}: {report}");
                assert!(!is_closed || report.is_closed_manifold(), "{i}, {method:?}: {report}");
            }
        }
    }
}

/// Two thin triangles over one edge, with the corners between at one place: they go, and the two corners become one.
#[test]
fn a_slit_closes() {
    let at = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 0.0, -1.0],
    ];
    let [a, c, b, d, up, down, tip] = [0, 1, 2, 3, 4, 5, 6];
    let triangles = [
        [a, b, c],
        [a, c, d],
        [b, a, up],
        [c, b, up],
        [d, c, down],
        [a, d, down],
        [up, a, tip],
        [c, up, tip],
        [down, c, tip],
        [a, down, tip],
    ];
    let mut slit = mesh(&at, &triangles);
    let before = slit.check();
    assert_eq!(
        (before.boundary_edges, before.non_manifold_edges, before.degenerate_triangles),
        (0, 0, 2),
        "{before}"
    );
    let removed = slit.remove_degenerate();
    let after = slit.check();
    assert_eq!((removed.triangles, removed.vertices, removed.flipped), (2, 1, 0));
    assert!(
        after.is_closed_manifold() && after.volume == before.volume && after.area == before.area,
        "{after}"
    );
    assert_eq!(slit.remove_degenerate(), Default::default());
}
