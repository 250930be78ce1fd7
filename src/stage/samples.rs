//! The samples of one brick on the CPU, wherever they lie; the twin of `shaders/source/*.wgsl`.

use crate::grid::SAMPLES_PER_BRICK;
use glam::UVec3;

/// A view of the (at most) 9³ samples of a brick. At the grid's end there are fewer: rows past it do
/// not exist, and no stage asks for them.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    data: &'a [f32],
    row_pitch: usize,
    plane_pitch: usize,
    /// Samples along x, y, z: 1 to 9.
    pub extent: [usize; 3],
}

impl<'a> Samples<'a> {
    /// The brick at `origin`, straight from the values of a volume with `points` points.
    #[inline(always)]
    pub fn of_volume(values: &'a [f32], points: [u32; 3], origin: UVec3) -> Self {
        let [nx, ny, _] = points.map(|n| n as usize);
        let [x, y, z] = origin.to_array().map(|n| n as usize);
        Self {
            data: &values[x + nx * (y + ny * z)..],
            row_pitch: nx,
            plane_pitch: nx * ny,
            extent: extent(points, origin),
        }
    }

    /// The brick at `origin` as the sample stage wrote it: 9³ values, x fastest.
    #[inline(always)]
    pub fn of_brick(values: &'a [f32; SAMPLES_PER_BRICK], points: [u32; 3], origin: UVec3) -> Self {
        Self { data: values, row_pitch: 9, plane_pitch: 81, extent: extent(points, origin) }
    }

    /// The brick at `origin`, whose samples begin where `values` do, in a row of bricks that are sampled together at so
    /// many points.
    #[inline(always)]
    pub fn of_row(values: &'a [f32], sampled: [usize; 3], points: [u32; 3], origin: UVec3) -> Self {
        let [nx, ny, _] = sampled;
        Self { data: values, row_pitch: nx, plane_pitch: nx * ny, extent: extent(points, origin) }
    }

    /// The samples of row (y, z).
    #[inline(always)]
    pub fn row(&self, y: usize, z: usize) -> &'a [f32] {
        let start = y * self.row_pitch + z * self.plane_pitch;
        &self.data[start..start + self.extent[0]]
    }

    /// The sample at (x, y, z).
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize, z: usize) -> f32 {
        self.data[x + y * self.row_pitch + z * self.plane_pitch]
    }
}

fn extent(points: [u32; 3], origin: UVec3) -> [usize; 3] {
    let origin = origin.to_array();
    [0, 1, 2].map(|i| (points[i] - origin[i]).min(9) as usize)
}
