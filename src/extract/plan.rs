//! How a grid is cut so that it fits: into slabs of bricks, and their active bricks into batches.
//!
//! All sizes and counts of the GPU path are computed here. A slab is a box of **own** bricks with a
//! **halo** of one more brick on its upper sides: the cells at the top of an own brick use vertices of the
//! bricks above. The cut is such that a slab's own bricks follow each other in the grid's order (x fastest,
//! then y, then z): they are whole layers, or some rows of one layer, or some bricks of one row. Then
//!
//! - in the order of the box with its halo, all own bricks come first, so that prefix sums over the box
//!   number their vertices without gaps, slab after slab, as in the uncut mesh;
//! - the halo's bricks of one row or layer begin where another slab begins, whose first vertex is known
//!   once all slabs are counted ([`Plan::run_of_halo`]).
//!
//! So a cut grid gives the bytes of the uncut one. A batch is as many active bricks as have their
//! samples in memory at once.

use super::ExtractError;
use crate::grid::{BRICK, Grid};
use crate::stage::cull::Bounds;
use crate::stage::cull::map::BrickMap;
use crate::stage::dispatches;
use crate::stage::params::{Params, Work};
use crate::stage::sample::BRICK_BYTES;
use crate::volume::Scalar;
use glam::UVec3;
use std::collections::BTreeSet;

/// Bytes of active list, counts, list of bricks that make anything, record and partial sums, an active brick.
const SLOT_BYTES: u64 = 4 + 8 + 4 + RECORD_BYTES + 1;
pub(super) const RECORD_BYTES: u64 = size_of::<crate::stage::classify::BrickRecord>() as u64;
/// What a slab leaves to be remembered: its counts, on the GPU and read back, and its place in the mesh.
const SLAB_BYTES: u64 = 2 * size_of::<Work>() as u64 + 32;
/// What a batch takes beside its samples: dispatch arguments, where its bricks that make anything begin, and the settings to count and to emit with.
const BATCH_OWN_BYTES: u64 = dispatches::OF_BATCH + 4 + 2 * size_of::<Params>() as u64;
/// Bricks of the smallest batch.
const LEAST_BATCH: u64 = 64;
/// A slab's vertices (at most 1536 an active brick) and triangles (2560) must be counted in 32 bits.
const MOST_SLOTS: u64 = (u32::MAX / 2560) as u64;
/// Active bricks that there is always room for: all of a grid of 256³ cells.
const LEAST_SLOTS: u32 = 33 * 33 * 33;
/// Samples in memory at once. Where they are more they are taken twice, to count and to emit; few surfaces have that many.
const BATCH_BYTES: u64 = 1 << 30;
/// Rows are not cut finer than this, so that no grid falls apart into a slab a brick.
const LEAST_RUN: u32 = 64;
/// A volume goes to the GPU in pieces of about this size, two of them on their way.
pub(super) const UPLOAD_BYTES: u64 = 8 << 20;

/// A box of a grid's bricks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slab {
    /// Its number, in the grid's order.
    pub(crate) index: usize,
    /// Its first brick.
    pub(crate) first: UVec3,
    /// Bricks along each axis, with the halo.
    pub(crate) extent: UVec3,
    /// Bricks without the halo.
    pub(crate) own_bricks: u32,
    /// First sample point, and number of them along each axis, that a volume's slab needs.
    pub(crate) first_point: UVec3,
    pub(crate) points: UVec3,
}

impl Slab {
    /// Bricks with the halo.
    pub(crate) fn bricks(&self) -> u32 {
        self.extent.element_product()
    }
}

/// The cut of a grid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    grid_bricks: UVec3,
    grid_points: UVec3,
    /// Bricks along each axis that a slab owns, but for the last ones.
    pub(super) own: UVec3,
    /// Slabs along each axis.
    across: UVec3,
    /// Bricks of the largest slab with its halo.
    pub bricks: u32,
    /// Active bricks that there is room for in a slab.
    pub slots: u32,
    /// Bytes of the source buffer: a slab's box of a volume, or a batch of bricks.
    pub source_bytes: u64,
    /// Active bricks a batch.
    pub batch_slots: u32,
    /// Batches of a slab that has as many as there is room for.
    pub batches: u32,
    /// Bytes of the scratch, the source, and for a volume its samples in main memory and those on their
    /// way to the GPU.
    pub bytes: u64,
    /// Bytes of the brick map, a field's lists of boxes, and the scratch of active bricks.
    pub scratch_bytes: u64,
    /// The bytes of the cut that takes the fewest.
    pub least_bytes: u64,
}

