//! Where a mesh will be open, from samples alone: the edges that it leaves in the faces of cells on the border of the domain.

use crate::stage::inside::Inside;
use crate::volume::Values;
use rayon::prelude::*;
use std::ops::Range;

/// How faces are looked at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Faces {
    pub(super) inside: Inside,
    /// Points of the whole grid.
    pub(super) points: [u32; 3],
    /// Whether a face is cut along the diagonal from its lowest corner, as tetrahedra do.
    pub(super) is_cut: bool,
}

impl Faces {
    /// The open edges of some layers of cells, from the samples of the planes from `first` on.
    ///
    /// Around a face, or a half of it, every second change between inside and outside begins an edge, whatever the
    /// decision in an ambiguous face is.
    pub(super) fn open_edges(&self, values: &Values, first: u32, layers: Range<u32>) -> u64 {
        let [nx, ny, nz] = self.points;
        let at = |x: u32, y: u32, z: u32| {
            let row = u64::from(z - first) * u64::from(ny) + u64::from(y);
            self.inside.test(values.get((row * u64::from(nx) + u64::from(x)) as usize))
        };
        let end = layers.end;
        let of_layer = |z: u32| {
            let sides = [0, nx - 1].map(|x| {
                (0..ny - 1)
                    .map(|y| self.edges([at(x, y, z), at(x, y + 1, z), at(x, y + 1, z + 1), at(x, y, z + 1)]))
                    .sum::<u64>()
            });
            let fronts = [0, ny - 1].map(|y| {
                (0..nx - 1)
                    .map(|x| self.edges([at(x, y, z), at(x + 1, y, z), at(x + 1, y, z + 1), at(x, y, z + 1)]))
                    .sum::<u64>()
            });
            sides.iter().chain(&fronts).sum::<u64>()
        };
        let of_row = |z: u32, y: u32| {
            (0..nx - 1)
                .map(|x| self.edges([at(x, y, z), at(x + 1, y, z), at(x + 1, y + 1, z), at(x, y + 1, z)]))
                .sum::<u64>()
        };
        let of_plane = |z: u32| (0..ny - 1).into_par_iter().map(|y| of_row(z, y)).sum::<u64>();
        let low = if layers.start == 0 { of_plane(0) } else { 0 };
        // The last bricks may have points alone.
        let high = if end == nz - 1 && !layers.is_empty() { of_plane(end) } else { 0 };
        low + high + layers.into_par_iter().map(of_layer).sum::<u64>()
    }

    /// Of a face with these corners, in order around it from its lowest.
    fn edges(&self, [a, b, c, d]: [bool; 4]) -> u64 {
        let changes = |corners: &[bool]| {
            let next = corners.iter().cycle().skip(1);
            corners.iter().zip(next).filter(|(a, b)| a != b).count() as u64 / 2
        };
        if self.is_cut { changes(&[a, b, c]) + changes(&[a, c, d]) } else { changes(&[a, b, c, d]) }
    }
}
