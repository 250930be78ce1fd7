//! The samples of a brick of a volume and those one step around it, side by side.

use super::edges::Edge;
use crate::stage::params::Params;
use crate::volume::Sample;

/// Samples of a row: those of a brick, and one on each side.
const SAMPLES: usize = 11;
/// From a sample to the next along each axis: points and steps of [`Edge`] are places, too.
pub(super) const PITCH: [usize; 3] = [1, 16, 256];
/// From the first of the samples that [`Around::ends`] gives to the sample itself.
pub(super) const CENTRE: usize = PITCH[2];
/// So many before and behind a sample are all that differences ask for.
const REACH: usize = 2 * CENTRE + 1;

/// A copy of the samples of a brick and of those around it: 11³, fewer at the volume's end. Each line of memory is read once and in
/// order, as memory likes it, and what vertices ask for is near, whatever type and pitch the volume has.
pub(super) struct Around {
    /// 11 planes, with one more before them and one behind. Where the volume has no sample, and in planes that no edge asks for, there is
    /// what was there before.
    samples: Box<[f32; (SAMPLES + 2) * PITCH[2]]>,
    /// Where the first sample of the brick lies.
    first: usize,
}

impl Default for Around {
    fn default() -> Self {
        Self { samples: Box::new([0.0; (SAMPLES + 2) * PITCH[2]]), first: 0 }
    }
}

impl Around {
    /// Takes what these edges of the brick at `origin` ask for, from the box of a volume that `params` names.
    #[inline(always)]
    pub(super) fn fill<T: Sample>(
        &mut self,
        params: &Params,
        values: &[T],
        origin: [u32; 3],
        edges: &[Edge],
    ) {
        let (Some(lowest), Some(highest)) = (edges.first(), edges.last()) else { return };
        let [lowest, highest] = [lowest, highest].map(|edge| edge.coordinate(2) as usize);
        let [nx, ny, nz] = params.source_extent.map(|n| n as usize);
        let origin = [0, 1, 2].map(|k| (origin[k] - params.source_first[k]) as usize);
        let [x, y, first_plane] = origin.map(|n| n.saturating_sub(1));
        self.first = (origin[0] - x) + PITCH[1] * (origin[1] - y) + PITCH[2] * (origin[2] - first_plane + 1);
        // Edges are in order: these are the planes of their owners, and around them.
        for z in (origin[2] + lowest).saturating_sub(1)..nz.min(origin[2] + highest + 3) {
            let plane = 1 + z - first_plane;
            for (row, y) in (y..ny.min(origin[1] + 10)).enumerate() {
                let from = &values[x + nx * (y + ny * z)..];
                let to = &mut self.samples[plane * PITCH[2] + row * PITCH[1]..][..SAMPLES];
                // Behind a row's end lies the next row: nobody asks.
                match from.first_chunk::<SAMPLES>() {
                    Some(from) => to.copy_from_slice(&from.map(T::to_f32)),
                    None => copy_last(from, to),
                }
            }
        }
    }

    /// The samples at both ends of an edge of the brick, at [`CENTRE`], and those around each.
    #[inline(always)]
    pub(super) fn ends(&self, edge: Edge) -> [&[f32]; 2] {
        let owner = self.first + edge.owner() as usize;
        [owner, owner + edge.step() as usize].map(|at| &self.samples[at - CENTRE..][..REACH])
    }
}

/// Copies the volume's last row. A function of its own: what its loop needs would be spilled around the copies of the other rows, and so
/// fewer of these wait for memory at a time.
#[cold]
#[inline(never)]
fn copy_last<T: Sample>(from: &[T], to: &mut [f32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = from.to_f32());
}
