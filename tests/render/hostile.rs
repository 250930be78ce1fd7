//! Meshes and frames that nobody would draw on purpose.

use crate::backends::Both;
use crate::common::gpu;
use crate::shapes::{sphere, torus};
use glam::Vec3;
use isoforge::gpu::{Gpu, GpuMesh, adapters};
use isoforge::mesh::{Mesh, Vertex};
use isoforge::render::*;

const WIRE: Style = Style { shade: Shade::Lit, wireframe: true, background: [255; 4] };

#[test]
fn triangles_without_a_place_are_left_out() {
    let both = Both::new();
    let mut mesh = sphere(12);
    let camera = Camera::fit(mesh.bounds(), &View { size: [200, 150], ..View::default() }).unwrap();
    let values = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e20];
    let mut gone = vec![false; mesh.vertices.len()];
    for (i, v) in mesh.vertices.iter_mut().enumerate().filter(|(i, _)| i % 11 == 3) {
        v.position[i % 3] = values[i % values.len()];
        gone[i] = true;
    }
    let mut without = mesh.clone();
    without.triangles.retain(|t| t.iter().all(|&i| !gone[i as usize]));
    assert!(without.triangles.len() < mesh.triangles.len());
    for style in [Style::default(), WIRE] {
        let pictures = both.agree("holes", &mesh, &camera, &style);
        if style.wireframe {
            continue; // The line across a hole belongs to the triangle that is left out.
        }
        for (a, b) in pictures.iter().zip(&both.draw(&without, &camera, &style)) {
            assert!(a == b);
        }
    }
}

#[test]
fn degenerate_triangles_and_missing_vertices_do_no_harm() {
    let at = |p: [f32; 3]| Vertex { position: p, normal: [0.0, 0.0, 1.0] };
    let mesh = Mesh {
        vertices: vec![at([0.0; 3]), at([1.0, 0.0, 0.0]), at([0.5, 0.0, 0.0]), at([1e-30, 1e-30, 0.0])],
        triangles: vec![[0, 0, 0], [0, 1, 1], [0, 1, 2], [0, 3, 0], [1, 2, 3]],
    };
    let camera = Camera::fit(mesh.bounds(), &View { size: [64, 64], ..View::default() }).unwrap();
    for style in [Style::default(), WIRE] {
        Both::new().draw(&mesh, &camera, &style);
        let beyond = Mesh { triangles: vec![[0, 1, 99], [u32::MAX; 3]], ..mesh.clone() };
        let picture = render_software(&beyond, &camera, &style).unwrap();
        assert!(picture.pixels().all(|p| p.0 == style.background));
    }
}

#[test]
fn a_camera_inside_the_mesh_agrees_too() {
    let both = Both::new();
    let mesh = torus(24);
    let tube = Vec3::new(1.0, 0.0, 0.0);
    // Eye in the tube's wall, in the tube, near the hole: near, far and guard planes all cut.
    for (centre, half) in [(tube, 0.05), (tube, 0.2), (Vec3::ZERO, 0.3), (Vec3::ZERO, 0.01)] {
        for azimuth in [0.0, 75.0, 160.0] {
            let view = View { azimuth, size: [240, 180], ..View::default() };
            let camera = Camera::fit((centre - half, centre + half), &view).unwrap();
            both.agree("inside", &mesh, &camera, &Style { shade: Shade::Normals, ..Style::default() });
            both.agree("inside", &mesh, &camera, &WIRE);
        }
    }
}

#[test]
fn far_and_tiny_and_huge_meshes_look_alike() {
    let both = Both::new();
    let view = View { size: [200, 150], ..View::default() };
    for (scale, shift) in [(1e-20, 0.0), (1e20, 0.0), (1e30, 0.0), (1.0, 1e4)] {
        let mut mesh = torus(16);
        mesh.vertices.iter_mut().for_each(|v| v.position = (v.at() * scale + shift).into());
        let camera = Camera::fit(mesh.bounds(), &view).unwrap();
        for picture in both.agree("scaled", &mesh, &camera, &Style::default()) {
            let covered = picture.pixels().filter(|p| p[0] < 240).count();
            assert!(covered > 4000, "{scale}, {shift}: {covered}");
        }
    }
}

#[test]
fn odd_frames_work() {
    let both = Both::new();
    let mesh = sphere(8);
    for size in [[1, 1], [3, 500], [700, 2], [65, 17], [2048, 16]] {
        let camera = Camera::fit(mesh.bounds(), &View { size, ..View::default() }).unwrap();
        for style in [Style::default(), WIRE] {
            for picture in both.draw(&mesh, &camera, &style) {
                assert_eq!([picture.width(), picture.height()], size);
            }
        }
    }
}

#[test]
fn frames_beyond_the_adapter_are_refused() {
    if gpu().is_none() {
        return;
    }
    let adapter = adapters().into_iter().next().unwrap();
    let required_limits = wgpu::Limits { max_texture_dimension_2d: 256, ..adapter.limits() };
    let (device, queue) = pollster::block_on(
        adapter.request_device(&wgpu::DeviceDescriptor { required_limits, ..Default::default() }),
    )
    .unwrap();
    let gpu = Gpu::from_device(device, queue, adapter.get_info());
    let renderer = Renderer::new(&gpu).unwrap();
    let mesh = GpuMesh::upload(&gpu, &sphere(4)).unwrap();
    let render = |size| {
        let camera = Camera::fit(None, &View { size, ..View::default() }).unwrap();
        renderer.render(&mesh, &camera, &Style::default())
    };
    assert!(render([256, 256]).is_ok());
    let error = render([257, 10]).unwrap_err();
    assert!(matches!(error, RenderError::TooLargeForAdapter { limit: 256, .. }), "{error}");
    assert!(error.to_string().contains("CPU backend"));
}
