//! The sheets of surface in a cell: the loops that the marching cubes table draws around it (Nielson 2004, *Dual
//! marching cubes*).
//!
//! Every crossed edge of a cell belongs to exactly one sheet. A sheet is a closed loop over the cell's faces, from
//! crossed edge to crossed edge; the table's one rule for ambiguous faces makes the loops of neighbours agree.

use crate::table::MARCHING_CUBES;
use std::sync::LazyLock;

/// A loop: the crossed edges in order, and the faces that it runs over between them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Loop {
    /// Edge numbers, as in `tables/README.md`.
    pub edges: Vec<u8>,
    /// Number `i` is the face from edge `i` to the next: `2 * axis + side`.
    pub faces: Vec<u8>,
    /// Bit `f` tells whether the loop runs over face `f` twice.
    pub twice: u8,
}

impl Loop {
    /// The edge at the other end of the segment that runs from `edge` over `face`, if the loop has it.
    pub fn across(&self, edge: u8, face: u8) -> Option<u8> {
        let (n, i) = (self.edges.len(), self.edges.iter().position(|e| *e == edge)?);
        let before = (i + n - 1) % n;
        match face {
            _ if self.faces[i] == face => Some(self.edges[(i + 1) % n]),
            _ if self.faces[before] == face => Some(self.edges[before]),
            _ => None,
        }
    }
}

/// The sheets of each of the 256 cases.
pub static SHEETS: LazyLock<Vec<Vec<Loop>>> = LazyLock::new(|| (0..=255).map(loops).collect());

/// The two faces that edge `e` lies in.
fn faces_of(e: u8) -> [u8; 2] {
    let [b, c] = others((e / 4) as usize).map(|axis| 2 * axis as u8);
    [b + (e & 1), c + (e >> 1 & 1)]
}

/// The two axes beside `axis`, the earlier first.
pub fn others(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis]
}

fn loops(case: u8) -> Vec<Loop> {
    let triangles = (0..MARCHING_CUBES.triangle_count(case)).map(|i| MARCHING_CUBES.triangle(case, i));
    let sides: Vec<[u32; 2]> = triangles.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    // A side of a triangle that no other runs along is a segment in a face.
    let mut next = [None; 12];
    for &[a, b] in sides.iter().filter(|[a, b]| !sides.contains(&[*b, *a])) {
        next[a as usize] = Some(b as u8);
    }
    let mut all = Vec::new();
    for start in 0..12 {
        let (mut one, mut at) = (Loop::default(), start);
        while let Some(to) = next[at as usize].take() {
            let face = faces_of(at).into_iter().find(|f| faces_of(to).contains(f)).unwrap_or(0);
            one.twice |= if one.faces.contains(&face) { 1 << face } else { 0 };
            one.edges.push(at);
            one.faces.push(face);
            at = to;
        }
        if !one.edges.is_empty() {
            all.push(one);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::EDGE_CORNERS;

    #[test]
    fn loops_hold_every_crossed_edge_once() {
        for case in 0..=255u8 {
            let mut edges: Vec<u8> = SHEETS[case as usize].iter().flat_map(|l| l.edges.clone()).collect();
            edges.sort_unstable();
            let crossed = (0..12u8).filter(|e| {
                let [a, b] = EDGE_CORNERS[*e as usize];
                (case >> a ^ case >> b) & 1 == 1
            });
            assert_eq!(edges, crossed.collect::<Vec<_>>(), "case {case}");
            for sheet in &SHEETS[case as usize] {
                for (i, (&edge, &face)) in sheet.edges.iter().zip(&sheet.faces).enumerate() {
                    let next = sheet.edges[(i + 1) % sheet.edges.len()];
                    assert!(faces_of(edge).contains(&face) && faces_of(next).contains(&face), "case {case}");
                    assert_eq!(
                        (sheet.across(edge, face), sheet.across(next, face)),
                        (Some(next), Some(edge))
                    );
                }
            }
        }
    }
}
