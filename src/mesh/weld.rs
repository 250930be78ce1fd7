//! Merging vertices by position, for triangle soups.

use std::iter::zip;

use glam::Vec3;

use super::{Mesh, Vertex};

/// No vertex here yet. Vertex numbers stay below it: 2³² vertices would not have u32 numbers.
const EMPTY: u32 = u32::MAX;

impl Mesh {
    /// Merges all vertices with equal positions (−0 equals +0; a NaN equals the same NaN), wherever
    /// in the mesh they are, and returns how many vertices that saved.
    ///
    /// Made for soups such as STL files, where every triangle has vertices of its own. Coincident
    /// sheets grow together: on a mesh with connectivity of its own, use
    /// [`remove_degenerate`](Mesh::remove_degenerate). Vertices and triangles keep their order, each
    /// merged vertex standing where its first stood; its normal is the normalised sum of the first and
    /// of those that differ from it, or the first where that is zero. Triangles that lose a corner stay, as degenerate ones.
    pub fn weld(&mut self) -> usize {
        let before = self.vertices.len();
        // Open addressing: this is the whole cost of reading an STL file, and std's map would triple it.
        let mask = (before * 2).next_power_of_two().max(2) - 1;
        let mut table = vec![EMPTY; mask + 1];
        let mut kept: Vec<Vertex> = Vec::new();
        let mut sums: Vec<Vec3> = Vec::new();
        let mut number = Vec::with_capacity(before);
        for vertex in &self.vertices {
            let bits = bits(vertex);
            let mut slot = hash(bits) & mask;
            let found = loop {
                match table[slot] {
                    EMPTY => break None,
                    v if self::bits(&kept[v as usize]) == bits => break Some(v),
                    _ => slot = (slot + 1) & mask,
                }
            };
            let v = found.unwrap_or_else(|| {
                table[slot] = kept.len() as u32;
                kept.push(*vertex);
                sums.push(Vec3::from(vertex.normal));
                table[slot]
            });
            if vertex.normal != kept[v as usize].normal {
                sums[v as usize] += Vec3::from(vertex.normal);
            }
            number.push(v);
        }
        for (vertex, sum) in zip(&mut kept, sums) {
            // Where all normals were equal they keep their bits.
            let mixed = sum != Vec3::from(vertex.normal);
            if let (true, Some(unit)) = (mixed, sum.try_normalize()) {
                vertex.normal = unit.to_array();
            }
        }
        for v in self.triangles.iter_mut().flatten() {
            // A bad index stays bad: it is at least the old count, and there are no more vertices now.
            *v = number.get(*v as usize).copied().unwrap_or(*v);
        }
        self.vertices = kept;
        before - self.vertices.len()
    }
}

/// The position's bits, with −0 as +0.
fn bits(vertex: &Vertex) -> [u32; 3] {
    vertex.position.map(|x| (x + 0.0).to_bits())
}

fn hash([x, y, z]: [u32; 3]) -> usize {
    let mix = |h: u64, x: u32| (h ^ u64::from(x)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    let h = mix(mix(mix(0, x), y), z);
    (h ^ (h >> 32)) as usize
}
