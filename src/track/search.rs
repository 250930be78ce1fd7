//! Seeds by intervals (Duff 1992): boxes without surface are dropped with a proof, those that may hold some are divided.

use super::seeds::{Span, bricks_of, from_lattice};
use super::{Probe, SearchReport, Starts, TrackError, corners};
use crate::extract::{ExtractError, Source};
use crate::field::{Field, Within};
use crate::grid::BRICK;
use crate::stage::cull::bounds::{can_cross, region_of_cells};
use crate::stage::params::Params;
use glam::UVec3;
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Cells along the edge of boxes from which on one thread goes through all that is within.
const SHARED: u32 = 64;
/// Cells along the edge of the smallest boxes that fields are pruned for.
const PRUNED: u32 = 16;
/// Boxes whose corners are looked at together.
const TOGETHER: usize = 1 << 13;

/// What is needed in every box.
struct Search<'a> {
    params: &'a Params,
    /// Cells along the smallest boxes, a power of two.
    side: u32,
    /// Bytes that open boxes may take.
    budget: u64,
    open: AtomicU64,
}

/// Looks for bricks with surface in the whole grid, down to boxes of `cells`.
pub(super) fn search(
    source: &Source<'_>,
    params: &Params,
    cells: u32,
    budget: u64,
    probe: Probe<'_>,
    starts: &mut Starts,
) -> Result<SearchReport, TrackError> {
    let grid = source.grid();
    let field = match source {
        Source::Field(field, _) if has_intervals(params, *field, cells) => *field,
        _ => {
            from_lattice(grid, cells, budget, probe, starts)?;
            return Ok(SearchReport { cells, ..SearchReport::default() });
        }
    };
    let whole = grid.cells().max_element().next_power_of_two();
    let side = (1 << cells.ilog2()).min(whole);
    let search = Search { params, side, budget, open: 0.into() };
    let (empty, open) = search.descend(field, None, UVec3::ZERO, whole);
    let needed = search.open.into_inner() * size_of::<UVec3>() as u64;
    if needed > budget {
        let what = "the boxes of the search that may hold surface";
        return Err(ExtractError::Budget { what, needed, budget }.into());
    }
    let mut report = SearchReport { cells: side, empty, by_intervals: true, ..SearchReport::default() };
    for boxes in open.chunks(TOGETHER) {
        let all: Vec<[UVec3; 8]> =
            boxes.iter().map(|&first| corners(first, (first + side).min(grid.cells()))).collect();
        let bits = probe(all.as_flattened())?;
        let mut spans = Vec::new();
        for ((&first, corners), bits) in boxes.iter().zip(&all).zip(bits.chunks_exact(8)) {
            match crossed(corners, bits) {
                Some(span) => spans.push(span),
                None => starts.open.push(first),
            }
        }
        report.crossed += spans.len() as u64;
        starts.bricks.extend(bricks_of(grid, spans, probe)?);
    }
    Ok(report)
}

/// Whether the field knows anything of any box: of two as small as are asked for.
fn has_intervals(params: &Params, field: &dyn Field, cells: u32) -> bool {
    let middle = UVec3::from(params.points) / 2;
    let known = |first: UVec3| {
        let end = first.saturating_add(UVec3::splat(cells));
        field.range(region_of_cells(params, first, end)).is_bounded()
    };
    known(UVec3::ZERO) || known(middle)
}

/// An edge of a box between whose ends the surface is crossed.
fn crossed(corners: &[UVec3; 8], bits: &[bool]) -> Option<Span> {
    let edges = (0..3).flat_map(|axis| (0..8).map(move |k: usize| (axis, k, k | 1 << axis)));
    let (axis, a, b) = edges.into_iter().find(|&(_, a, b)| a != b && bits[a] != bits[b])?;
    Some(Span { from: corners[a], axis, length: corners[b][axis] - corners[a][axis], inside: bits[a] })
}

/// How many boxes are not decided yet once these bricks are reached, all of whose samples were looked at.
pub(super) fn undecided(params: &Params, side: u32, open: &[UVec3], reached: &HashSet<u32>) -> u64 {
    let [nx, ny, _] = params.slab_extent;
    let cells = UVec3::from(params.points) - 1;
    let is_reached = |first: &UVec3| {
        let low = *first / BRICK;
        let high = ((*first + side).min(cells) - 1) / BRICK;
        let mut bricks = (low.z..=high.z)
            .flat_map(|z| (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| [x, y, z])));
        bricks.all(|[x, y, z]| reached.contains(&(x + nx * (y + ny * z))))
    };
    if side == 1 {
        return open.len() as u64;
    }
    open.par_iter().filter(|first| !is_reached(first)).count() as u64
}

impl Search<'_> {
    /// How many boxes within this one are empty, and the smallest ones that may not be, in order.
    fn descend(
        &self,
        field: &dyn Field,
        pruned: Option<&Arc<dyn Field>>,
        first: UVec3,
        side: u32,
    ) -> (u64, Vec<UVec3>) {
        let cells = UVec3::from(self.params.points) - 1;
        if first.cmpge(cells).any() {
            return (0, Vec::new());
        }
        let region = region_of_cells(self.params, first, first + side);
        let within = if side > self.side && side >= PRUNED {
            field.within(region)
        } else {
            Within { range: field.range(region), field: None }
        };
        if !can_cross(self.params, within.range) {
            return (1, Vec::new());
        }
        if side == self.side {
            self.open.fetch_add(1, Ordering::Relaxed);
            return (0, vec![first]);
        }
        // Over the budget there is no use in going on.
        if self.open.load(Ordering::Relaxed) > self.budget / size_of::<UVec3>() as u64 {
            return (0, Vec::new());
        }
        let pruned = within.field.as_ref().or(pruned);
        let field = pruned.map_or(field, |field| &**field);
        let of_part = |k: u32| {
            let up = UVec3::new(k & 1, k >> 1 & 1, k >> 2);
            self.descend(field, pruned, first + up * (side / 2), side / 2)
        };
        let joined = |mut a: (u64, Vec<UVec3>), b: (u64, Vec<UVec3>)| {
            a.1.extend(b.1);
            (a.0 + b.0, a.1)
        };
        if side > SHARED {
            let parts: Vec<_> = (0..8u32).into_par_iter().map(of_part).collect();
            parts.into_iter().fold(Default::default(), joined)
        } else {
            (0..8).map(of_part).fold(Default::default(), joined)
        }
    }
}
