//! Where the dual surface's vertices are: crossings of the polygons' edges by root finding, vertices by the quadric error
//! of the tangent planes there.

use super::dual::{Corner, Dual, INNER, Polygon};
use super::quadric::{Plane, minimiser};
use super::tree::Tree;
use super::{Placement, TASK};
use crate::field::{NoForm, Surface};
use crate::grid::Grid;
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

/// Where a polygon's edge crosses the surface.
#[derive(Debug, Clone, Copy, Default)]
pub struct Crossing {
    /// In world units.
    pub at: Vec3,
    /// Unit normal out of the solid, or zero where there is none.
    pub normal: Vec3,
}

/// How far a vertex may lie beyond its leaf, as a part of the leaf: the tip of a wedge often lies in the next one, no corner
/// of which it reaches. Where that turns triangles round, the vertex goes back.
const BEYOND: f64 = 1.0;
/// Steps of root finding: regula falsi after Illinois takes 3 to 6 on smooth fields.
const STEPS: usize = 8;

/// A unit vector, or zero where there is no direction.
pub fn unit(gradient: Vec3) -> Vec3 {
    let g = gradient.as_dvec3();
    let length = g.length();
    if length > 0.0 && length.is_finite() { (g / length).as_vec3() } else { Vec3::ZERO }
}

/// The crossings of all polygons.
pub fn crossings(
    tree: &Tree,
    surface: &Surface<'_>,
    grid: &Grid,
    polygons: &[Polygon],
) -> Result<Vec<Crossing>, NoForm> {
    let parts: Vec<Vec<Crossing>> = polygons
        .par_chunks(TASK)
        .map(|polygons| {
            let mut edges: Vec<Edge> = polygons.iter().map(|p| Edge::new(tree, grid, p)).collect();
            let mut open: Vec<usize> = (0..edges.len()).collect();
            let (mut points, mut fields, mut values) = (Vec::new(), Vec::new(), Vec::new());
            for _ in 0..STEPS {
                open.retain(|&i| !edges[i].is_found());
                if open.is_empty() {
                    break;
                }
                points.clear();
                points.extend(open.iter().map(|&i| edges[i].next()));
                fields.clear();
                fields.extend(open.iter().map(|&i| edges[i].field));
                values.resize(points.len(), 0.0);
                tree.fields.values(surface, &fields, &points, &mut values)?;
                open.iter().zip(&values).for_each(|(&i, &v)| edges[i].narrow(v));
            }
            let points: Vec<Vec3> = edges.iter().map(Edge::found).collect();
            let fields: Vec<u32> = edges.iter().map(|e| e.field).collect();
            let mut gradients = vec![Vec3::ZERO; points.len()];
            tree.fields.gradients(surface, &fields, &points, &mut gradients)?;
            let crossing = |(at, g)| Crossing { at, normal: unit(g) };
            Ok(points.into_iter().zip(gradients).map(crossing).collect())
        })
        .collect::<Result<_, NoForm>>()?;
    Ok(parts.concat())
}

/// Root finding on an edge.
struct Edge {
    ends: [Vec3; 2],
    /// Between which parts of the edge the crossing is, the inside first.
    bracket: [f32; 2],
    /// Signed values there.
    values: [f32; 2],
    /// The last point that was tried.
    tried: f32,
    /// Which end the last point replaced.
    replaced: usize,
    /// |value| that is near enough.
    enough: f32,
    found: bool,
    field: u32,
}

impl Edge {
    fn new(tree: &Tree, grid: &Grid, polygon: &Polygon) -> Self {
        let mut high = polygon.low;
        high[polygon.axis as usize] += polygon.length;
        let ends = [polygon.low, high].map(|p| grid.position(p.as_vec3()));
        let values = polygon.values;
        let swapped = values[1] < 0.0;
        let ordered = |v: [f32; 2]| if swapped { [v[1], v[0]] } else { v };
        let mut edge = Self {
            ends,
            bracket: ordered([0.0, 1.0]),
            values: ordered(values),
            tried: 0.0,
            replaced: 2,
            enough: 1e-6 * (values[0] - values[1]).abs(),
            found: false,
            field: tree.nodes[polygon.owner as usize].field,
        };
        if !edge.enough.is_finite() {
            edge.enough = 0.0;
        }
        edge.tried = edge.guess();
        edge
    }

    fn is_found(&self) -> bool {
        self.found
    }

    fn guess(&self) -> f32 {
        let [(a, b), (fa, fb)] = [self.bracket, self.values].map(|[a, b]| (a, b));
        let t = a + (b - a) * (fa / (fa - fb));
        if t.is_finite() && fb.is_finite() { t } else { 0.5 * (a + b) }
    }

