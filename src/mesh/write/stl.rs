//! Binary STL: each triangle by itself, with the normal of its plane.

use std::io::{self, Write};

use super::{Mesh, Vertex, floats_le, in_chunks};

/// Whether a count of triangles fits the format's u32.
pub(super) fn fits(triangles: u64) -> Result<(), String> {
    match u32::try_from(triangles) {
        Ok(_) => Ok(()),
        Err(_) => Err(format!("STL holds at most {} triangles, and the mesh has {triangles}", u32::MAX)),
    }
}

pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    header(out, mesh.triangles.len() as u32)?;
    facets(out, &mesh.triangles, 0, &mesh.vertices)
}

pub(super) fn header(out: &mut impl Write, triangles: u32) -> io::Result<()> {
    // Must not start with "solid", which means the text variant.
    let text = b"binary STL by isoforge";
    let mut header = [b' '; 80];
    header[..text.len()].copy_from_slice(text);
    out.write_all(&header)?;
    out.write_all(&triangles.to_le_bytes())
}

/// Writes triangles of `vertices`, of which the first is number `first`.
pub(super) fn facets(
    out: &mut impl Write,
    triangles: &[[u32; 3]],
    first: u32,
    vertices: &[Vertex],
) -> io::Result<()> {
    in_chunks(out, triangles, |buffer, triangle| {
        let [a, b, c] = triangle.map(|v| vertices[(v - first) as usize].at());
        // In f64: a small triangle's cross product underflows f32. Zero where the triangle has no plane.
        let (u, v) = ((b - a).as_dvec3(), (c - a).as_dvec3());
        let normal = u.cross(v).normalize_or_zero().as_vec3();
        for corner in [normal, a, b, c] {
            floats_le(buffer, &corner.to_array())?;
        }
        buffer.extend_from_slice(&[0, 0]);
        Ok(())
    })
}
