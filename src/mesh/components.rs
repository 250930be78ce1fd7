//! The pieces of a mesh, and removing small ones.

use glam::DVec3;

use super::Mesh;
use super::check::{join, root};
use super::clean::Removed;

/// A piece of a mesh: triangles that are connected through shared vertices.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Component {
    /// How many triangles it has.
    pub triangles: usize,
    /// Its surface.
    pub area: f64,
    /// What it encloses, by the divergence theorem: negative where it is wound inside out, as the inner surface of a
    /// hollow is. Means something only where it is closed.
    pub volume: f64,
}

/// What [`Mesh::components`] found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Components {
    /// The components, in the order of their first triangles.
    pub components: Vec<Component>,
    /// The number of each triangle's component; `None` of one that names a vertex that does not exist.
    pub of_triangle: Vec<Option<u32>>,
}

/// Which components are too small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Least {
    /// Those of fewer triangles.
    Triangles(usize),
    /// Those with less than this part, from 0 to 1, of the area of the largest.
    Area(f64),
    /// Those that enclose less than this part, from 0 to 1, of what the largest encloses.
    Volume(f64),
}

impl Mesh {
    /// The pieces that are connected through shared vertices.
    pub fn components(&self) -> Components {
        let count = self.vertices.len();
        let is_good = |t: &[u32; 3]| t.iter().all(|&v| (v as usize) < count);
        let mut parent: Vec<u32> = (0..count as u32).collect();
        for &[a, b, c] in self.triangles.iter().filter(|t| is_good(t)) {
            join(&mut parent, a, b);
            join(&mut parent, b, c);
        }
        let mut number: Vec<Option<u32>> = vec![None; count];
        let mut found = Components::default();
        for triangle in &self.triangles {
            if !is_good(triangle) {
                found.of_triangle.push(None);
                continue;
            }
            // The lowest vertex of the component, which is the origin of its volume, too.
            let lowest = root(&mut parent, triangle[0]) as usize;
            let component = *number[lowest].get_or_insert_with(|| {
                found.components.push(Component::default());
                found.components.len() as u32 - 1
            });
            found.of_triangle.push(Some(component));
            let origin = self.vertices[lowest].at().as_dvec3();
            let [a, b, c] = triangle.map(|v| self.vertices[v as usize].at().as_dvec3() - origin);
            let normal: DVec3 = (b - a).cross(c - a);
            let of = &mut found.components[component as usize];
            of.triangles += 1;
            if normal.is_finite() {
                of.area += normal.length() / 2.0;
                of.volume += a.dot(b.cross(c)) / 6.0;
            }
        }
        found
    }

    /// Removes the components that are too small, and the vertices that no triangle is left of. The largest (of equal ones
    /// the first) always stays. Triangles that name a vertex that does not exist are in no component, and go.
    ///
    /// The inner surface of a hollow is a component, too: without it the hollow is filled.
    pub fn remove_below(&mut self, least: Least) -> Removed {
        let before = (self.triangles.len(), self.vertices.len());
        let found = self.components();
        let size = |c: &Component| match least {
            Least::Triangles(_) => c.triangles as f64,
            Least::Area(_) => c.area,
            Least::Volume(_) => c.volume.abs(),
        };
        let largest = found.components.iter().map(size).fold(0.0, f64::max);
        let bound = match least {
            Least::Triangles(n) => n as f64,
            Least::Area(part) | Least::Volume(part) => part * largest,
        };
        let first = found.components.iter().position(|c| size(c) == largest);
        let stays = |c: u32| Some(c as usize) == first || size(&found.components[c as usize]) >= bound;
        let mut of_triangle = found.of_triangle.iter();
        self.triangles.retain(|_| of_triangle.next().copied().flatten().is_some_and(stays));
        self.drop_unused();
        Removed {
            triangles: before.0 - self.triangles.len(),
            vertices: before.1 - self.vertices.len(),
            flipped: 0,
        }
    }
}
