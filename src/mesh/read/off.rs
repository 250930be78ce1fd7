//! OFF text files. Colours and texture coordinates (COFF, STOFF, after a face) are skipped.

use super::polygon::Faces;
use super::{Contents, Fault, countable, text, three};
use crate::mesh::Vertex;

pub(super) fn parse(bytes: &[u8]) -> Result<Contents, Fault> {
    let text = text(bytes);
    let mut lines = (1..)
        .zip(text.lines())
        .map(|(number, line)| (number, line.split('#').next().unwrap_or("").trim()))
        .filter(|(_, line)| !line.is_empty());
    let end = |what: &str| Fault::new(format!("the file ends where {what} should be"));

    let (number, header) = lines.next().ok_or_else(|| end("the word OFF"))?;
    let mut words = header.split_whitespace().peekable();
    let with_normals = match words.next().and_then(|word| word.strip_suffix("OFF")) {
        // In the format's order: texture coordinates, colours, normals; 4 and n change the dimension.
        Some("" | "C" | "ST" | "STC") => false,
        Some("N" | "CN" | "STN" | "STCN") => true,
        Some(other) => {
            return Err(Fault::unsupported(Some(number), format!("{other}OFF files are not supported")));
        }
        None => return Err(Fault::at(number, "not an OFF file: the word OFF is missing")),
    };
    if words.peek() == Some(&"BINARY") {
        return Err(Fault::unsupported(Some(number), "binary OFF files are not supported"));
    }
    let (number, counts) = match words.peek() {
        Some(_) => (number, words.collect::<Vec<_>>()),
        None => {
            let (number, line) = lines.next().ok_or_else(|| end("the counts"))?;
            (number, line.split_whitespace().collect())
        }
    };
    let count = |i: usize| counts.get(i).and_then(|word| word.parse::<usize>().ok());
    let (Some(vertex_count), Some(face_count)) = (count(0), count(1)) else {
        return Err(Fault::at(number, "the counts of vertices and faces expected"));
    };
    countable(vertex_count)?;
    // Each takes a line: a character and its end at the least.
    if vertex_count.saturating_add(face_count) > bytes.len() / 2 + 1 {
        let what = format!("{vertex_count} vertices and {face_count} faces do not fit into the file");
        return Err(Fault::at(number, what));
    }

    let mut vertices = Vec::with_capacity(vertex_count);
    for i in 0..vertex_count {
        let (number, line) = lines.next().ok_or_else(|| end(&format!("vertex {i} of {vertex_count}")))?;
        let mut words = line.split_whitespace();
        let position = three(&mut words, number)?;
        let normal = if with_normals { three(&mut words, number)? } else { [0.0; 3] };
        vertices.push(Vertex { position, normal });
    }
    let mut faces = Faces::with_capacity(face_count);
    let mut corners = Vec::new();
    for i in 0..face_count {
        let (number, line) = lines.next().ok_or_else(|| end(&format!("face {i} of {face_count}")))?;
        let mut words = line.split_whitespace();
        let size = words.next().and_then(|word| word.parse::<usize>().ok());
        let size = size.ok_or_else(|| Fault::at(number, format!("face {i}: the corner count expected")))?;
        corners.clear();
        for word in words.by_ref().take(size) {
            match word.parse::<u32>() {
                Ok(v) if (v as usize) < vertex_count => corners.push(v),
                _ => {
                    let what = format!("face {i} names vertex {word}, but there are {vertex_count}");
                    return Err(Fault::at(number, what));
                }
            }
        }
        if corners.len() < size {
            let what = format!("face {i} should have {size} corners, and has {}", corners.len());
            return Err(Fault::at(number, what));
        }
        faces.add(&corners);
    }
    Ok(faces.finish(vertices))
}
