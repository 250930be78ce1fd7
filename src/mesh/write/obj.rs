//! Wavefront OBJ: one position and one normal a vertex, numbered alike.

use std::io::{self, Write};

use super::{Mesh, in_chunks};

pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "# isoforge: {} vertices, {} triangles", mesh.vertices.len(), mesh.triangles.len())?;
    in_chunks(out, &mesh.vertices, |buffer, vertex| {
        let [x, y, z] = vertex.position;
        writeln!(buffer, "v {x} {y} {z}")
    })?;
    in_chunks(out, &mesh.vertices, |buffer, vertex| {
        let [x, y, z] = vertex.normal;
        writeln!(buffer, "vn {x} {y} {z}")
    })?;
    in_chunks(out, &mesh.triangles, |buffer, triangle| {
        // OBJ counts from 1, where the last u32 has no successor.
        let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
        writeln!(buffer, "f {a}//{a} {b}//{b} {c}//{c}")
    })
}
