//! PLY, little-endian binary, with normals.

use std::io::{self, Write};

use super::{Mesh, in_chunks, vertices_le};

pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment isoforge")?;
    writeln!(out, "element vertex {}", mesh.vertices.len())?;
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        writeln!(out, "property float {name}")?;
    }
    writeln!(out, "element face {}", mesh.triangles.len())?;
    // "int" because that is what readers expect. The bits are those of u32; only beyond 2³¹ vertices
    // would a reader see negative numbers.
    let index = if mesh.vertices.len() > i32::MAX as usize { "uint" } else { "int" };
    writeln!(out, "property list uchar {index} vertex_indices\nend_header")?;
    vertices_le(out, &mesh.vertices)?;
    in_chunks(out, &mesh.triangles, |buffer, triangle| {
        let mut face = [3; 13];
        for (bytes, v) in face[1..].chunks_exact_mut(4).zip(triangle) {
            bytes.copy_from_slice(&v.to_le_bytes());
        }
        buffer.extend_from_slice(&face);
        Ok(())
    })
}
