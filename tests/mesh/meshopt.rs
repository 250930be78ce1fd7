//! Order and strips: the feature `meshopt`; and our simplification beside its.

use std::collections::BTreeMap;

use isoforge::mesh::{Budget, Mesh, Unfit, triangles_of_strip};
use meshopt::{SimplifyOptions, VertexDataAdapter};

use crate::common::Random;
use crate::extracted::{named, noise};
use crate::shapes::{cube, torus};
use crate::simplify::distances;

/// How often each triangle is there: by its corners' positions, the lowest first, in the order of the winding.
fn triangles(mesh: &Mesh) -> BTreeMap<[[u32; 3]; 3], usize> {
    let mut all = BTreeMap::new();
    for t in &mesh.triangles {
        let mut corners = t.map(|v| mesh.vertices[v as usize].position.map(f32::to_bits));
        let lowest = (0..3).min_by_key(|&k| corners[k]).expect("three corners");
        corners.rotate_left(lowest);
        *all.entry(corners).or_insert(0) += 1;
    }
    all
}

#[test]
fn optimized_meshes_are_the_same_triangles_in_a_better_order() {
    let mut shuffled = named("torus", 40);
    let mut random = Random(3);
    for i in (1..shuffled.triangles.len()).rev() {
        shuffled.triangles.swap(i, random.below(i + 1));
    }
    for (name, mesh) in
        [("torus", named("torus", 40)), ("shuffled torus", shuffled), ("gyroid", named("gyroid", 32))]
    {
        let mut better = mesh.clone();
        better.optimize().unwrap();
        assert!(triangles(&better) == triangles(&mesh));
        let misses = |mesh: &Mesh| {
            let count = mesh.vertices.len();
            f64::from(meshopt::analyze_vertex_cache(mesh.triangles.as_flattened(), count, 16, 0, 0).acmr)
        };
        println!("{name}: {:.3} to {:.3} misses a triangle", mesh.cache_misses(), better.cache_misses());
        // Their simulation is another's.
        assert!(
            (misses(&mesh) - mesh.cache_misses()).abs() < 0.02,
            "{} {}",
            misses(&mesh),
            mesh.cache_misses()
        );
        assert!(better.cache_misses() < 0.8 && better.cache_misses() < mesh.cache_misses());
        // Vertices come in the order of their use.
        let mut seen = 0;
        for &v in better.triangles.as_flattened() {
            assert!(v <= seen);
            seen = seen.max(v + 1);
        }
        assert_eq!(seen as usize, better.vertices.len());
    }
}

#[test]
fn strips_are_the_same_triangles() {
    for mesh in [cube(), torus(30, 20), named("gyroid", 23), noise(6, 9, true), Mesh::default()] {
        let mut better = mesh.clone();
        better.optimize().unwrap();
        for mesh in [mesh, better] {
            let strip = mesh.strip().unwrap();
            let decoded = Mesh { triangles: triangles_of_strip(&strip), ..mesh.clone() };
            assert!(triangles(&decoded) == triangles(&mesh));
            println!("{} triangles: {} in the strip", mesh.triangles.len(), strip.len());
            assert!(mesh.triangles.len() < 1000 || strip.len() < 2 * mesh.triangles.len());
        }
    }
}

#[test]
fn what_is_broken_is_refused() {
    let mut bad = cube();
    bad.triangles[4][1] = 8;
    assert_eq!(bad.clone().optimize(), Err(Unfit::BadIndex { triangle: 4 }));
    assert_eq!(bad.strip(), Err(Unfit::BadIndex { triangle: 4 }));
    let mut bad = cube();
    bad.vertices[3].position[0] = f32::INFINITY;
    let before = bad.clone();
    assert_eq!(bad.optimize(), Err(Unfit::NotFinite { vertex: 3 }));
    assert_eq!(bad, before);
    let mut none = Mesh::default();
    none.optimize().unwrap();
    assert_eq!(none, Mesh::default());
}

/// With no more triangles than meshoptimizer's, and no farther from the old surface.
#[test]
fn simplification_is_level_with_meshoptimizer() {
    for (name, cells) in [("sphere", 40), ("torus", 40), ("gyroid", 32), ("boy", 32)] {
        let mut mesh = named(name, cells);
        mesh.remove_degenerate();
        let bytes = bytemuck::cast_slice(&mesh.vertices);
        let vertices = VertexDataAdapter::new(bytes, 24, 0).unwrap();
        for part in [2, 5, 10] {
            let triangles = mesh.triangles.len() / part;
            let mut ours = mesh.clone();
            ours.simplify(&Budget { triangles, error: f32::INFINITY }).unwrap();
            let indices = meshopt::simplify(
                mesh.triangles.as_flattened(),
                &vertices,
                3 * triangles,
                f32::MAX,
                SimplifyOptions::ErrorAbsolute,
                None,
            );
            let theirs = Mesh { triangles: indices.as_chunks().0.to_vec(), ..mesh.clone() };
            let [ours, theirs] =
                [ours, theirs].map(|simple| (simple.triangles.len(), distances(&mesh, &simple)));
            println!("{name}, 1/{part}: {ours:?}, meshoptimizer {theirs:?}");
            assert!(ours.0 <= theirs.0.max(triangles), "{name} {part}");
            assert!(ours.1[0] <= 1.3 * theirs.1[0] && ours.1[1] <= 1.1 * theirs.1[1], "{name} {part}");
        }
    }
}
