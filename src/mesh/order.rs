//! The order in which a GPU meets vertices: how good it is, and, with the feature `meshopt`, a better one.

use std::collections::VecDeque;

use super::Mesh;

/// Vertices that the cache of [`Mesh::cache_misses`] holds.
const CACHE: usize = 16;

impl Mesh {
    /// The average cache miss ratio: how many vertices are fetched a triangle, through a cache that holds the last 16 that
    /// were fetched. From 0.5 at best (of large meshes) to 3; 0 without triangles.
    pub fn cache_misses(&self) -> f64 {
        let mut cache = VecDeque::with_capacity(CACHE + 1);
        let mut misses = 0usize;
        for &v in self.triangles.as_flattened() {
            if !cache.contains(&v) {
                misses += 1;
                cache.push_back(v);
                if cache.len() > CACHE {
                    cache.pop_front();
                }
            }
        }
        misses as f64 / self.triangles.len().max(1) as f64
    }
}

#[cfg(feature = "meshopt")]
mod by_meshopt {
    use super::Mesh;
    use crate::mesh::simplify::{Unfit, fit};

    impl Mesh {
        /// Puts triangles into an order that suits a GPU's vertex cache, and vertices into the order of their first use; unused
        /// ones go. The triangles and their winding stay, though they may begin at another corner.
        ///
        /// # Errors
        /// [`Unfit`]; the mesh is as it was.
        pub fn optimize(&mut self) -> Result<(), Unfit> {
            fit(self)?;
            let count = self.vertices.len();
            let mut indices = meshopt::optimize_vertex_cache(self.triangles.as_flattened(), count);
            self.vertices = meshopt::optimize_vertex_fetch(&mut indices, &self.vertices);
            self.triangles = indices.as_chunks().0.to_vec();
            Ok(())
        }

        /// The triangles as one strip, which [`triangles_of_strip`](crate::mesh::triangles_of_strip) turns back into them (in
        /// another order). Its runs are joined by triangles that repeat a vertex, since glTF has no other way.
        ///
        /// # Errors
        /// [`Unfit`].
        pub fn strip(&self) -> Result<Vec<u32>, Unfit> {
            fit(self)?;
            let proper: Vec<[u32; 3]> =
                self.triangles.iter().copied().filter(|&[a, b, c]| a != b && b != c && c != a).collect();
            let count = self.vertices.len();
            let indices = meshopt::optimize_vertex_cache_strip(proper.as_flattened(), count);
            meshopt::stripify(&indices, count, 0).map_err(|_| Unfit::TooLarge)
        }
    }
}
