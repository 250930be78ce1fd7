//! What one round's mesh leaves to the next: a round splits few leaves, and what has none of them around stays as it was,
//! bit for bit. So a round costs what it changes.

use super::Contour;
use super::dual::{Dual, NONE, Polygon};
use super::triangles::Triangle;
use super::vertices::Crossing;
use glam::Vec3;

/// The mesh of the round before.
pub struct Before {
    contour: Contour,
    /// Of each triangle, as `measure` found it.
    distances: Vec<f32>,
    /// Of each polygon its first triangle.
    triangles: Vec<u32>,
    /// Nodes of the tree then: leaves with higher numbers are new.
    nodes: u32,
}

impl Before {
    /// Of a mesh of the first `nodes` nodes, and its triangles' distances to the surface.
    pub fn new(contour: Contour, distances: Vec<f32>, nodes: usize) -> Self {
        let mut triangles = vec![NONE; contour.dual.polygons.len()];
        for (i, triangle) in contour.triangles.iter().enumerate().rev() {
            triangles[triangle.polygon as usize] = i as u32;
        }
        Self { contour, distances, triangles, nodes: nodes as u32 }
    }

    /// Of each polygon its number then, or [`NONE`]. Polygons come in the order of the tree's walk, which a
    /// split does not change for those that stay.
    pub fn polygons(&self, polygons: &[Polygon]) -> Vec<u32> {
        let mut then = self.contour.dual.polygons.iter().enumerate();
        let mut find = |polygon: &Polygon| {
            if polygon.corners.iter().any(|c| c.leaf >= self.nodes) {
                return NONE;
            }
            let is_same =
                |p: &Polygon| (p.corners, p.axis, p.low) == (polygon.corners, polygon.axis, polygon.low);
            then.find(|(_, p)| is_same(p)).map_or(NONE, |(i, _)| i as u32)
        };
        polygons.iter().map(&mut find).collect()
    }

    /// Where polygon `then`, a number of that time, had its crossing.
    pub fn crossing(&self, then: u32) -> Option<Crossing> {
        self.contour.crossings.get(then as usize).copied()
    }

    /// Where `vertex` was, if the same polygons were around it and it was placed by their planes.
    pub fn position(&self, dual: &Dual, kept: &[u32], vertex: u32) -> Option<Vec3> {
        let fan = dual.fan(vertex);
        let polygon = *fan.first()? as usize;
        let corner = dual.vertex[4 * polygon..][..4].iter().position(|&v| v == vertex)?;
        let then = self.contour.dual.vertex.chunks(4).nth(kept[polygon] as usize)?;
        let old = then[corner];
        let is_same = self.contour.dual.fan(old).iter().eq(fan.iter().map(|&p| &kept[p as usize]));
        (is_same && !self.contour.plain[old as usize]).then(|| self.contour.positions[old as usize])
    }

    /// The distance of the `nth` triangle of a polygon that was `then`, if its corners were where they are.
    pub fn distance(&self, then: u32, nth: usize, corners: [Vec3; 3]) -> Option<f32> {
        let i = *self.triangles.get(then as usize)? as usize + nth;
        let old: &Triangle = self.contour.triangles.get(i)?;
        let is_same =
            old.polygon == then && old.vertices.map(|v| self.contour.positions[v as usize]) == corners;
        is_same.then(|| self.distances[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Sense, Surface};
    use crate::graph::shapes::{box_, cylinder};
    use crate::graph::{GraphField, shapes::sphere};
    use crate::grid::Grid;
    use crate::octree::criterion::{Criterion, coarsest};
    use crate::octree::{Settings, fields, measure, tree};

    /// Goes red when a vertex is kept whose fan is another, when leaves are told apart by nothing but their
    /// number, and when a triangle's corners are not compared.
    #[test]
    fn what_is_kept_is_what_would_be_found() {
        let drilled = box_([-0.7, -0.4, -0.3], [0.7, 0.43, 0.2]).difference(cylinder(0.15, 3.0));
        let solid = drilled.union(sphere(0.3).translate([0.2, 0.3, 0.1]));
        let field = GraphField::new(&solid, Sense::Below);
        let surface = Surface::new(&field, 0.0, Sense::Below, 1e-3).unwrap();
        let grid = Grid::from_bounds([64; 3], Vec3::NEG_ONE, Vec3::ONE).unwrap();
        let settings = Settings { error: 2e-3, ..Settings::new(&grid) };
        let mut tree = tree::Tree::new(&surface, &grid).unwrap();
        let criterion = Criterion { surface: &surface, grid: &grid, error: 0.02, coarsest: coarsest(&tree) };
        let verdict =
            |fields: &fields::Fields, nodes: &[tree::Sampled<'_>]| criterion.verdicts(fields, nodes);
        tree.grow(&surface, &grid, settings.budget, vec![0], &verdict).unwrap();
        let (mut before, mut rounds, mut kept) = (None, 0, 0);
        loop {
            let contour = |before| Contour::new(&tree, &surface, &grid, &settings, before).unwrap();
            let measure = |c, before| measure::measure(&tree, &surface, c, settings.error, before).unwrap();
            let (here, fresh) = (contour(before.as_ref()), contour(None));
            let (measured, anew) = (measure(&here, before.as_ref()), measure(&fresh, None));
            assert!(here.positions == fresh.positions && here.plain == fresh.plain, "round {rounds}");
            assert!(measured.distances == anew.distances && measured.split == anew.split, "round {rounds}");
            kept += here.kept.iter().filter(|k| **k != NONE).count();
            rounds += 1;
            if measured.split.is_empty() {
                break;
            }
            before = Some(Before::new(here, measured.distances, tree.nodes.len()));
            tree.grow(&surface, &grid, settings.budget, measured.split, &verdict).unwrap();
        }
        assert!(rounds > 2 && kept > 500, "{rounds} rounds, {kept} kept");
    }
}