/// What limits a plan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits<'a> {
    /// Bytes that the adapter binds at most.
    pub binding: u64,
    /// Bytes for all buffers.
    pub budget: u64,
    /// Bytes that are needed however the grid is cut.
    pub fixed: u64,
    /// The adapter's name, for messages.
    pub adapter: &'a str,
}

/// The most that a slab of a [`Plan`] may be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Most {
    /// Bricks that it owns along each axis.
    pub own: UVec3,
    /// Active bricks.
    pub slots: u32,
}

impl Most {
    /// Anything, with room for so many active bricks of the grid as a surface without many folds has: it grows with
    /// the square of the bricks along an axis.
    pub fn guess(grid: &Grid) -> Self {
        let layer = (grid.brick_count() as f64).powf(2.0 / 3.0);
        Self { own: UVec3::MAX, slots: ((16.0 * layer) as u32).max(LEAST_SLOTS) }
    }

    /// Anything, with room for every brick.
    pub fn all(grid: &Grid) -> Self {
        Self { own: UVec3::MAX, slots: u32::try_from(grid.brick_count()).unwrap_or(u32::MAX) }
    }

    /// Anything, with little room for active bricks: for those who look how many there are before they go on.
    pub fn at_first() -> Self {
        Self { own: UVec3::MAX, slots: LEAST_SLOTS }
    }
}

impl Plan {
    /// Halves the slabs of `grid`, from those that are as large as `most` allows, until they fit. There may be room for
    /// fewer active bricks than `most` says: then a slab that has more must be made smaller.
    ///
    /// # Errors
    /// [`ExtractError::Budget`], [`ExtractError::Binding`] if even the least slab is too much.
    pub(crate) fn new(
        grid: &Grid,
        volume: Option<Scalar>,
        limits: Limits<'_>,
        most: Most,
    ) -> Result<Self, ExtractError> {
        let cuts = || std::iter::successors(Some(most.own.min(grid.bricks())), |&own| finer(own));
        // What is bound and counted limits the active bricks of a slab, which are not known yet, and not all its bricks.
        let slots = most.slots.min((limits.binding / RECORD_BYTES).clamp(1, MOST_SLOTS) as u32);
        let most = Most { slots, ..most };
        let allowed =
            |plan: &Self| plan.largest_binding(volume.is_some()) <= limits.binding && plan.bricks < u32::MAX;
        let limits_of = |budget| Limits { budget, ..limits };
        let with = |own, budget| Self::with_own(grid, volume, limits_of(budget), Most { own, ..most });
        // Not always the finest cut: each slab leaves something to be remembered.
        let least = cuts().map(|own| with(own, 0)).filter(allowed).min_by_key(|plan| plan.bytes);
        let Some(least) = least else {
            let finest = with(cuts().last().unwrap_or(UVec3::ONE), 0);
            return Err(ExtractError::Binding {
                bricks: finest.bricks.into(),
                needed: finest.largest_binding(volume.is_some()),
                limit: limits.binding,
                adapter: limits.adapter.into(),
            });
        };
        let least_bytes = least.bytes;
        if least_bytes > limits.budget {
            let what = "the smallest slab of the grid";
            return Err(ExtractError::Budget { what, needed: least_bytes, budget: limits.budget });
        }
        // Of what the volume leaves, scratch gets half where it can: the rest is the mesh's.
        let fixed = limits.fixed + volume.map_or(0, |scalar| scalar.size() as u64 * grid.point_count());
        let half = fixed.saturating_add(limits.budget.saturating_sub(fixed) / 2);
        let fitting =
            cuts().map(|own| with(own, limits.budget)).filter(allowed).find(|plan| plan.bytes <= half);
        Ok(Self { least_bytes, ..fitting.unwrap_or(least) })
    }

    fn largest_binding(&self, is_volume: bool) -> u64 {
        let bricks = u64::from(self.bricks);
        let of_bricks = if is_volume { 8 * bricks } else { self.box_bytes() };
        let map = 8 * BrickMap::word_count(bricks);
        let largest = self.source_bytes.max(u64::from(self.slots) * RECORD_BYTES).max(of_bricks).max(map);
        // As buffers are padded.
        largest.next_multiple_of(16)
    }

    /// The largest slab's bricks along each axis, with the halo.
    fn extent(&self) -> UVec3 {
        (self.own + 1).min(self.grid_bricks)
    }

    /// Bytes of the lists of boxes of a field's bricks.
    pub(super) fn box_bytes(&self) -> u64 {
        4 * Bounds::list_words(self.extent())
    }

