//! Where the vertex of a sheet lies: on the feature that the surface has in the cell, else on its smooth surface.
//!
//! The tangent planes at the crossings meet near a feature only where the sides are flat. So the planes are taken again,
//! ever closer to where they met: from each crossing towards that point, projected on the surface, until the sides are
//! flat for all that matters. What is left of the normals' differences then is a feature; what curvature made of them is
//! gone, as it falls with the distance.

use super::hermite::{Nearby, unit};
use super::qef::{Meeting, Plane, meet};
use crate::field::NoForm;
use glam::DVec3;

/// What a vertex lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// No feature.
    Smooth,
    /// Two sides meet there.
    Edge,
    /// Three or more meet there, or the surface has a tip.
    Corner,
}

/// A vertex.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    pub at: DVec3,
    /// At unit length.
    pub normal: DVec3,
    pub kind: Kind,
    /// Whether the position had to be kept to the cell.
    pub clamped: bool,
    /// Whether no point of the surface was found, and this is the crossings' mean.
    pub fallback: bool,
    /// Whether the surface has no gradient there.
    pub singular: bool,
}

/// The vertex of a cell's sheet, or of a segment in a face, that is wanted.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// The box in which it lies, in grid coordinates; flat for a face.
    pub low: DVec3,
    pub high: DVec3,
    /// The normal of the face to which it keeps.
    pub face: Option<DVec3>,
    /// The crossings.
    pub planes: Vec<Plane>,
    /// Out of the solid, by the signs of the corners alone.
    pub outward: DVec3,
}

impl Wanted {
    /// The mean of the crossings.
    pub fn mass(&self) -> DVec3 {
        self.planes.iter().map(|p| p.at).sum::<DVec3>() / self.planes.len().max(1) as f64
    }
}

/// Normals that are turned by less than 8° against each other are of one smooth side.
const SMOOTH: f64 = 0.99;
/// Where planes are taken again, from the point where they met; in cells.
const RADII: [f64; 3] = [0.4, 0.1, 0.03];
/// What a feature point may be off the surface; in cells.
const TOLERANCE: f64 = 2e-3;
/// How far a feature point may lie beyond its cell: where a thin edge pokes into a cell whose corners are all outside,
/// no other vertex can be on it. In cells.
const REACH: f64 = 1.0;
/// How far a vertex on an edge may be off any of its cell's tangent planes, before it goes to a corner; in cells.
const MISS: f64 = 0.02;
/// How far a smooth point may lie beyond its cell.
const SLACK: f64 = 0.25;

/// A corner that a vertex could lie on.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    /// Which of the wanted vertices sees it.
    pub by: usize,
    pub at: DVec3,
    /// The mean of the sides' normals.
    pub normal: DVec3,
    /// How far it lies beyond that vertex's cell; in cells.
    pub excess: f64,
}

