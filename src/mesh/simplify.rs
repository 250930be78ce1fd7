//! Fewer triangles within an error, by meshoptimizer (edge collapses by quadrics, after M. Garland & P. Heckbert, *Surface
//! simplification using quadric error metrics*, SIGGRAPH 1997).

use meshopt::{SimplifyOptions, VertexDataAdapter};

use super::check::faulty_vertices;
use super::{Components, Mesh, Vertex};
use std::iter::zip;

/// Where simplification stops, at whichever comes first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// At so many triangles.
    pub triangles: usize,
    /// Before the surface moves farther than this, in world units; infinite for any distance.
    pub error: f32,
}

/// A mesh that this cannot be done with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// A triangle names a vertex that does not exist.
    #[error(
        "triangle {triangle} names a vertex that does not exist: remove such triangles first (Mesh::remove_broken)"
    )]
    BadIndex {
        /// The first such triangle, from 0.
        triangle: usize,
    },
    /// A vertex is NaN or infinite.
    #[error("vertex {vertex} is not finite: remove its triangles first (Mesh::remove_broken)")]
    NotFinite {
        /// The first such vertex, from 0.
        vertex: usize,
    },
    /// More indices than can be worked with.
    #[error("the mesh is too large: take a coarser one")]
    TooLarge,
}

/// Refuses what the C++ code, which trusts its input, must not see.
pub(super) fn fit(mesh: &Mesh) -> Result<(), Unfit> {
    let count = mesh.vertices.len();
    if let Some(triangle) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
        return Err(Unfit::BadIndex { triangle });
    }
    match mesh.vertices.iter().position(|v| !v.at().is_finite()) {
        Some(vertex) => Err(Unfit::NotFinite { vertex }),
        None => Ok(()),
    }
}

/// How often what became faulty is tried again with its surroundings locked, before its whole component is.
const ROUNDS: usize = 8;

impl Mesh {
    /// Collapses edges, those first by which the surface moves least, until the budget is reached or no edge is left that
    /// can go; returns how far the surface moved, in world units.
    ///
    /// The vertices left are some of the old ones, where they were and with their normals. The distance is the library's
    /// own measure, a root of the mean square from quadrics: single points may lie farther (in the tests up to four times as
    /// far on closed shapes, nine times on a thin, coarse sheet). Borders keep their shape within the same error. Vertices at the same
    /// place stay: [`remove_degenerate`](Mesh::remove_degenerate) first.
    ///
    /// Where edges, vertices and winding were in order, they stay so: a closed mesh stays closed. No component vanishes, or becomes
    /// a sheet without thickness. The surroundings of such faults are left as they were, as far as it takes, and so are
    /// components that would vanish; then more triangles than the budget stay.
    ///
    /// # Errors
    /// [`Unfit`]; the mesh is as it was.
    pub fn simplify(&mut self, budget: &Budget) -> Result<f32, Unfit> {
        fit(self)?;
        let mut locked = vec![false; self.vertices.len()];
        let is_sound = faulty_vertices(self).is_empty();
        let pieces = self.components();
        for round in 0.. {
            // What is locked is beyond the budget: the rest would be worn out by it.
            let kept = self.triangles.iter().filter(|t| t.iter().all(|&v| locked[v as usize])).count();
            let triangles = budget.triangles.saturating_add(kept);
            let (simple, moved) = self.collapsed(&Budget { triangles, ..*budget }, &locked)?;
            let mut around = vec![false; self.vertices.len()];
            if is_sound {
                faulty_vertices(&simple).iter().for_each(|&v| around[v as usize] = true);
            }
            // As far as the collapses at a fault may have come from.
            let each = self.triangles.len() as f64 / simple.triangles.len().max(1) as f64;
            let reach = if round < ROUNDS { each.sqrt().ceil() as usize + round } else { 0 };
            (0..reach).for_each(|_| self.spread(&mut around));
            if round >= ROUNDS {
                self.fill_components(&pieces, &mut around);
            }
            self.mark_lost(&pieces, &simple, &mut around);
            // In the end there is nothing new to lock: triangles that were degenerate before do not come back.
            if zip(&locked, &around).all(|(locked, around)| *locked || !around) {
                *self = simple;
                self.drop_unused();
                return Ok(moved);
            }
            zip(&mut locked, around).for_each(|(locked, around)| *locked |= around);
        }
        Ok(0.0)
    }

    /// With all old vertices, used or not.
    fn collapsed(&self, budget: &Budget, locked: &[bool]) -> Result<(Self, f32), Unfit> {
        let bytes: &[u8] = bytemuck::cast_slice(&self.vertices);
        let vertices = VertexDataAdapter::new(bytes, size_of::<Vertex>(), 0).map_err(|_| Unfit::TooLarge)?;
        let mut moved = 0.0;
        let indices = meshopt::simplify_with_locks(
            self.triangles.as_flattened(),
            &vertices,
            locked,
            budget.triangles.saturating_mul(3),
            budget.error.min(f32::MAX),
            SimplifyOptions::ErrorAbsolute,
            Some(&mut moved),
        );
        Ok((Self { vertices: self.vertices.clone(), triangles: indices.as_chunks().0.to_vec() }, moved))
    }

    /// Marks the vertices that share a triangle with a marked one.
    fn spread(&self, marks: &mut [bool]) {
        let near = |t: &&[u32; 3]| t.iter().any(|&v| marks[v as usize]);
        let reached: Vec<u32> = self.triangles.iter().filter(near).flatten().copied().collect();
        reached.into_iter().for_each(|v| marks[v as usize] = true);
    }

    /// Marks the whole components of marked vertices.
    fn fill_components(&self, pieces: &Components, marks: &mut [bool]) {
        let mut chosen = vec![false; pieces.components.len()];
        for (triangle, component) in zip(&self.triangles, &pieces.of_triangle) {
            if let Some(component) = component.filter(|_| triangle.iter().any(|&v| marks[v as usize])) {
                chosen[component as usize] = true;
            }
        }
        self.mark_components(pieces, &chosen, marks);
    }

    /// Marks the components of which nothing is left in `simple`.
    fn mark_lost(&self, pieces: &Components, simple: &Self, marks: &mut [bool]) {
        let mut of_vertex = vec![None; self.vertices.len()];
        for (triangle, component) in zip(&self.triangles, &pieces.of_triangle) {
            triangle.iter().for_each(|&v| of_vertex[v as usize] = *component);
        }
        let mut lost = vec![true; pieces.components.len()];
        for component in simple.triangles.iter().filter_map(|t| of_vertex[t[0] as usize]) {
            lost[component as usize] = false;
        }
        self.mark_components(pieces, &lost, marks);
    }

    fn mark_components(&self, pieces: &Components, chosen: &[bool], marks: &mut [bool]) {
        for (triangle, component) in zip(&self.triangles, &pieces.of_triangle) {
            if component.is_some_and(|component| chosen[component as usize]) {
                triangle.iter().for_each(|&v| marks[v as usize] = true);
            }
        }
    }
}
