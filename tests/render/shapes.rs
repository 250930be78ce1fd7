//! Meshes with known shapes, normals out of the solid, triangles counter-clockwise from outside.

use glam::Vec3;
use isoforge::mesh::{Mesh, Vertex};
use std::f32::consts::TAU;

/// A grid of `u` by `v` quads, bent by `at`, which gives position and normal for 0…1 each way. Seen
/// from outside, u goes right when v goes up.
pub fn bent(u: u32, v: u32, at: impl Fn(f32, f32) -> (Vec3, Vec3)) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=v {
        for i in 0..=u {
            let (position, normal) = at(i as f32 / u as f32, j as f32 / v as f32);
            mesh.vertices.push(Vertex { position: position.into(), normal: normal.into() });
        }
    }
    for j in 0..v {
        for i in 0..u {
            let a = j * (u + 1) + i;
            let (b, c, d) = (a + 1, a + u + 2, a + u + 1);
            mesh.triangles.push([a, b, c]);
            mesh.triangles.push([a, c, d]);
        }
    }
    mesh
}

/// A sphere of radius 1 of `2 n` by `n` quads.
pub fn sphere(n: u32) -> Mesh {
    let mut mesh = bent(2 * n, n, |u, v| {
        let (sp, cp) = ((v - 0.5) * TAU * 0.5).sin_cos();
        let (st, ct) = (u % 1.0 * TAU).sin_cos();
        let p = Vec3::new(cp * ct, cp * st, sp).normalize();
        (p, p)
    });
    // At the poles one corner of every other triangle falls on another.
    let at = |i: u32| mesh.vertices[i as usize].at();
    let thick = |t: &[u32; 3]| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length() > 1e-12;
    mesh.triangles = mesh.triangles.iter().copied().filter(thick).collect();
    mesh
}

/// A torus around z, radii 1 and 0.4, of `2 n` by `n` quads.
pub fn torus(n: u32) -> Mesh {
    bent(2 * n, n, |u, v| {
        let (st, ct) = (u % 1.0 * TAU).sin_cos();
        let (sp, cp) = (v % 1.0 * TAU).sin_cos();
        let normal = Vec3::new(cp * ct, cp * st, sp);
        (Vec3::new(ct, st, 0.0) + normal * 0.4, normal)
    })
}

/// `mesh` with every triangle wound the other way.
pub fn flipped(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// `mesh` with the normals of `f`.
pub fn with_normals(mut mesh: Mesh, f: impl Fn(Vec3) -> Vec3) -> Mesh {
    mesh.vertices.iter_mut().for_each(|v| v.normal = f(v.normal.into()).into());
    mesh
}
