//! From seed points, and from a coarse lattice, to crossed edges of the grid.

use super::{Edge, Missed, Probe, Starts, TrackError, Why, corners};
use crate::extract::ExtractError;
use crate::grid::Grid;
use glam::{IVec3, UVec3, Vec3};

/// Points of a line that are looked at together.
const LINE: u32 = 256;
/// Points of a lattice that are looked at together, if a plane has not more.
const LATTICE: usize = 1 << 16;
/// The ways from a seed, up first.
const WAYS: [IVec3; 6] = [IVec3::Z, IVec3::NEG_Z, IVec3::X, IVec3::NEG_X, IVec3::Y, IVec3::NEG_Y];

/// A part of a grid line whose ends lie on different sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    pub(super) from: UVec3,
    pub(super) axis: usize,
    pub(super) length: u32,
    /// Whether `from` is inside.
    pub(super) inside: bool,
}

/// The crossed edges that the points lead to, and the points that lead to none.
pub(super) fn from_points(
    grid: &Grid,
    points: &[Vec3],
    probe: Probe<'_>,
    starts: &mut Starts,
) -> Result<Vec<Missed>, TrackError> {
    let mut missed = Vec::new();
    let mut walks = Vec::new();
    for (seed, &point) in points.iter().enumerate() {
        if !point.is_finite() {
            return Err(TrackError::SeedNotFinite { seed, point });
        }
        let away = point.as_dvec3() - grid.origin().as_dvec3();
        let place = grid.step().as_dmat3().inverse() * away;
        let cells = grid.cells().as_dvec3();
        // A point of the border, given in decimals, is not outside. (`!` also catches NaN.)
        let slack = 1e-3;
        if !(place.cmpge(glam::DVec3::splat(-slack)).all() && place.cmple(cells + slack).all()) {
            missed.push(Missed { seed, point, why: Why::Outside });
            continue;
        }
        let cell = place.floor().max(glam::DVec3::ZERO).min(cells - 1.0).as_uvec3();
        let nearest = place.round().max(glam::DVec3::ZERO).min(cells).as_uvec3();
        walks.push(Walk { seed, cell, from: nearest, way: 0, at: nearest, inside: false });
    }

    let around: Vec<UVec3> =
        walks.iter().flat_map(|w| corners(w.cell, w.cell + 1).into_iter().chain([w.from])).collect();
    let bits = probe(&around)?;
    let mut found = bits.chunks_exact(9);
    walks.retain_mut(|walk| {
        let Some(bits) = found.next() else { return true };
        walk.inside = bits[8];
        let before = starts.edges.len();
        for (axis, corner) in (0..3).flat_map(|axis| (0..8).map(move |corner| (axis, corner))) {
            let next = corner | 1 << axis;
            if corner != next && bits[corner] != bits[next] {
                starts.edges.push(Edge { point: corners(walk.cell, walk.cell + 1)[corner], axis });
            }
        }
        starts.edges.len() == before
    });

    // All walks go on together, a piece of a line at a time.
    while !walks.is_empty() {
        let lines: Vec<Vec<UVec3>> = walks.iter().map(|walk| walk.ahead(grid)).collect();
        let bits = probe(&lines.concat())?;
        let mut first = 0;
        let mut lines = lines.into_iter();
        walks.retain_mut(|walk| {
            let line = lines.next().unwrap_or_default();
            let bits = &bits[first..first + line.len()];
            first += line.len();
            if let Some(crossed) = bits.iter().position(|&inside| inside != walk.inside) {
                let before = if crossed == 0 { walk.at } else { line[crossed - 1] };
                let axis = (0..3).find(|&axis| WAYS[walk.way][axis] != 0).unwrap_or(0);
                starts.edges.push(Edge { point: before.min(line[crossed]), axis });
                return false;
            }
            match line.last() {
                Some(&last) => walk.at = last,
                None if walk.way + 1 < WAYS.len() => (walk.way, walk.at) = (walk.way + 1, walk.from),
                None => {
                    missed.push(Missed { seed: walk.seed, point: points[walk.seed], why: Why::NoSurface });
                    return false;
                }
            }
            true
        });
    }
    missed.sort_by_key(|m| m.seed);
    Ok(missed)
}

