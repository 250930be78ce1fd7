//! Why a track failed.

use super::Missed;
use crate::extract::ExtractError;
use crate::field::NoForm;
use crate::gpu::GpuError;
use glam::Vec3;

/// Why a track failed.
#[derive(Debug, Clone, thiserror::Error)]
pub enum TrackError {
    /// As in an extraction.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// A method that cuts cells in tetrahedra.
    #[error(
        "the tracker follows cubes: take marching cubes or its topologically correct form, or extract the whole grid"
    )]
    Method,
    /// No point, no coarse step and no search.
    #[error("there is nothing to start from: give a seed point, a coarse step or a search size")]
    NoSeeds,
    /// A seed point with NaN or infinity.
    #[error("seed {seed} is {point}: give finite numbers")]
    SeedNotFinite {
        /// Its place among the points.
        seed: usize,
        /// What it is.
        point: Vec3,
    },
    /// A coarse step of 0.
    #[error("the step of the coarse lattice is 0: give 1 or more grid steps")]
    CoarseStep,
    /// A search down to boxes of no cells.
    #[error("the search goes down to boxes of 0 cells: give 1 or more")]
    SearchSize,
    /// A GPU follows the surface in grids of one slab only.
    #[error(
        "the grid's {bricks} bricks do not fit the adapter {adapter} and the memory budget at once: track on the CPU, \
         or coarsen the grid"
    )]
    Slabs {
        /// Bricks of the grid.
        bricks: u64,
        /// The adapter's name.
        adapter: String,
    },
    /// What labels the components of the mesh is more than the adapter binds.
    #[error(
        "the labels of the mesh's components take {needed} bytes, and the adapter {adapter} binds at most {limit}: \
         track on the CPU, or coarsen the grid"
    )]
    Labels {
        /// Their bytes.
        needed: u64,
        /// Bytes that the adapter binds.
        limit: u64,
        /// Its name.
        adapter: String,
    },
    /// No seed point led to surface, and nothing else was asked for.
    #[error("no seed leads to the surface: {}", told(.missed))]
    NothingReached {
        /// Each, and why.
        missed: Vec<Missed>,
    },
}

impl From<NoForm> for TrackError {
    fn from(error: NoForm) -> Self {
        Self::Extract(error.into())
    }
}

impl From<GpuError> for TrackError {
    fn from(error: GpuError) -> Self {
        Self::Extract(error.into())
    }
}

/// The first few seeds that led nowhere.
fn told(missed: &[Missed]) -> String {
    const TOLD: usize = 3;
    let each = missed.iter().take(TOLD).map(|m| format!("seed {} at {} {}", m.seed, m.point, m.why));
    let mut text = each.collect::<Vec<_>>().join("; ");
    if missed.len() > TOLD {
        text += &format!("; and {} more", missed.len() - TOLD);
    }
    text + ": move it, or look for seeds by a coarse step or a search"
}
