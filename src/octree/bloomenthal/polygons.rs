//! The polygons of an octree's leaves, cut into triangles.
//!
//! A polygon that is small and near the surface is cut by diagonals from one of its corners, others by a fan around a
//! new vertex on the surface. A diagonal never joins crossings that another leaf has, too: it could be cut there once
//! more, and the edge would have four triangles.

use super::super::TASK;
use super::super::dual::{Dual, INNER};
use super::super::tree::{Tree, world_box};
use super::super::vertices::{Crossing, unit};
use crate::field::{NoForm, Surface, project};
use crate::grid::Grid;
use crate::mesh::{Mesh, Vertex};
use glam::Vec3;
use rayon::prelude::*;

/// Part of ε that the middle of a polygon without a vertex there may be away from the surface.
const FLAT: f32 = 0.75;
/// The most corners of a polygon without a vertex in its middle: around large leaves they often lie on one line.
const FEW: usize = 6;
/// Part of ε within which a middle is on the surface.
const CLOSE: f32 = 0.01;

/// A triangle and the leaf it lies in.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Counter-clockwise seen from outside.
    pub vertices: [u32; 3],
    /// Its leaf.
    pub leaf: u32,
    /// Whether it faces against the mean of its vertices' normals.
    pub flipped: bool,
}

/// A mesh in the making.
#[derive(Debug)]
pub struct Polygons {
    /// The crossings, in their order, then the middles.
    pub vertices: Vec<Vertex>,
    /// In the order of the leaves' loops.
    pub triangles: Vec<Triangle>,
    /// Middles that are not on the surface, because it was not found in the leaf or triangles were flipped.
    pub flattened: u64,
}

/// What one task makes. Middles are numbered from the number of crossings on.
#[derive(Default)]
struct Part {
    middles: Vec<Vertex>,
    triangles: Vec<Triangle>,
    flattened: u64,
}

impl Polygons {
    /// Of all loops of a tree's leaves.
    pub fn new(
        tree: &Tree,
        surface: &Surface<'_>,
        grid: &Grid,
        dual: &Dual,
        crossings: &[Crossing],
        error: f32,
    ) -> Result<Self, NoForm> {
        let cutter = Cutter { tree, surface, grid, dual, crossings, error };
        let loops: Vec<u32> =
            (0..dual.vertices.len() as u32).filter(|&v| dual.vertices[v as usize].0.place == INNER).collect();
        let parts: Vec<Part> =
            loops.par_chunks(TASK).map(|loops| cutter.cut(loops)).collect::<Result<_, NoForm>>()?;
        let vertex = |c: &Crossing| Vertex { position: c.at.to_array(), normal: c.normal.to_array() };
        let mut all = Self {
            vertices: crossings.iter().map(vertex).collect(),
            triangles: Vec::with_capacity(parts.iter().map(|p| p.triangles.len()).sum()),
            flattened: 0,
        };
        for part in parts {
            let shift = (all.vertices.len() - crossings.len()) as u32;
            all.triangles.extend(part.triangles.into_iter().map(|mut t| {
                for v in &mut t.vertices {
                    *v += if *v as usize >= crossings.len() { shift } else { 0 };
                }
                t
            }));
            all.vertices.extend(part.middles);
            all.flattened += part.flattened;
        }
        all.give_normals();
        Ok(all)
    }

    /// To the vertices that the field gave none: the mean of the triangles' around them.
    fn give_normals(&mut self) {
        let without: Vec<bool> = self.vertices.iter().map(|v| v.normal == [0.0; 3]).collect();
        if !without.contains(&true) {
            return;
        }
        let mut sums = vec![Vec3::ZERO; self.vertices.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.vertices.map(|v| self.vertices[v as usize].at());
            triangle.vertices.iter().for_each(|&v| sums[v as usize] += (b - a).cross(c - a));
        }
        for ((vertex, sum), _) in self.vertices.iter_mut().zip(sums).zip(without).filter(|(_, w)| *w) {
            vertex.normal = super::super::unit_or_up(sum).to_array();
        }
    }

