//! Whether a node of the tree needs splitting, seen from its values alone.
//!
//! The error of Zhang, Bajaj & Sohn 2005 compares the field at the 19 points that a split adds with its interpolation,
//! over the gradient's length: that never ends at creases, where no interpolation fits. Here the same points give
//! tangent planes, and the node's error is their largest distance to the best vertex: 0 for a straight crease.

use super::fields::Fields;
use super::quadric::{Plane, minimiser};
use super::tree::{Node, Sampled, Tree, Verdict, excludes, world_box};
use crate::field::{NoForm, Surface};
use crate::grid::Grid;
use glam::{DVec3, UVec3, Vec3};

/// Times ε that a node's error may be: the triangles have about a part of it, and those that have more are measured later.
const SLACK: f64 = 2.0;

/// The criterion's settings.
pub struct Criterion<'a> {
    /// The surface.
    pub surface: &'a Surface<'a>,
    /// The grid.
    pub grid: &'a Grid,
    /// The largest distance to a tangent plane that a leaf may have.
    pub error: f32,
    /// Cells along the edge of the largest leaf with surface.
    pub coarsest: u32,
}

/// Lattice edges: pairs of neighbouring lattice points.
fn lattice_edges() -> impl Iterator<Item = [usize; 2]> {
    [1, 3, 9]
        .into_iter()
        .flat_map(|step| (0..27usize).filter(move |i| i / step % 3 < 2).map(move |i| [i, i + step]))
}

impl Criterion<'_> {
    /// What the signs at the lattice points say alone: `None` for a node whose surface they show.
    pub fn by_signs(&self, fields: &Fields, node: &Node, lattice: &[f32; 27]) -> Option<Verdict> {
        if node.size > self.coarsest {
            return Some(Verdict::Split);
        }
        if lattice.iter().all(|v| *v < 0.0) || lattice.iter().all(|v| *v >= 0.0) {
            // What may be hidden here is looked for, but not nearer to the border than what is allowed to be wrong:
            // it is a neighbour's surface that bulges.
            let (low, high) = world_box(self.grid, node.low, node.high());
            let margin = Vec3::splat(self.error).min((high - low) * 0.5);
            let here = fields.surface(self.surface, node.field);
            let hidden = !excludes(here.range(low + margin, high - margin));
            return Some(if hidden { Verdict::Split } else { Verdict::Keep });
        }
        (!agrees(lattice)).then_some(Verdict::Split)
    }

    /// See [`Tree::grow`].
    ///
    /// # Errors
    /// [`NoForm`] as [`Surface::values`].
    pub fn verdicts(&self, fields: &Fields, nodes: &[Sampled<'_>]) -> Result<Vec<Verdict>, NoForm> {
        let mut verdicts = Vec::with_capacity(nodes.len());
        let (mut points, mut of) = (Vec::new(), Vec::new());
        let mut ranges = Vec::with_capacity(nodes.len());
        for Sampled { node, lattice } in nodes {
            let begin = points.len();
            if let Some(verdict) = self.by_signs(fields, node, lattice) {
                verdicts.push(verdict);
            } else {
                verdicts.push(Verdict::Keep);
                let position = |i: usize| {
                    let at = UVec3::new(i as u32 % 3, i as u32 / 3 % 3, i as u32 / 9);
                    self.grid.position((node.low + at * (node.size / 2)).as_vec3())
                };
                for [a, b] in lattice_edges() {
                    let (va, vb) = (lattice[a], lattice[b]);
                    if (va < 0.0) != (vb < 0.0) {
                        let t = va / (va - vb);
                        let t = if t.is_finite() { t } else { 0.5 };
                        points.push(position(a).lerp(position(b), t));
                        of.push(node.field);
                    }
                }
            }
            ranges.push(begin..points.len());
        }
        let mut values = vec![0.0; points.len()];
        let mut gradients = vec![Vec3::ZERO; points.len()];
        fields.values(self.surface, &of, &points, &mut values)?;
        fields.gradients(self.surface, &of, &points, &mut gradients)?;
        let mut planes = Vec::new();
        for ((range, verdict), Sampled { node, .. }) in ranges.into_iter().zip(&mut verdicts).zip(nodes) {
            if range.is_empty() {
                continue;
            }
            planes.clear();
            for i in range {
                let gradient = gradients[i].as_dvec3();
                let length = gradient.length();
                if length > 0.0 && length.is_finite() && values[i].is_finite() {
                    let normal = gradient / length;
                    planes.push(Plane {
                        at: points[i].as_dvec3() - normal * (f64::from(values[i]) / length),
                        normal,
                    });
                }
            }
            let mean = planes.iter().map(|p| p.at).sum::<DVec3>() / planes.len().max(1) as f64;
            let (low, high) = world_box(self.grid, node.low, node.high());
            let clamp = |x: DVec3| x.clamp(low.as_dvec3(), high.as_dvec3());
            let (_, error) = minimiser(&planes, mean, f64::from(self.error) / 4.0, clamp);
            if planes.is_empty() || error > SLACK * f64::from(self.error) {
                *verdict = Verdict::Split;
            }
        }
        Ok(verdicts)
    }
}

/// Ju et al. 2002, § 4.1: the sign in the middle of each edge, face and of the cell is that of one of its corners.
fn agrees(lattice: &[f32; 27]) -> bool {
    let inside = |i: usize| lattice[i] < 0.0;
    (0..27usize).all(|i| {
        let at = [i % 3, i / 3 % 3, i / 9];
        (0..8usize).any(|c| {
            let corner = [0, 1, 2].map(|k| if at[k] == 1 { c >> k & 1 } else { at[k] / 2 });
            inside(2 * corner[0] + 6 * corner[1] + 18 * corner[2]) == inside(i)
        })
    })
}

/// The size of the largest leaf with surface: an eighth of the tree.
pub fn coarsest(tree: &Tree) -> u32 {
    (tree.size / 8).max(1)
}
