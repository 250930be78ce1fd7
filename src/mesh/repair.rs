//! Making a manifold of a surface that touches itself: sheets without thickness go, and what only touches comes apart.

use std::collections::{HashMap, HashSet};

use super::Mesh;
use super::check::{join, root};

/// How often the sides of crowded edges are paired anew where two fans share an edge twice: no bound for a mesh that is not
/// made for it, since each time parts fans.
const ROUNDS: usize = 1000;

/// What [`Mesh::repair`] did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Repaired {
    /// Triangles removed.
    pub triangles: usize,
    /// Vertices added, at the places of others.
    pub split: usize,
}

/// A side of a triangle: its ends in order, whether it runs down from the higher one, and its number, 3 × triangle + corner.
type Side = ([u32; 2], bool, u32);

impl Mesh {
    /// Removes triangles that repeat a vertex or name one that does not exist, pairs of opposite triangles on the same three
    /// vertices, and repeated triangles that have no neighbours of their own; glues the rest along its edges, each side to one that runs against it, and gives every fan of triangles
    /// around a vertex a vertex of its own. No vertex moves; unused ones go.
    ///
    /// An oriented surface without border that touches itself in points and edges, as a welded soup may, becomes a closed
    /// manifold. Sides that none runs against, as where the winding
    /// turns over or three triangles meet, become a border.
    pub fn repair(&mut self) -> Repaired {
        let before = self.triangles.len();
        let count = self.vertices.len();
        self.triangles.retain(|t| {
            t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && t.iter().all(|&v| (v as usize) < count)
        });
        self.cancel_opposites();
        self.drop_repeated();
        let mut fans = self.fans();
        // The first fan of a vertex keeps its number.
        let mut first = vec![None; count];
        let mut number = vec![u32::MAX; fans.len()];
        for h in 0..fans.len() as u32 {
            let (v, fan) = (self.triangles[h as usize / 3][h as usize % 3], root(&mut fans, h));
            if number[fan as usize] == u32::MAX {
                number[fan as usize] = if *first[v as usize].get_or_insert(fan) == fan {
                    v
                } else {
                    self.vertices.push(self.vertices[v as usize]);
                    self.vertices.len() as u32 - 1
                };
            }
        }
        for (h, v) in (0..).zip(self.triangles.as_flattened_mut()) {
            *v = number[root(&mut fans, h) as usize];
        }
        let split = self.vertices.len() - count;
        self.drop_unused();
        Repaired { triangles: before - self.triangles.len(), split }
    }

