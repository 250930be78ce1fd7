//! Simplification: closed, manifold, of the same topology, and near.

use glam::Vec3;
use isoforge::mesh::{Budget, Mesh, Unfit};
use proptest::prelude::*;

use crate::extracted::{named, noise};
use crate::shapes::{both, cube};

/// The distance of a point from a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
fn distance(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    let (vc, vb, va) = (d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4);
    let nearest = if d1 <= 0.0 && d2 <= 0.0 {
        a
    } else if d3 >= 0.0 && d4 <= d3 {
        b
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        a + ab * (d1 / (d1 - d3))
    } else if d6 >= 0.0 && d5 <= d6 {
        c
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        a + ac * (d2 / (d2 - d6))
    } else if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))
    } else {
        a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc))
    };
    p.distance(nearest)
}

/// The largest and the root mean square distance of the old vertices from the new surface.
pub fn distances(old: &Mesh, new: &Mesh) -> [f32; 2] {
    let faces: Vec<[Vec3; 3]> =
        new.triangles.iter().map(|t| t.map(|v| new.vertices[v as usize].at())).collect();
    let each: Vec<f32> = old
        .vertices
        .iter()
        .map(|v| faces.iter().map(|face| distance(v.at(), *face)).fold(f32::MAX, f32::min))
        .collect();
    let square: f32 = each.iter().map(|d| d * d).sum();
    [each.iter().copied().fold(0.0, f32::max), (square / each.len() as f32).sqrt()]
}

#[test]
fn simplified_meshes_stay_closed_and_near() {
    let two = both(&named("torus", 24), &named("sphere", 24), [5.0; 3]);
    for (name, mut mesh) in [
        ("sphere", named("sphere", 24)),
        ("torus", named("torus", 32)),
        ("boy", named("boy", 24)),
        ("both", two),
    ] {
        mesh.remove_degenerate();
        let before = mesh.check();
        // Boy's surface is cut off by the box: thin and open.
        let most = if name == "boy" { 9.0 } else { 4.0 };
        for error in [1e-3, 5e-3, 2e-2] {
            let mut simple = mesh.clone();
            let moved = simple.simplify(&Budget { triangles: 0, error }).unwrap();
            let [largest, rms] = distances(&mesh, &simple);
            println!(
                "{name} {error}: {} of {} triangles, told {moved:.2e}, largest {largest:.2e}, rms {rms:.2e}",
                simple.triangles.len(),
                mesh.triangles.len()
            );
            let after = simple.check();
            assert!(
                moved <= error && rms <= error && largest <= most * error,
                "{name} {error}: {moved} {largest} {rms}"
            );
            assert!(simple.triangles.len() < mesh.triangles.len(), "{name} {error}");
            assert_eq!(
                (after.is_closed_manifold(), after.genus, after.components),
                (before.is_closed_manifold(), before.genus, before.components)
            );
            assert_eq!((after.duplicate_triangles, after.unused_vertices), (0, 0));
            // Vertices are old ones.
            assert!(simple.vertices.iter().all(|v| mesh.vertices.contains(v)));
        }
        for triangles in [mesh.triangles.len() / 2, mesh.triangles.len() / 10] {
            let mut simple = mesh.clone();
            simple.simplify(&Budget { triangles, error: f32::INFINITY }).unwrap();
            let left = simple.triangles.len();
            assert!(
                left + 20 > triangles && (left <= triangles || name == "boy"),
                "{name}: {left} of {triangles}"
            );
            assert_eq!(simple.check().genus, before.genus, "{name} {triangles}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    /// Noise has handles everywhere, of the size of a cell.
    #[test]
    fn closed_noise_stays_closed(n in 3u32..12, seed in any::<u64>(), part in 1usize..100) {
        let mut mesh = noise(n, seed, true);
        mesh.remove_degenerate();
        let before = mesh.check();
        prop_assume!(before.is_closed_manifold());
        let triangles = mesh.triangles.len() * part / 100;
        mesh.simplify(&Budget { triangles, error: f32::INFINITY }).unwrap();
        let after = mesh.check();
        prop_assert!(after.is_closed_manifold() && after.duplicate_triangles == 0, "{}", after);
        prop_assert_eq!((after.components, after.genus), (before.components, before.genus));
    }

    #[test]
    fn open_noise_stays_manifold(n in 3u32..12, seed in any::<u64>(), part in 1usize..100) {
        let mut mesh = noise(n, seed, false);
        mesh.remove_degenerate();
        let before = mesh.check();
        prop_assume!(before.non_manifold_vertices + before.non_manifold_edges == 0);
        let triangles = mesh.triangles.len() * part / 100;
        mesh.simplify(&Budget { triangles, error: f32::INFINITY }).unwrap();
        let after = mesh.check();
        let faults = (after.non_manifold_vertices, after.non_manifold_edges, after.misoriented_edges);
        prop_assert_eq!(faults, (0, 0, 0), "{}", after);
    }
}

#[test]
fn what_is_broken_is_refused() {
    let budget = Budget { triangles: 0, error: 1.0 };
    let mut bad = cube();
    bad.triangles[4][1] = 8;
    assert_eq!(bad.clone().simplify(&budget), Err(Unfit::BadIndex { triangle: 4 }));
    let mut bad = cube();
    bad.vertices[3].position[0] = f32::INFINITY;
    let before = bad.clone();
    assert_eq!(bad.simplify(&budget), Err(Unfit::NotFinite { vertex: 3 }));
    assert_eq!(bad, before);
    for error in [-1.0, f32::NAN, f32::NEG_INFINITY] {
        assert!(matches!(cube().simplify(&Budget { error, ..budget }), Err(Unfit::Error(_))));
    }
    let mut none = Mesh::default();
    none.simplify(&budget).unwrap();
    assert_eq!(none, Mesh::default());
}

/// A tetrahedron has four triangles, and no closed mesh has fewer.
#[test]
fn the_smallest_meshes_stay() {
    let mut mesh = cube();
    mesh.simplify(&Budget { triangles: 0, error: f32::INFINITY }).unwrap();
    assert!(mesh.triangles.len() < 12 && mesh.check().genus == Some(0), "{}", mesh.check());
    let mut sphere = named("sphere", 16);
    sphere.remove_degenerate();
    sphere.simplify(&Budget { triangles: 0, error: f32::INFINITY }).unwrap();
    assert!(sphere.triangles.len() < 40 && sphere.check().genus == Some(0), "{}", sphere.check());
}

/// Two cones, base to base: their tips have 50,000 triangles each, and stay until those are fewer (`hubs_stay` in src/mesh/collapse.rs).
#[test]
fn hubs() {
    let n = 50_000;
    let rim = |i: u32| (i as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
    let mut positions = vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    positions.extend((0..n).map(rim).map(|(y, x)| [x, y, 0.0]));
    let sides = |i: u32| [[0, 2 + i, 2 + (i + 1) % n], [1, 2 + (i + 1) % n, 2 + i]];
    let mut cones = crate::shapes::mesh(&positions, &(0..n).flat_map(sides).collect::<Vec<_>>());
    let before = cones.check();
    let moved = cones.simplify(&Budget { triangles: 1000, error: f32::INFINITY }).unwrap();
    let after = cones.check();
    assert!(after.is_closed_manifold() && cones.triangles.len() == 1000 && moved < 1e-3, "{moved}: {after}");
    assert!((after.volume / before.volume - 1.0).abs() < 1e-3, "{before}\n{after}");
}
