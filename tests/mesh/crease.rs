//! Vertices of sharp edges get a normal for each side.

use crate::shapes::{cube, torus};
use glam::Vec3;
use isoforge::mesh::{Mesh, Vertex};

fn facet(mesh: &Mesh, triangle: [u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize].at());
    (b - a).cross(c - a).normalize()
}

/// Goes red when the first side keeps the old normal, or sides are told apart across a face's diagonal.
#[test]
fn a_cube_has_three_normals_a_corner() {
    let split = cube().split_creases(30.0);
    assert_eq!((split.vertices.len(), split.triangles.len()), (24, 12));
    for &triangle in &split.triangles {
        for v in triangle {
            let normal = Vec3::from(split.vertices[v as usize].normal);
            assert!(normal.distance(facet(&split, triangle)) < 1e-6, "{normal}");
        }
    }
    // The same places, in the same order.
    let places = |mesh: &Mesh| -> Vec<[f32; 3]> {
        mesh.triangles.iter().flatten().map(|&v| mesh.vertices[v as usize].position).collect()
    };
    assert!(places(&split) == places(&cube()));
    assert!(cube().split_creases(95.0) == cube(), "right angles are below");
}

#[test]
fn smooth_and_broken_meshes_stay() {
    let smooth = torus(40, 30);
    assert!(smooth.split_creases(30.0) == smooth);
    assert!(Mesh::default().split_creases(30.0) == Mesh::default());
    let mut broken = cube();
    broken.triangles.push([0, 99, 1]);
    broken.triangles.push([0, 0, 1]);
    broken.vertices.push(Vertex { position: [f32::NAN; 3], normal: [0.0; 3] });
    broken.triangles.push([0, 1, 8]);
    let split = broken.split_creases(30.0);
    assert_eq!(split.triangles.len(), broken.triangles.len());
}
