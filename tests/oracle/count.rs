//! What a mesh is, counted once more: from a sorted list of half-edges, and sets of corners that grow together across
//! edges. Nothing of `isoforge::mesh::check` is in it.

use crate::topology::Sets;

/// Names as those of the checker's report.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct Count {
    pub boundary_edges: usize,
    pub non_manifold_edges: usize,
    pub misoriented_edges: usize,
    pub non_manifold_vertices: usize,
    /// Each piece's first vertex, and its V − E + F.
    pub pieces: Vec<(u32, i64)>,
}

impl Count {
    pub fn euler(&self) -> i64 {
        self.pieces.iter().map(|piece| piece.1).sum()
    }

    /// Whether every directed edge is there once, and once the other way round.
    pub fn is_closed_by_edge(&self) -> bool {
        self.boundary_edges + self.non_manifold_edges + self.misoriented_edges == 0
    }
}

/// Counts a mesh of so many vertices. A triangle that repeats a vertex is none.
pub fn count(vertices: usize, triangles: &[[u32; 3]]) -> Count {
    let proper = |t: &&[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let triangles: Vec<[u32; 3]> = triangles.iter().filter(proper).copied().collect();
    let mut pieces = Sets::new(vertices);
    // A half-edge by its ends, lower first, and the corner that it starts at.
    let mut halves: Vec<(u64, u32)> = Vec::with_capacity(3 * triangles.len());
    for (t, triangle) in (0u32..).zip(&triangles) {
        for k in 0..3 {
            let [a, b] = [triangle[k as usize], triangle[(k as usize + 1) % 3]];
            halves.push((u64::from(a.min(b)) << 32 | u64::from(a.max(b)), 3 * t + k));
            pieces.join(a, b);
        }
    }
    halves.sort_unstable();

    let mut count = Count::default();
    let mut euler = vec![0i64; vertices];
    let mut crowded = vec![false; vertices];
    let mut fans = Sets::new(3 * triangles.len());
    let next = |corner: u32| corner / 3 * 3 + (corner + 1) % 3;
    let vertex = |corner: u32| triangles[corner as usize / 3][corner as usize % 3];
    for edge in halves.chunk_by(|a, b| a.0 == b.0) {
        let [low, high] = [edge[0].0 >> 32, edge[0].0 & u64::from(u32::MAX)].map(|v| v as usize);
        euler[pieces.find(low as u32) as usize] -= 1;
        // The corners at the lower and at the higher end.
        let ends = |corner: u32| {
            let ends = [corner, next(corner)];
            if vertex(corner) as usize == low { ends } else { [ends[1], ends[0]] }
        };
        match edge {
            [_] => count.boundary_edges += 1,
            [a, b] => count.misoriented_edges += usize::from(vertex(a.1) == vertex(b.1)),
            _ => {
                count.non_manifold_edges += 1;
                (crowded[low], crowded[high]) = (true, true);
            }
        }
        for pair in edge.windows(2) {
            let [a, b] = [ends(pair[0].1), ends(pair[1].1)];
            fans.join(a[0], b[0]);
            fans.join(a[1], b[1]);
        }
    }
    let mut fans_at = vec![0; vertices];
    for corner in 0..3 * triangles.len() as u32 {
        fans_at[vertex(corner) as usize] += usize::from(fans.find(corner) == corner);
    }
    for v in 0..vertices {
        count.non_manifold_vertices += usize::from(fans_at[v] > 1 || crowded[v]);
        euler[pieces.find(v as u32) as usize] += i64::from(fans_at[v] > 0);
    }
    for triangle in &triangles {
        euler[pieces.find(triangle[0]) as usize] += 1;
    }
    let first = |v: &u32| fans_at[*v as usize] > 0 && pieces.find(*v) == *v;
    count.pieces = (0..vertices as u32).filter(first).map(|v| (v, euler[v as usize])).collect();
    count
}
