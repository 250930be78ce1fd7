//! PLY, little-endian binary, with normals, and with values and colours where there are any.

use std::io::{self, Write};

use super::{Mesh, floats_le, in_chunks, vertices_le};
use crate::colour::Coloured;

pub(super) fn write(mesh: &Mesh, colours: Option<&Coloured>, out: &mut impl Write) -> io::Result<()> {
    let counts = [mesh.vertices.len() as u64, mesh.triangles.len() as u64];
    match colours {
        None => {
            header(out, counts, "")?;
            vertices_le(out, &mesh.vertices)?;
        }
        Some(Coloured { values, colours }) => {
            let more =
                "property float value\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";
            header(out, counts, more)?;
            let rows: Vec<_> = mesh.vertices.iter().zip(values).zip(colours).collect();
            in_chunks(out, &rows, |buffer, ((vertex, value), colour)| {
                floats_le(buffer, vertex.position.iter().chain(&vertex.normal).chain([*value]))?;
                buffer.extend_from_slice(*colour);
                Ok(())
            })?;
        }
    }
    faces(out, &mesh.triangles)
}

/// `more` declares what a vertex has beside position and normal.
pub(super) fn header(out: &mut impl Write, [vertices, triangles]: [u64; 2], more: &str) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment isoforge")?;
    writeln!(out, "element vertex {vertices}")?;
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        writeln!(out, "property float {name}")?;
    }
    write!(out, "{more}")?;
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
