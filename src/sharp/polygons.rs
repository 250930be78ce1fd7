//! The polygons around the crossed edges, and their triangles.

use super::hermite::{Crossing, Scene, unit};
use super::place::{Corner, Kind, Placed, Wanted, place};
use super::sheets::others;
use super::{Hermite, SharpError, SharpReport, Sheets, outward};
use crate::field::NoForm;
use crate::grid::Grid;
use glam::DVec3;
use rayon::prelude::*;

/// Of a cell's face.
const LEAST_AREA: f64 = 1e-4;

const NONE: u32 = u32::MAX;

/// The places of the cells around an edge (bits: on which side of the cell the edge lies, along the two other axes,
/// the earlier first), in a circle.
const CIRCLE: [u8; 4] = [0, 1, 3, 2];

/// The polygons around the crossed edges: faces of the mesh before they are cut into triangles.
pub struct Polygons {
    /// Of sheets, then of segments, then of crossed edges in the border.
    pub vertices: Vec<Placed>,
    /// The vertices of segments in which two sheets meet for one of two times, as numbers; sorted.
    between: Vec<u32>,
    /// Corners of the polygons, one after another.
    corners: Vec<u32>,
    /// The first corner of each polygon, and the end.
    first: Vec<u32>,
    /// The surface's normals at the crossed edges; zero where there is none.
    normals: Vec<DVec3>,
    /// The ways along the crossed edges, out of the solid.
    outward: Vec<DVec3>,
    /// Twice the area of a triangle that is rounding, and no more.
    least_area: f64,
}

/// What the polygons are made from.
struct Maker<'a> {
    hermite: &'a Hermite,
    sheets: &'a Sheets,
    cells: [u32; 3],
    /// The sheets around each crossed edge, by place.
    around: Vec<[u32; 4]>,
    /// Segments with a vertex, as the crossed edges at their ends; sorted.
    segments: Vec<[u32; 2]>,
    /// Crossed edges in the border; sorted.
    border: Vec<u32>,
}

