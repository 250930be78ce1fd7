//! Faces of any number of corners, cut into triangles.

use std::collections::HashMap;
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::Contents;
use crate::mesh::{Mesh, Vertex};

/// Cuts a polygon into a fan of triangles; fewer than three corners make none.
pub(super) fn fan(triangles: &mut Vec<[u32; 3]>, corners: &[u32]) {
    if let [first, rest @ ..] = corners {
        triangles.extend(rest.windows(2).map(|side| [*first, side[0], side[1]]));
    }
}

/// The faces of a file, as it comes by them.
#[derive(Default)]
pub(super) struct Faces {
    triangles: Vec<[u32; 3]>,
    /// Which triangles are the fans of polygons. They are cut anew when all vertices are known.
    polygons: Vec<Range<usize>>,
    left_out: usize,
}

impl Faces {
    pub(super) fn with_capacity(faces: usize) -> Self {
        Faces { triangles: Vec::with_capacity(faces), ..Faces::default() }
    }

    pub(super) fn add(&mut self, corners: &[u32]) {
        let first = self.triangles.len();
        fan(&mut self.triangles, corners);
        match corners.len() {
            0..3 => self.left_out += 1,
            3 => {}
            _ => self.polygons.push(first..self.triangles.len()),
        }
    }

    /// The mesh; all corners must be numbers of `vertices`.
    pub(super) fn finish(self, vertices: Vec<Vertex>) -> Contents {
        let Faces { mut triangles, polygons, left_out } = self;
        let cut: Vec<_> = polygons
            .into_par_iter()
            .filter_map(|polygon| Some((cut(&vertices, &triangles[polygon.clone()])?, polygon)))
            .collect();
        for (new, polygon) in cut {
            triangles[polygon].copy_from_slice(&new);
        }
        Contents { mesh: Mesh { vertices, triangles }, left_out }
    }
}

/// The polygon of a fan cut so that no triangle is turned over or flat: as many triangles as the fan has, which keep each
/// edge of the polygon. `None` where the fan is as good, or the polygon has no inside that could be told.
fn cut(vertices: &[Vertex], fan: &[[u32; 3]]) -> Option<Vec<[u32; 3]>> {
    let corners: Vec<u32> = fan[0][..2].iter().copied().chain(fan.iter().map(|t| t[2])).collect();
    let at = |v: u32| vertices[v as usize].at().as_dvec3();
    let normal: DVec3 = fan.iter().map(|&[a, b, c]| (at(b) - at(a)).cross(at(c) - at(a))).sum();
    // Along an axis, so that coordinates keep their bits and collinear corners stay collinear.
    let axis = normal.abs().max_position();
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (u, v) = (v, u);
    }
    let flat = |corner: u32| Point2::new(at(corner)[u], at(corner)[v]);
    let area = |&[a, b, c]: &[u32; 3]| {
        let (a, b, c) = (flat(a), flat(b), flat(c));
        (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)
    };
    if !normal.is_finite() || fan.iter().all(|triangle| area(triangle) > 0.0) {
        return None;
    }

    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut number = Vec::with_capacity(corners.len());
    let mut points = Vec::with_capacity(corners.len());
    for &corner in &corners {
        let point = cdt.insert(flat(corner)).ok()?;
        if point.index() == number.len() {
            number.push(corner);
        }
        // Corners at one place that are different vertices cannot be told apart in the plane.
        (number[point.index()] == corner).then(|| points.push(point))?;
    }
    // How often the polygon runs along an edge, less how often against it: a hole may be cut free by a bridge there and back.
    let mut along: HashMap<_, i32> = HashMap::new();
    for (i, &from) in points.iter().enumerate() {
        let to = points[(i + 1) % points.len()];
        *along.entry((from, to)).or_default() += 1;
        *along.entry((to, from)).or_default() -= 1;
        if from != to {
            cdt.try_add_constraint(from, to);
        }
        // Not there where the polygon crosses itself, or a corner lies on one of its edges.
        cdt.get_edge_from_neighbors(from, to)?;
    }

    // How often the polygon goes round each triangle, from the outside in.
    let left = |edge: (_, _)| along.get(&edge).copied().unwrap_or(0);
    let mut winding: Vec<Option<i32>> = vec![None; cdt.num_all_faces()];
    let mut waiting: Vec<_> = cdt
        .convex_hull()
        .map(|edge| edge.rev())
        .map(|edge| (edge, left((edge.from().fix(), edge.to().fix()))))
        .collect();
    while let Some((edge, turns)) = waiting.pop() {
        let Some(face) = edge.face().as_inner() else { continue };
        if winding[face.index()].replace(turns).is_none() {
            waiting.extend(face.adjacent_edges().map(|edge| {
                let back = edge.rev();
                (back, turns + left((back.from().fix(), back.to().fix())))
            }));
        }
    }
    let mut triangles = Vec::with_capacity(fan.len());
    for face in cdt.inner_faces() {
        match winding[face.index()] {
            Some(0) => {}
            Some(1) => triangles.push(face.vertices().map(|point| number[point.index()])),
            _ => return None,
        }
    }
    (triangles.len() == fan.len()).then_some(triangles)
}
