//! Wavefront OBJ: positions, normals and faces of the whole file as one mesh. Groups, materials,
//! texture coordinates, points and lines are skipped.
//!
//! Read here rather than by tobj, which numbers vertices anew in the order of the faces and apart for
//! each group, splits those with several normals, and gives no line numbers: what the checker would say
//! of its mesh would not be true of the file.

use std::borrow::Cow;

use glam::Vec3;

use super::polygon::Faces;
use super::{Contents, Fault, countable, text, three};
use crate::mesh::Vertex;

/// The statements that are skipped, those of free-form surfaces and the superseded ones among them: a file without any
/// statement is no OBJ.
const SKIPPED: &str = "vt g s o usemtl mtllib l p mg usemap maplib vp cstype deg bmat step curv curv2 surf parm trim hole \
    scrv sp end con bevel c_interp d_interp lod shadow_obj trace_obj ctech stech call csh bsp bzp cdc cdp res";

#[derive(Default)]
struct Obj {
    vertices: Vec<Vertex>,
    normals: Vec<[f32; 3]>,
    /// For each vertex: the normal of its first corner that has one, by number.
    first: Vec<Option<u32>>,
    /// The sum over its corners, and whether they differ.
    sums: Vec<(Vec3, bool)>,
    /// (line, kind, number) of references to what had not appeared then.
    ahead: Vec<(usize, &'static str, usize)>,
    /// How many faces have begun.
    begun: usize,
    faces: Faces,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Contents, Fault> {
    let text = text(bytes);
    let mut obj = Obj::default();
    let mut lines = (1..).zip(text.lines());
    // Corners may come before their vertices, so normals wait until all are there.
    let mut corners: Vec<(u32, u32)> = Vec::new();
    let mut face = Vec::new();
    // The first line that is no statement, and whether any is one.
    let (mut stranger, mut has_skipped) = (None, false);
    while let Some((number, line)) = lines.next() {
        let mut line = Cow::Borrowed(line);
        // Appended in place: files have lines of any number of pieces.
        while line.ends_with('\\') {
            let joined = line.to_mut();
            joined.pop();
            joined.push(' ');
            joined.push_str(lines.next().unwrap_or_default().1);
        }
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let position = three(&mut words, number)?;
                obj.vertices.push(Vertex { position, normal: [0.0; 3] });
            }
            Some("vn") => obj.normals.push(three(&mut words, number)?),
            Some("f") => {
                face.clear();
                for word in words.take_while(|word| !word.starts_with('#')) {
                    let (v, normal) = obj.corner(word, number)?;
                    face.push(v);
                    corners.extend(normal.map(|normal| (v, normal)));
                }
                obj.faces.add(&face);
                obj.begun += 1;
            }
            Some(word) if SKIPPED.split(' ').any(|skipped| skipped == word) => has_skipped = true,
            Some(word) if !word.starts_with('#') && stranger.is_none() => {
                stranger = Some((number, word.chars().take(40).collect::<String>()));
            }
            _ => {}
        }
    }
    if let Some((number, word)) = stranger
        && !has_skipped
        && obj.vertices.is_empty()
        && obj.normals.is_empty()
        && obj.begun == 0
    {
        let what =
            format!("{word:?} begins no statement of OBJ, and no line has one: v, vn, vt or f expected");
        return Err(Fault::at(number, what));
    }
    obj.finish(&corners)
}

impl Obj {
    /// Vertex and normal, from 0, of `v`, `v/t`, `v/t/n` or `v//n`.
    fn corner(&mut self, word: &str, line: usize) -> Result<(u32, Option<u32>), Fault> {
        let mut parts = word.split('/');
        let v = parts.next().unwrap_or("");
        let v = self.number(v, "vertex", self.vertices.len(), line)?;
        let normal = match parts.nth(1) {
            Some(n) if !n.is_empty() => Some(self.number(n, "normal", self.normals.len(), line)?),
            _ => None,
        };
        Ok((v, normal))
    }

    /// A number from 0, given from 1 or, backwards from what has appeared, from −1.
    fn number(&mut self, word: &str, kind: &'static str, so_far: usize, line: usize) -> Result<u32, Fault> {
        let face = self.begun;
        let bad = || Fault::at(line, format!("face {face} names {kind} {word}, which does not exist"));
        let number = match word
            .parse::<i64>()
            .map_err(|_| Fault::at(line, format!("face {face}: {word:?} is not the number of a {kind}")))?
        {
            0 => return Err(bad()),
            n if n > 0 => n - 1,
            n => n + so_far as i64,
        };
        let number = u32::try_from(number).ok().filter(|&n| n != u32::MAX).ok_or_else(bad)?;
        if number as usize >= so_far {
            self.ahead.push((line, kind, number as usize));
        }
        Ok(number)
    }

    fn finish(mut self, corners: &[(u32, u32)]) -> Result<Contents, Fault> {
        countable(self.vertices.len())?;
        for &(line, kind, number) in &self.ahead {
            let count = if kind == "vertex" { self.vertices.len() } else { self.normals.len() };
            if number >= count {
                let what = format!("a face names {kind} {}, but the file has {count}", number + 1);
                return Err(Fault::at(line, what));
            }
        }
        self.first = vec![None; self.vertices.len()];
        self.sums = vec![(Vec3::ZERO, false); self.vertices.len()];
        for &(v, normal) in corners {
            let (first, (sum, mixed)) = (&mut self.first[v as usize], &mut self.sums[v as usize]);
            let value = self.normals[normal as usize];
            *mixed |= first.is_some_and(|first| self.normals[first as usize] != value);
            first.get_or_insert(normal);
            *sum += Vec3::from(value);
        }
        for ((vertex, first), (sum, mixed)) in self.vertices.iter_mut().zip(self.first).zip(self.sums) {
            let Some(first) = first else { continue };
            let unit = sum.try_normalize().filter(|_| mixed);
            vertex.normal = unit.map_or(self.normals[first as usize], |unit| unit.to_array());
        }
        Ok(self.faces.finish(self.vertices))
    }
}
