//! Fewer triangles within an error: edge collapses in the order of their quadric error, after M. Garland & P. Heckbert, *Surface
//! simplification using quadric error metrics*, SIGGRAPH 1997, each held to the link condition of T. Dey, H. Edelsbrunner,
//! S. Guha & D. Nekhayev, *Topology preserving edge contraction*, 1999 ([`Collapses`]).
//!
//! A collapse moves a vertex onto a neighbour, so that the vertices left are old ones, with what is theirs.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::AddAssign;

use glam::{DMat3, DVec3};

use super::Mesh;
use super::check::faulty_vertices;
use super::collapse::Collapses;

/// How much the shape of a border counts, against a triangle as large as the square of its edge.
const BORDER: f64 = 10.0;

/// What the square of its length adds to the rank of a collapse, so that of those that move nothing the short ones come first.
const LENGTH: f64 = 1e-6;

/// Where simplification stops, at whichever comes first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// At so many triangles.
    pub triangles: usize,
    /// Before the surface moves farther than this, in world units; infinite for any distance.
    pub error: f32,
}

/// A mesh that this cannot be done with.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// A triangle names a vertex that does not exist.
    #[error(
        "triangle {triangle} names a vertex that does not exist: remove such triangles first (Mesh::remove_broken)"
    )]
    BadIndex {
        /// The first such triangle, from 0.
        triangle: usize,
    },
    /// A vertex is NaN or infinite.
    #[error("vertex {vertex} is not finite: remove its triangles first (Mesh::remove_broken)")]
    NotFinite {
        /// The first such vertex, from 0.
        vertex: usize,
    },
    /// [`Budget::error`] is NaN or negative.
    #[error("the surface may not move by {0}: give a distance from 0 on, or infinity for any")]
    Error(f32),
    /// More indices than can be worked with.
    #[error("the mesh is too large: take a coarser one")]
    TooLarge,
}

/// Refuses what has no meaning here, and what C++ code, which trusts its input, must not see.
pub(super) fn fit(mesh: &Mesh) -> Result<(), Unfit> {
    let count = mesh.vertices.len();
    if let Some(triangle) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
        return Err(Unfit::BadIndex { triangle });
    }
    match mesh.vertices.iter().position(|v| !v.at().is_finite()) {
        Some(vertex) => Err(Unfit::NotFinite { vertex }),
        None => Ok(()),
    }
}

impl Mesh {
    /// Collapses edges, those first by which the surface moves least, until the budget is reached or no edge is left that
    /// can go; returns how far the surface moved, in world units.
    ///
    /// The vertices left are some of the old ones, where they were and with their normals. The distance is the largest of all
    /// collapses, of each the root of the mean square of how far it is from the planes of the old triangles that went with
    /// the vertex, by their areas: single points may lie farther (in the tests up to four times as far on closed shapes, nine
    /// times on a thin, coarse sheet). Borders keep their shape within the same error. Triangles that repeat a vertex go.
    ///
    /// The topology stays: a closed mesh stays closed and a manifold one, no component vanishes, falls apart or
    /// becomes a sheet without thickness, no handle or hole closes; then more triangles than the budget may stay. A vertex of more than
    /// a thousand triangles stays until those around it are fewer. Where edges,
    /// vertices or winding are not in order, the triangles stay as they are.
    ///
    /// # Errors
    /// [`Unfit::BadIndex`], [`Unfit::NotFinite`], [`Unfit::Error`]; the mesh is as it was.
    pub fn simplify(&mut self, budget: &Budget) -> Result<f32, Unfit> {
        fit(self)?;
        if budget.error.is_nan() || budget.error < 0.0 {
            return Err(Unfit::Error(budget.error));
        }
        let is_proper = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
        self.triangles.retain(is_proper);
        let mut queue = Queue::of(self, budget);
        while queue.pass() {}
        let moved = queue.moved;
        self.triangles = queue.collapses.into_triangles();
        self.drop_unused();
        Ok(moved.sqrt() as f32)
    }
}

/// The sum of the squares of a point's distances from planes, by weights; and the weights of those of the surface.
#[derive(Clone, Copy)]
struct Quadric {
    square: DMat3,
    linear: DVec3,
    constant: f64,
    weight: f64,
}

impl Quadric {
    const NONE: Self = Self { square: DMat3::ZERO, linear: DVec3::ZERO, constant: 0.0, weight: 0.0 };

    fn plane(normal: DVec3, through: DVec3, weight: f64) -> Self {
        let offset = normal.dot(through);
        Self {
            square: DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z) * weight,
            linear: normal * (-offset * weight),
            constant: offset * offset * weight,
            weight,
        }
    }

    /// The mean square distance from the surface's planes, and what borders add to it.
    fn at(&self, p: DVec3) -> f64 {
        let sum = p.dot(self.square * p) + 2.0 * self.linear.dot(p) + self.constant;
        if self.weight > 0.0 { sum.max(0.0) / self.weight } else { 0.0 }
    }
}