    /// The mesh itself.
    pub fn mesh(self) -> Mesh {
        let triangles = self.triangles.iter().map(|t| t.vertices).collect();
        Mesh { vertices: self.vertices, triangles }
    }
}

struct Cutter<'a> {
    tree: &'a Tree,
    surface: &'a Surface<'a>,
    grid: &'a Grid,
    dual: &'a Dual,
    crossings: &'a [Crossing],
    error: f32,
}

/// A polygon to be cut.
struct Polygon {
    leaf: u32,
    /// Crossings, counter-clockwise seen from outside.
    corners: Vec<u32>,
    /// The mean of the corners.
    middle: Vec3,
    /// The diagonals from one corner that do, if some do.
    fan: Option<usize>,
    needs_middle: bool,
}

impl Cutter<'_> {
    fn cut(&self, loops: &[u32]) -> Result<Part, NoForm> {
        let mut polygons: Vec<Polygon> = loops.iter().filter_map(|&v| self.polygon(v)).collect();
        let open: Vec<usize> = (0..polygons.len()).filter(|&i| polygons[i].corners.len() > 3).collect();
        let middles: Vec<Vec3> = open.iter().map(|&i| polygons[i].middle).collect();
        let fields: Vec<u32> =
            open.iter().map(|&i| self.tree.nodes[polygons[i].leaf as usize].field).collect();
        let (mut values, mut gradients) = (vec![0.0; open.len()], vec![Vec3::ZERO; open.len()]);
        self.tree.fields.values(self.surface, &fields, &middles, &mut values)?;
        self.tree.fields.gradients(self.surface, &fields, &middles, &mut gradients)?;
        for ((&i, value), gradient) in open.iter().zip(values).zip(gradients) {
            let away = (value / gradient.length()).abs();
            polygons[i].fan = self.fan(&polygons[i], unit(gradient));
            let is_flat = away <= FLAT * self.error && polygons[i].fan.is_some();
            polygons[i].needs_middle = !is_flat;
        }
        self.triangles(&polygons)
    }

    /// The loop as a polygon, if it is one.
    fn polygon(&self, vertex: u32) -> Option<Polygon> {
        // A fan goes clockwise around a vertex.
        let corners: Vec<u32> = self.dual.fan(vertex).iter().rev().copied().collect();
        if corners.len() < 3 {
            return None;
        }
        let middle = corners.iter().map(|&c| self.crossings[c as usize].at.as_dvec3()).sum::<glam::DVec3>();
        Some(Polygon {
            leaf: self.dual.vertices[vertex as usize].0.leaf,
            middle: (middle / corners.len() as f64).as_vec3(),
            corners,
            fan: Some(0),
            needs_middle: false,
        })
    }

    /// The corner from which diagonals cut a small polygon such that no triangle is flipped, the lowest above the
    /// plane across `normal`.
    fn fan(&self, polygon: &Polygon, normal: Vec3) -> Option<usize> {
        let corners = &polygon.corners;
        let n = corners.len();
        let at = |i: usize| self.crossings[corners[i % n] as usize].at;
        let height = |first: usize| {
            let do_diagonals = (2..n - 1).all(|i| self.is_free(corners[first], corners[(first + i) % n]));
            let flipped = (1..n - 1).any(|i| {
                let three = [first, first + i, first + i + 1];
                is_flipped(three.map(at), three.map(|i| self.crossings[corners[i % n] as usize].normal))
            });
            (do_diagonals && !flipped).then(|| {
                let middles = (2..n - 1).map(|i| (at(first) + at(first + i)) * 0.5);
                middles.map(|m| (m - polygon.middle).dot(normal).abs()).fold(0.0, f32::max)
            })
        };
        let last = if n <= FEW { n } else { 0 };
        let heights = (0..last).filter_map(|first| Some((first, height(first)?)));
        heights.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(first, _)| first)
    }

    /// Whether two crossings have only one leaf in common.
    fn is_free(&self, a: u32, b: u32) -> bool {
        let corners = |c: u32| {
            let polygon = &self.dual.polygons[c as usize];
            &polygon.corners[..polygon.count as usize]
        };
        corners(a).iter().filter(|c| corners(b).contains(c)).count() == 1
    }

    fn triangles(&self, polygons: &[Polygon]) -> Result<Part, NoForm> {
        let around: Vec<usize> = (0..polygons.len()).filter(|&i| polygons[i].needs_middle).collect();
        let mut points: Vec<Vec3> = around.iter().map(|&i| polygons[i].middle).collect();
        let boxes = around.iter().map(|&i| {
            let leaf = &self.tree.nodes[polygons[i].leaf as usize];
            world_box(self.grid, leaf.low, leaf.high())
        });
        let boxes: Vec<(Vec3, Vec3)> = boxes.collect();
        let radii: Vec<f32> = boxes.iter().map(|(low, high)| 0.5 * low.distance(*high)).collect();
        let mut found = project(self.surface, &mut points, &radii, CLOSE * self.error)?.converged;
        for (k, (low, high)) in boxes.into_iter().enumerate() {
            if !(points[k].cmpge(low).all() && points[k].cmple(high).all()) {
                points[k] = polygons[around[k]].middle;
                found[k] = false;
            }
        }
        let fields: Vec<u32> =
            around.iter().map(|&i| self.tree.nodes[polygons[i].leaf as usize].field).collect();
        let mut gradients = vec![Vec3::ZERO; points.len()];
        self.tree.fields.gradients(self.surface, &fields, &points, &mut gradients)?;
        let flattened = found.iter().filter(|f| !**f).count() as u64;
        let mut part = Part { flattened, ..Part::default() };
        let mut middles = points.into_iter().zip(gradients.into_iter().map(unit));
        for polygon in polygons {
            let middle = if polygon.needs_middle { middles.next() } else { None };
            self.triangles_of(polygon, middle, &mut part);
        }
        Ok(part)
    }

    /// Of one polygon, with what was found for its middle.
    fn triangles_of(&self, polygon: &Polygon, middle: Option<(Vec3, Vec3)>, part: &mut Part) {
        let corners = &polygon.corners;
        let n = corners.len();
        let crossing = |i: usize| self.crossings[corners[i % n] as usize];
        let Some((mut at, normal)) = middle else {
            let first = polygon.fan.unwrap_or(0);
            part.triangles.extend((1..n - 1).map(|i| {
                let three = [first, first + i, first + i + 1];
                Triangle {
                    vertices: three.map(|i| corners[i % n]),
                    leaf: polygon.leaf,
                    flipped: is_flipped(three.map(|i| crossing(i).at), three.map(|i| crossing(i).normal)),
                }
            }));
            return;
        };
        let turned = |at: Vec3, i: usize| {
            let (a, b) = (crossing(i), crossing(i + 1));
            is_flipped([at, a.at, b.at], [normal, a.normal, b.normal])
        };
        let count = |at: Vec3| (0..n).filter(|&i| turned(at, i)).count();
        if count(at) > count(polygon.middle) {
            at = polygon.middle;
            part.flattened += 1;
        }
        let vertex = (self.crossings.len() + part.middles.len()) as u32;
        part.middles.push(Vertex { position: at.to_array(), normal: normal.to_array() });
        part.triangles.extend((0..n).map(|i| Triangle {
            vertices: [vertex, corners[i], corners[(i + 1) % n]],
            leaf: polygon.leaf,
            flipped: turned(at, i),
        }));
    }
}

/// Whether a triangle faces against its normals.
fn is_flipped([a, b, c]: [Vec3; 3], normals: [Vec3; 3]) -> bool {
    (b - a).cross(c - a).dot(normals.iter().sum()) < 0.0
}
