//! Contracting groups of vertices so that a manifold stays a manifold.
//!
//! The triangles near the groups are cut apart into half-edges and corners, and stitched again.
//! Which half-edge faces which is known from before contraction; a collapsed triangle (x, x, y) hands
//! the neighbour on one side to the neighbour on the other, and so does a pair of opposite triangles
//! that cancel. The corners that stitches connect then form one fan or one cycle around each vertex of
//! the result, and each such fan gets a vertex of its own.
//!
//! What can remain is an edge that one pair of fans shares twice: a neck pinched flat. Swapping its two
//! stitches cuts the neck, which parts the fans at both ends.

use std::iter::zip;

use glam::Vec3;
use rayon::prelude::*;

use super::check::{join, root};
use super::repair::next;
use super::{Mesh, Vertex};

const NONE: u32 = u32::MAX;

/// Rounds of cutting necks. A round parts at least one fan and nearly always all; what a hostile mesh
/// still has after these stays as non-manifold edges.
const ROUNDS: usize = 64;

/// `mesh` with each vertex v replaced by `group[v]`, the lowest of its group; see
/// [`Mesh::remove_degenerate`] for what becomes of the rest. Every index must be good.
pub(super) fn contract(mesh: &Mesh, group: &[u32]) -> Mesh {
    let near = Near::of(mesh, group);
    let mut patch = Patch::of(mesh, group, &near);
    patch.collapse();
    patch.cancel(&near);
    let fans = patch.stitch(&near);
    patch.rebuild(&near, &fans)
}

/// Where contraction may change what surrounds a vertex.
struct Near {
    /// Whether a vertex is one of a group of several.
    merged: Vec<bool>,
    /// Whether a vertex shares a triangle with a merged one.
    near: Vec<bool>,
}

impl Near {
    fn of(mesh: &Mesh, group: &[u32]) -> Self {
        let mut merged = vec![false; group.len()];
        for (v, &g) in group.iter().enumerate().filter(|&(v, &g)| v != g as usize) {
            merged[v] = true;
            merged[g as usize] = true;
        }
        let mut near = vec![false; group.len()];
        for triangle in &mesh.triangles {
            if triangle.iter().any(|&v| merged[v as usize]) {
                for &v in triangle {
                    near[v as usize] = true;
                }
            }
        }
        Near { merged, near }
    }
}

/// The triangles with a near vertex. Their half-edges and corners are numbered 3 × (place here) + k:
/// half-edge k runs from corner k to corner k + 1.
struct Patch<'a> {
    mesh: &'a Mesh,
    group: &'a [u32],
    triangles: Vec<u32>,
    dead: Vec<bool>,
    /// The half-edge on the other side, by the edges before contraction.
    facing: Vec<u32>,
    /// For half-edges of dead triangles: where one leaves the dead triangle again.
    through: Vec<u32>,
}

impl<'a> Patch<'a> {
    fn of(mesh: &'a Mesh, group: &'a [u32], near: &Near) -> Self {
        let is_near = |t: &[u32; 3]| t.iter().any(|&v| near.near[v as usize]);
        let triangles: Vec<u32> =
            (0u32..).zip(&mesh.triangles).filter(|(_, t)| is_near(t)).map(|(i, _)| i).collect();
        let count = triangles.len();
        let (dead, none) = (vec![false; count], vec![NONE; 3 * count]);
        let mut patch = Patch { mesh, group, triangles, dead, facing: none.clone(), through: none };
        patch.face(near);
        patch
    }

    /// The vertex at a corner before contraction.
    fn old(&self, corner: u32) -> u32 {
        self.mesh.triangles[self.triangles[corner as usize / 3] as usize][corner as usize % 3]
    }

    /// The group at a corner.
    fn vertex(&self, corner: u32) -> u32 {
        self.group[self.old(corner) as usize]
    }

    fn halves(&self) -> std::ops::Range<u32> {
        0..3 * self.triangles.len() as u32
    }

