//! Both backends draw the same, and each shows what it must.
//!
//! Tolerances: of a picture's mean difference in 1/255, and of the part of the pixels that differ by
//! more than 24/255. Measured on lavapipe: at most 0.013 and 0.01 %, with lines 0.39 and 0.35 %
//! (lavapipe leaves out bits of lines at the rims of its 64-pixel tiles).

use crate::common::gpu;
use crate::compare::{difference, is_background, share};
use crate::shapes::{bent, flipped, sphere, torus, with_normals};
use glam::Vec3;
use image::RgbaImage;
use isoforge::gpu::{Gpu, GpuMesh, MeshHeader};
use isoforge::mesh::Mesh;
use isoforge::render::*;

/// The agreement that surfaces must reach.
const SURFACE: (f64, f64) = (0.05, 0.001);
/// The agreement that wireframes must reach: adapters differ in what a line covers.
const LINES: (f64, f64) = (1.0, 0.01);

pub struct Both {
    pub gpu: Option<(Gpu, Renderer)>,
}

impl Both {
    pub fn new() -> Self {
        Self { gpu: gpu().map(|gpu| (gpu.clone(), Renderer::new(gpu).unwrap())) }
    }

    /// The software picture, and the GPU's.
    pub fn draw(&self, mesh: &Mesh, camera: &Camera, style: &Style) -> Vec<RgbaImage> {
        let mut pictures = vec![render_software(mesh, camera, style).unwrap()];
        if let Some((gpu, renderer)) = &self.gpu {
            let on_gpu = GpuMesh::upload(gpu, mesh).unwrap();
            pictures.push(renderer.render(&on_gpu, camera, style).unwrap());
        }
        pictures
    }

    /// Draws on both and asserts that they agree.
    pub fn agree(&self, what: &str, mesh: &Mesh, camera: &Camera, style: &Style) -> Vec<RgbaImage> {
        let pictures = self.draw(mesh, camera, style);
        let (mean, far) = if style.wireframe { LINES } else { SURFACE };
        if let [software, gpu] = &pictures[..] {
            let d = difference(software, gpu);
            println!("{what}: {d:?}");
            assert!(d.mean < mean && d.far < far, "{what}, {style:?}: {d:?}");
        }
        pictures
    }
}

fn camera(mesh: &Mesh, azimuth: f32, elevation: f32) -> Camera {
    let view = View { azimuth, elevation, size: [400, 300], ..View::default() };
    Camera::fit(mesh.bounds(), &view).unwrap()
}

fn shaded(shade: Shade) -> Style {
    Style { shade, ..Style::default() }
}

/// Part of the pixels that show no background at all.
fn covered(image: &RgbaImage) -> f64 {
    1.0 - share(image, [244, 245, 247])
}

#[test]
fn both_backends_draw_the_same() {
    let both = Both::new();
    for (what, mesh) in [("sphere", sphere(24)), ("torus", torus(32)), ("fine torus", torus(200))] {
        for (azimuth, elevation) in [(30.0, 25.0), (200.0, -60.0), (0.0, 90.0)] {
            let camera = camera(&mesh, azimuth, elevation);
            for shade in [Shade::Lit, Shade::Normals, Shade::Debug] {
                let pictures = both.agree(what, &mesh, &camera, &shaded(shade));
                assert!(pictures.iter().all(|p| covered(p) > 0.1), "{what} shows nothing");
                let style = Style { wireframe: true, ..shaded(shade) };
                let lines = both.agree(what, &mesh, &camera, &style);
                for (with, without) in lines.iter().zip(&pictures) {
                    assert!(difference(with, without).mean > 1.0, "{what} shows no lines");
                }
            }
        }
    }
}

#[test]
fn both_backends_draw_the_same_colours() {
    let both = Both::new();
    let mesh = torus(48);
    let colours: Vec<[u8; 3]> =
        mesh.vertices.iter().map(|v| v.position.map(|x| ((x + 1.5) / 3.0 * 255.0) as u8)).collect();
    let camera = camera(&mesh, 30.0, 25.0);
    for wireframe in [false, true] {
        let style = Style { wireframe, ..Style::default() };
        let software = render_software_coloured(&mesh, &colours, &camera, &style).unwrap();
        let plain = render_software(&mesh, &camera, &style).unwrap();
        assert!(difference(&software, &plain).mean > 2.0);
        // Without any colour, and where there are too few, it is the plain one.
        assert!(render_software_coloured(&mesh, &[], &camera, &style).unwrap() == plain);
        let Some((gpu, renderer)) = &both.gpu else { continue };
        let on_gpu = GpuMesh::upload(gpu, &mesh).unwrap();
        let drawn = renderer.render_coloured(&on_gpu, &colours, &camera, &style).unwrap();
        let d = difference(&software, &drawn);
        println!("colours: {d:?}");
        let (mean, far) = if wireframe { LINES } else { SURFACE };
        assert!(d.mean < mean && d.far < far, "{style:?}: {d:?}");
        let few = renderer.render_coloured(&on_gpu, &colours[..0], &camera, &style).unwrap();
        assert!(few == renderer.render(&on_gpu, &camera, &style).unwrap());
    }
    // Only lit surfaces show them.
    let normals = render_software_coloured(&mesh, &colours, &camera, &shaded(Shade::Normals)).unwrap();
    assert!(normals == render_software(&mesh, &camera, &shaded(Shade::Normals)).unwrap());
}

