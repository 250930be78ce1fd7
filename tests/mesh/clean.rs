use std::collections::HashMap;

use isoforge::mesh::Mesh;
use proptest::prelude::*;

use crate::shapes::{both, cube, mesh, tetrahedron, torus};

type Point = [i32; 3];

/// Marching tetrahedra at 0 over an n³ block of samples, −1 around it; a sample of 0 is inside, and puts
/// the vertices of all edges from it on its own point. Closed and manifold by construction.
fn surface(n: i32, samples: &[i8]) -> Mesh {
    let value = |p: Point| -> f32 {
        let inside = p.iter().all(|x| (1..=n).contains(x));
        if inside { f32::from(samples[(((p[2] - 1) * n + p[1] - 1) * n + p[0] - 1) as usize]) } else { -1.0 }
    };
    let mut numbers: HashMap<(Point, Point), u32> = HashMap::new();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let axes = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    for cell in 0..(n + 1).pow(3) {
        let origin = [cell % (n + 1), cell / (n + 1) % (n + 1), cell / (n + 1).pow(2)];
        for (i, order) in axes.iter().enumerate() {
            let mut tet = [origin; 4];
            for k in 0..3 {
                tet[k + 1] = tet[k];
                tet[k + 1][order[k]] += 1;
            }
            if i >= 3 {
                tet.swap(0, 1);
            }
            let mut cut = |i: usize, j: usize| {
                let (a, b) = (tet[i].min(tet[j]), tet[i].max(tet[j]));
                *numbers.entry((a, b)).or_insert_with(|| {
                    let t = -value(a) / (value(b) - value(a));
                    positions.push([0, 1, 2].map(|k| a[k] as f32 + (b[k] - a[k]) as f32 * t));
                    positions.len() as u32 - 1
                })
            };
            let inside: Vec<usize> = (0..4).filter(|&i| value(tet[i]) >= 0.0).collect();
            // Even permutations of (0 1 2 3) with the corners wanted in front.
            let single = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 0, 2, 1]];
            match inside.len() {
                1 => {
                    let [a, b, c, d] = single[inside[0]];
                    triangles.push([cut(a, b), cut(a, c), cut(a, d)]);
                }
                2 => {
                    let rest: Vec<usize> = (0..4).filter(|i| !inside.contains(i)).collect();
                    let (a, b) = (inside[0], inside[1]);
                    let odd = matches!((a, b), (0, 2) | (1, 3));
                    let (c, d) = if odd { (rest[1], rest[0]) } else { (rest[0], rest[1]) };
                    let quad = [cut(a, c), cut(a, d), cut(b, d), cut(b, c)];
                    triangles.push([quad[0], quad[1], quad[2]]);
                    triangles.push([quad[0], quad[2], quad[3]]);
                }
                3 => {
                    let out = (0..4).find(|i| !inside.contains(i)).unwrap();
                    let [a, b, c, d] = single[out];
                    triangles.push([cut(a, b), cut(a, d), cut(a, c)]);
                }
                _ => {}
            }
        }
    }
    mesh(&positions, &triangles)
}

/// Cleans and holds the result against every promise.
fn cleaned(before: &Mesh) -> Mesh {
    let mut after = before.clone();
    let removed = after.remove_degenerate();
    assert_eq!(removed.triangles, before.triangles.len() - after.triangles.len());
    let (old, new) = (before.check(), after.check());
    let context = format!("{new}\n{before:?}");
    assert_eq!((new.boundary_edges, new.misoriented_edges), (0, 0), "{context}");
    assert_eq!((new.non_manifold_edges, new.non_manifold_vertices), (0, 0), "{context}");
    assert_eq!((new.degenerate_triangles, new.duplicate_triangles), (0, 0), "{context}");
    assert_eq!(new.unused_vertices, 0, "{context}");
    assert!((old.volume - new.volume).abs() <= 1e-6 * old.volume.abs(), "{context}");
    for vertex in &after.vertices {
        assert!(before.vertices.iter().any(|old| old.position == vertex.position), "moved: {context}");
        assert!((glam::Vec3::from(vertex.normal).length() - 1.0).abs() < 1e-5, "{context}");
    }
    let mut again = after.clone();
    assert_eq!(again.remove_degenerate(), Default::default(), "not idempotent: {context}");
    assert_eq!(again, after);
    after
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn ties_everywhere(n in 2i32..6, values in prop::collection::vec(0usize..6, 125)) {
        let samples: Vec<i8> = values.iter().map(|&i| [-1, -2, 0, 0, 1, 2][i]).collect();
        let before = surface(n, &samples);
        let r = before.check();
        prop_assert_eq!([r.boundary_edges, r.non_manifold_edges, r.non_manifold_vertices, r.misoriented_edges], [0; 4]);
        cleaned(&before);
    }

    /// Only ties and outside: threads, sheets, and solids whose whole surface is on samples.
    #[test]
    fn only_ties(values in prop::collection::vec(-1i8..1, 64)) {
        cleaned(&surface(4, &values));
    }
}