    fn with_own(grid: &Grid, volume: Option<Scalar>, limits: Limits<'_>, most: Most) -> Self {
        let own = most.own;
        let (grid_bricks, grid_points) = (grid.bricks(), grid.points());
        let across = (grid_bricks + own - 1) / own;
        let bricks = bricks_with_halo(grid_bricks, own);
        let slots = bricks.min(most.slots.into());
        let slabs: u64 = across.to_array().map(u64::from).iter().product();
        // The map and its partial sums, and ranges or lists of boxes.
        let map = 8 * BrickMap::word_count(bricks) + bricks / 256;
        let of_bricks =
            if volume.is_some() { 8 * bricks } else { 4 * Bounds::list_words((own + 1).min(grid_bricks)) };
        let scratch = map + of_bricks + (slots + 1) * SLOT_BYTES + slabs * SLAB_BYTES + 4096;
        let (source_bytes, batch_slots, host_bytes) = if let Some(scalar) = volume {
            let size = scalar.size() as u64;
            // The first slab is as large as any along an axis with two, or else the second is, since it has
            // a point below.
            let points = |first: UVec3| {
                let (_, points) = points(grid_points, first, (own + 1).min(grid_bricks));
                points
            };
            let most = points(UVec3::ZERO).max(points(own.min(grid_bricks - 1)));
            let bytes = size * most.to_array().map(u64::from).iter().product::<u64>();
            let bytes = bytes.next_multiple_of(4);
            let row = size * u64::from(most.x);
            let on_their_way = bytes.min(2 * UPLOAD_BYTES.max(4 * row));
            (bytes, slots, size * grid.point_count() + on_their_way)
        } else {
            // The smaller the batches, the more there are of them.
            let own_bytes = slots.div_ceil(LEAST_BATCH) * BATCH_OWN_BYTES;
            let room = limits.budget.saturating_sub(2 * (scratch + own_bytes) + limits.fixed) / 2;
            let bytes = room.min(limits.binding).clamp(LEAST_BATCH * BRICK_BYTES, BATCH_BYTES);
            let of_batch = (bytes / BRICK_BYTES).min(slots);
            (of_batch * BRICK_BYTES, of_batch, 0)
        };
        let batches = slots.div_ceil(batch_slots.max(1));
        let bytes = scratch + batches * BATCH_OWN_BYTES + source_bytes + host_bytes + limits.fixed;
        Self {
            grid_bricks,
            grid_points,
            own,
            across,
            // Where the number saturates, the plan is refused.
            bricks: u32::try_from(bricks).unwrap_or(u32::MAX),
            slots: slots as u32,
            source_bytes,
            batch_slots: u32::try_from(batch_slots).unwrap_or(u32::MAX),
            batches: u32::try_from(batches).unwrap_or(u32::MAX),
            bytes,
            scratch_bytes: map + if volume.is_some() { 0 } else { of_bricks } + (slots + 1) * SLOT_BYTES,
            least_bytes: bytes,
        }
    }

    /// How many slabs there are.
    pub fn slab_count(&self) -> usize {
        self.across.to_array().map(|n| n as usize).iter().product()
    }

    /// The slabs in order.
    pub(crate) fn slabs(&self) -> impl ExactSizeIterator<Item = Slab> + '_ {
        (0..self.slab_count()).map(|index| self.slab(index))
    }

    pub(crate) fn slab(&self, index: usize) -> Slab {
        let [nx, ny, _] = self.across.to_array().map(|n| n as usize);
        let place = [index % nx, index / nx % ny, index / (nx * ny)].map(|i| i as u32);
        let first = UVec3::from(place) * self.own;
        let left = self.grid_bricks - first;
        let own = self.own.min(left);
        let extent = (own + 1).min(left);
        let (first_point, points) = points(self.grid_points, first, extent);
        Slab { index, first, extent, own_bricks: own.element_product(), first_point, points }
    }

    /// Of the bricks one row (`run & 1`) and one layer (`run >> 1`) up from an own brick: in which run of
    /// bricks of the slab's box they lie, and which slab begins with that run.
    ///
    /// A run follows in the grid's order without gaps. Run 0 begins with the own bricks. Only where rows
    /// are cut do the next row and the next layer begin other runs, and where only layers are cut the next
    /// layer does; where neither is, and where there is no next one, it is run 0.
    pub(crate) fn run_of_halo(&self, slab: Slab, run: usize) -> (usize, usize) {
        let [nx, ny, _] = self.across.to_array().map(|n| n as usize);
        let y = if nx > 1 { run & 1 } else { 0 };
        let z = if nx * ny > 1 { run >> 1 } else { 0 };
        let exists = slab.extent.y > y as u32 && slab.extent.z > z as u32;
        if exists { (y + 2 * z, slab.index + nx * (y + ny * z)) } else { (0, slab.index) }
    }

    /// The slabs whose vertices the triangles of `slab` may have: those where a run begins, and the next ones,
    /// which a run may reach into.
    pub(crate) fn slabs_beside(&self, slab: Slab) -> impl Iterator<Item = usize> {
        let first = [0, 1, 2, 3].map(|run| self.run_of_halo(slab, run).1);
        let count = self.slab_count();
        let all = BTreeSet::from_iter(first.into_iter().flat_map(|i| [i, i + 1]));
        all.into_iter().filter(move |&i| i < count)
    }
}

