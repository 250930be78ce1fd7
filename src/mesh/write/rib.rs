//! RIB, what RenderMan renderers read: the mesh as `PointsPolygons` with normals, with a camera and lights of its own.
//! (The RenderMan Interface, version 3.2, Pixar 2000.)

use std::io::{self, Write};

use glam::DVec3;

use super::{Mesh, in_chunks};
use crate::render::View;

/// How much of the frame stays free.
const MARGIN: f64 = 1.05;

/// `name` is the picture's, which a renderer makes of the file.
pub(super) fn write(mesh: &Mesh, name: &str, from: &View, out: &mut impl Write) -> io::Result<()> {
    let view = Camera::of(mesh, from);
    writeln!(out, "##RenderMan RIB-Structure 1.1\n##Creator isoforge")?;
    let quoted = name.replace('\\', "\\\\").replace('"', "\\\"").replace(char::is_control, "_");
    writeln!(out, "version 3.03\nDisplay \"{quoted}.tiff\" \"file\" \"rgba\"")?;
    writeln!(out, "Format {} {} 1\nPixelSamples 3 3", from.size[0], from.size[1])?;
    writeln!(out, "Projection \"perspective\" \"fov\" [{}]\nClipping {} {}", view.fov, view.near, view.far)?;
    writeln!(out, "ConcatTransform {}", list(&view.world_to_camera()))?;
    writeln!(out, "WorldBegin")?;
    writeln!(out, "LightSource \"ambientlight\" 1 \"intensity\" [0.15]")?;
    for (number, intensity, [right, up, back]) in
        [(2, 0.9, [-0.55, 0.65, 0.75]), (3, 0.25, [0.85, -0.05, 0.45])]
    {
        let from = view.centre + view.axes[0] * right + view.axes[1] * up - view.axes[2] * back;
        let [from, to] = [from, view.centre].map(|p| list(&p.to_array()));
        writeln!(
            out,
            "LightSource \"distantlight\" {number} \"intensity\" [{intensity}] \"from\" {from} \"to\" {to}"
        )?;
    }
    writeln!(
        out,
        "AttributeBegin\nColor [0.75 0.77 0.8]\nSurface \"plastic\" \"Ks\" [0.3] \"roughness\" [0.08]"
    )?;
    // Triangles are counter-clockwise from outside in right-handed world space; open surfaces show both sides.
    writeln!(out, "Orientation \"rh\"\nSides 2\nPointsPolygons [")?;
    in_chunks(out, &mesh.triangles, |buffer, _| buffer.write_all(b"3\n"))?;
    writeln!(out, "] [")?;
    in_chunks(out, &mesh.triangles, |buffer, [a, b, c]| writeln!(buffer, "{a} {b} {c}"))?;
    writeln!(out, "]\n\"P\" [")?;
    in_chunks(out, &mesh.vertices, |buffer, vertex| row(buffer, vertex.position))?;
    writeln!(out, "]")?;
    if mesh.vertices.iter().any(|vertex| vertex.normal != [0.0; 3]) {
        writeln!(out, "\"N\" [")?;
        in_chunks(out, &mesh.vertices, |buffer, vertex| row(buffer, vertex.normal))?;
        writeln!(out, "]")?;
    }
    writeln!(out, "AttributeEnd\nWorldEnd")
}

fn row(buffer: &mut Vec<u8>, [x, y, z]: [f32; 3]) -> io::Result<()> {
    writeln!(buffer, "{x} {y} {z}")
}

fn list(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
    format!("[{}]", words.join(" "))
}

/// A camera that sees all of the mesh.
struct Camera {
    /// The angle that the shorter side of the picture spans, in degrees.
    fov: f64,
    centre: DVec3,
    eye: DVec3,
    /// Right, up and forwards: the camera space of RenderMan is left-handed.
    axes: [DVec3; 3],
    near: f64,
    far: f64,
}

impl Camera {
    fn of(mesh: &Mesh, from: &View) -> Self {
        let (low, high) = mesh
            .bounds()
            .map_or((DVec3::NEG_ONE, DVec3::ONE), |(low, high)| (low.as_dvec3(), high.as_dvec3()));
        let centre = (low + high) * 0.5;
        let half = ((high - low) * 0.5).length();
        let radius = if half > 0.0 { half } else { 1.0 };
        let [azimuth, elevation, height] =
            [from.azimuth, from.elevation, from.fov].map(|a| f64::from(a).to_radians());
        let (sin_a, cos_a) = azimuth.sin_cos();
        let (sin_e, cos_e) = elevation.sin_cos();
        let [across, down] = from.size.map(f64::from);
        let fov = if across < down { 2.0 * ((height * 0.5).tan() * across / down).atan() } else { height };
        let back = DVec3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        let axes = [DVec3::new(-sin_a, cos_a, 0.0), DVec3::new(-sin_e * cos_a, -sin_e * sin_a, cos_e), -back];
        let distance = MARGIN * radius / (fov * 0.5).sin();
        let [near, far] = [distance - MARGIN * radius, distance + MARGIN * radius];
        Self { fov: fov.to_degrees(), centre, eye: centre + back * distance, axes, near, far }
    }

    /// For row vectors, as RenderMan has it.
    fn world_to_camera(&self) -> [f64; 16] {
        let mut matrix = [0.0; 16];
        for (column, axis) in self.axes.into_iter().enumerate() {
            for row in 0..3 {
                matrix[4 * row + column] = axis[row];
            }
            matrix[12 + column] = -self.eye.dot(axis);
        }
        matrix[15] = 1.0;
        matrix
    }
}
