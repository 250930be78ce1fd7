//! Polygons in the leaves of an octree (Bloomenthal 1988, *Polygonization of implicit surfaces*).
//!
//! A leaf is split while it is larger than a grid cell and its polygon does not do: by its corners alone
//! ([`split`]), and once the mesh is made, by the distance of its triangles to the surface.
//!
//! The mesh's vertices are the crossings of the minimal edges, which are no longer than the smallest leaf around
//! them. On the face that two leaves share, which is a whole face of the smaller one, crossings are joined in pairs,
//! such that runs of inside points are parted (on a face of one size: the rule of the marching cubes table). A leaf's
//! polygons are the loops of the segments on all its faces. Both leaves at a face have the same segments, so that the
//! mesh has no cracks whatever the sizes are, and needs no balanced tree. A leaf has loops where its smaller
//! neighbours have crossings, even if its own corners do not differ.
//!
//! Crossings, segments and loops are the polygons, joined sides and vertices of [`super::dual`]: the two meshes are
//! each other's dual. Only a loop of two crossings makes no polygon: it is one edge, of the leaves on either side.

mod polygons;
mod split;

use super::criterion::Criterion;
use super::dual::{Dual, INNER};
use super::fields::Fields;
use super::measure::{Placed, SMALL, farthest};
use super::tree::{Grown, Sampled, Tree};
use super::vertices::crossings;
use super::{OctreeError, OctreeReport, Settings};
use crate::field::{NoForm, Surface};
use crate::grid::Grid;
use crate::mesh::Mesh;
use polygons::Polygons;

/// The mesh of `surface` within `grid` by Bloomenthal's octree: a polygon or more for each leaf that the surface
/// crosses, its vertices on the leaves' edges, its triangles within `settings.error` of the surface wherever cells of
/// the grid's size allow. `settings.placement` does not matter. Creases are cut off as marching cubes of the grid
/// does. `progress` is told the part that is done, roughly.
///
/// # Errors
/// [`OctreeError`].
pub fn polygonize(
    surface: &Surface<'_>,
    grid: &Grid,
    settings: &Settings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, OctreeReport), OctreeError> {
    settings.check(surface)?;
    let mut tree = Tree::new(surface, grid)?;
    let criterion = Criterion { surface, grid, error: settings.error, coarsest: settings.coarsest(&tree) };
    let verdict = |fields: &Fields, nodes: &[Sampled<'_>]| split::verdicts(&criterion, fields, nodes);
    let mut rounds = 0;
    let mut grown = tree.grow(surface, grid, settings.budget, vec![0], &verdict)?;
    progress(0.4);
    loop {
        rounds += 1;
        let dual = Dual::new(&tree, grid.is_mirrored());
        let vertices = (dual.vertices.len() + 2 * dual.polygons.len()) as u64;
        if vertices >= u64::from(u32::MAX) / 8 {
            return Err(OctreeError::TooLarge(vertices));
        }
        let crossings = crossings(&tree, surface, grid, &dual.polygons)?;
        let polygons = Polygons::new(&tree, surface, grid, &dual, &crossings, settings.error)?;
        progress(1.0 - 0.6 / f64::from(rounds + 1));
        let (mut report, wrong) = measure(&tree, surface, &polygons, settings.error)?;
        if wrong.is_empty() || grown.unsplit > 0 {
            report.nodes = tree.nodes.len() as u64;
            report.rounds = rounds;
            report.thin = tree.thin;
            Grown { unsplit: report.unsplit, unsplit_size: report.unsplit_size } = grown;
            let mut leaves: Vec<u32> =
                dual.vertices.iter().filter(|v| v.0.place == INNER).map(|v| v.0.leaf).collect();
            leaves.dedup();
            report.leaves = leaves.len() as u64;
            report.flattened = polygons.flattened;
            return Ok((polygons.mesh(), report));
        }
        grown = tree.grow(surface, grid, settings.budget, wrong, &verdict)?;
    }
}

/// How near the triangles are, and the leaves to split, in order: those with triangles that are too far away or
/// flipped.
fn measure(
    tree: &Tree,
    surface: &Surface<'_>,
    polygons: &Polygons,
    error: f32,
) -> Result<(OctreeReport, Vec<u32>), NoForm> {
    let found = farthest(tree, surface, error, &polygons.triangles, |t| {
        let leaf = &tree.nodes[t.leaf as usize];
        let corners = t.vertices.map(|v| polygons.vertices[v as usize].at());
        Placed { corners, field: leaf.field, known: corners[0], is_large: leaf.size > SMALL }
    })?;
    let mut report = OctreeReport::default();
    let (mut wrong, mut stopped) = (Vec::new(), Vec::new());
    for (triangle, distance) in polygons.triangles.iter().zip(found) {
        let is_over = distance > error;
        report.largest_error = report.largest_error.max(distance);
        report.over += u64::from(is_over);
        report.flipped += u64::from(triangle.flipped);
        if tree.nodes[triangle.leaf as usize].size > 1 {
            wrong.extend((is_over || triangle.flipped).then_some(triangle.leaf));
        } else {
            stopped.extend(is_over.then_some(triangle.leaf));
        }
    }
    for leaves in [&mut wrong, &mut stopped] {
        leaves.sort_unstable();
        leaves.dedup();
    }
    report.stopped = stopped.len() as u64;
    Ok((report, wrong))
}
