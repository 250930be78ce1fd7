//! The picture without an adapter: a software rasteriser that follows the GPU's rules (4 samples a
//! pixel, top-left rule, one shading a pixel and triangle), so that both pictures agree.
//!
//! The picture is cut into bands of rows. Each band draws all triangles that touch it, in mesh
//! order, into its own samples; bands are independent, so the result is the same on any number of
//! threads.

mod corner;
mod line;
mod triangle;

use super::shade::{Frame, base};
use super::style::unmultiply;
use super::{Camera, RenderError, Style};
use crate::mesh::Mesh;
use corner::{Point, Viewport};
use image::RgbaImage;
use rayon::prelude::*;

/// Rows of a band.
const ROWS: u32 = 16;
/// Triangles that are skipped together if none touches the band.
const CHUNK: usize = 256;
/// Sample positions in a pixel, in 1/256 pixels: the standard pattern of Direct3D and Vulkan.
const SAMPLES: [[i32; 2]; 4] = [[96, 32], [224, 96], [32, 160], [160, 224]];

/// Draws `mesh` on the CPU; the picture is that of [`super::Renderer::render`] up to rounding.
/// Triangles with a vertex that is not finite or absurdly far away (a million times the box that the
/// camera was fitted to), or a vertex number that does not exist, are left out.
///
/// # Errors
/// None at present: sizes are checked by [`Camera::fit`].
pub fn render_software(mesh: &Mesh, camera: &Camera, style: &Style) -> Result<RgbaImage, RenderError> {
    draw(mesh, &[], camera, style)
}

/// As [`render_software`], of a material with a colour (sRGB) for each vertex; vertices beyond the last colour are neutral.
/// Only [`super::Shade::Lit`] shows them.
///
/// # Errors
/// As [`render_software`].
pub fn render_software_coloured(
    mesh: &Mesh,
    colours: &[[u8; 3]],
    camera: &Camera,
    style: &Style,
) -> Result<RgbaImage, RenderError> {
    draw(mesh, colours, camera, style)
}

fn draw(mesh: &Mesh, colours: &[[u8; 3]], camera: &Camera, style: &Style) -> Result<RgbaImage, RenderError> {
    let [width, height] = camera.size;
    let scene = Scene::new(mesh, colours, camera, style);
    let mut image = RgbaImage::new(width, height);
    let row_bytes = width as usize * 4;
    image.par_chunks_mut(row_bytes * ROWS as usize).enumerate().for_each_init(
        || Band::new(width),
        |band, (number, out)| {
            band.clear(number as u32, style.clear());
            scene.draw(band);
            band.resolve(out);
            unmultiply(out);
        },
    );
    Ok(image)
}

/// The mesh, projected.
struct Scene<'a> {
    mesh: &'a Mesh,
    colours: &'a [[u8; 3]],
    frame: Frame,
    viewport: Viewport,
    wireframe: bool,
    corners: Vec<Point>,
    /// First and last band that each triangle touches; first > last for none.
    ranges: Vec<[u16; 2]>,
    /// The same for each [`CHUNK`] of triangles.
    chunk_ranges: Vec<[u16; 2]>,
}

const NOWHERE: [u16; 2] = [u16::MAX, 0];

fn touches(range: [u16; 2], band: u16) -> bool {
    range[0] <= band && band <= range[1]
}

