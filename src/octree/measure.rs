//! How far the mesh is from the surface, and which leaves to split for it.

use super::before::Before;
use super::tree::Tree;
use super::triangles::{Triangle, is_flipped};
use super::{Contour, TASK};
use crate::field::{NoForm, Surface};
use glam::Vec3;
use rayon::prelude::*;

/// Where a triangle is looked at: its middle, its corners and the middles of its sides; one of leaves larger than
/// [`SMALL`], or with much error there, at the other points of its division into quarters, too: a crease may lie between.
const SAMPLES: [[f32; 3]; 16] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.75, 0.25, 0.0],
    [0.25, 0.75, 0.0],
    [0.0, 0.75, 0.25],
    [0.0, 0.25, 0.75],
    [0.75, 0.0, 0.25],
    [0.25, 0.0, 0.75],
    [0.5, 0.25, 0.25],
    [0.25, 0.5, 0.25],
    [0.25, 0.25, 0.5],
];
/// How many of them are for all triangles.
const FEW: usize = 7;
/// The size of the largest leaves with few samples.
pub const SMALL: u32 = 2;
/// Part of ε within which the first step is believed: at an edge of the solid the nearest point is farther away than either
/// face, 2.9 times for an edge of 40°.
const NEAR: f32 = 0.35;
/// How many times farther than a known point of the surface a projection is not believed.
const ASTRAY: f32 = 4.0;
/// Steps of projection beyond the first.
const STEPS: usize = 3;

/// A triangle as [`farthest`] looks at it.
pub struct Placed {
    /// Its corners.
    pub corners: [Vec3; 3],
    /// The number of a field that may hold there.
    pub field: u32,
    /// A point of the surface beside it.
    pub known: Vec3,
    /// Whether it is of a leaf larger than [`SMALL`].
    pub is_large: bool,
}

/// What was found.
#[derive(Debug, Default)]
pub struct Measured {
    /// The largest distance.
    pub largest: f32,
    /// Triangles beyond ε.
    pub over: u64,
    /// Leaves of the smallest size at those that nothing can be split for.
    pub stopped: u64,
    /// Leaves to split, in order: also those of flipped triangles.
    pub split: Vec<u32>,
    /// The largest distance on each triangle.
    pub distances: Vec<f32>,
}

/// The distance of points of each triangle to the surface, by projection along the gradient: what a projected
/// point has come is never less than its distance, up to how near the surface it ends.
pub fn measure(
    tree: &Tree,
    surface: &Surface<'_>,
    contour: &Contour,
    error: f32,
    before: Option<&Before>,
) -> Result<Measured, NoForm> {
    let corners = |t: &Triangle| t.vertices.map(|v| contour.positions[v as usize]);
    let of_polygons = contour.triangles.chunk_by(|a, b| a.polygon == b.polygon);
    let known: Vec<Option<f32>> = of_polygons
        .flat_map(|of| of.iter().enumerate())
        .map(|(nth, t)| before?.distance(contour.kept[t.polygon as usize], nth, corners(t)))
        .collect();
    let new: Vec<Triangle> =
        contour.triangles.iter().zip(&known).filter(|(_, k)| k.is_none()).map(|(t, _)| *t).collect();
    let found = farthest(tree, surface, error, &new, |t| {
        let polygon = &contour.dual.polygons[t.polygon as usize];
        Placed {
            corners: corners(t),
            field: tree.nodes[polygon.owner as usize].field,
            known: contour.crossings[t.polygon as usize].at,
            is_large: polygon.corners.iter().any(|c| tree.nodes[c.leaf as usize].size > SMALL),
        }
    })?;
    let mut found = found.into_iter();
    let distances = known.into_iter().filter_map(|known| known.or_else(|| found.next())).collect();
    let mut measured = Measured { distances, ..Measured::default() };
    let mut stopped = Vec::new();
    for (triangle, &distance) in contour.triangles.iter().zip(&measured.distances) {
        measured.largest = measured.largest.max(distance);
        let is_over = distance > error;
        if !is_over && !is_flipped(triangle, &contour.positions, &contour.crossings) {
            continue;
        }
        measured.over += u64::from(is_over);
        let polygon = &contour.dual.polygons[triangle.polygon as usize];
        let leaves = || polygon.corners.iter().map(|c| c.leaf);
        let size = |leaf: u32| tree.nodes[leaf as usize].size;
        let largest = leaves().map(size).max().unwrap_or(1);
        if largest > 1 {
            measured.split.extend(leaves().filter(|&l| size(l) == largest));
        } else if is_over {
            stopped.extend(leaves());
        }
    }
    measured.split.sort_unstable();
    measured.split.dedup();
    stopped.sort_unstable();
    stopped.dedup();
    measured.stopped = stopped.len() as u64;
    Ok(measured)
}