/// The vertices, and the corners that they see in their cells or near to them. A corner is seen from several cells, so
/// the vertices are those that lie on edges and smooth sides.
pub fn place(near: &Nearby<'_>, wanted: &[Wanted]) -> Result<(Vec<Placed>, Vec<Corner>), NoForm> {
    let owners: Vec<usize> = (0..wanted.len()).filter(|&i| is_bent(&wanted[i].planes)).collect();
    let tasks: Vec<Wanted> = owners.iter().map(|&i| wanted[i].clone()).collect();
    let first = features(near, &tasks)?;
    // A second look: at the ends of edges for corners, and at pairs of sides where all of them meet in a corner.
    let mut again = probes(near, &tasks, &first)?;
    for (k, (task, own)) in tasks.iter().zip(&first).enumerate() {
        if own.rank == 3 || (own.rank == 2 && !own.is_on) {
            again.extend(pairs_of_sides(task).into_iter().map(|pair| (k, pair)));
        }
    }
    let more: Vec<Wanted> = again.iter().map(|(_, task)| task.clone()).collect();
    let second = features(near, &more)?;
    let mut all: Vec<Vec<Feature>> = first.iter().map(|own| vec![*own]).collect();
    for ((k, _), feature) in again.iter().zip(second) {
        all[*k].push(feature);
    }
    let mut found: Vec<Option<Feature>> = vec![None; wanted.len()];
    let mut corners = Vec::new();
    for (k, task) in tasks.iter().enumerate() {
        let mass = task.mass();
        let beyond = |f: &Feature| excess(near, task, f.at);
        all[k].retain(|f| f.is_on && beyond(f) <= REACH);
        let order = |f: &Feature| (beyond(f), f.at.distance(mass));
        let nearer = |a: Feature, b: Feature| if order(&b) < order(&a) { b } else { a };
        let nearest = |rank: usize| all[k].iter().copied().filter(|f| f.rank == rank).reduce(nearer);
        // A vertex on two sides of a cell that sees three would take the third side's polygons with it.
        let miss =
            |f: &Feature| task.planes.iter().map(|p| p.normal.dot(f.at - p.at).abs()).fold(0.0, f64::max);
        found[owners[k]] = match (nearest(2), nearest(3)) {
            (Some(edge), Some(corner)) if miss(&edge) > 2.0 * miss(&corner) + MISS * near.frame.cell => {
                Some(corner)
            }
            (edge, _) => edge,
        };
        if let Some(f) = nearest(3) {
            corners.push(Corner { by: owners[k], at: f.at, normal: f.normal, excess: beyond(&f) });
        }
    }
    Ok((smooth(near, wanted, &found)?, corners))
}

/// Where planes of the surface met.
#[derive(Debug, Clone, Copy)]
struct Feature {
    at: DVec3,
    /// As [`Meeting::rank`], in a face one less.
    rank: usize,
    line: DVec3,
    /// The mean of the sides' normals.
    normal: DVec3,
    /// Whether it is on the surface.
    is_on: bool,
}

/// Whether any two of the normals differ.
fn is_bent(planes: &[Plane]) -> bool {
    let pairs =
        planes.iter().enumerate().flat_map(|(i, a)| planes[..i].iter().map(move |b| a.normal.dot(b.normal)));
    pairs.fold(1.0, f64::min) < SMOOTH
}

/// How far a point lies beyond the box, along the axis where it is farthest; in cells.
fn excess(near: &Nearby<'_>, task: &Wanted, at: DVec3) -> f64 {
    let q = near.frame.local(at);
    (task.low - q).max(q - task.high).max_element().max(0.0)
}

/// The part of a line that lies in the box, from and to in lengths of `line`.
fn clip(near: &Nearby<'_>, task: &Wanted, at: DVec3, line: DVec3) -> Option<[f64; 2]> {
    let (q, d) = (near.frame.local(at), near.frame.local_direction(line));
    let mut range = [f64::NEG_INFINITY, f64::INFINITY];
    for k in 0..3 {
        if d[k].abs() > 1e-12 * d.abs().max_element() {
            let [a, b] = [(task.low[k] - q[k]) / d[k], (task.high[k] - q[k]) / d[k]];
            range = [range[0].max(a.min(b)), range[1].min(a.max(b))];
        } else if q[k] < task.low[k] || q[k] > task.high[k] {
            return None;
        }
    }
    (range[0] <= range[1] && range[0].is_finite() && range[1].is_finite()).then_some(range)
}

/// Keeps a meeting to the cell where it can choose its place, and near to it else.
fn confine(near: &Nearby<'_>, task: &Wanted, mut meeting: Meeting) -> Meeting {
    if task.face.is_none()
        && meeting.rank == 2
        && let Some([from, to]) = clip(near, task, meeting.at, meeting.line)
    {
        // Not at the end, where the next cell's vertex may be.
        let margin = 0.25 * (to - from);
        meeting.at += meeting.line * 0.0f64.clamp(from + margin, to - margin);
    }
    if excess(near, task, meeting.at) > REACH || !meeting.at.is_finite() {
        let q = near.frame.local(meeting.at);
        let kept = q.clamp(task.low - REACH, task.high + REACH);
        meeting.at = if kept.is_finite() { near.frame.world(kept) } else { task.mass() };
    }
    meeting
}