impl Maker<'_> {
    /// Whether a face of a cell lies in the grid's border.
    fn is_border(&self, sheet: u32, face: u8) -> bool {
        let (axis, cell) = (usize::from(face / 2), self.sheets.all[sheet as usize].cell);
        if face & 1 == 0 { cell[axis] == 0 } else { cell[axis] + 1 == self.cells[axis] }
    }

    /// Whether two sheets meet in both segments of a face.
    fn is_twice(&self, sheet: u32, face: u8, beyond: u32) -> bool {
        self.sheets.loop_of(sheet).twice >> face & 1 == 1
            && self.sheets.loop_of(beyond).twice >> (face ^ 1) & 1 == 1
    }

    /// Segments that get a vertex, with the sheet and the face.
    fn find_segments(&self) -> Vec<([u32; 2], u32, u8)> {
        let of_sheet = |sheet: u32| {
            let (one, edges) = (self.sheets.loop_of(sheet), self.sheets.edges_of(sheet));
            let segments = one.faces.iter().enumerate().filter_map(move |(i, &face)| {
                let (axis, e) = (usize::from(face / 2), one.edges[i]);
                let [b, _] = others(usize::from(e / 4));
                let beyond =
                    self.around[edges[i] as usize][usize::from(e & 3) ^ if axis == b { 1 } else { 2 }];
                let has_vertex = match beyond {
                    NONE => self.is_border(sheet, face),
                    beyond => face & 1 == 1 && self.is_twice(sheet, face, beyond),
                };
                has_vertex.then(|| (ends(edges[i], edges[(i + 1) % edges.len()]), sheet, face))
            });
            segments.collect::<Vec<_>>()
        };
        let mut all: Vec<_> =
            (0..self.sheets.all.len() as u32).into_par_iter().flat_map_iter(of_sheet).collect();
        all.par_sort_unstable();
        all
    }

    /// What is asked of a segment's vertex.
    fn wanted(&self, scene: &Scene<'_>, segment: &[u32; 2], sheet: u32, face: u8) -> Wanted {
        let (axis, cell) = (usize::from(face / 2), self.sheets.all[sheet as usize].cell.as_dvec3());
        let (mut low, mut high) = (cell, cell + 1.0);
        if face & 1 == 0 {
            high[axis] = low[axis]
        } else {
            low[axis] = high[axis]
        }
        let mut wanted = self.hermite.wanted(scene, segment, low, high);
        let [b, c] = others(axis).map(|k| scene.frame.along(k));
        let normal = unit(b.cross(c));
        for plane in &mut wanted.planes {
            plane.normal = unit(plane.normal - normal * normal.dot(plane.normal));
        }
        wanted.face = Some(normal);
        wanted
    }

    /// The corners of the polygon around an edge, counter-clockwise seen from outside the solid.
    fn polygon(&self, edge: u32, is_mirrored: bool, corners: &mut Vec<u32>) {
        let Crossing { axis, rises, .. } = self.hermite.crossings[edge as usize];
        let [b, c] = others(usize::from(axis));
        let around = &self.around[edge as usize];
        let (sheets, segments) = (self.sheets.all.len(), self.segments.len());
        let vertex_of_segment = |sheet: u32, place: u8, face: u8| {
            let one = self.sheets.loop_of(sheet);
            let other = one.across(4 * axis + place, face)?;
            let i = one.edges.iter().position(|e| *e == other)?;
            let key = ends(edge, self.sheets.edges_of(sheet)[i]);
            Some((sheets + self.segments.binary_search(&key).ok()?) as u32)
        };
        let first = corners.len();
        for i in 0..4 {
            let (place, next) = (CIRCLE[i], CIRCLE[(i + 1) % 4]);
            let (sheet, beyond) = (around[usize::from(place)], around[usize::from(next)]);
            // The face between the two places, of the cell at the first, and of the other.
            let along = if (place ^ next) == 1 { b } else { c };
            let side = |place: u8| if along == b { place & 1 } else { place >> 1 };
            let face = |place: u8| 2 * along as u8 + side(place);
            if sheet != NONE {
                corners.push(sheet);
            }
            match (sheet, beyond) {
                (NONE, NONE) => {}
                (NONE, beyond) => corners.extend(vertex_of_segment(beyond, next, face(next))),
                (sheet, NONE) => {
                    corners.extend(vertex_of_segment(sheet, place, face(place)));
                    let rank = self.border.binary_search(&edge).unwrap_or(0);
                    corners.push((sheets + segments + rank) as u32);
                }
                (sheet, beyond) if self.is_twice(sheet, face(place), beyond) => {
                    corners.extend(vertex_of_segment(sheet, place, face(place)));
                }
                _ => {}
            }
        }
        if (axis == 1) == (rises == is_mirrored) {
            return;
        }
        corners[first..].reverse();
    }
}