/// The largest distance to the surface that is found on each of `triangles`, whose whereabouts `placed` tells.
pub fn farthest<T: Sync>(
    tree: &Tree,
    surface: &Surface<'_>,
    error: f32,
    triangles: &[T],
    placed: impl Fn(&T) -> Placed + Sync,
) -> Result<Vec<f32>, NoForm> {
    let found: Vec<Vec<f32>> = triangles
        .par_chunks(TASK / 4)
        .map(|triangles| {
            let triangles: Vec<Placed> = triangles.iter().map(&placed).collect();
            let mut worst = vec![0.0f32; triangles.len()];
            let mut look = |chosen: &[usize], samples: &[[f32; 3]]| {
                let mut points = Vec::with_capacity(chosen.len() * samples.len());
                let mut hints = Vec::with_capacity(points.capacity());
                for t in chosen.iter().map(|&i| &triangles[i]) {
                    let [a, b, c] = t.corners;
                    points.extend(samples.iter().map(|[u, v, w]| a * u + b * v + c * w));
                    hints.resize(points.len(), t.field);
                }
                let mut distances = distances(tree, surface, &points, &hints, error)?;
                // Where the gradients led astray: no farther than the point that is known.
                for (k, (distance, point)) in distances.iter_mut().zip(&points).enumerate() {
                    let known = point.distance(triangles[chosen[k / samples.len()]].known);
                    *distance = if *distance > ASTRAY * known { known } else { *distance };
                }
                for (&i, of) in chosen.iter().zip(distances.chunks(samples.len())) {
                    worst[i] = of.iter().copied().fold(worst[i], f32::max);
                }
                Ok::<_, NoForm>(worst.clone())
            };
            let first = look(&(0..triangles.len()).collect::<Vec<_>>(), &SAMPLES[..FEW])?;
            let closer: Vec<usize> =
                (0..triangles.len()).filter(|&i| first[i] > 0.4 * error || triangles[i].is_large).collect();
            if closer.is_empty() { Ok(first) } else { look(&closer, &SAMPLES[FEW..]) }
        })
        .collect::<Result<_, NoForm>>()?;
    Ok(found.concat())
}

/// Distances of points to the surface. Those that one step shows to be well within `error` are not followed further.
fn distances(
    tree: &Tree,
    surface: &Surface<'_>,
    points: &[Vec3],
    hints: &[u32],
    error: f32,
) -> Result<Vec<f32>, NoForm> {
    let mut at = points.to_vec();
    let mut distances = vec![0.0f32; points.len()];
    let mut open: Vec<usize> = (0..points.len()).collect();
    for step in 0..=STEPS {
        let here: Vec<Vec3> = open.iter().map(|&i| at[i]).collect();
        let fields: Vec<u32> = open.iter().map(|&i| tree.fields.at(hints[i], at[i])).collect();
        let mut values = vec![0.0; here.len()];
        let mut gradients = vec![Vec3::ZERO; here.len()];
        tree.fields.values(surface, &fields, &here, &mut values)?;
        tree.fields.gradients(surface, &fields, &here, &mut gradients)?;
        let mut still = Vec::new();
        for ((&i, value), gradient) in open.iter().zip(values).zip(gradients) {
            let length = gradient.length();
            let way = value / length;
            if !way.is_finite() {
                continue;
            }
            if step == STEPS {
                // What is left is in doubt.
                distances[i] += way.abs();
                continue;
            }
            at[i] -= gradient * (way / length);
            distances[i] = at[i].distance(points[i]);
            if way.abs() > 0.02 * error && (step > 0 || distances[i] > NEAR * error) {
                still.push(i);
            }
        }
        open = still;
        if open.is_empty() {
            break;
        }
    }
    Ok(distances)
}
