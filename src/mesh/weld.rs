//! Merging vertices by position, for triangle soups.

use std::collections::HashMap;
use std::iter::zip;

use glam::{DVec3, Vec3};

use super::clean::Removed;
use super::{Mesh, Vertex};

/// No vertex here yet. Vertex numbers stay below it: 2³² vertices would not have u32 numbers.
const EMPTY: u32 = u32::MAX;

/// A distance within which nothing can be welded.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "vertices cannot be welded within {distance}: give a finite distance of zero or more, in world units"
)]
pub struct WeldError {
    /// The distance asked for.
    pub distance: f32,
}

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
        let mut merged = Merged::default();
        for vertex in &self.vertices {
            let bits = bits(vertex);
            let mut slot = hash(bits) & mask;
            let found = loop {
                match table[slot] {
                    EMPTY => break None,
                    v if self::bits(&merged.kept[v as usize]) == bits => break Some(v),
                    _ => slot = (slot + 1) & mask,
                }
            };
            let v = merged.add(*vertex, found);
            table[slot] = v;
        }
        merged.into_mesh(self);
        before - self.vertices.len()
    }

    /// Merges vertices that lie within `distance` (in world units, 0 for equal positions alone) of each other, for soups
    /// whose corners only nearly agree, and removes the triangles that lose a corner by it.
    ///
    /// In the order of the mesh, each vertex becomes one with the nearest of those kept before it, or is kept. So no
    /// vertex moves farther than `distance`, and those kept are farther apart than it; which they are depends on the order.
    /// Normals are those of [`weld`](Mesh::weld). Parts of the surface that are nearer to each other than `distance` grow
    /// together: take less than the shortest edge. Vertices that are not finite stay alone.
    ///
    /// # Errors
    /// [`WeldError`] if `distance` is negative or not finite; the mesh is as it was.
    pub fn weld_within(&mut self, distance: f32) -> Result<Removed, WeldError> {
        if !(distance.is_finite() && distance >= 0.0) {
            return Err(WeldError { distance });
        }
        let before = (self.triangles.len(), self.vertices.len());
        if distance == 0.0 {
            self.weld();
        } else {
            self.weld_by_cells(f64::from(distance));
        }
        self.triangles.retain(|&[a, b, c]| a != b && b != c && c != a);
        Ok(Removed {
            triangles: before.0 - self.triangles.len(),
            vertices: before.1 - self.vertices.len(),
            flipped: 0,
        })
    }

    /// Kept vertices lie in lists, one for each cubic cell of twice the distance: what is near a point lies in 8 of them.
    fn weld_by_cells(&mut self, distance: f64) {
        let mut heads: HashMap<[u64; 3], u32> = HashMap::new();
        let mut next: Vec<u32> = Vec::new();
        let mut merged = Merged::default();
        // As bits: far out, cells have no integer numbers. The sum makes −0 a 0.
        let key = |cell: DVec3| (cell + 0.0).to_array().map(f64::to_bits);
        for vertex in &self.vertices {
            let at = vertex.at().as_dvec3();
            let place = at / (2.0 * distance);
            let low = (place - 0.5).floor();
            let mut nearest: Option<(f64, u32)> = None;
            for corner in 0..8 {
                let offset = DVec3::from([0, 1, 2].map(|axis| f64::from(corner >> axis & 1)));
                let mut v = heads.get(&key(low + offset)).copied().unwrap_or(EMPTY);
                while v != EMPTY {
                    let found = (merged.kept[v as usize].at().as_dvec3().distance_squared(at), v);
                    if found.0 <= distance * distance && nearest.is_none_or(|nearest| found < nearest) {
                        nearest = Some(found);
                    }
                    v = next[v as usize];
                }
            }
            let v = merged.add(*vertex, nearest.map(|(_, v)| v));
            if nearest.is_none() {
                next.push(if at.is_finite() {
                    heads.insert(key(place.floor()), v).unwrap_or(EMPTY)
                } else {
                    EMPTY
                });
            }
        }
        merged.into_mesh(self);
    }
}

/// The vertices that are left, and which of them each old one became.
#[derive(Default)]
struct Merged {
    kept: Vec<Vertex>,
    /// Of the normals.
    sums: Vec<Vec3>,
    number: Vec<u32>,
}

impl Merged {
    /// Takes the next old vertex, which is one with a kept one, or kept; its new number.
    fn add(&mut self, vertex: Vertex, same: Option<u32>) -> u32 {
        let v = same.unwrap_or_else(|| {
            self.kept.push(vertex);
            self.sums.push(Vec3::from(vertex.normal));
            self.kept.len() as u32 - 1
        });
        if vertex.normal != self.kept[v as usize].normal {
            self.sums[v as usize] += Vec3::from(vertex.normal);
        }
        self.number.push(v);
        v
    }

    fn into_mesh(mut self, mesh: &mut Mesh) {
        for (vertex, sum) in zip(&mut self.kept, self.sums) {
            // Where all normals were equal they keep their bits.
            let mixed = sum != Vec3::from(vertex.normal);
            if let (true, Some(unit)) = (mixed, sum.try_normalize()) {
                vertex.normal = unit.to_array();
            }
        }
        for v in mesh.triangles.iter_mut().flatten() {
            // A bad index stays bad: it is at least the old count, and there are no more vertices now.
            *v = self.number.get(*v as usize).copied().unwrap_or(*v);
        }
        mesh.vertices = self.kept;
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