impl AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        self.square += other.square;
        self.linear += other.linear;
        self.constant += other.constant;
        self.weight += other.weight;
    }
}

/// The best collapse of a vertex: its rank, the bits of a float that is not negative; the vertex; what it goes onto; and how
/// often this had been ranked anew before.
type Ranked = Reverse<(u32, u32, u32, u32)>;

struct Queue {
    collapses: Collapses,
    quadrics: Vec<Quadric>,
    anew: Vec<u32>,
    ranked: BinaryHeap<Ranked>,
    triangles: usize,
    /// The square of the error allowed, and the largest so far.
    limit: f64,
    moved: f64,
}

impl Queue {
    fn of(mesh: &Mesh, budget: &Budget) -> Self {
        let mut locked = vec![false; mesh.vertices.len()];
        faulty_vertices(mesh).iter().for_each(|&v| locked[v as usize] = true);
        // Far from the world's origin quadrics would drown in cancellation.
        let centre = mesh.bounds().map_or(DVec3::ZERO, |(lo, hi)| (lo.as_dvec3() + hi.as_dvec3()) / 2.0);
        let at = mesh.vertices.iter().map(|v| v.at().as_dvec3() - centre).collect();
        let collapses = Collapses::new(at, &mesh.triangles, locked);
        let mut quadrics = vec![Quadric::NONE; mesh.vertices.len()];
        for &triangle in &mesh.triangles {
            let normal = collapses.normal(triangle);
            let (double, [a, ..]) = (normal.length(), triangle.map(|v| collapses.at[v as usize]));
            let of_face = Quadric::plane(normal.normalize_or_zero(), a, double / 2.0);
            triangle.iter().for_each(|&v| quadrics[v as usize] += of_face);
            for (i, v) in triangle.into_iter().enumerate() {
                let w = triangle[(i + 1) % 3];
                if collapses.is_border(v, w) {
                    let from = collapses.at[v as usize];
                    let along = collapses.at[w as usize] - from;
                    let across = along.cross(normal).normalize_or_zero();
                    let plane = Quadric::plane(across, from, BORDER * along.length_squared());
                    // Beside the surface's error, without thinning it.
                    let of_border = Quadric { weight: 0.0, ..plane };
                    quadrics[v as usize] += of_border;
                    quadrics[w as usize] += of_border;
                }
            }
        }
        Self {
            collapses,
            quadrics,
            anew: vec![0; mesh.vertices.len()],
            ranked: BinaryHeap::new(),
            triangles: budget.triangles,
            limit: f64::from(budget.error).powi(2),
            moved: 0.0,
        }
    }

    /// Collapses what can go, the least first; whether there may be more: what one collapse stood in the way of, another may
    /// have made possible.
    fn pass(&mut self) -> bool {
        self.collapses.sweep();
        (0..self.anew.len() as u32).for_each(|v| self.rank(v));
        let before = self.collapses.left();
        while self.collapses.left() > self.triangles {
            let Some(Reverse((rank, from, to, anew))) = self.ranked.pop() else {
                return self.collapses.left() < before;
            };
            if self.anew[from as usize] != anew {
                continue;
            }
            if !self.collapses.collapse(from, to) {
                self.rank_beyond(from, (rank, to));
                continue;
            }
            let of_from = self.quadrics[from as usize];
            self.moved = self.moved.max(of_from.at(self.collapses.at[to as usize]));
            self.quadrics[to as usize] += of_from;
            self.anew[from as usize] += 1;
            self.rank(to);
            self.collapses.neighbours(to).into_iter().for_each(|near| self.rank(near));
        }
        false
    }

    /// Ranks the best collapse of a vertex anew.
    fn rank(&mut self, from: u32) {
        self.anew[from as usize] += 1;
        self.rank_beyond(from, (0, 0));
    }

    /// Ranks the best collapse of a vertex from a rank, and an other end, on.
    fn rank_beyond(&mut self, from: u32, beyond: (u32, u32)) {
        if self.collapses.is_hub(from) {
            return;
        }
        let (of_from, at) = (&self.quadrics[from as usize], &self.collapses.at);
        let ranks = self.collapses.ring(from).filter_map(|to| {
            let error = of_from.at(at[to as usize]);
            let rank = error + LENGTH * at[to as usize].distance_squared(at[from as usize]);
            (error <= self.limit).then_some(((rank as f32).to_bits(), to))
        });
        if let Some((rank, to)) = ranks.filter(|ranked| *ranked > beyond).min() {
            self.ranked.push(Reverse((rank, from, to, self.anew[from as usize])));
        }
    }
}
