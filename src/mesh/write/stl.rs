//! Binary STL: each triangle by itself, with the normal of its plane.

use std::io::{self, Write};

use super::{Mesh, floats_le, in_chunks};

/// Whether the count fits the format's u32.
pub(super) fn fits(mesh: &Mesh) -> Result<(), String> {
    match u32::try_from(mesh.triangles.len()) {
        Ok(_) => Ok(()),
        Err(_) => Err(format!(
            "STL holds at most {} triangles, and the mesh has {}",
            u32::MAX,
            mesh.triangles.len()
        )),
    }
}

pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    // Must not start with "solid", which means the text variant.
    out.write_all(&header(b"binary STL by isoforge"))?;
    out.write_all(&(mesh.triangles.len() as u32).to_le_bytes())?;
    in_chunks(out, &mesh.triangles, |buffer, triangle| {
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize].at());
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

fn header(text: &[u8]) -> [u8; 80] {
    let mut header = [b' '; 80];
    header[..text.len()].copy_from_slice(text);
    header
}
