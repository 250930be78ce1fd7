//! Pictures for people to look at: `ISOFORGE_PICTURES=folder cargo test --test render -- --ignored pictures`.

use crate::adapter::gpu;
use crate::compare::difference;
use crate::shapes::{flipped, sphere, torus, with_normals};
use isoforge::gpu::GpuMesh;
use isoforge::mesh::Mesh;
use isoforge::render::*;
use std::path::PathBuf;
use std::time::Instant;

/// A torus with a flipped patch, a patch with negated and one with no normals.
fn broken() -> Mesh {
    let mut mesh = torus(24);
    for t in &mut mesh.triangles[200..260] {
        t.swap(1, 2);
    }
    for v in &mut mesh.vertices[600..640] {
        v.normal = v.normal.map(|c| -c);
    }
    for v in &mut mesh.vertices[151..155] {
        v.normal = [0.0; 3];
    }
    mesh
}

#[test]
#[ignore = "writes files to look at, with timings"]
fn pictures() {
    let folder =
        PathBuf::from(std::env::var("ISOFORGE_PICTURES").expect("set ISOFORGE_PICTURES to a folder"));
    let Some(gpu) = gpu() else { return };
    let renderer = Renderer::new(&gpu).unwrap();
    let wire = Style { wireframe: true, ..Style::default() };
    let of = |shade| Style { shade, ..Style::default() };
    let cutout = Style { background: [0; 4], ..wire };
    let cases = [
        ("lit", torus(128), Style::default()),
        ("sphere", sphere(64), Style::default()),
        ("normals", torus(128), of(Shade::Normals)),
        ("debug", broken(), of(Shade::Debug)),
        ("debug-flipped", flipped(sphere(24)), of(Shade::Debug)),
        ("flat", with_normals(torus(16), |_| glam::Vec3::ZERO), Style::default()),
        ("wire", torus(32), wire),
        ("wire-dense", torus(128), wire),
        ("wire-cutout", sphere(16), cutout),
        ("million", torus(500), Style::default()),
        ("million-wire", torus(500), wire),
    ];
    for (name, mesh, style) in cases {
        let camera = Camera::fit(mesh.bounds(), &View::default()).unwrap();
        let on_gpu = GpuMesh::upload(&gpu, &mesh).unwrap();
        renderer.render(&on_gpu, &camera, &style).unwrap();
        let start = Instant::now();
        let a = renderer.render(&on_gpu, &camera, &style).unwrap();
        let gpu_time = start.elapsed();
        let start = Instant::now();
        let b = render_software(&mesh, &camera, &style).unwrap();
        let cpu_time = start.elapsed();
        println!(
            "{name}: {} triangles, gpu {gpu_time:?}, software {cpu_time:?}, {:?}",
            mesh.triangles.len(),
            difference(&a, &b)
        );
        save_png(&a, &folder.join(format!("{name}-gpu.png"))).unwrap();
        save_png(&b, &folder.join(format!("{name}-software.png"))).unwrap();
    }
}