/// The features of tasks, where they have any: all of them at once, for the sake of the evaluator.
fn features(near: &Nearby<'_>, tasks: &[Wanted]) -> Result<Vec<Feature>, NoForm> {
    let planes_of_face = |task: &Wanted| task.face.map(|normal| Plane { at: task.mass(), normal });
    let meeting = |task: &Wanted, planes: &[Plane], start| {
        let all = planes.iter().copied().filter(|p| p.normal != DVec3::ZERO).chain(planes_of_face(task));
        confine(near, task, meet(all, start))
    };
    let mut meetings: Vec<Meeting> =
        tasks.iter().map(|task| meeting(task, &task.planes, task.mass())).collect();
    let mut planes: Vec<Plane> = Vec::new();
    let (mut points, mut found) = (Vec::new(), Vec::new());
    for radius in RADII {
        let radius = radius * near.frame.cell;
        points.clear();
        for (task, meeting) in tasks.iter().zip(&meetings) {
            points.extend(task.planes.iter().map(|plane| {
                let way = plane.at - meeting.at;
                let length = way.length();
                if length <= radius { plane.at } else { meeting.at + way * (radius / length) }
            }));
        }
        // Twice, as the first step may still be a long one.
        for _ in 0..2 {
            near.evaluate(&points, &mut found)?;
            planes.clear();
            let faces = tasks.iter().flat_map(|task| task.planes.iter().map(|_| task.face));
            for ((point, (value, gradient)), face) in points.iter_mut().zip(&found).zip(faces) {
                let gradient = face.map_or(*gradient, |n| *gradient - n * n.dot(*gradient));
                let step = gradient * (value / gradient.length_squared());
                let is_known = step.is_finite() && step.length() <= 2.0 * near.frame.cell;
                *point -= if is_known { step } else { DVec3::ZERO };
                planes
                    .push(Plane { at: *point, normal: if is_known { unit(gradient) } else { DVec3::ZERO } });
            }
        }
        let mut rest = &planes[..];
        for (task, met) in tasks.iter().zip(&mut meetings) {
            let (own, after) = rest.split_at(task.planes.len());
            rest = after;
            *met = meeting(task, own, met.at);
        }
    }
    let at: Vec<DVec3> = meetings.iter().map(|m| m.at).collect();
    near.evaluate(&at, &mut found)?;
    let mut rest = &planes[..];
    let feature = |((task, met), (value, gradient)): ((&Wanted, &Meeting), &(f64, DVec3))| {
        let (own, after) = rest.split_at(task.planes.len());
        rest = after;
        let rank = met.rank - usize::from(task.face.is_some()).min(met.rank);
        let distance = value.abs() / gradient.length();
        let is_on = *value == 0.0 || distance <= TOLERANCE * near.frame.cell;
        let normal = own.iter().map(|p| p.normal).sum::<DVec3>();
        Feature { at: met.at, rank, line: met.line, normal: unit(normal), is_on }
    };
    Ok(tasks.iter().zip(&meetings).zip(&found).map(feature).collect())
}