    /// Finds the facing half-edges at all edges with a near end.
    fn face(&mut self, near: &Near) {
        let mut sides: Vec<(u32, u32, bool, u32)> = self
            .halves()
            .into_par_iter()
            .filter_map(|h| {
                let (a, b) = (self.old(h), self.old(next(h)));
                let wanted = near.near[a as usize] || near.near[b as usize];
                let length = self.group[a as usize] != self.group[b as usize];
                (wanted && length).then_some((a.min(b), a.max(b), a > b, h))
            })
            .collect();
        sides.par_sort_unstable();
        for edge in sides.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            // Up faces down; where the mesh was already non-manifold any such pairs will do, and what
            // is left of a badly wound edge pairs among itself.
            let (up, down) = edge.split_at(edge.partition_point(|side| !side.2));
            let both = up.len().min(down.len());
            let left = up[both..].iter().chain(&down[both..]).collect::<Vec<_>>();
            let pairs = zip(up, down).chain(left.chunks_exact(2).map(|pair| (pair[0], pair[1])));
            for (x, y) in pairs {
                self.facing[x.3 as usize] = y.3;
                self.facing[y.3 as usize] = x.3;
            }
        }
    }

    /// Kills the triangles that repeat a vertex.
    fn collapse(&mut self) {
        for t in 0..self.triangles.len() {
            let halves = [0, 1, 2].map(|k| 3 * t as u32 + k);
            let [a, b, c] = halves.map(|h| self.vertex(h));
            self.dead[t] = a == b || b == c || c == a;
            let sides = match (a == b, b == c, c == a) {
                (true, false, _) => Some((1, 2)),
                (_, true, false) => Some((2, 0)),
                (false, _, true) => Some((0, 1)),
                _ => None,
            };
            if let Some((x, y)) = sides {
                self.through[halves[x] as usize] = halves[y];
                self.through[halves[y] as usize] = halves[x];
            }
        }
    }

    /// Kills pairs of opposite triangles on the same vertices, where contraction laid them so.
    fn cancel(&mut self, near: &Near) {
        let mut faces: Vec<([u32; 3], bool, u32)> = (0..self.triangles.len() as u32)
            .into_par_iter()
            .filter(|&t| !self.dead[t as usize])
            .filter_map(|t| {
                let [a, b, c] = [0, 1, 2].map(|k| self.vertex(3 * t + k));
                let touched = [a, b, c].iter().any(|&v| near.merged[v as usize]);
                let mut sorted = [a, b, c];
                sorted.sort_unstable();
                let even = sorted == [a, b, c] || sorted == [b, c, a] || sorted == [c, a, b];
                touched.then_some((sorted, even, t))
            })
            .collect();
        faces.par_sort_unstable();
        for same in faces.chunk_by(|x, y| x.0 == y.0) {
            let (odd, even) = same.split_at(same.partition_point(|face| !face.1));
            for (&(_, _, s), &(_, _, t)) in zip(odd, even) {
                self.dead[s as usize] = true;
                self.dead[t as usize] = true;
                for h in 3 * s..3 * s + 3 {
                    let opposite = (3 * t..3 * t + 3).find(|&g| self.vertex(g) == self.vertex(next(h)));
                    if let Some(g) = opposite {
                        self.through[h as usize] = g;
                        self.through[g as usize] = h;
                    }
                }
            }
        }
    }

    /// The living half-edge that faces `h` across whatever died between them.
    fn across(&self, h: u32) -> Option<u32> {
        // The two steps are matchings, so the walk from a living half-edge never comes round.
        let mut g = self.facing[h as usize];
        while g != NONE && self.dead[g as usize / 3] {
            let out = self.through[g as usize];
            g = if out == NONE { NONE } else { self.facing[out as usize] };
        }
        (g != NONE).then_some(g)
    }

    /// The corner of `h`'s two that is at `vertex`.
    fn end(&self, h: u32, vertex: u32) -> u32 {
        if self.vertex(h) == vertex { h } else { next(h) }
    }

    /// Joins corners into fans, cutting necks; gives each corner its fan's lowest corner.
    fn stitch(&self, near: &Near) -> Vec<u32> {
        let mut stitches: Vec<(u32, u32)> = self
            .halves()
            .into_par_iter()
            .filter(|&h| !self.dead[h as usize / 3])
            .filter_map(|h| self.across(h).filter(|&g| h < g).map(|g| (h, g)))
            .collect();
        let mut fans: Vec<u32> = Vec::new();
        for _ in 0..ROUNDS {
            fans.clear();
            fans.extend(self.halves());
            for &(h, g) in &stitches {
                for v in [self.vertex(h), self.vertex(next(h))] {
                    join(&mut fans, self.end(h, v), self.end(g, v));
                }
            }
            for c in self.halves() {
                fans[c as usize] = root(&mut fans, c);
            }
            if !self.cut(near, &fans, &mut stitches) {
                break;
            }
        }
        fans
    }

    /// Swaps two stitches of each edge that a pair of fans shares twice; whether there was any.
    fn cut(&self, near: &Near, fans: &[u32], stitches: &mut [(u32, u32)]) -> bool {
        let mut edges: Vec<(u32, u32, usize)> = stitches
            .par_iter()
            .enumerate()
            .filter_map(|(i, &(h, _))| {
                let (a, b) = (self.vertex(h), self.vertex(next(h)));
                let (x, y) = (fans[h as usize], fans[next(h) as usize]);
                let merged = near.merged[a as usize] || near.merged[b as usize];
                merged.then_some((x.min(y), x.max(y), i))
            })
            .collect();
        edges.par_sort_unstable();
        let mut touched = vec![false; fans.len()];
        let mut any = false;
        for edge in edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            let &[(x, y, i), (_, _, j), ..] = edge else { continue };
            // A fan is swapped once a round: two swaps could undo each other.
            if touched[x as usize] || touched[y as usize] {
                continue;
            }
            let ((h, g), (mut k, mut l)) = (stitches[i], stitches[j]);
            if self.vertex(k) == self.vertex(h) {
                (k, l) = (l, k);
            }
            // A half-edge faces one that runs the other way, or the mesh was badly wound here.
            if self.vertex(g) == self.vertex(h) || self.vertex(k) == self.vertex(l) {
                continue;
            }
            (stitches[i], stitches[j]) = ((h, k), (l, g));
            touched[x as usize] = true;
            touched[y as usize] = true;
            any = true;
        }
        any
    }

    /// Puts the result together: one vertex a fan, and all that was not near as it was.
    fn rebuild(&self, near: &Near, fans: &[u32]) -> Mesh {
        let repeats = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
        let mut used = vec![false; self.group.len()];
        let mut place = 0;
        // Old triangle to its place in the patch, `None` for those outside; skipping what died.
        let living: Vec<([u32; 3], Option<u32>)> = (0u32..)
            .zip(&self.mesh.triangles)
            .filter_map(|(i, &triangle)| {
                let inside = self.triangles.get(place) == Some(&i);
                let at = inside.then_some(place as u32);
                place += usize::from(inside);
                let dead = if inside { self.dead[place - 1] } else { repeats(triangle) };
                (!dead).then_some((triangle, at))
            })
            .collect();
        for &v in living.iter().flat_map(|(triangle, _)| triangle) {
            used[v as usize] = true;
        }

        // (fan, old vertex) for all near corners, and from these the fans in the order of their first
        // old vertex.
        let mut members: Vec<(u32, u32)> = living
            .iter()
            .filter_map(|&(_, at)| at)
            .flat_map(|t| 3 * t..3 * t + 3)
            .filter(|&c| near.near[self.old(c) as usize])
            .map(|c| (fans[c as usize], self.old(c)))
            .collect();
        members.par_sort_unstable();
        members.dedup();
        let mut split: Vec<(u32, u32, Vertex)> =
            members.chunk_by(|x, y| x.0 == y.0).map(|fan| (fan[0].1, fan[0].0, self.merge(fan))).collect();
        split.par_sort_unstable_by_key(|&(old, fan, _)| (old, fan));

        let mut vertices = Vec::with_capacity(self.mesh.vertices.len());
        let mut of_vertex = vec![NONE; self.group.len()];
        let mut of_fan = vec![NONE; fans.len()];
        let mut split = split.into_iter().peekable();
        for (v, vertex) in (0u32..).zip(&self.mesh.vertices) {
            while let Some((_, fan, vertex)) = split.next_if(|&(old, ..)| old == v) {
                of_fan[fan as usize] = vertices.len() as u32;
                vertices.push(vertex);
            }
            if used[v as usize] && !near.near[v as usize] {
                of_vertex[v as usize] = vertices.len() as u32;
                vertices.push(*vertex);
            }
        }
        let triangles = living
            .iter()
            .map(|&(triangle, at)| {
                [0, 1, 2].map(|k| match at {
                    Some(t) if near.near[triangle[k] as usize] => of_fan[fans[3 * t as usize + k] as usize],
                    _ => of_vertex[triangle[k] as usize],
                })
            })
            .collect();
        Mesh { vertices, triangles }
    }

    /// One vertex for those of a fan, its first standing for the position.
    fn merge(&self, fan: &[(u32, u32)]) -> Vertex {
        let vertex = |&(_, v): &(u32, u32)| self.mesh.vertices[v as usize];
        let mut merged = vertex(&fan[0]);
        if fan.len() > 1 {
            let sum: Vec3 = fan.iter().map(|member| Vec3::from(vertex(member).normal)).sum();
            merged.normal = sum.try_normalize().map_or(merged.normal, |unit| unit.to_array());
        }
        merged
    }
}
