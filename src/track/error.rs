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