/// A seed on its way.
struct Walk {
    seed: usize,
    cell: UVec3,
    from: UVec3,
    way: usize,
    at: UVec3,
    /// Whether `from`, and so everything up to `at`, is inside.
    inside: bool,
}

impl Walk {
    /// The next points on the way; none at the border.
    fn ahead(&self, grid: &Grid) -> Vec<UVec3> {
        let way = WAYS[self.way];
        let last = grid.cells().as_ivec3();
        let next = (1..=LINE as i32).map(|i| self.at.as_ivec3() + way * i);
        next.take_while(|p| p.cmpge(IVec3::ZERO).all() && p.cmple(last).all()).map(|p| p.as_uvec3()).collect()
    }
}

/// The bricks that a coarse lattice finds.
pub(super) fn from_lattice(
    grid: &Grid,
    step: u32,
    budget: u64,
    probe: Probe<'_>,
    starts: &mut Starts,
) -> Result<(), TrackError> {
    let axes = grid.cells().to_array().map(|cells| {
        let mut places: Vec<u32> = (0..cells).step_by(step as usize).collect();
        places.push(cells);
        places
    });
    let [nx, ny, nz] = [axes[0].len(), axes[1].len(), axes[2].len()];
    // Its points, which are inside, and which of the plane before are.
    let needed = nx as u64 * ny as u64 * (size_of::<UVec3>() as u64 + 2);
    if needed > budget {
        let what = "a plane of the coarse lattice";
        return Err(ExtractError::Budget { what, needed, budget }.into());
    }
    let plane = nx * ny;
    let planes = (LATTICE / plane).max(1);
    // The last plane of the planes before, which has been looked at.
    let mut before: Vec<bool> = Vec::new();
    for first in (0..nz).step_by(planes) {
        let end = (first + planes).min(nz);
        let points: Vec<UVec3> = (first..end)
            .flat_map(|z| (0..plane).map(move |i| (i, z)))
            .map(|(i, z)| UVec3::new(axes[0][i % nx], axes[1][i / nx], axes[2][z]))
            .collect();
        let bits = probe(&points)?;
        let mut spans = Vec::new();
        for (i, (&point, &inside)) in points.iter().zip(&bits).enumerate() {
            let (x, y, z) = (i % nx, i / nx % ny, first + i / plane);
            let mut look = |there: bool, other: Option<&bool>, axis: usize, place: usize| {
                if there && other.is_some_and(|&other| other != inside) {
                    let mut from = point;
                    from[axis] = axes[axis][place - 1];
                    let length = point[axis] - from[axis];
                    spans.push(Span { from, axis, length, inside: !inside });
                }
            };
            look(x > 0, bits.get(i.wrapping_sub(1)), 0, x);
            look(y > 0, bits.get(i.wrapping_sub(nx)), 1, y);
            let below = if i >= plane { bits.get(i - plane) } else { before.get(i) };
            look(z > 0, below, 2, z);
        }
        starts.bricks.extend(bricks_of(grid, spans, probe)?);
        before = bits[bits.len() - plane..].to_vec();
    }
    Ok(())
}

/// The owners of a crossed edge of each span, found by bisection: sorted, each once.
pub(super) fn bricks_of(grid: &Grid, mut spans: Vec<Span>, probe: Probe<'_>) -> Result<Vec<u32>, TrackError> {
    loop {
        let middle = |span: &Span| {
            let mut point = span.from;
            point[span.axis] += span.length / 2;
            point
        };
        let points: Vec<UVec3> = spans.iter().filter(|s| s.length > 1).map(middle).collect();
        if points.is_empty() {
            break;
        }
        let bits = probe(&points)?;
        for (span, inside) in spans.iter_mut().filter(|s| s.length > 1).zip(bits) {
            let half = span.length / 2;
            if inside == span.inside {
                span.from[span.axis] += half;
                span.length -= half;
            } else {
                span.length = half;
            }
        }
    }
    let mut bricks: Vec<u32> = spans.iter().map(|span| brick_of(grid, span.from)).collect();
    bricks.sort_unstable();
    bricks.dedup();
    Ok(bricks)
}

/// The brick that owns a point.
pub(super) fn brick_of(grid: &Grid, point: UVec3) -> u32 {
    let (b, n) = (point / crate::grid::BRICK, grid.bricks());
    b.x + n.x * (b.y + n.y * b.z)
}
