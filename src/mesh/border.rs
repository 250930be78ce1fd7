//! Where a mesh is open because the domain ended.

use super::{Mesh, Vertex};
use crate::grid::Grid;
use glam::Vec3;
use rayon::prelude::*;

impl Mesh {
    /// Edges of one triangle alone that lie on the border of `grid`'s domain, where extraction leaves a surface open. Triangles that
    /// name a vertex which does not exist are not looked at.
    pub fn open_edges_at_border(&self, grid: &Grid) -> u64 {
        let to_steps = grid.step().as_dmat3().inverse().as_mat3();
        let (cells, near) = (grid.cells().as_vec3(), grid.on_border());
        // The border planes that a vertex lies on, a bit each.
        let planes = |vertex: &Vertex| {
            let q = to_steps * (vertex.at() - grid.origin());
            (q.cmplt(Vec3::splat(near)).bitmask() | q.cmpgt(cells - near).bitmask() << 3) as u8
        };
        let planes: Vec<u8> = self.vertices.par_iter().map(planes).collect();
        let mut edges = Vec::new();
        for triangle in &self.triangles {
            let [Some(a), Some(b), Some(c)] = triangle.map(|corner| planes.get(corner as usize)) else {
                continue;
            };
            let at = [a, b, c];
            for i in 0..3 {
                let j = (i + 1) % 3;
                if at[i] & at[j] != 0 {
                    let (a, b) = (triangle[i], triangle[j]);
                    edges.push([a.min(b), a.max(b)]);
                }
            }
        }
        edges.sort_unstable();
        edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).count() as u64
    }
}
