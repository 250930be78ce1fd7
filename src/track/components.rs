//! Leaving out of a mesh the components that no seed lies on.

use crate::mesh::Mesh;
use crate::mesh::check::{join, root};

/// Keeps the components of `mesh` that hold one of `vertices`, in their order; tells how many are kept, and how
/// many are not. Every vertex is a triangle's.
pub(super) fn keep_reached(mesh: &mut Mesh, vertices: &[u32]) -> [u64; 2] {
    const OUT: u32 = u32::MAX;
    let count = mesh.vertices.len() as u32;
    let mut parent: Vec<u32> = (0..count).collect();
    for &[a, b, c] in &mesh.triangles {
        join(&mut parent, a, b);
        join(&mut parent, b, c);
    }
    // Roots are the lowest of their components: each comes before the others.
    let mut is_kept = vec![false; count as usize];
    for &vertex in vertices {
        let root = root(&mut parent, vertex);
        is_kept[root as usize] = true;
    }
    let mut components = [0; 2];
    for v in 0..count {
        let root = root(&mut parent, v);
        components[usize::from(!is_kept[root as usize])] += u64::from(root == v);
        is_kept[v as usize] = is_kept[root as usize];
    }
    if components[1] == 0 {
        return components;
    }
    // From here on the new numbers.
    let mut next = 0;
    for (number, &is_kept) in parent.iter_mut().zip(&is_kept) {
        *number = if is_kept { next } else { OUT };
        next += u32::from(is_kept);
    }
    let mut flags = is_kept.iter();
    mesh.vertices.retain(|_| flags.next().is_some_and(|&kept| kept));
    mesh.triangles.retain_mut(|triangle| {
        *triangle = triangle.map(|v| parent[v as usize]);
        triangle[0] != OUT
    });
    components
}
