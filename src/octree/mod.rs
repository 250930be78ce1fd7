//! Adaptive extraction: an octree that is fine only where the surface needs it, contoured by dual contouring.
//!
//! ```text
//! field ─► tree (intervals, tangent planes) ─► dual polygons ─► vertices (quadric error) ─► triangles
//!            ▲                                                                                 │
//!            └────────── leaves whose triangles are farther from the surface than ε ◄──────────┘
//! ```
//!
//! The method is *manifold dual contouring* (Schaefer, Ju & Warren 2007) on an octree that is split from the top: one vertex a
//! sheet and leaf, one polygon a crossed edge ([`dual`](self)). It stands for the dual marching cubes of Schaefer &
//! Warren 2004: their dual cells need leaves along creases on either side of the surface, these only where it is.
//!
//! [`polygonize`] is Bloomenthal's older method on the same tree: a polygon or more a leaf, vertices on the leaves'
//! edges.
//!
//! The mesh is manifold, without cracks, and closed where the surface does not leave the grid, for every tree. That it is near the
//! surface is measured: points of each triangle are projected on the surface, and leaves with triangles beyond ε
//! are split. It can still miss what no sample of the field shows and lies inside a leaf that has other surface.

mod before;
mod bloomenthal;
mod criterion;
mod dual;
mod fields;
mod measure;
mod quadric;
mod tree;
mod triangles;
mod vertices;

use crate::field::{NoForm, Surface};
use crate::grid::Grid;
use crate::mesh::{Mesh, Vertex};
use before::Before;
pub use bloomenthal::polygonize;
use criterion::Criterion;
use dual::{Dual, NONE, Polygon};
use glam::Vec3;
use rayon::prelude::*;
use tree::{Grown, Tree};
use vertices::{Cells, Crossing};

/// What one thread takes at a time, of polygons, vertices or triangles: fixed, so that nothing depends on the threads.
const TASK: usize = 256;

/// Where vertices are placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Placement {
    /// At the point of the leaf nearest to the tangent planes around it: creases and corners are kept.
    #[default]
    Quadric,
    /// In the middle of the crossed edges around it (surface nets): creases are rounded.
    Mean,
}

/// How to extract.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// ε: the largest distance of the mesh to the surface that is allowed, in world units; finite and over 0.
    pub error: f32,
    /// Where vertices are placed. Of [`extract`] alone: [`polygonize`] has them on edges.
    pub placement: Placement,
    /// The most nodes of the tree, over 0. Only nodes that reach over the grid's border are split beyond it. The tree is
    /// grown size by size, so that what is left unsplit is small.
    pub budget: u64,
    /// Cells along the edge of the largest leaf that may hold surface; smaller features of a leaf's inside may be missed.
    /// 0 for an eighth of the tree.
    pub coarsest: u32,
}

impl Settings {
    /// A tenth of the grid's shortest step as ε, 16 million nodes.
    pub fn new(grid: &Grid) -> Self {
        let error = (grid.shortest_step() / 10.0) as f32;
        Self {
            error: error.max(f32::MIN_POSITIVE),
            placement: Placement::Quadric,
            budget: 1 << 24,
            coarsest: 0,
        }
    }

    fn check(&self, surface: &Surface<'_>) -> Result<(), OctreeError> {
        if !surface.iso().is_finite() {
            return Err(OctreeError::Iso(surface.iso()));
        }
        if !(self.error.is_finite() && self.error > 0.0) {
            return Err(OctreeError::Error(self.error));
        }
        if self.budget == 0 {
            return Err(OctreeError::Budget);
        }
        Ok(())
    }

    fn coarsest(&self, tree: &Tree) -> u32 {
        if self.coarsest == 0 { criterion::coarsest(tree) } else { self.coarsest }
    }
}

/// Why nothing was extracted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OctreeError {
    /// ε is not a length.
    #[error("the error bound is {0}: give a finite length over 0, in world units")]
    Error(f32),
    /// The iso value is NaN or infinite.
    #[error("the iso value is {0}: give a finite number")]
    Iso(f32),
    /// No nodes allowed.
    #[error("the budget is 0 nodes: allow at least 1")]
    Budget,
    /// More vertices or triangles than indices can name.
    #[error(
        "the mesh has {0} vertices, more than 32-bit indices name: allow a larger error or a coarser grid"
    )]
    TooLarge(u64),
    /// The field cannot be evaluated.
    #[error(transparent)]
    Field(#[from] NoForm),
}

