//! OFF, the plain text variant: positions and triangles.

use std::io::{self, Write};

use super::{Mesh, in_chunks};

pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "OFF\n{} {} 0", mesh.vertices.len(), mesh.triangles.len())?;
    in_chunks(out, &mesh.vertices, |buffer, vertex| {
        let [x, y, z] = vertex.position;
        writeln!(buffer, "{x} {y} {z}")
    })?;
    in_chunks(out, &mesh.triangles, |buffer, [a, b, c]| writeln!(buffer, "3 {a} {b} {c}"))
}
