//! The samples of one brick on the CPU, wherever they lie; the twin of `shaders/source/*.wgsl`.

use crate::grid::SAMPLES_PER_BRICK;
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::volume::values::each_type;
use crate::volume::{Sample, Slice, Values};
use glam::UVec3;

/// A view of the (at most) 9³ samples of a brick, in a volume's own type. At the grid's end there are fewer: rows past it
/// do not exist, and no stage asks for them.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    data: Slice<'a>,
    row_pitch: usize,
    plane_pitch: usize,
    /// Samples along x, y, z: 1 to 9.
    pub extent: [usize; 3],
}

impl<'a> Samples<'a> {
    /// The brick at `origin`, straight from the values of a volume with `points` points.
    #[inline(always)]
    pub fn of_volume(values: &'a Values, points: [u32; 3], origin: UVec3) -> Self {
        Self::of_box(values, [0; 3], points, points, origin)
    }

    /// The brick at `origin`, from those of a volume's values that a run works on: the box that `params` names.
    #[inline(always)]
    pub fn of_source(values: &'a Values, params: &Params, origin: UVec3) -> Self {
        Self::of_box(values, params.source_first, params.source_extent, params.points, origin)
    }

    #[inline(always)]
    fn of_box(
        values: &'a Values,
        first: [u32; 3],
        extent_of_box: [u32; 3],
        points: [u32; 3],
        origin: UVec3,
    ) -> Self {
        let [nx, ny, _] = extent_of_box.map(|n| n as usize);
        let [x, y, z] = (origin - UVec3::from(first)).to_array().map(|n| n as usize);
        Self {
            data: values.as_slice().range(x + nx * (y + ny * z)..values.len()),
            row_pitch: nx,
            plane_pitch: nx * ny,
            extent: extent(points, origin),
        }
    }

    /// The brick at `origin` as the sample stage wrote it: 9³ values, x fastest.
    #[inline(always)]
    pub fn of_brick(values: &'a [f32; SAMPLES_PER_BRICK], points: [u32; 3], origin: UVec3) -> Self {
        let data = Slice::F32(values);
        Self { data, row_pitch: 9, plane_pitch: 81, extent: extent(points, origin) }
    }

    /// The brick at `origin`, whose samples begin where `values` do, in a row of bricks that are sampled together at so
    /// many points.
    #[inline(always)]
    pub fn of_row(values: &'a [f32], sampled: [usize; 3], points: [u32; 3], origin: UVec3) -> Self {
        let [nx, ny, _] = sampled;
        let data = Slice::F32(values);
        Self { data, row_pitch: nx, plane_pitch: nx * ny, extent: extent(points, origin) }
    }

    /// Tells for each sample of row (y, z) whether it is inside, a bit each.
    #[inline(always)]
    pub fn row_inside(&self, inside: Inside, y: usize, z: usize) -> u32 {
        each_type!(Slice, self.data, data => inside.row(self.row_of(data, y, z)))
    }

    /// The samples from the brick's first on, to be asked for rows by [`row_of`](Self::row_of).
    #[inline(always)]
    pub(crate) fn data(&self) -> Slice<'a> {
        self.data
    }

    /// The samples of row (y, z) in what [`data`](Self::data) gave.
    #[inline(always)]
    pub(crate) fn row_of<'d, T: Sample>(&self, data: &'d [T], y: usize, z: usize) -> &'d [T] {
        let start = y * self.row_pitch + z * self.plane_pitch;
        &data[start..start + self.extent[0]]
    }

    /// How many samples of the brick's own points, those of the first eight along each axis, are NaN or infinite.
    pub fn owned_non_finite(&self) -> u64 {
        let Slice::F32(data) = self.data else { return 0 };
        let [nx, ny, nz] = self.extent.map(|n| n.min(8));
        let rows = (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z)));
        rows.map(|(y, z)| self.row_of(data, y, z)[..nx].iter().filter(|v| !v.is_finite()).count() as u64)
            .sum()
    }

    /// The eight corners of the cell whose lowest is the point (x, y, z): corner k lies at (k & 1, k >> 1 & 1, k >> 2).
    #[inline(always)]
    pub fn of_cell(&self, [x, y, z]: [usize; 3]) -> [f32; 8] {
        [0, 1, 2, 3, 4, 5, 6, 7].map(|k: usize| self.at(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)))
    }

    /// Asks the processor to have the rows at hand soon. What lies in main memory takes longer to come than a row takes to be
    /// worked on.
    #[inline(always)]
    pub fn load_ahead(&self) {
        let [nx, ny, nz] = self.extent;
        each_type!(Slice, self.data, data => for z in 0..nz {
            for y in 0..ny {
                let first = data.as_ptr().wrapping_add(y * self.row_pitch + z * self.plane_pitch);
                load_line(first);
                load_line(first.wrapping_add(nx - 1));
            }
        });
    }

    /// The sample at (x, y, z).
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize, z: usize) -> f32 {
        self.data.get(x + y * self.row_pitch + z * self.plane_pitch)
    }
}

/// Begins to load the cache line of what is pointed at, if anything is there.
#[cfg_attr(target_arch = "x86_64", allow(unsafe_code))]
#[inline(always)]
pub(crate) fn load_line<T>(at: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a hint, for any address: it reads and writes nothing that a program sees, and never faults (AMD64 Architecture
    // Programmer's Manual, volume 3, PREFETCHlevel). SSE, which has it, is part of x86-64.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(at.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = at;
}

fn extent(points: [u32; 3], origin: UVec3) -> [usize; 3] {
    let origin = origin.to_array();
    [0, 1, 2].map(|i| (points[i] - origin[i]).min(9) as usize)
}
