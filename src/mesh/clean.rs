//! Removing the triangles that marching cubes leaves where a sample equals the iso value, and those that mean nothing.

use rayon::prelude::*;

use super::check::{is_degenerate, join, root, unused};
use super::{Mesh, stitch};

/// What was taken away.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Removed {
    /// Triangles fewer than before.
    pub triangles: usize,
    /// Vertices fewer than before; 0 where splitting made more than contraction saved.
    pub vertices: usize,
    /// Triangles that are left, with area now that an edge is flipped; by [`Mesh::remove_degenerate`] alone.
    pub flipped: usize,
}

impl Mesh {
    /// Triangles that repeat a vertex or have no area: [`Report::degenerate_triangles`] without the
    /// rest of the check.
    ///
    /// [`Report::degenerate_triangles`]: super::check::Report::degenerate_triangles
    pub fn degenerate_count(&self) -> usize {
        self.triangles.par_iter().filter(|&&triangle| is_degenerate(&self.vertices, triangle)).count()
    }

    /// Contracts zero-length edges, removes the triangles that collapse with them, and flips edges of others without area.
    ///
    /// Marching cubes puts several vertices on one grid point when its sample equals the iso value. The
    /// vertices that edges of no length connect become one, with the normalised sum of their normals
    /// (the first's where that is zero); vertices that merely lie at the same place stay apart, so
    /// coincident sheets do not grow together. Then:
    ///
    /// * triangles that repeat a vertex go, and so do pairs of opposite triangles that contraction laid
    ///   onto the same three vertices: a sheet without thickness;
    /// * where the surface now touches itself in a point or along an edge, the vertices there are
    ///   split, so that a mesh that was manifold and consistently wound stays so. A neck pinched flat
    ///   into an edge is cut through (the genus falls), which moves nothing;
    /// * where the corners of a triangle lie on a line and are different places, its longest edge is flipped, which parts
    ///   the neighbour over that edge where the middle corner lies; if that edge is a border, the triangle goes, and the border
    ///   runs by the middle corner; where the flip would lay a triangle onto an opposite one, both go; two such triangles over one
    ///   longest edge with their middle corners at one place close up like a zip; and four triangles that are a component by
    ///   themselves, flat with such a one among them, go;
    /// * unused vertices go. What remains keeps its order.
    ///
    /// A closed mesh stays closed, no vertex moves, and the enclosed volume stays. The result has no
    /// edges of no length, hence no triangle with coincident corners. A triangle with collinear corners stays where a flip
    /// would make a second edge between two vertices, or its longest edge has not two triangles, wound alike:
    /// [`degenerate_count`](Mesh::degenerate_count) tells. A second run changes
    /// nothing. A mesh with a bad index is left as it is. A mesh that was non-manifold before may stay
    /// so, and where a surface has a border, an edge of the border may come to lie on an inner edge and
    /// give it a third triangle: [`check`](Mesh::check) tells.
    pub fn remove_degenerate(&mut self) -> Removed {
        let count = self.vertices.len();
        if self.triangles.par_iter().flatten().any(|&v| v as usize >= count) {
            return Removed::default();
        }
        let before = (self.triangles.len(), count);
        let mut flipped = 0;
        loop {
            self.contract_coincident();
            let flips = self.flip_thin();
            flipped += flips.flipped;
            // Contraction takes two triangles each time, so this ends.
            if !flips.has_pressed {
                break;
            }
        }
        Removed {
            triangles: before.0 - self.triangles.len(),
            vertices: before.1.saturating_sub(self.vertices.len()),
            flipped,
        }
    }

    /// Makes one of vertices that edges of no length connect; what repeats a vertex goes, and what is unused.
    fn contract_coincident(&mut self) {
        let count = self.vertices.len();
        let coincident: Vec<(u32, u32)> = self
            .triangles
            .par_iter()
            .flat_map_iter(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .filter(|&(a, b)| {
                a != b && self.vertices[a as usize].position == self.vertices[b as usize].position
            })
            .collect();
        let repeats = |&[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
        // Most meshes have nothing to contract, and need no copy to know it.
        if !coincident.is_empty() || self.triangles.par_iter().any(repeats) || unused(self) > 0 {
            let mut parent: Vec<u32> = (0..count as u32).collect();
            for &(a, b) in &coincident {
                join(&mut parent, a, b);
            }
            for v in 0..count as u32 {
                parent[v as usize] = root(&mut parent, v);
            }
            *self = stitch::contract(self, &parent);
        }
    }

    /// Removes triangles that name a vertex that does not exist, or one that is NaN or infinite, and then the vertices that
    /// no triangle is left of.
    pub fn remove_broken(&mut self) -> Removed {
        let before = (self.triangles.len(), self.vertices.len());
        let vertices = &self.vertices;
        let is_good = |&v: &u32| vertices.get(v as usize).is_some_and(|v| v.at().is_finite());
        self.triangles.retain(|t| t.iter().all(is_good));
        self.drop_unused();
        Removed {
            triangles: before.0 - self.triangles.len(),
            vertices: before.1 - self.vertices.len(),
            flipped: 0,
        }
    }

    /// Removes the vertices that no triangle names; the others keep their order.
    pub(super) fn drop_unused(&mut self) {
        let mut number = vec![u32::MAX; self.vertices.len()];
        for &v in self.triangles.as_flattened() {
            if let Some(number) = number.get_mut(v as usize) {
                *number = 0;
            }
        }
        for (next, number) in (0..).zip(number.iter_mut().filter(|number| **number == 0)) {
            *number = next;
        }
        let mut used = number.iter().map(|&number| number != u32::MAX);
        self.vertices.retain(|_| used.next() == Some(true));
        for v in self.triangles.as_flattened_mut() {
            *v = number.get(*v as usize).copied().unwrap_or(u32::MAX);
        }
    }
}