impl<'a> Scene<'a> {
    fn new(mesh: &'a Mesh, colours: &'a [[u8; 3]], camera: &Camera, style: &Style) -> Self {
        let frame = Frame::new(camera, style);
        let viewport = Viewport::new(camera.size);
        let project = |(i, v): (usize, &crate::mesh::Vertex)| {
            viewport.point(&frame.vertex(v.at(), v.normal.into(), base(colours, i)))
        };
        let corners = mesh.vertices.par_iter().enumerate().map(project).collect();
        let mut scene = Self {
            mesh,
            colours,
            frame,
            viewport,
            wireframe: style.wireframe,
            corners,
            ranges: Vec::new(),
            chunk_ranges: Vec::new(),
        };
        scene.ranges = mesh.triangles.par_iter().map(|t| scene.range(t)).collect();
        let joined = |c: &[[u16; 2]]| c.iter().fold(NOWHERE, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        scene.chunk_ranges = scene.ranges.par_chunks(CHUNK).map(joined).collect();
        scene
    }

    /// The triangle's vertices; `None` if there are no such vertices.
    fn points(&self, triangle: &[u32; 3]) -> Option<[&Point; 3]> {
        let [a, b, c] = triangle.map(|i| self.corners.get(i as usize));
        Some([a?, b?, c?])
    }

    fn range(&self, triangle: &[u32; 3]) -> [u16; 2] {
        let Some(points) = self.points(triangle) else { return NOWHERE };
        if points.iter().any(|p| p.lost) {
            // Its edge between usable vertices is still a line. Rare: let every band find out.
            return if self.wireframe { [0, u16::MAX] } else { NOWHERE };
        }
        if points.iter().any(|p| p.outside) {
            let polygon = corner::clip_triangle(self.varyings(triangle), &self.viewport);
            self.rows(polygon.iter().map(|c| c.y))
        } else {
            self.rows(points.iter().map(|p| p.corner.y))
        }
    }

    /// The bands between the lowest and the highest of some corners.
    fn rows(&self, ys: impl Iterator<Item = i32>) -> [u16; 2] {
        // A line reaches half a pixel beyond its ends.
        let margin = if self.wireframe { 256 } else { 0 };
        let (low, high) = ys.fold((i32::MAX, i32::MIN), |(low, high), y| {
            (low.min(y.saturating_sub(margin)), high.max(y.saturating_add(margin)))
        });
        let last = (self.viewport.height << 8) - 1;
        if high < 0 || low > last {
            return NOWHERE;
        }
        let band = |y: i32| ((y.clamp(0, last) >> 8) / ROWS as i32) as u16;
        [band(low), band(high)]
    }

    fn draw(&self, band: &mut Band) {
        self.each(band, |scene, band, triangle, points| {
            if points.iter().any(|p| p.lost) {
                return;
            }
            let bad = points.iter().any(|p| p.bad);
            if points.iter().any(|p| p.outside) {
                let polygon = corner::clip_triangle(scene.varyings(triangle), &scene.viewport);
                for i in 2..polygon.len() {
                    let corners = [&polygon[0], &polygon[i - 1], &polygon[i]];
                    triangle::draw(&scene.frame, band, corners, bad, scene.wireframe);
                }
            } else {
                let corners = points.map(|p| &p.corner);
                triangle::draw(&scene.frame, band, corners, bad, scene.wireframe);
            }
        });
        if !self.wireframe {
            return;
        }
        self.each(band, |scene, band, triangle, points| {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                if points[a].lost || points[b].lost {
                    continue;
                }
                if points[a].outside || points[b].outside {
                    let all = scene.varyings(triangle);
                    if let Some([a, b]) = corner::clip_line(all[a], all[b], &scene.viewport) {
                        line::draw(band, &a, &b, scene.frame.line_bias);
                    }
                } else {
                    line::draw(band, &points[a].corner, &points[b].corner, scene.frame.line_bias);
                }
            }
        });
    }

    /// Calls `draw` for the triangles that may touch the band, in mesh order.
    fn each(&self, band: &mut Band, draw: impl Fn(&Self, &mut Band, &[u32; 3], [&Point; 3])) {
        let number = (band.top / ROWS as i32) as u16;
        for (chunk, &range) in self.chunk_ranges.iter().enumerate() {
            if !touches(range, number) {
                continue;
            }
            let first = chunk * CHUNK;
            let last = (first + CHUNK).min(self.ranges.len());
            for (range, triangle) in self.ranges[first..last].iter().zip(&self.mesh.triangles[first..last]) {
                if touches(*range, number)
                    && let Some(points) = self.points(triangle)
                {
                    draw(self, band, triangle, points);
                }
            }
        }
    }

    fn varyings(&self, triangle: &[u32; 3]) -> [super::shade::Varyings; 3] {
        triangle.map(|i| {
            let vertex = self.mesh.vertices.get(i as usize).copied().unwrap_or_default();
            self.frame.vertex(vertex.at(), vertex.normal.into(), base(self.colours, i as usize))
        })
    }
}

/// The samples of some rows.
struct Band {
    width: i32,
    /// The first row.
    top: i32,
    /// Four samples a pixel.
    depth: Vec<[f32; 4]>,
    colour: Vec<[[u8; 4]; 4]>,
}

/// Bytes of the samples of [`ROWS`] rows.
pub(super) fn band_bytes(width: u32) -> u64 {
    u64::from(width) * u64::from(ROWS) * 4 * (4 + 4)
}

impl Band {
    fn new(width: u32) -> Self {
        let pixels = (width * ROWS) as usize;
        Self { width: width as i32, top: 0, depth: vec![[1.0; 4]; pixels], colour: vec![[[0; 4]; 4]; pixels] }
    }

    fn clear(&mut self, number: u32, background: [u8; 4]) {
        self.top = (number * ROWS) as i32;
        self.depth.fill([1.0; 4]);
        self.colour.fill([background; 4]);
    }

    /// The row after the last.
    fn bottom(&self) -> i32 {
        self.top + ROWS as i32
    }

    fn resolve(&self, out: &mut [u8]) {
        for (samples, pixel) in self.colour.iter().zip(out.chunks_exact_mut(4)) {
            for (channel, out) in pixel.iter_mut().enumerate() {
                let sum: u32 = samples.iter().map(|s| u32::from(s[channel])).sum();
                *out = ((sum + 2) / 4) as u8;
            }
        }
    }
}

/// A colour component from 0…1 as the GPU stores it.
fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}