#[test]
fn a_clean_mesh_stays_bit_for_bit() {
    let torus = torus(12, 9);
    assert_eq!(cleaned(&torus), torus);
}

#[test]
fn one_tie_becomes_one_vertex() {
    let mut samples = vec![-1; 27];
    samples[13] = 0;
    let alone = cleaned(&surface(3, &samples));
    assert_eq!((alone.vertices.len(), alone.triangles.len()), (0, 0));
    samples[12] = 3;
    let before = surface(3, &samples);
    let after = cleaned(&before);
    assert!(after.triangles.len() < before.triangles.len());
    assert_eq!(after.check().genus, Some(0));
}

#[test]
fn order_stays() {
    // A square of two triangles with a zero-length edge (4 on 1) between, and an unused vertex 0.
    let p = [[9.0; 3], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut square = mesh(&p, &[[1, 2, 3], [1, 3, 4], [4, 3, 5]]);
    let normals = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
    (square.vertices[1].normal, square.vertices[4].normal) = (normals[0], normals[1]);
    let removed = square.remove_degenerate();
    assert_eq!((removed.triangles, removed.vertices), (1, 2));
    assert_eq!(square.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(square.vertices[3].position, p[5]);
    let unit = 0.5f32.sqrt();
    assert!((glam::Vec3::from(square.vertices[0].normal) - glam::vec3(0.0, unit, unit)).length() < 1e-6);
}

#[test]
fn coincident_sheets_stay_apart_but_weld_together() {
    let two = both(&tetrahedron(), &tetrahedron(), [0.0; 3]);
    assert_eq!(cleaned_as_is(&two), two);
    let mut welded = two.clone();
    assert_eq!(welded.weld(), 4);
    assert_eq!((welded.vertices.len(), welded.triangles.len()), (4, 8));
    assert_eq!(&welded.vertices, &tetrahedron().vertices);
    assert_eq!(welded.triangles[4..], tetrahedron().triangles);
}

fn cleaned_as_is(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.remove_degenerate();
    mesh
}

/// A torus of square section, pressed flat at one place: there the surface touches itself along an edge.
#[test]
fn a_flat_neck_is_cut() {
    let mut pressed = torus(8, 4);
    pressed.vertices[2].position = pressed.vertices[1].position;
    pressed.vertices[3].position = pressed.vertices[0].position;
    assert_eq!(pressed.check().genus, Some(1));
    let after = cleaned(&pressed);
    assert_eq!((after.check().genus, after.check().components), (Some(0), 1));
    assert_eq!((after.vertices.len(), after.triangles.len()), (32, 60));

    // Pressed at two places it falls apart.
    pressed.vertices[18].position = pressed.vertices[17].position;
    pressed.vertices[19].position = pressed.vertices[16].position;
    let after = cleaned(&pressed);
    assert_eq!((after.check().genus, after.check().components), (Some(0), 2));
}

#[test]
fn weld_knows_both_zeros_and_keeps_bad_indices() {
    let mut soup = mesh(&[[0.0, 0.0, 1.0], [-0.0, 0.0, 1.0], [f32::NAN; 3], [f32::NAN; 3]], &[[0, 1, 7]]);
    assert_eq!(soup.weld(), 2);
    assert_eq!(soup.triangles, [[0, 0, 7]]);
    let mut sum = cube();
    sum.vertices.extend(cube().vertices);
    sum.vertices[8].normal = [0.0, 0.0, -1.0];
    assert_eq!(sum.weld(), 8);
    assert_eq!(sum.vertices[1..], cube().vertices[1..]);
}

#[test]
fn a_bad_index_leaves_the_mesh_alone() {
    let mut broken = mesh(&[[0.0; 3], [0.0; 3]], &[[0, 1, 1], [0, 1, 7]]);
    let before = broken.clone();
    assert_eq!(broken.remove_degenerate(), Default::default());
    assert_eq!(broken, before);
}
