//! PLY, little-endian binary, with normals.

use std::io::{self, Write};

use super::{Mesh, in_chunks, vertices_le};

pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    header(out, mesh.vertices.len() as u64, mesh.triangles.len() as u64)?;
    vertices_le(out, &mesh.vertices)?;
    faces(out, &mesh.triangles)
}

pub(super) fn header(out: &mut impl Write, vertices: u64, triangles: u64) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment isoforge")?;
    writeln!(out, "element vertex {vertices}")?;
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        writeln!(out, "property float {name}")?;
    }
    writeln!(out, "element face {triangles}")?;
    // "int" because that is what readers expect. The bits are those of u32; only beyond 2³¹ vertices
    // would a reader see negative numbers.
    let index = if vertices > i32::MAX as u64 { "uint" } else { "int" };
    writeln!(out, "property list uchar {index} vertex_indices\nend_header")
}

pub(super) fn faces(out: &mut impl Write, triangles: &[[u32; 3]]) -> io::Result<()> {
    in_chunks(out, triangles, |buffer, triangle| {
        let mut face = [3; 13];
        for (bytes, v) in face[1..].chunks_exact_mut(4).zip(triangle) {
            bytes.copy_from_slice(&v.to_le_bytes());
        }
        buffer.extend_from_slice(&face);
        Ok(())
    })
}