/// The next smaller slab, if there is one: half the layers, of one layer half the rows, of one row half.
pub(super) fn finer(own: UVec3) -> Option<UVec3> {
    if own.z > 1 {
        Some(UVec3::new(own.x, own.y, own.z.div_ceil(2)))
    } else if own.y > 1 {
        Some(UVec3::new(own.x, own.y.div_ceil(2), 1))
    } else if own.x > LEAST_RUN {
        Some(UVec3::new(own.x.div_ceil(2).max(LEAST_RUN), 1, 1))
    } else {
        None
    }
}

fn bricks_with_halo(grid_bricks: UVec3, own: UVec3) -> u64 {
    (own + 1).min(grid_bricks).to_array().map(u64::from).iter().fold(1, |n, &m| n.saturating_mul(m))
}

/// First point and number of points along each axis that bricks from `first` on read: their own, the
/// next, and one more on either side for central differences.
fn points(grid_points: UVec3, first: UVec3, extent: UVec3) -> (UVec3, UVec3) {
    let from = (first * BRICK).saturating_sub(UVec3::ONE);
    let to = ((first + extent) * BRICK + 2).min(grid_points);
    (from, to - from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Anything, with room for every brick.
    const ANY: Most = Most { own: UVec3::MAX, slots: u32::MAX };

    /// Every brick's number in the grid.
    fn own_bricks(plan: &Plan, slab: Slab) -> Vec<u64> {
        let b = plan.grid_bricks.as_u64vec3();
        let own = slab.own_bricks / (slab.extent.x.min(plan.own.x) * slab.extent.y.min(plan.own.y)).max(1);
        let counts = UVec3::new(plan.own.x, plan.own.y, own).min(plan.grid_bricks - slab.first);
        let mut found = Vec::new();
        for z in 0..counts.z {
            for y in 0..counts.y {
                for x in 0..counts.x {
                    let at = (slab.first + UVec3::new(x, y, z)).as_u64vec3();
                    found.push(at.x + b.x * (at.y + b.y * at.z));
                }
            }
        }
        assert_eq!(found.len(), slab.own_bricks as usize);
        found
    }

    /// Every cut of a grid: own bricks in the grid's order, first in their box; halos one brick; what
    /// follows in the halo's rows and layers is where another slab begins.
    #[test]
    fn slabs_cover_every_brick_once_and_in_order() {
        let grid = Grid::from_bounds([1600, 17, 20], Vec3::ZERO, Vec3::ONE).unwrap();
        let limits = Limits { binding: u64::MAX, budget: u64::MAX, fixed: 0, adapter: "" };
        let mut own = grid.bricks();
        let mut cuts = 0;
        loop {
            let plan = Plan::new(&grid, Some(Scalar::F32), limits, Most { own, slots: u32::MAX }).unwrap();
            assert_eq!(plan.own, own);
            let mut next = 0;
            for slab in plan.slabs() {
                for brick in own_bricks(&plan, slab) {
                    assert_eq!(brick, next);
                    next += 1;
                }
                assert!(slab.bricks() <= plan.bricks);
                let bytes = 4 * slab.points.to_array().map(u64::from).iter().product::<u64>();
                assert!(bytes <= plan.source_bytes);
                for run in 0..4 {
                    let (found, beside) = plan.run_of_halo(slab, run);
                    let up = UVec3::new(0, found as u32 & 1, found as u32 >> 1);
                    assert_eq!(plan.slab(beside).first, slab.first + up);
                    let cut = UVec3::new(0, u32::from(own.x < 201), u32::from(own.x < 201 || own.y < 3));
                    let wanted = UVec3::new(0, run as u32 & 1, run as u32 >> 1) * cut;
                    if (slab.first + wanted).cmplt(grid.bricks()).all() {
                        assert_eq!(up, wanted);
                    }
                }
            }
            assert_eq!(next, grid.brick_count());
            cuts += 1;
            match finer(own) {
                Some(finer) => own = finer,
                None => break,
            }
        }
        assert_eq!(own, UVec3::new(LEAST_RUN, 1, 1));
        assert!(cuts > 5, "{cuts}");
    }

    #[test]
    fn a_grid_of_any_shape_is_cut_to_fit() {
        let limits = Limits { binding: 128 << 20, budget: 1 << 40, fixed: 0, adapter: "" };
        for cells in [[6000, 6000, 8], [8, 60_000, 6000], [1 << 20, 40, 9], [3000; 3]] {
            let grid = Grid::from_bounds(cells, Vec3::ZERO, Vec3::ONE).unwrap();
            let plan = Plan::new(&grid, Some(Scalar::F32), limits, ANY).unwrap();
            assert!(plan.largest_binding(true) <= limits.binding, "{cells:?}");
            assert!(plan.slab_count() > 1, "{cells:?}");
            // A field has no samples of its own, and room for as many active bricks as are bound.
            let plan = Plan::new(&grid, None, limits, ANY).unwrap();
            assert!(plan.largest_binding(false) <= limits.binding, "{cells:?}");
            assert_eq!(plan.slab_count(), 1, "{cells:?}");
            assert!(plan.slots < plan.bricks);
        }
    }

    /// What is named suffices, whatever was asked for first; batches count with what they take themselves.
    #[test]
    fn the_least_need_is_one_figure() {
        let with = |cells, volume, budget| {
            let grid = Grid::from_bounds(cells, Vec3::ZERO, Vec3::ONE).unwrap();
            Plan::new(&grid, volume, Limits { binding: 1 << 31, budget, fixed: 0, adapter: "" }, ANY)
        };
        // Of the last one the finest cut is not the smallest: it has so many slabs.
        for cells in [[64; 3], [400, 30, 9], [5000, 100, 900], [1 << 20, 100, 100]] {
            for volume in [None, Some(Scalar::F32), Some(Scalar::U8)] {
                let least = with(cells, volume, u64::MAX).unwrap().least_bytes;
                for budget in [0, least / 2, least - 1] {
                    let found = with(cells, volume, budget);
                    assert!(matches!(found, Err(ExtractError::Budget { needed, .. }) if needed == least));
                }
                for budget in [least, least + least / 3, 2 * least, 5 * least] {
                    let plan = with(cells, volume, budget).unwrap();
                    assert!(
                        plan.bytes <= budget && plan.least_bytes == least,
                        "{cells:?}, {budget}: {plan:?}"
                    );
                    let settings = u64::from(plan.batches) * (3 * 12 + 4 + 2 * size_of::<Params>() as u64);
                    let bricks = u64::from(plan.bricks);
                    let slabs = plan.slab_count() as u64 * SLAB_BYTES;
                    let scratch = bricks / 4 + u64::from(plan.slots) * SLOT_BYTES + slabs + 4096;
                    assert!(plan.bytes >= plan.source_bytes + scratch + settings, "{plan:?}");
                }
            }
        }
        let grid = Grid::from_bounds([1 << 20, 100, 100], Vec3::ZERO, Vec3::ONE).unwrap();
        let limits = Limits { binding: 1 << 31, budget: 0, fixed: 0, adapter: "" };
        let finest = Plan::with_own(&grid, None, limits, Most { own: UVec3::new(LEAST_RUN, 1, 1), ..ANY });
        assert!(with([1 << 20, 100, 100], None, u64::MAX).unwrap().least_bytes < finest.bytes);
    }

    #[test]
    fn too_little_is_an_error_with_the_need() {
        let grid = Grid::from_bounds([64; 3], Vec3::ZERO, Vec3::ONE).unwrap();
        let limits = Limits { binding: u64::MAX, budget: 1000, fixed: 0, adapter: "" };
        assert!(
            matches!(Plan::new(&grid, Some(Scalar::F32), limits, ANY), Err(ExtractError::Budget { needed, .. }) if needed > 1000)
        );
        let limits = Limits { binding: 1000, budget: u64::MAX, fixed: 0, adapter: "" };
        assert!(matches!(
            Plan::new(&grid, Some(Scalar::F32), limits, ANY),
            Err(ExtractError::Binding { .. })
        ));
    }
}