    /// Which corners (3 × triangle + corner) are one vertex: sets as of [`join`].
    fn fans(&self) -> Vec<u32> {
        let sides = |(t, i): (&[u32; 3], u32)| {
            let side = |k: usize| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                ([a.min(b), a.max(b)], a > b, 3 * i + k as u32)
            };
            [side(0), side(1), side(2)]
        };
        let mut sides: Vec<Side> = self.triangles.iter().zip(0u32..).flat_map(sides).collect();
        sides.sort_unstable();
        // Where the sides of each crowded edge lie, and which of those that run down each that runs up is glued to.
        let mut crowded: Vec<(usize, usize, Vec<usize>)> = Vec::new();
        let mut start = 0;
        for edge in sides.chunk_by(|a, b| a.0 == b.0) {
            if edge.len() > 2 {
                let down = edge.iter().filter(|side| side.1).count();
                crowded.push((start, start + edge.len(), (0..down).collect()));
            }
            start += edge.len();
        }
        let mut corners = Vec::new();
        for _ in 0..ROUNDS {
            corners = (0..sides.len() as u32).collect();
            for edge in sides.chunk_by(|a, b| a.0 == b.0).filter(|edge| edge.len() == 2) {
                glue(edge, &[0], &mut corners);
            }
            crowded.iter().for_each(|(start, end, to)| glue(&sides[*start..*end], to, &mut corners));
            // Two pairs between the same two fans: swapped, they part both fans. One swap at a vertex and round, since a second one
            // might join them again.
            let mut swapped: HashSet<u32> = HashSet::new();
            let mut is_done = true;
            for (start, end, to) in &mut crowded {
                let mut ends: Vec<([u32; 2], usize)> = sides[*start..*end]
                    .iter()
                    .filter(|side| !side.1)
                    .map(|&(_, _, h)| [h, next(h)].map(|corner| root(&mut corners, corner)))
                    .zip(0..to.len())
                    .collect();
                ends.sort_unstable();
                if let Some(two) = ends.windows(2).find(|two| two[0].0 == two[1].0) {
                    is_done = false;
                    let at = sides[*start].0;
                    if at.iter().all(|v| !swapped.contains(v)) {
                        swapped.extend(at);
                        to.swap(two[0].1, two[1].1);
                    }
                }
            }
            if is_done {
                break;
            }
        }
        corners
    }

    /// Drops triangles that are there twice, wound the same way, where no side of the second has one that runs against it: where all have,
    /// two sheets touch.
    fn drop_repeated(&mut self) {
        let mut seen = HashSet::new();
        let first = |t: &[u32; 3]| (0..3).map(|k| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]).min();
        let repeated: Vec<bool> = self.triangles.iter().map(|t| !seen.insert(first(t))).collect();
        if !repeated.contains(&true) {
            return;
        }
        let sides = |t: [u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        // By their ends, how many more sides run upwards than downwards.
        let mut excess: HashMap<[u32; 2], i64> = HashMap::new();
        let upwards = |[a, b]: [u32; 2]| if a < b { ([a, b], 1) } else { ([b, a], -1) };
        for side in self.triangles.iter().flat_map(|&t| sides(t)) {
            let (edge, way) = upwards(side);
            *excess.entry(edge).or_default() += way;
        }
        let mut repeated = repeated.into_iter();
        self.triangles.retain(|&t| {
            let own = sides(t).map(upwards);
            let is_alone = own.iter().all(|(edge, way)| excess.get(edge).is_some_and(|n| n * way > 0));
            let goes = repeated.next() == Some(true) && is_alone;
            if goes {
                own.iter().for_each(|(edge, way)| *excess.entry(*edge).or_default() -= way);
            }
            !goes
        });
    }

    fn cancel_opposites(&mut self) {
        // Beside the three in order: whether the triangle goes from the lowest to the middle one.
        let key = |t: &[u32; 3]| {
            let mut sorted = *t;
            sorted.sort_unstable();
            let lowest = t.iter().position(|&v| v == sorted[0]).unwrap_or(0);
            (sorted, t[(lowest + 1) % 3] == sorted[1])
        };
        let mut order: Vec<([u32; 3], bool, usize)> =
            self.triangles.iter().map(key).zip(0..).map(|((sorted, way), i)| (sorted, way, i)).collect();
        order.sort_unstable();
        let mut dead = vec![false; self.triangles.len()];
        for same in order.chunk_by(|a, b| a.0 == b.0) {
            let one_way = same.iter().filter(|(_, way, _)| !way).count();
            let pairs = one_way.min(same.len() - one_way);
            // Sorted: those of the one way come first.
            same[..pairs].iter().chain(&same[one_way..one_way + pairs]).for_each(|&(.., t)| dead[t] = true);
        }
        let mut dead = dead.into_iter();
        self.triangles.retain(|_| dead.next() == Some(false));
    }
}

pub(super) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// Glues each side of an edge that runs up to the one that runs down that `to` says, as far as there are some.
fn glue(edge: &[Side], to: &[usize], corners: &mut [u32]) {
    let (up, down) = edge.split_at(edge.iter().filter(|side| !side.1).count());
    for (&(_, _, a), &to) in up.iter().zip(to) {
        let Some(&(_, _, b)) = down.get(to) else { continue };
        join(corners, a, next(b));
        join(corners, next(a), b);
    }
}