/// Tasks with one plane more, for edges that end in their cell or near to it: that of the third side, which the surface
/// has where the edge would go on. With each the number of the task that it comes from.
fn probes(near: &Nearby<'_>, tasks: &[Wanted], first: &[Feature]) -> Result<Vec<(usize, Wanted)>, NoForm> {
    let (mut owners, mut points, mut found) = (Vec::new(), Vec::new(), Vec::new());
    for (k, (task, feature)) in tasks.iter().zip(first).enumerate() {
        if feature.rank != 2 || task.face.is_some() {
            continue;
        }
        let wider = Wanted { low: task.low - REACH, high: task.high + REACH, ..task.clone() };
        for t in clip(near, &wider, feature.at, feature.line).into_iter().flatten() {
            owners.push(k);
            points.push(feature.at + feature.line * t);
        }
    }
    let mut is_off = vec![false; points.len()];
    for round in 0..3 {
        near.evaluate(&points, &mut found)?;
        for (i, (value, gradient)) in found.iter().enumerate() {
            let step = *gradient * (value / gradient.length_squared());
            if round == 0 {
                is_off[i] = step.length() > 5.0 * TOLERANCE * near.frame.cell;
            }
            if step.is_finite() && step.length() <= 2.0 * near.frame.cell {
                points[i] -= step;
            }
        }
    }
    let mut all: Vec<(usize, Wanted)> = Vec::new();
    for (i, owner) in owners.into_iter().enumerate().filter(|(i, _)| is_off[*i]) {
        let (mut task, normal) = (tasks[owner].clone(), unit(found[i].1));
        if task.planes.iter().all(|p| p.normal.dot(normal) < SMOOTH) {
            task.planes.push(Plane { at: points[i], normal });
            all.push((owner, task));
        }
    }
    Ok(all)
}

/// A task for every two sides of one that has three: their planes alone.
fn pairs_of_sides(task: &Wanted) -> Vec<Wanted> {
    let mut sides: Vec<Vec<Plane>> = Vec::new();
    for plane in &task.planes {
        let near = |side: &&mut Vec<Plane>| side[0].normal.dot(plane.normal) > 0.9;
        match sides.iter_mut().find(near) {
            Some(side) => side.push(*plane),
            None => sides.push(vec![*plane]),
        }
    }
    if sides.len() < 3 {
        return Vec::new();
    }
    let pairs = (0..sides.len()).flat_map(|i| (0..i).map(move |j| [j, i]));
    pairs.map(|[i, j]| Wanted { planes: [&sides[i][..], &sides[j]].concat(), ..task.clone() }).collect()
}

/// Vertices on the features that were found, and on the smooth surface where none was.
fn smooth(near: &Nearby<'_>, wanted: &[Wanted], features: &[Option<Feature>]) -> Result<Vec<Placed>, NoForm> {
    let mut points: Vec<DVec3> =
        wanted.iter().zip(features).map(|(w, f)| f.map_or(w.mass(), |f| f.at)).collect();
    let mut found = Vec::new();
    for _ in 0..3 {
        near.evaluate(&points, &mut found)?;
        for (i, task) in wanted.iter().enumerate().filter(|(i, _)| features[*i].is_none()) {
            let (value, gradient) = found[i];
            let gradient = task.face.map_or(gradient, |n| gradient - n * n.dot(gradient));
            let step = gradient * (value / gradient.length_squared());
            if step.is_finite() && step.length() <= 2.0 * near.frame.cell {
                points[i] -= step;
            }
        }
    }
    near.evaluate(&points, &mut found)?;
    let mut placed = Vec::with_capacity(wanted.len());
    for (i, task) in wanted.iter().enumerate() {
        let (value, gradient) = found[i];
        let singular = unit(gradient) == DVec3::ZERO;
        let mean = unit(task.planes.iter().map(|p| p.normal).sum::<DVec3>());
        let normal = match features[i] {
            Some(feature) if feature.normal != DVec3::ZERO => feature.normal,
            _ if !singular => unit(gradient),
            _ if mean != DVec3::ZERO => mean,
            _ => unit(task.outward),
        };
        let mut one =
            Placed { at: points[i], normal, kind: Kind::Smooth, clamped: false, fallback: false, singular };
        match features[i] {
            Some(feature) => one.kind = if feature.rank == 2 { Kind::Edge } else { Kind::Corner },
            None => {
                let is_near = value.abs() / gradient.length() <= 0.05 * near.frame.cell;
                if !(is_near && excess(near, task, one.at) <= REACH) {
                    (one.at, one.fallback) = (task.mass(), true);
                } else if excess(near, task, one.at) > SLACK {
                    let q = near.frame.local(one.at).clamp(task.low, task.high);
                    (one.at, one.clamped) = (near.frame.world(q), true);
                }
            }
        }
        placed.push(one);
    }
    Ok(placed)
}