/// What was done, and how near the mesh is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OctreeReport {
    /// Nodes of the tree.
    pub nodes: u64,
    /// Leaves that hold a vertex.
    pub leaves: u64,
    /// How often the mesh was made, measured and refined.
    pub rounds: u32,
    /// The largest distance to the surface that was found on a triangle, in world units.
    pub largest_error: f32,
    /// Triangles over ε that are left, because their leaves are of the smallest size or the budget ran out.
    pub over: u64,
    /// Leaves of the smallest size at those triangles.
    pub stopped: u64,
    /// Nodes that were left unsplit when the budget ran out.
    pub unsplit: u64,
    /// The size of the largest of them, in cells: below twice it, the tree is complete. 0 if there are none.
    pub unsplit_size: u32,
    /// Smallest leaves that may hold surface thinner than a cell: their bounds do not exclude it, and no corner
    /// differs in sign.
    pub thin: u64,
    /// Vertices that went to the mean of their crossings, because a triangle was flipped.
    pub flattened: u64,
    /// Triangles that face away from the field's gradient.
    pub flipped: u64,
}

/// The mesh of `surface` within `grid`, its triangles within `settings.error` of the surface wherever cells of the grid's
/// size allow. `progress` is told the part that is done, roughly.
///
/// # Errors
/// [`OctreeError`].
pub fn extract(
    surface: &Surface<'_>,
    grid: &Grid,
    settings: &Settings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, OctreeReport), OctreeError> {
    settings.check(surface)?;
    let mut tree = Tree::new(surface, grid)?;
    let criterion = Criterion { surface, grid, error: settings.error, coarsest: settings.coarsest(&tree) };
    let verdict = |fields: &fields::Fields, nodes: &[tree::Sampled<'_>]| criterion.verdicts(fields, nodes);
    let mut report = OctreeReport::default();
    let mut grown = tree.grow(surface, grid, settings.budget, vec![0], &verdict)?;
    progress(0.4);
    let mut before = None;
    loop {
        report.rounds += 1;
        let contour = Contour::new(&tree, surface, grid, settings, before.as_ref())?;
        progress(1.0 - 0.6 / f64::from(report.rounds + 1));
        let measured = measure::measure(&tree, surface, &contour, settings.error, before.as_ref())?;
        let budget_left = grown.unsplit == 0;
        if measured.split.is_empty() || !budget_left {
            report.nodes = tree.nodes.len() as u64;
            report.thin = tree.thin;
            Grown { unsplit: report.unsplit, unsplit_size: report.unsplit_size } = grown;
            report.largest_error = measured.largest;
            report.over = measured.over;
            report.stopped = measured.stopped;
            report.flattened = contour.plain.iter().filter(|p| **p).count() as u64;
            report.flipped = contour.flipped;
            return Ok((contour.mesh(&tree, surface, &mut report)?, report));
        }
        before = Some(Before::new(contour, measured.distances, tree.nodes.len()));
        grown = tree.grow(surface, grid, settings.budget, measured.split, &verdict)?;
    }
}

/// A tree's mesh in the making.
struct Contour {
    dual: Dual,
    crossings: Vec<Crossing>,
    /// Of the dual's vertices, and of those put between.
    positions: Vec<Vec3>,
    /// Vertices at the mean of their crossings.
    plain: Vec<bool>,
    triangles: Vec<triangles::Triangle>,
    flipped: u64,
    /// Of each polygon its number the round before, or [`dual::NONE`].
    kept: Vec<u32>,
}

impl Contour {
    fn new(
        tree: &Tree,
        surface: &Surface<'_>,
        grid: &Grid,
        settings: &Settings,
        before: Option<&Before>,
    ) -> Result<Self, OctreeError> {
        let dual = Dual::new(tree, grid.is_mirrored());
        let vertices = (dual.vertices.len() + 2 * dual.polygons.len()) as u64;
        if vertices >= u64::from(u32::MAX) / 8 {
            return Err(OctreeError::TooLarge(vertices));
        }
        let kept =
            before.map_or_else(|| vec![NONE; dual.polygons.len()], |before| before.polygons(&dual.polygons));
        let new: Vec<Polygon> =
            dual.polygons.iter().zip(&kept).filter(|(_, k)| **k == NONE).map(|(p, _)| *p).collect();
        let mut new = vertices::crossings(tree, surface, grid, &new)?.into_iter();
        let crossings: Vec<Crossing> =
            kept.iter().filter_map(|&k| if k == NONE { new.next() } else { before?.crossing(k) }).collect();
        let cells = Cells::new(tree, grid);
        let mut plain = vec![false; dual.vertices.len()];
        let enough = f64::from(settings.error) / 4.0;
        let place = |plain: &[bool], known: &(dyn Fn(u32) -> Option<Vec3> + Sync)| {
            cells.place(&dual, &crossings, settings.placement, enough, plain, known)
        };
        let mut placed = place(&plain, &|v| before?.position(&dual, &kept, v));
        // Twice, vertices of flipped triangles give way.
        for last in [false, false, true] {
            let (positions, triangles) = triangles::triangles(tree, &dual, &crossings, placed);
            let flipped: Vec<&triangles::Triangle> =
                triangles.par_iter().filter(|t| triangles::is_flipped(t, &positions, &crossings)).collect();
            if last || flipped.is_empty() || settings.placement == Placement::Mean {
                let flipped = flipped.len() as u64;
                return Ok(Self { dual, crossings, positions, plain, triangles, flipped, kept });
            }
            let was_plain = plain.clone();
            for v in flipped.into_iter().flat_map(|t| t.vertices) {
                if let Some(plain) = plain.get_mut(v as usize) {
                    *plain = true;
                }
            }
            let stays = |v: u32| plain[v as usize] == was_plain[v as usize];
            placed = place(&plain, &|v| stays(v).then(|| positions[v as usize]));
        }
        unreachable!("the last round returns")
    }

    /// With normals: the gradient at a vertex, or where there is none the mean of those around.
    fn mesh(self, tree: &Tree, surface: &Surface<'_>, report: &mut OctreeReport) -> Result<Mesh, NoForm> {
        let mut polygon_of = vec![u32::MAX; self.positions.len()];
        for triangle in self.triangles.iter().rev() {
            triangle.vertices.iter().for_each(|&v| polygon_of[v as usize] = triangle.polygon);
        }
        let parts: Vec<Vec<Vertex>> = self
            .positions
            .par_chunks(TASK)
            .enumerate()
            .map(|(chunk, points)| {
                let polygons = &polygon_of[chunk * TASK..][..points.len()];
                let field = |(&p, &polygon): (&Vec3, &u32)| {
                    let owner = self.dual.polygons.get(polygon as usize).map(|p| p.owner);
                    let field = owner.map_or(fields::WHOLE, |o| tree.nodes[o as usize].field);
                    tree.fields.at(field, p)
                };
                let fields: Vec<u32> = points.iter().zip(polygons).map(field).collect();
                let mut gradients = vec![Vec3::ZERO; points.len()];
                tree.fields.gradients(surface, &fields, points, &mut gradients)?;
                let vertex = |i: usize| {
                    let mut normal = vertices::unit(gradients[i]);
                    if normal == Vec3::ZERO {
                        let v = chunk * TASK + i;
                        let fan =
                            if v < self.plain.len() { self.dual.fan(v as u32) } else { &polygons[i..=i] };
                        let around = fan.iter().filter_map(|&p| self.crossings.get(p as usize));
                        normal = unit_or_up(around.map(|c| c.normal).sum());
                    }
                    Vertex { position: points[i].to_array(), normal: normal.to_array() }
                };
                Ok((0..points.len()).map(vertex).collect())
            })
            .collect::<Result<_, NoForm>>()?;
        let mut leaves: Vec<u32> = self.dual.vertices.iter().map(|v| v.0.leaf).collect();
        leaves.dedup();
        report.leaves = leaves.len() as u64;
        let triangles = self.triangles.iter().map(|t| t.vertices).collect();
        Ok(Mesh { vertices: parts.concat(), triangles })
    }
}

/// A unit vector, or up where there is no direction.
fn unit_or_up(sum: Vec3) -> Vec3 {
    let normal = vertices::unit(sum);
    if normal == Vec3::ZERO { Vec3::Z } else { normal }
}