#[test]
fn four_samples_smooth_the_rim() {
    let mesh = sphere(24);
    let style = Style { shade: Shade::Debug, background: [0, 0, 0, 255], ..Style::default() };
    let both = Both::new();
    for picture in both.draw(&flipped(mesh.clone()), &camera(&mesh, 0.0, 0.0), &style) {
        let between = picture.pixels().filter(|p| p[0] > 0 && p[0] < 255).count();
        assert!(between > 200, "{between} pixels are between colour and background");
    }
    if let Some((_, renderer)) = &both.gpu {
        assert_eq!(renderer.samples(), 4);
    }
}

#[test]
fn debug_shows_what_is_wrong() {
    let both = Both::new();
    let good = torus(32);
    let colours = [BEHIND, WRONG_NORMAL, BAD_NORMAL];
    let cases = [
        ("good", good.clone(), None),
        ("flipped", flipped(good.clone()), Some(BEHIND)),
        ("negated", with_normals(good.clone(), |n| -n), Some(WRONG_NORMAL)),
        ("zero", with_normals(good.clone(), |_| Vec3::ZERO), Some(BAD_NORMAL)),
        ("nan", with_normals(good.clone(), |_| Vec3::new(0.0, f32::NAN, 1.0)), Some(BAD_NORMAL)),
        ("infinite", with_normals(good.clone(), |n| n * f32::INFINITY), Some(BAD_NORMAL)),
    ];
    for (what, mesh, expected) in cases {
        let camera = camera(&good, 30.0, 25.0);
        for picture in both.agree(what, &mesh, &camera, &shaded(Shade::Debug)) {
            for colour in colours {
                let seen = share(&picture, colour);
                if Some(colour) == expected {
                    assert!(seen > 0.95 * covered(&picture) - 0.02, "{what}: {colour:?} on {seen}");
                } else {
                    assert_eq!(seen, 0.0, "{what}: {colour:?}");
                }
            }
        }
    }
}

#[test]
fn one_wrong_triangle_shows() {
    let both = Both::new();
    let mut mesh = sphere(8);
    let camera = camera(&mesh, 30.0, 25.0);
    let facing = |m: &Mesh, t: [u32; 3]| m.vertices[t[0] as usize].at().dot(camera.eye());
    let nearest = (0..mesh.triangles.len())
        .max_by(|&a, &b| facing(&mesh, mesh.triangles[a]).total_cmp(&facing(&mesh, mesh.triangles[b])))
        .unwrap();
    mesh.triangles[nearest].swap(0, 1);
    for picture in both.agree("one triangle", &mesh, &camera, &shaded(Shade::Debug)) {
        let seen = share(&picture, BEHIND);
        assert!(seen > 0.0005 && seen < 0.02, "{seen}");
    }
}

#[test]
fn light_falls_on_both_sides_alike() {
    let both = Both::new();
    let good = torus(32);
    let camera = camera(&good, 30.0, 25.0);
    let right = both.draw(&good, &camera, &Style::default());
    for mesh in [flipped(good.clone()), with_normals(good.clone(), |n| -n)] {
        let other = both.draw(&mesh, &camera, &Style::default());
        for (a, b) in right.iter().zip(&other) {
            let d = difference(a, b);
            assert!(d.mean < 0.05 && d.far < 0.001, "{d:?}");
        }
    }
}

#[test]
fn hidden_lines_are_hidden() {
    let both = Both::new();
    let style = Style { wireframe: true, ..Style::default() };
    // A wall across the view in front of a sphere.
    let mut wall = bent(2, 2, |u, v| (Vec3::new(1.2, 4.0 * u - 2.0, 4.0 * v - 2.0), Vec3::X));
    let camera = camera(&sphere(8), 0.0, 0.0);
    let alone = both.draw(&wall, &camera, &style);
    let first = wall.vertices.len() as u32;
    let hidden = sphere(16);
    wall.triangles.extend(hidden.triangles.iter().map(|t| t.map(|i| i + first)));
    wall.vertices.extend(&hidden.vertices);
    for (a, b) in alone.iter().zip(&both.draw(&wall, &camera, &style)) {
        assert!(a == b, "{:?}", difference(a, b));
    }
}

