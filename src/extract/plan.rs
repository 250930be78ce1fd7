//! How a grid is cut so that it fits: into slabs of brick layers, and their active bricks into batches.
//!
//! All sizes and counts of the GPU path are computed here. A slab is a run of whole layers of bricks
//! (z), with the next layer as its **halo**: cells at the slab's top use vertices of the halo's bricks.
//! Since bricks are numbered with z slowest, the halo's bricks come next after the slab's own, and the
//! prefix sums over both give the halo's vertices the numbers they have in the whole mesh. So a cut grid
//! gives the bytes of the uncut one. A batch is as many active bricks as have their samples in
//! memory at once.

use super::ExtractError;
use crate::grid::{BRICK, Grid};
use crate::stage::sample::BRICK_BYTES;

/// Bytes of marks, brick map, active list, record, counts and range, a brick.
const SCRATCH_BYTES: u64 = 8 + 4 + 4 + RECORD_BYTES + 8 + 8;
const RECORD_BYTES: u64 = size_of::<crate::stage::classify::BrickRecord>() as u64;
/// A slab's vertices (at most 1536 a brick) and triangles (2560) must be counted in 32 bits.
const MOST_BRICKS: u64 = (u32::MAX / 2560) as u64;
/// Samples in memory at once beyond which more gain nothing.
const BATCH_BYTES: u64 = 512 << 20;

/// Some layers of a grid's bricks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slab {
    /// First brick, and first layer.
    pub first_brick: u32,
    /// Bricks without and with the halo.
    pub own_bricks: u32,
    /// Bricks with the halo layer.
    pub bricks: u32,
    /// Planes of samples (z) that a volume's slab needs: from, and up to but without.
    pub planes: (u32, u32),
}

/// The cut of a grid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// The slabs in order.
    pub slabs: Vec<Slab>,
    /// Bricks of the largest slab with its halo.
    pub bricks: u32,
    /// Bytes of the source buffer: a slab's planes of a volume, or a batch of bricks.
    pub source_bytes: u64,
    /// Active bricks a batch.
    pub batch_slots: u32,
    /// Batches of the largest slab.
    pub batches: u32,
    /// Bytes of all scratch and the source.
    pub bytes: u64,
}

/// What limits a plan.
#[derive(Debug, Clone, Copy)]
pub struct Limits<'a> {
    /// Bytes that the adapter binds at most.
    pub binding: u64,
    /// Bytes for all buffers.
    pub budget: u64,
    /// The adapter's name, for messages.
    pub adapter: &'a str,
}

impl Plan {
    /// Cuts `grid` into as few slabs as the limits and `most_layers` allow.
    ///
    /// # Errors
    /// [`ExtractError::Budget`], [`ExtractError::Binding`] if even a slab of one layer is too much.
    pub fn new(
        grid: &Grid,
        is_volume: bool,
        limits: Limits<'_>,
        most_layers: u32,
    ) -> Result<Self, ExtractError> {
        let layers = grid.bricks().z;
        let mut tried = layers.min(most_layers.max(1));
        loop {
            let plan = Self::with_layers(grid, is_volume, limits, tried);
            let largest = plan.largest_binding();
            // Scratch gets half of the budget where it can: the rest is the mesh's.
            let budget = if tried > 1 { limits.budget / 2 } else { limits.budget };
            let fits =
                largest <= limits.binding && plan.bytes <= budget && u64::from(plan.bricks) <= MOST_BRICKS;
            if fits {
                return Ok(plan);
            }
            if tried > 1 {
                tried = tried.div_ceil(2);
                continue;
            }
            if plan.bytes > limits.budget {
                let what = "the smallest slab of the grid";
                return Err(ExtractError::Budget { what, needed: plan.bytes, budget: limits.budget });
            }
            return Err(ExtractError::Binding {
                bricks: plan.bricks.into(),
                needed: largest,
                limit: limits.binding,
                adapter: limits.adapter.into(),
            });
        }
    }

    fn largest_binding(&self) -> u64 {
        self.source_bytes.max(u64::from(self.bricks) * RECORD_BYTES)
    }

    fn with_layers(grid: &Grid, is_volume: bool, limits: Limits<'_>, layers_each: u32) -> Self {
        let (bricks, points) = (grid.bricks(), grid.points());
        let layer = bricks.x * bricks.y;
        let mut slabs = Vec::new();
        for first in (0..bricks.z).step_by(layers_each as usize) {
            let own = layers_each.min(bricks.z - first);
            let with_halo = (own + 1).min(bricks.z - first);
            // One plane below and one above for central differences.
            let from = (first * BRICK).saturating_sub(1);
            let to = ((first + with_halo) * BRICK + 2).min(points.z);
            slabs.push(Slab {
                first_brick: first * layer,
                own_bricks: own * layer,
                bricks: with_halo * layer,
                planes: (from, to),
            });
        }
        let most = slabs.iter().map(|s| s.bricks).max().unwrap_or(0);
        let scratch = (u64::from(most) + 1) * SCRATCH_BYTES + u64::from(most) / 8 + 4096;
        let planes = slabs.iter().map(|s| s.planes.1 - s.planes.0).max().unwrap_or(0);
        let (source_bytes, batch_slots) = if is_volume {
            (4 * u64::from(points.x) * u64::from(points.y) * u64::from(planes), most)
        } else {
            let room = limits.budget.saturating_sub(2 * scratch) / 2;
            let bytes = room.min(limits.binding).clamp(64 * BRICK_BYTES, BATCH_BYTES);
            let slots = (bytes / BRICK_BYTES).min(u64::from(most)) as u32;
            (u64::from(slots) * BRICK_BYTES, slots)
        };
        Self {
            bricks: most,
            source_bytes,
            batch_slots,
            batches: most.div_ceil(batch_slots.max(1)),
            bytes: scratch + source_bytes,
            slabs,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn slabs_cover_every_brick_once_and_halos_overlap() {
        let grid = Grid::from_bounds([40, 17, 90], Vec3::ZERO, Vec3::ONE).unwrap();
        for layers in 1..14 {
            let limits = Limits { binding: u64::MAX, budget: u64::MAX, adapter: "" };
            let plan = Plan::new(&grid, true, limits, layers).unwrap();
            let mut next = 0;
            for slab in &plan.slabs {
                assert_eq!(slab.first_brick, next);
                next += slab.own_bricks;
                let more = next < grid.brick_count() as u32;
                assert_eq!(slab.bricks - slab.own_bricks, if more { 6 * 3 } else { 0 });
            }
            assert_eq!(u64::from(next), grid.brick_count());
        }
    }

    #[test]
    fn too_little_is_an_error_with_the_need() {
        let grid = Grid::from_bounds([64; 3], Vec3::ZERO, Vec3::ONE).unwrap();
        let limits = Limits { binding: u64::MAX, budget: 1000, adapter: "" };
        assert!(
            matches!(Plan::new(&grid, true, limits, 99), Err(ExtractError::Budget { needed, .. }) if needed > 1000)
        );
        let limits = Limits { binding: 1000, budget: u64::MAX, adapter: "" };
        assert!(matches!(Plan::new(&grid, true, limits, 99), Err(ExtractError::Binding { .. })));
    }
}
