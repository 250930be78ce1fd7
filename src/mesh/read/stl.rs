//! STL, binary and text, by `stl_io`.

use std::io::Cursor;

use super::{Fault, text};
use crate::mesh::{Mesh, Vertex};

const HEADER: usize = 84;
const FACET: usize = 50;

pub(super) fn parse(mut bytes: Vec<u8>) -> Result<Mesh, Fault> {
    let count = bytes.get(80..HEADER).map(|count| {
        let mut word = [0; 4];
        word.copy_from_slice(count);
        u32::from_le_bytes(word) as usize
    });
    let binary_length = count.map(|count| HEADER + count.saturating_mul(FACET));
    // The length decides, since binary files too may begin with "solid".
    if binary_length == Some(bytes.len()) {
        bytes[0] = b' ';
        return triangles(bytes);
    }
    if bytes.trim_ascii_start().starts_with(b"solid") || bytes.trim_ascii_start().starts_with(b"SOLID") {
        return triangles(one_solid(&text(&bytes))?);
    }
    Err(Fault::new(match (count, binary_length) {
        (Some(count), Some(length)) => format!(
            "the header promises {count} triangles, which take {length} bytes, but the file has {}",
            bytes.len()
        ),
        _ => format!("{} bytes are too few for an STL file", bytes.len()),
    }))
}

/// The text with all its solids as one, as `stl_io` wants it: it stops after the first, knows lower
/// case only, and wants a name.
fn one_solid(text: &str) -> Result<Vec<u8>, Fault> {
    let text = text.trim().to_ascii_lowercase();
    if !text.lines().next_back().is_some_and(|line| line.trim().starts_with("endsolid")) {
        return Err(Fault::at(text.lines().count(), "the file ends without endsolid"));
    }
    let mut out = Vec::with_capacity(text.len() + 32);
    out.extend_from_slice(b"solid all\n");
    for line in text.lines() {
        let word = line.split_whitespace().next().unwrap_or("");
        if word != "solid" && word != "endsolid" {
            out.extend_from_slice(line.as_bytes());
            out.push(b'\n');
        }
    }
    out.extend_from_slice(b"endsolid all\n");
    Ok(out)
}

fn triangles(bytes: Vec<u8>) -> Result<Mesh, Fault> {
    let mut mesh = Mesh::default();
    let mut bytes = Cursor::new(bytes);
    let reader = stl_io::create_stl_reader(&mut bytes).map_err(|error| Fault::new(error.to_string()))?;
    for (i, facet) in reader.enumerate() {
        let facet = facet.map_err(|error| Fault::new(format!("triangle {i}: {error}")))?;
        let first = u32::try_from(mesh.vertices.len()).ok().filter(|&first| first < u32::MAX - 3);
        let first = first.ok_or_else(|| Fault::new("more triangles than 32-bit indices can number"))?;
        let normal = facet.normal.into();
        mesh.vertices.extend(facet.vertices.map(|corner| Vertex { position: corner.into(), normal }));
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh.weld();
    Ok(mesh)
}
