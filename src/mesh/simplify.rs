//! Fewer triangles within an error, by meshoptimizer (edge collapses by quadrics, after M. Garland & P. Heckbert, *Surface
//! simplification using quadric error metrics*, SIGGRAPH 1997).

use meshopt::{SimplifyOptions, VertexDataAdapter};

use super::{Mesh, Vertex};

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

impl Mesh {
    /// Collapses edges, those first by which the surface moves least, until the budget is reached or no edge is left that
    /// can go; returns how far the surface moved, in world units.
    ///
    /// The vertices left are some of the old ones, where they were and with their normals. The distance is the library's
    /// own measure, from quadrics: single points may lie up to twice as far. Borders keep their shape within the same error.
    ///
    /// A mesh without non-manifold or misoriented edges and vertices stays such, and a closed one stays closed: where collapses
    /// lay two sheets onto each other these go (a component may vanish so), what touches comes apart, and where that is not
    /// enough more triangles stay than the budget allows.
    ///
    /// # Errors
    /// [`Unfit`]; the mesh is as it was.
    pub fn simplify(&mut self, budget: &Budget) -> Result<f32, Unfit> {
        fit(self)?;
        let is_fit = is_manifold(self);
        let mut triangles = budget.triangles;
        while triangles < self.triangles.len() {
            let (mut simple, moved) = self.collapsed(&Budget { triangles, ..*budget })?;
            if is_fit.0 {
                simple.glue();
            }
            if is_manifold(&simple) >= is_fit {
                *self = simple;
                return Ok(moved);
            }
            triangles = 2 * triangles.max(simple.triangles.len()).max(1);
        }
        Ok(0.0)
    }

    fn collapsed(&self, budget: &Budget) -> Result<(Self, f32), Unfit> {
        let bytes: &[u8] = bytemuck::cast_slice(&self.vertices);
        let vertices = VertexDataAdapter::new(bytes, size_of::<Vertex>(), 0).map_err(|_| Unfit::TooLarge)?;
        let mut moved = 0.0;
        let indices = meshopt::simplify(
            self.triangles.as_flattened(),
            &vertices,
            budget.triangles.saturating_mul(3),
            budget.error.min(f32::MAX),
            SimplifyOptions::ErrorAbsolute,
            Some(&mut moved),
        );
        let mut simple = Self { vertices: self.vertices.clone(), triangles: indices.as_chunks().0.to_vec() };
        simple.drop_unused();
        Ok((simple, moved))
    }
}

/// Whether edges and vertices are manifold and wound alike, and whether there is no border either.
fn is_manifold(mesh: &Mesh) -> (bool, bool) {
    let r = mesh.check();
    let is_manifold =
        r.non_manifold_edges + r.non_manifold_vertices + r.misoriented_edges + r.duplicate_triangles == 0;
    (is_manifold, is_manifold && r.boundary_edges == 0)
}
