//! Where vertices go: onto the surface, with their normals; twin of `shaders/refine/tasks.wgsl` and `place.wgsl`.

use super::Settings;
use super::split::dot;
use crate::field::unit::{has_direction, length, unit};
use crate::field::{NoForm, Search, Surface, search};
use crate::mesh::Vertex;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::AddAssign;

/// Vertices that one task places.
const TASK: usize = 512;
/// How far a midpoint may move, and a start vertex, in parts of its edge or its longest edge.
const REACH: f32 = 0.5;

/// The cosine of the angle between the normals at an edge's ends from which on a crease is expected.
const CREASE: f32 = 0.7;

/// How placing went.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    pub projected: u64,
    pub not_converged: u64,
    pub singular: u64,
    pub taken_back: u64,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.projected += other.projected;
        self.not_converged += other.not_converged;
        self.singular += other.singular;
        self.taken_back += other.taken_back;
    }
}

/// A vertex that is to be placed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task {
    search: Search,
    /// What it is if it finds no place: the start, with a normal from its neighbours (0 if they say nothing).
    pub fallback: Vertex,
}

impl Task {
    /// A vertex of the start mesh, whose longest edge is `longest`.
    pub(super) fn of_start(settings: &Settings, vertex: &Vertex, longest: f32) -> Self {
        let p = vertex.at();
        let search = Search::new(p, longest * REACH, settings.epsilon).with_free(settings.free(p, p));
        let search = search.with_step(settings.step.unwrap_or(f32::MAX));
        Self { search, fallback: *vertex }
    }

    /// The midpoint of an edge. The surface may bulge over it like an arc that meets the normals at its ends.
    pub(super) fn of_middle(settings: &Settings, a: &Vertex, b: &Vertex) -> Self {
        let (p, q) = (a.at(), b.at());
        let middle = p * 0.5 + q * 0.5;
        let edge = length(q - p);
        let sum = Vec3::from(a.normal) + Vec3::from(b.normal);
        let direction = if has_direction(sum) { unit(sum) } else { Vec3::from(a.normal) };
        // cos and tan of a half and a quarter of the angle between the normals.
        let cos = length(sum) * 0.5;
        let cos = if cos < 1.0 { cos } else { 1.0 };
        let tan = ((1.0 - cos) / (1.0 + cos)).sqrt();
        let guess = (edge * 0.625) * tan;
        let hint = direction * if guess > settings.epsilon { guess } else { settings.epsilon };
        let free = settings.free(p, q);
        let start = middle + towards_crease(a, b, edge) * free;
        let search = Search::new(start, edge * REACH, settings.epsilon).with_hint(hint).with_free(free);
        let search = search.with_step(settings.step.unwrap_or(f32::MAX));
        Self { search, fallback: Vertex { position: middle.into(), normal: direction.into() } }
    }
}

/// From the middle of an edge to the nearest point of the line where the tangent planes at its ends meet, if they
/// meet at a large angle: there lies the sharp edge of a solid that the edge runs across. Goes along the edge by a part
/// only, so that no end is reached.
fn towards_crease(a: &Vertex, b: &Vertex, edge: f32) -> Vec3 {
    let (n, m) = (Vec3::from(a.normal), Vec3::from(b.normal));
    let cos = dot(n, m);
    if !(cos < CREASE && cos > -0.99 && edge > 0.0) {
        return Vec3::ZERO;
    }
    let half = (b.at() - a.at()) * 0.5;
    // n · x = n · (a − middle), m · x = m · (b − middle), x in the plane of both normals.
    let (to_a, to_b) = (-dot(n, half), dot(m, half));
    let rest = 1.0 - cos * cos;
    let x = n * ((to_a - cos * to_b) / rest) + m * ((to_b - cos * to_a) / rest);
    let direction = half / (edge * 0.5);
    let along = dot(x, direction);
    let across = x - direction * along;
    let (most_along, most_across) = (edge * 0.3, edge * REACH);
    let along = if along > most_along {
        most_along
    } else if along < -most_along {
        -most_along
    } else {
        along
    };
    let far = length(across);
    let across = if far > most_across { across * (most_across / far) } else { across };
    direction * along + across
}

/// Places all, and says of each whether it lies on the surface now.
///
/// A vertex whose normal there points away from that of its fallback has reached another sheet of the surface, and
/// is taken back; so is one that has left the box of the border.
pub(super) fn place(
    surface: &Surface<'_>,
    settings: &Settings,
    tasks: &[Task],
    vertices: &mut [Vertex],
    placed: &mut [bool],
) -> Result<Tally, NoForm> {
    let chunks = tasks.par_chunks(TASK).zip(vertices.par_chunks_mut(TASK)).zip(placed.par_chunks_mut(TASK));
    let tallies = chunks.map(|((tasks, vertices), placed)| {
        let mut searches: Vec<Search> = tasks.iter().map(|task| task.search).collect();
        search(surface, &mut searches)?;
        let points: Vec<Vec3> = searches.iter().map(|search| search.at).collect();
        let mut gradients = vec![Vec3::ZERO; points.len()];
        surface.gradients(&points, &mut gradients)?;
        let mut tally = Tally::default();
        for (i, vertex) in vertices.iter_mut().enumerate() {
            let (fallback, gradient) = (tasks[i].fallback, gradients[i]);
            let expected = Vec3::from(fallback.normal);
            let (is_singular, converged) = (!has_direction(gradient), searches[i].converged());
            tally.singular += u64::from(is_singular);
            tally.not_converged += u64::from(!converged);
            let normal = if is_singular { expected } else { unit(gradient) };
            let is_astray = converged && (dot(normal, expected) < 0.0 || !settings.holds(points[i]));
            tally.taken_back += u64::from(is_astray);
            placed[i] = converged && !is_astray;
            tally.projected += u64::from(placed[i]);
            *vertex = if placed[i] {
                Vertex { position: points[i].into(), normal: normal.into() }
            } else {
                fallback
            };
        }
        Ok(tally)
    });
    let sum = |mut a: Tally, b: Tally| {
        a += b;
        Ok(a)
    };
    tallies.try_reduce(Tally::default, sum)
}