    fn next(&self) -> Vec3 {
        self.at(self.tried)
    }

    fn at(&self, t: f32) -> Vec3 {
        self.ends[0] + (self.ends[1] - self.ends[0]) * t
    }

    fn narrow(&mut self, value: f32) {
        if value.abs() <= self.enough {
            self.found = true;
            return;
        }
        let end = usize::from(value >= 0.0);
        self.bracket[end] = self.tried;
        self.values[end] = value;
        // Illinois: an end that stays twice counts half.
        if self.replaced == end {
            self.values[1 - end] *= 0.5;
        }
        self.replaced = end;
        self.tried = self.guess();
    }

    fn found(&self) -> Vec3 {
        self.at(self.tried)
    }
}

/// What placing vertices needs of the grid.
pub struct Cells<'a> {
    tree: &'a Tree,
    grid: &'a Grid,
    to_grid: DMat3,
    normals: DMat3,
}

impl<'a> Cells<'a> {
    /// Of a tree's leaves.
    pub fn new(tree: &'a Tree, grid: &'a Grid) -> Self {
        let to_grid = grid.step().as_dmat3().inverse();
        Self { tree, grid, to_grid, normals: to_grid.transpose() }
    }

    /// The nearest point, in grid coordinates axis by axis, of a corner's cell grown by the part `beyond` of its size.
    fn clamp(&self, corner: Corner, x: DVec3, beyond: f64) -> DVec3 {
        let leaf = &self.tree.nodes[corner.leaf as usize];
        let origin = self.grid.origin().as_dvec3();
        let (mut low, mut high) = (leaf.low.as_dvec3(), leaf.high().as_dvec3());
        for (k, weight) in [1, 3, 9].into_iter().enumerate() {
            match corner.place / weight % 3 {
                0 => high[k] = low[k],
                2 => low[k] = high[k],
                _ => {}
            }
        }
        // On the border nothing leaves it, nor the grid.
        if corner.place == INNER {
            let margin = beyond * f64::from(leaf.size);
            (low, high) =
                ((low - margin).max(DVec3::ZERO), (high + margin).min(self.grid.cells().as_dvec3()));
        }
        let q = (self.to_grid * (x - origin)).clamp(low, high);
        origin + self.grid.step().as_dmat3() * q
    }

    /// The normals of the border's faces on which a corner's cell lies flat.
    fn flat(&self, corner: Corner) -> impl Iterator<Item = DVec3> {
        let place = corner.place;
        let normals = self.normals;
        [1, 3, 9]
            .into_iter()
            .enumerate()
            .filter(move |(_, weight)| place / weight % 3 != 1)
            .map(move |(k, _)| normals.col(k).normalize())
    }

    /// Positions of the vertices; `known` tells those that need not be found again.
    pub fn place(
        &self,
        dual: &Dual,
        crossings: &[Crossing],
        placement: Placement,
        enough: f64,
        plain: &[bool],
        known: impl Fn(u32) -> Option<Vec3> + Sync,
    ) -> Vec<Vec3> {
        let one = |planes: &mut Vec<Plane>, vertex: usize| {
            let corner = dual.vertices[vertex].0;
            let fan = dual.fan(vertex as u32);
            let mean =
                fan.iter().map(|&p| crossings[p as usize].at.as_dvec3()).sum::<DVec3>() / fan.len() as f64;
            if placement == Placement::Mean || plain[vertex] {
                return self.clamp(corner, mean, 0.0).as_vec3();
            }
            planes.clear();
            for &p in fan {
                let Crossing { at, normal } = crossings[p as usize];
                let mut normal = normal.as_dvec3();
                if corner.place != INNER {
                    self.flat(corner).for_each(|across| normal -= across * across.dot(normal));
                    normal = normal.normalize_or_zero();
                }
                if normal != DVec3::ZERO {
                    planes.push(Plane { at: at.as_dvec3(), normal });
                }
            }
            minimiser(planes, mean, enough, |x| self.clamp(corner, x, BEYOND)).0.as_vec3()
        };
        let mut out = vec![Vec3::ZERO; dual.vertices.len()];
        out.par_chunks_mut(TASK).enumerate().for_each(|(chunk, out)| {
            let mut planes = Vec::new();
            for (i, out) in out.iter_mut().enumerate() {
                let vertex = chunk * TASK + i;
                *out = known(vertex as u32).unwrap_or_else(|| one(&mut planes, vertex));
            }
        });
        out
    }
}
