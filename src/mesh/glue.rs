//! Making a manifold of what edge collapses leave: sheets without thickness go, and what only touches comes apart.

use std::collections::HashMap;

use super::Mesh;
use super::check::{join, root};

impl Mesh {
    /// Removes triangles that repeat a vertex, and pairs of opposite triangles on the same three vertices; then glues the
    /// rest along its edges, each triangle to one that runs against it, and gives every fan of triangles around a vertex
    /// a vertex of its own. Nothing moves. Needs good indices.
    ///
    /// Of an oriented surface without border it makes one again, but for an edge that the same two fans share twice.
    pub(super) fn glue(&mut self) {
        self.triangles.retain(|&[a, b, c]| a != b && b != c && c != a);
        self.cancel_opposites();
        // A half-edge is 3 × triangle + k, and runs from corner k to the next.
        let ends = |h: u32| {
            let triangle = self.triangles[h as usize / 3];
            (triangle[h as usize % 3], triangle[(h as usize + 1) % 3])
        };
        let next = |h: u32| if h % 3 == 2 { h - 2 } else { h + 1 };
        let count = 3 * self.triangles.len() as u32;
        let mut open: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
        // Corners that are one vertex: corner h is where half-edge h begins.
        let mut corners: Vec<u32> = (0..count).collect();
        for h in 0..count {
            let (a, b) = ends(h);
            match open.get_mut(&(b, a)).and_then(Vec::pop) {
                Some(other) => {
                    join(&mut corners, h, next(other));
                    join(&mut corners, next(h), other);
                }
                None => open.entry((a, b)).or_default().push(h),
            }
        }
        // The first fan of a vertex keeps its number.
        let mut fan_of: Vec<Option<u32>> = vec![None; self.vertices.len()];
        let mut number: HashMap<u32, u32> = HashMap::new();
        for h in 0..count {
            let (v, fan) = (ends(h).0, root(&mut corners, h));
            if *fan_of[v as usize].get_or_insert(fan) != fan && !number.contains_key(&fan) {
                number.insert(fan, self.vertices.len() as u32);
                self.vertices.push(self.vertices[v as usize]);
            }
        }
        if !number.is_empty() {
            for (h, v) in (0..count).zip(self.triangles.as_flattened_mut()) {
                *v = number.get(&root(&mut corners, h)).copied().unwrap_or(*v);
            }
        }
        self.drop_unused();
    }

    fn cancel_opposites(&mut self) {
        // Whether it runs upwards, from the lowest vertex to the lower of the others, beside the three in order.
        let key = |&t: &[u32; 3]| {
            let mut sorted = t;
            sorted.sort_unstable();
            let lowest = t.iter().position(|&v| v == sorted[0]).unwrap_or(0);
            (sorted, t[(lowest + 1) % 3] == sorted[1])
        };
        let mut order: Vec<(([u32; 3], bool), usize)> = self.triangles.iter().map(key).zip(0..).collect();
        order.sort_unstable();
        let mut dead = vec![false; self.triangles.len()];
        for same in order.chunk_by(|a, b| a.0.0 == b.0.0) {
            let downwards = same.iter().filter(|(key, _)| !key.1).count();
            let pairs = downwards.min(same.len() - downwards);
            // Sorted: those that run downwards first.
            same[..pairs]
                .iter()
                .chain(&same[downwards..downwards + pairs])
                .for_each(|&(_, t)| dead[t] = true);
        }
        let mut dead = dead.into_iter();
        self.triangles.retain(|_| dead.next() == Some(false));
    }
}