#[test]
fn lines_are_the_same_in_any_window() {
    let Some((gpu, renderer)) = Both::new().gpu else { return };
    let style = Style { wireframe: true, ..Style::default() };
    // More capacity than triangles, and a last window that is partly full.
    let mesh = torus(12);
    let uploaded = GpuMesh::upload(&gpu, &mesh).unwrap();
    let roomy = GpuMesh::with_capacity(&gpu, 5000, 7001).unwrap();
    gpu.queue.write_buffer(&roomy.vertices, 0, bytemuck::cast_slice(&mesh.vertices));
    gpu.queue.write_buffer(&roomy.indices, 0, bytemuck::cast_slice(&mesh.triangles));
    gpu.queue.write_buffer(&roomy.header, 0, bytemuck::bytes_of(&uploaded.read_header(&gpu).unwrap()));
    let camera = camera(&mesh, 30.0, 25.0);
    let whole = renderer.render(&uploaded, &camera, &style).unwrap();
    for window in [1, 64, 200, 512] {
        let windowed = Renderer::with_line_window(&gpu, window).unwrap();
        for mesh in [&uploaded, &roomy] {
            let picture = windowed.render(mesh, &camera, &style).unwrap();
            assert!(picture == whole, "window {window}: {:?}", difference(&picture, &whole));
        }
    }
}

#[test]
fn nothing_gives_the_background() {
    let both = Both::new();
    let camera = Camera::fit(None, &View { size: [70, 50], ..View::default() }).unwrap();
    for wireframe in [false, true] {
        for background in [[1, 2, 3, 255], [0, 0, 0, 0], [200, 100, 50, 255]] {
            let style = Style { wireframe, background, ..Style::default() };
            for picture in both.draw(&Mesh::default(), &camera, &style) {
                assert!(is_background(&picture, background));
            }
        }
    }
}

#[test]
fn an_overflowed_mesh_draws_nothing() {
    let Some((gpu, renderer)) = Both::new().gpu else { return };
    let mesh = sphere(16);
    let on_gpu = GpuMesh::upload(&gpu, &mesh).unwrap();
    let header = MeshHeader {
        instance_count: 1,
        vertices: 1 << 30,
        triangles: 1 << 30,
        overflow: 2,
        ..Default::default()
    };
    gpu.queue.write_buffer(&on_gpu.header, 0, bytemuck::bytes_of(&header));
    assert_eq!(gpu_bounds(&gpu, &on_gpu).unwrap(), None);
    for wireframe in [false, true] {
        let style = Style { wireframe, ..Style::default() };
        let picture = renderer.render(&on_gpu, &camera(&mesh, 30.0, 25.0), &style).unwrap();
        assert!(is_background(&picture, style.background));
    }
}

#[test]
fn the_gpu_finds_the_bounds() {
    let Some((gpu, _)) = Both::new().gpu else { return };
    let mut holes = torus(20);
    for (i, v) in holes.vertices.iter_mut().enumerate() {
        v.position = (v.at() * 1e3 - Vec3::new(5e3, 0.0, -7e3)).into();
        if i % 7 == 0 {
            v.position[i % 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][i % 3];
        }
    }
    let mut none = sphere(4);
    none.vertices.iter_mut().for_each(|v| v.position[1] = f32::NAN);
    for mesh in [sphere(3), torus(100), torus(300), holes, none, Mesh::default()] {
        let on_gpu = GpuMesh::upload(&gpu, &mesh).unwrap();
        assert_eq!(gpu_bounds(&gpu, &on_gpu).unwrap(), mesh.bounds());
    }
}

#[test]
fn a_cut_out_has_clean_rims() {
    let mesh = flipped(sphere(24));
    let style = Style { shade: Shade::Debug, background: [0; 4], ..Style::default() };
    for picture in Both::new().agree("cut-out", &mesh, &camera(&mesh, 30.0, 25.0), &style) {
        assert_eq!(picture.get_pixel(0, 0).0, [0; 4]);
        assert!(
            picture.pixels().any(|p| p[3] > 0 && p[3] < 255),
            "no pixel of the rim is in part transparent"
        );
        // Where near and far side meet at the rim, a sample or two may show the far side.
        let tinted = picture.pixels().filter(|p| p[3] != 0 && p.0[..3] != BEHIND).count();
        assert!(tinted <= 10, "{tinted} pixels are tinted");
    }
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let mesh = torus(60);
    let style = Style { wireframe: true, ..Style::default() };
    let camera = camera(&mesh, 30.0, 25.0);
    let draw = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render_software(&mesh, &camera, &style).unwrap())
    };
    assert!(draw(1) == draw(4));
}
