//! Meshes with known answers.

use isoforge::mesh::{Mesh, Vertex};

pub fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
    let vertex = |&position: &[f32; 3]| {
        let normal = glam::Vec3::from(position).try_normalize().unwrap_or(glam::Vec3::Z).to_array();
        Vertex { position, normal }
    };
    Mesh { vertices: positions.iter().map(vertex).collect(), triangles: triangles.to_vec() }
}

/// The unit corner: area 1.5 + √3/2, volume 1/6.
pub fn tetrahedron() -> Mesh {
    mesh(
        &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    )
}

/// The unit cube.
pub fn cube() -> Mesh {
    let corners: Vec<[f32; 3]> =
        (0..8).map(|i| [(i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32]).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    mesh(&corners, &triangles)
}

/// A torus of n × m quads.
pub fn torus(n: u32, m: u32) -> Mesh {
    let turn = |i: u32, of: u32| (i as f32 / of as f32 * std::f32::consts::TAU).sin_cos();
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..n {
        for j in 0..m {
            let ((s, c), (t, d)) = (turn(i, n), turn(j, m));
            let position = [(3.0 + d) * c, (3.0 + d) * s, t];
            vertices.push(Vertex { position, normal: [d * c, d * s, t] });
            let at = |i: u32, j: u32| i % n * m + j % m;
            let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.push([quad[0], quad[1], quad[2]]);
            triangles.push([quad[0], quad[2], quad[3]]);
        }
    }
    Mesh { vertices, triangles }
}

/// Both meshes side by side, the second moved by `offset`.
pub fn both(a: &Mesh, b: &Mesh, offset: [f32; 3]) -> Mesh {
    let mut sum = a.clone();
    let base = a.vertices.len() as u32;
    sum.vertices.extend(
        b.vertices.iter().map(|v| Vertex { position: (v.at() + glam::Vec3::from(offset)).to_array(), ..*v }),
    );
    sum.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + base)));
    sum
}

/// `mesh` with vertex `from` replaced by `to` in all triangles.
pub fn renamed(mut mesh: Mesh, renames: &[(u32, u32)]) -> Mesh {
    for v in mesh.triangles.iter_mut().flatten() {
        if let Some((_, to)) = renames.iter().find(|(from, _)| from == v) {
            *v = *to;
        }
    }
    mesh
}
