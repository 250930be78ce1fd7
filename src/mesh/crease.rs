//! Shading of sharp edges: vertices there are doubled, so that each smooth side has a normal of its own.

use super::{Mesh, Vertex};
use glam::Vec3;

impl Mesh {
    /// The same triangles, with a vertex for each smooth side where sides meet at more than `degrees`. New normals are the
    /// means of the side's facets, by area; where there is one side, the vertex keeps its own.
    ///
    /// For drawing: along such edges the result is not joined. New vertices follow the old ones.
    #[must_use]
    pub fn split_creases(&self, degrees: f32) -> Self {
        let mut split = self.clone();
        let facets: Vec<Vec3> = self.triangles.iter().map(|t| self.facet(*t)).collect();
        let (starts, around) = self.triangles_around();
        let least = degrees.to_radians().cos();
        let mut sides = Vec::new();
        for v in 0..self.vertices.len() {
            let ring = &around[starts[v]..starts[v + 1]];
            sides.clear();
            sides.extend(0..ring.len());
            self.join_sides(v as u32, ring, &facets, least, &mut sides);
            if sides.iter().all(|side| *side == 0) {
                continue;
            }
            for first in (0..ring.len()).filter(|&i| sides[i] == i) {
                let of_side =
                    || ring.iter().zip(&sides).filter(|(_, side)| **side == first).map(|(t, _)| *t as usize);
                let normal = of_side().map(|t| facets[t]).sum::<Vec3>().try_normalize();
                let normal = normal.map_or(self.vertices[v].normal, |n| n.to_array());
                let vertex = Vertex { normal, ..self.vertices[v] };
                if first == 0 {
                    split.vertices[v] = vertex;
                    continue;
                }
                let number = split.vertices.len() as u32;
                split.vertices.push(vertex);
                for corner in of_side().flat_map(|t| [(t, 0), (t, 1), (t, 2)]) {
                    let corner = &mut split.triangles[corner.0][corner.1];
                    *corner = if *corner == v as u32 { number } else { *corner };
                }
            }
        }
        split
    }

    /// Along the normal of a triangle, twice as long as its area; 0 of one with a bad index.
    fn facet(&self, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|v| self.vertices.get(v as usize).map(Vertex::at));
        let (Some(a), Some(b), Some(c)) = (a, b, c) else { return Vec3::ZERO };
        let facet = (b - a).cross(c - a);
        if facet.is_finite() { facet } else { Vec3::ZERO }
    }

    /// The triangles at vertex v: those from `starts[v]` to before `starts[v + 1]`.
    fn triangles_around(&self) -> (Vec<usize>, Vec<u32>) {
        let mut starts = vec![0; self.vertices.len() + 2];
        let corners = || self.triangles.iter().zip(0u32..).flat_map(|(t, i)| t.map(|v| (v as usize, i)));
        let known = |(v, _): &(usize, u32)| *v < self.vertices.len();
        corners().filter(known).for_each(|(v, _)| starts[v + 2] += 1);
        for v in 2..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut around = vec![0; starts[starts.len() - 1]];
        for (v, i) in corners().filter(known) {
            around[starts[v + 1]] = i;
            starts[v + 1] += 1;
        }
        (starts, around)
    }

    /// Gives the triangles of a ring that are smoothly joined the number of the first of them.
    fn join_sides(&self, v: u32, ring: &[u32], facets: &[Vec3], least: f32, sides: &mut [usize]) {
        for i in 1..ring.len() {
            for j in 0..i {
                let [a, b] = [i, j].map(|k| self.triangles[ring[k] as usize]);
                let is_beside = a.iter().any(|corner| *corner != v && b.contains(corner));
                let [f, g] = [i, j].map(|k| facets[ring[k] as usize].normalize_or_zero());
                // A triangle without area has no side of its own.
                let is_smooth = f.dot(g) >= least || f == Vec3::ZERO || g == Vec3::ZERO;
                if is_beside && is_smooth && sides[i] != sides[j] {
                    let (keep, drop) = (sides[i].min(sides[j]), sides[i].max(sides[j]));
                    sides.iter_mut().for_each(|side| *side = if *side == drop { keep } else { *side });
                }
            }
        }
    }
}
