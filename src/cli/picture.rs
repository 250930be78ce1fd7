//! Drawing the mesh into a file.

use super::Failure;
use super::args::PictureArgs;
use crate::gpu::{Gpu, GpuMesh};
use crate::mesh::Mesh;
use crate::render::{self, Camera, Renderer, Style, View};
use std::path::Path;

fn view(args: &PictureArgs) -> View {
    View { azimuth: args.azimuth, elevation: args.elevation, fov: args.fov, size: args.size.0 }
}

fn style(args: &PictureArgs) -> Style {
    Style { shade: args.shade.into(), wireframe: args.wireframe, ..Style::default() }
}

/// Refuses a view or a target that cannot work, before the long work.
pub fn check(args: &PictureArgs, path: &Path) -> Result<(), Failure> {
    Camera::fit(None, &view(args)).map_err(Failure::usage)?;
    render::check_target(path).map_err(Failure::run)
}

/// Draws a mesh that is on the GPU, without reading it back.
pub fn draw_gpu(gpu: &Gpu, mesh: &GpuMesh, args: &PictureArgs, path: &Path) -> Result<(), Failure> {
    let bounds = render::gpu_bounds(gpu, mesh).map_err(Failure::run)?;
    let camera = Camera::fit(bounds, &view(args)).map_err(Failure::run)?;
    let renderer = Renderer::new(gpu).map_err(Failure::run)?;
    let image = renderer.render(mesh, &camera, &style(args)).map_err(Failure::run)?;
    render::save_png(image, path).map_err(Failure::run)
}

/// Draws a mesh by the software rasteriser.
pub fn draw_cpu(mesh: &Mesh, args: &PictureArgs, path: &Path) -> Result<(), Failure> {
    let camera = Camera::fit(mesh.bounds(), &view(args)).map_err(Failure::run)?;
    let image = render::render_software(mesh, &camera, &style(args)).map_err(Failure::run)?;
    render::save_png(image, path).map_err(Failure::run)
}
