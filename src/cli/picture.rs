//! Drawing the mesh into a file.

use super::Failure;
use super::args::{ExtractArgs, PictureArgs};
use super::colour::Painter;
use super::watchdog::{DRAWING, Watchdog};
use crate::colour::Coloured;
use crate::gpu::{Gpu, GpuMesh};
use crate::mesh::{Mesh, write};
use crate::render::{self, Camera, Renderer, Style, View};
use crate::scene;
use std::path::Path;

/// Degrees between smooth sides from which on an edge is drawn sharp, unless the user says.
const CREASE: f32 = 40.0;

/// The user's words first, then the scene's.
pub fn view(args: &PictureArgs, camera: &scene::Camera) -> View {
    let plain = View::default();
    View {
        azimuth: args.azimuth.or(camera.azimuth).unwrap_or(plain.azimuth),
        elevation: args.elevation.or(camera.elevation).unwrap_or(plain.elevation),
        fov: args.fov.or(camera.fov).unwrap_or(plain.fov),
        size: args.size.0,
    }
}

fn style(args: &PictureArgs) -> Style {
    Style { shade: args.shade.into(), wireframe: args.wireframe, ..Style::default() }
}

/// Refuses a view or a target that cannot work, before the long work; and a view that nobody takes, of the picture or a mesh
/// file with a camera.
pub fn check(args: &PictureArgs, png: Option<&Path>, output: Option<&Path>) -> Result<(), Failure> {
    if png.is_some() || output.and_then(write::ending) == Some("rib") {
        Camera::fit(None, &view(args, &scene::Camera::default())).map_err(Failure::usage)?;
    } else if let Some(flag) = args.given() {
        return Err(Failure::usage(format!("{flag} is for pictures: name one with --png, or leave it out")));
    }
    png.map_or(Ok(()), |path| render::check_target(path).map_err(Failure::run))
}

/// Refuses a picture that is more than the memory budget by itself.
pub fn check_memory(args: &ExtractArgs, on_gpu: bool, budget: u64) -> Result<(), Failure> {
    let [width, height] = args.picture.size.0;
    let needed = render::picture_bytes([width, height], on_gpu);
    if args.png.is_none() || needed <= budget {
        return Ok(());
    }
    let place = if on_gpu { "GPU" } else { "CPU" };
    Err(Failure::usage(format!(
        "--size {width}x{height}: drawing that on the {place} takes {needed} bytes, over the memory budget of {budget} \
         bytes: give a smaller size or raise the budget (--memory-budget)"
    )))
}

/// Draws a mesh that is on the GPU, without reading it back.
pub fn draw_gpu(
    gpu: &Gpu,
    mesh: &GpuMesh,
    colours: Option<&Coloured>,
    args: &ExtractArgs,
    camera: &scene::Camera,
    path: &Path,
) -> Result<(), Failure> {
    let watchdog = Watchdog::new(args.run.time_limit, DRAWING);
    let args = &args.picture;
    let bounds = render::gpu_bounds(gpu, mesh).map_err(Failure::run)?;
    let camera = Camera::fit(bounds, &view(args, camera)).map_err(Failure::run)?;
    let renderer = Renderer::new(gpu).map_err(Failure::run)?;
    watchdog.alive();
    let image = match colours {
        Some(coloured) => renderer.render_coloured(mesh, &coloured.colours, &camera, &style(args)),
        None => renderer.render(mesh, &camera, &style(args)),
    };
    let image = image.map_err(Failure::run)?;
    drop(watchdog);
    render::save_png(image, path).map_err(Failure::run)
}

/// From which angle on edges are drawn sharp, if any are: vertices of the methods beside the plain sweep lie on edges, and caps
/// have some.
pub fn crease(args: &ExtractArgs) -> Option<f32> {
    let method = &args.method;
    let has_edges =
        method.refine.is_some() || method.sharp || method.cap || method.method.of_cells().is_none();
    args.picture.crease.or(has_edges.then_some(CREASE)).filter(|degrees| *degrees < 180.0)
}

/// Draws a mesh by the software rasteriser.
pub fn draw_cpu(
    mesh: &Mesh,
    painter: Option<&Painter>,
    args: &PictureArgs,
    crease: Option<f32>,
    camera: &scene::Camera,
    path: &Path,
) -> Result<(), Failure> {
    // What has no area has no normal to tell edges by.
    let split = crease.map(|degrees| {
        let mut mesh = mesh.clone();
        mesh.remove_degenerate();
        mesh.split_creases(degrees)
    });
    let mesh = split.as_ref().unwrap_or(mesh);
    let coloured = painter.map_or(Ok(Coloured::default()), |painter| painter.paint(mesh))?;
    let camera = Camera::fit(mesh.bounds(), &view(args, camera)).map_err(Failure::run)?;
    let image = render::render_software_coloured(mesh, &coloured.colours, &camera, &style(args));
    let image = image.map_err(Failure::run)?;
    render::save_png(image, path).map_err(Failure::run)
}