fn ends(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Where [`Polygons::unfold`] moves vertices.
#[derive(Debug, Clone, Copy)]
enum Turn {
    Corner,
    Neighbour,
    Cell,
    Mean,
}

impl Polygons {
    pub(super) fn new(
        scene: &Scene<'_>,
        grid: &Grid,
        hermite: &Hermite,
        sheets: &Sheets,
    ) -> Result<Self, SharpError> {
        let mut around = vec![[NONE; 4]; hermite.crossings.len()];
        for sheet in 0..sheets.all.len() as u32 {
            for (&edge, e) in sheets.edges_of(sheet).iter().zip(&sheets.loop_of(sheet).edges) {
                around[edge as usize][usize::from(e & 3)] = sheet;
            }
        }
        let border = (0..around.len()).filter(|&e| around[e].contains(&NONE)).map(|e| e as u32).collect();
        let cells = grid.cells().into();
        let mut maker = Maker { hermite, sheets, cells, around, segments: Vec::new(), border };
        let segments = maker.find_segments();
        let of_task = |segments: &[([u32; 2], u32, u8)]| {
            // Those of one task may lie in several bricks.
            let mut placed = Vec::with_capacity(segments.len());
            for (ends, sheet, face) in segments {
                let brick = hermite.brick_of(sheets.all[*sheet as usize].cell);
                placed.extend(place(&scene.nearby(brick), &[maker.wanted(scene, ends, *sheet, *face)])?.0);
            }
            Ok(placed)
        };
        let placed: Vec<Vec<Placed>> = segments.par_chunks(64).map(of_task).collect::<Result<_, NoForm>>()?;
        let is_between =
            |(_, (_, sheet, face)): &(u32, &([u32; 2], u32, u8))| !maker.is_border(*sheet, *face);
        let numbered = (sheets.all.len() as u32..).zip(&segments);
        let between = numbered.filter(is_between).map(|(number, _)| number).collect();
        maker.segments = segments.into_iter().map(|(ends, ..)| ends).collect();
        let mut vertices = sheets.placed.clone();
        vertices.extend(placed.into_iter().flatten());
        vertices.extend(maker.border.iter().map(|&e| {
            let crossing = &hermite.crossings[e as usize];
            let singular = crossing.normal == DVec3::ZERO;
            let normal = if singular { unit(outward(scene, crossing)) } else { crossing.normal };
            let (kind, at) = (Kind::Smooth, crossing.at);
            Placed { at, normal, kind, clamped: false, fallback: false, singular }
        }));
        if vertices.len() >= NONE as usize {
            return Err(SharpError::TooLarge { vertices: vertices.len() as u64 });
        }
        let (mut corners, mut first) = (Vec::with_capacity(4 * hermite.crossings.len()), vec![0]);
        for edge in 0..hermite.crossings.len() as u32 {
            maker.polygon(edge, grid.is_mirrored(), &mut corners);
            first.push(corners.len() as u32);
        }
        let normals = hermite.crossings.iter().map(|c| c.normal).collect();
        let outward = hermite.crossings.iter().map(|c| unit(outward(scene, c))).collect();
        let least_area = LEAST_AREA * scene.frame.cell * scene.frame.cell;
        Ok(Self { vertices, between, corners, first, normals, outward, least_area })
    }

    fn corners_of(&self, polygon: usize) -> &[u32] {
        &self.corners[self.first[polygon] as usize..self.first[polygon + 1] as usize]
    }

    fn len(&self) -> usize {
        self.normals.len()
    }

    /// Whether a triangle of the polygon, cut as well as may be, looks against the surface.
    fn is_folded(&self, polygon: usize) -> bool {
        self.best_fan(polygon).1 < 0.0
    }

    /// The corner from which a polygon is best cut, as its number, and the cosine between the surface's normal and that
    /// of the triangle which is turned most against it.
    fn best_fan(&self, polygon: usize) -> (usize, f64) {
        let fan = |normal: DVec3| {
            let corners = self.corners_of(polygon);
            let n = corners.len();
            let at = |i: usize| self.vertices[corners[i % n] as usize].at;
            let mut best = (0, f64::NEG_INFINITY, f64::INFINITY);
            // Two sheets that meet twice are joined by their segments' vertices alone: a diagonal between them would be
            // that of the four polygons there.
            let is_between = |i: &usize| self.between.binary_search(&corners[*i]).is_ok();
            let has_between = (0..n).any(|i| is_between(&i));
            // The two ends of a quadrilateral's diagonal are one fan.
            let ends = if n == 4 && !has_between { 2 } else { n };
            for from in (0..ends).filter(|i| !has_between || is_between(i)) {
                let (mut least, mut length) = (f64::INFINITY, 0.0f64);
                for i in 1..n.saturating_sub(1) {
                    let (a, b, c) = (at(from), at(from + i), at(from + i + 1));
                    // Without area a triangle has no direction.
                    let area = (b - a).cross(c - a);
                    let is_flat = area.length_squared() <= self.least_area * self.least_area;
                    least = least.min(if is_flat { 0.0 } else { unit(area).dot(normal) });
                    length = length.max(a.distance_squared(c));
                }
                if least > best.1 + 1e-3 || (least > best.1 - 1e-3 && length < best.2 * (1.0 - 1e-6)) {
                    best = (from, least, length);
                }
            }
            (best.0, best.1)
        };
        let best = fan(self.normals[polygon]);
        // With all vertices in their cells one way to cut it looks along the edge, whatever the normals say.
        if best.1 >= 0.0 { best } else { (fan(self.outward[polygon]).0, best.1) }
    }

    /// Moves vertices where a triangle looks against the surface, in turn: to the corner that they see, where another
    /// vertex lies already; to another vertex on the feature; back into their cells; to the mean of their crossings.
    /// The first two leave triangles without area, but nothing of the shape is lost.
    pub(super) fn unfold(
        &mut self,
        scene: &Scene<'_>,
        hermite: &Hermite,
        sheets: &Sheets,
        report: &mut SharpReport,
    ) {
        for turn in [Turn::Corner, Turn::Neighbour, Turn::Cell, Turn::Mean] {
            let bad: Vec<usize> = (0..self.len()).into_par_iter().filter(|&i| self.is_folded(i)).collect();
            for polygon in bad {
                let corners: Vec<u32> = self.corners_of(polygon).to_vec();
                for &v in corners.iter().filter(|v| (**v as usize) < sheets.all.len()) {
                    self.back(turn, v, &corners, scene, hermite, sheets);
                }
            }
        }
        report.flipped = (0..self.len()).into_par_iter().filter(|&i| self.is_folded(i)).count() as u64;
    }

    fn back(
        &mut self,
        turn: Turn,
        v: u32,
        corners: &[u32],
        scene: &Scene<'_>,
        hermite: &Hermite,
        sheets: &Sheets,
    ) {
        let (one, low) = (self.vertices[v as usize], sheets.all[v as usize].cell.as_dvec3());
        let q = scene.frame.local(one.at);
        let is_beyond = q.cmplt(low).any() || q.cmpgt(low + 1.0).any();
        let moved = match turn {
            Turn::Corner => {
                let Ok(i) = sheets.corners.binary_search_by_key(&(v as usize), |c| c.by) else { return };
                let Corner { at, normal, .. } = sheets.corners[i];
                Placed { at, normal, kind: Kind::Corner, ..one }
            }
            Turn::Neighbour if is_beyond && one.kind == Kind::Edge => {
                let others = corners.iter().filter(|w| **w != v).map(|w| self.vertices[*w as usize]);
                let others = others.filter(|other| other.kind != Kind::Smooth);
                let nearer = |a: Placed, b: Placed| {
                    if b.at.distance(one.at) < a.at.distance(one.at) { b } else { a }
                };
                let Some(other) = others.reduce(nearer) else { return };
                Placed { at: other.at, normal: other.normal, ..one }
            }
            Turn::Cell if is_beyond => {
                Placed { at: scene.frame.world(q.clamp(low, low + 1.0)), clamped: true, ..one }
            }
            Turn::Mean => {
                let wanted = hermite.wanted(scene, sheets.edges_of(v), low, low + 1.0);
                let mean = unit(wanted.planes.iter().map(|p| p.normal).sum());
                let normal = if mean == DVec3::ZERO { one.normal } else { mean };
                Placed { at: wanted.mass(), normal, fallback: true, kind: Kind::Smooth, ..one }
            }
            _ => return,
        };
        self.vertices[v as usize] = moved;
    }

    /// The polygons cut into triangles.
    pub(super) fn triangles(&self) -> Vec<[u32; 3]> {
        let of_polygon = |polygon: usize| {
            let (corners, (from, _)) = (self.corners_of(polygon), self.best_fan(polygon));
            let at = move |i: usize| corners[(from + i) % corners.len()];
            (1..corners.len().saturating_sub(1)).map(move |i| [at(0), at(i), at(i + 1)])
        };
        (0..self.len()).into_par_iter().flat_map_iter(of_polygon).collect()
    }
}
