//! Putting a slab's box of a volume on the GPU, in pieces, so that little is on its way at a time.

use super::plan::{Slab, UPLOAD_BYTES};
use super::workspace::Workspace;
use super::{Extractor, Options};
use crate::gpu::GpuError;
use crate::grid::Grid;
use crate::stage::params::Work;
use crate::volume::Volume;
use std::num::NonZeroU64;

impl Extractor {
    /// Puts a volume's slab on the GPU and builds its range table.
    pub(super) fn upload(&self, space: &Workspace, volume: &Volume, slab: Slab) -> Result<(), GpuError> {
        let gpu = &self.gpu;
        let values = volume.values();
        let size = values.scalar().size();
        let row_bytes = size * slab.points.x as usize;
        let rows = slab.points.y as usize * slab.points.z as usize;
        // Pieces begin with a word.
        let rows_a_piece = (UPLOAD_BYTES as usize / row_bytes).max(1).next_multiple_of(4);
        let mut before = None;
        for first in (0..rows).step_by(rows_a_piece) {
            let rows = first..rows.min(first + rows_a_piece);
            let bytes = (row_bytes * rows.len()).next_multiple_of(4) as u64;
            let submitted = gpu.guarded("samples", space.plan.source_bytes, || {
                let length = NonZeroU64::new(bytes)?;
                let at = (row_bytes * first) as u64;
                let mut view = gpu.queue.write_buffer_with(&space.source, at, length)?;
                for (i, row) in rows.enumerate() {
                    let samples = row_of_box(&space.grid, slab, row);
                    let samples = &values.bytes()[size * samples.start..size * samples.end];
                    view.slice(row_bytes * i..row_bytes * (i + 1)).copy_from_slice(samples);
                }
                drop(view);
                Some(gpu.queue.submit([]))
            })?;
            // The piece before this one is done before the next is begun.
            if before.is_some() {
                gpu.wait_for(before)?;
            }
            before = submitted;
        }
        let params = space.params(&Options::new(0.0), slab);
        gpu.guarded("brick ranges", space.plan.source_bytes, || {
            let params = self.settings(space, &params);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&space.work_start, 0, &space.work, 0, size_of::<Work>() as u64);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            space.kernels.range.encode(gpu, &mut pass, &space.bindings(self, &params), slab.bricks());
            drop(pass);
            encoder.copy_buffer_to_buffer(&space.work, Workspace::NON_FINITE, &space.odd, 0, 4);
            gpu.queue.submit([encoder.finish()]);
        })
    }
}

/// Where in the volume the samples of a row along x of the slab's box lie.
fn row_of_box(grid: &Grid, slab: Slab, row: usize) -> std::ops::Range<usize> {
    let points = grid.points().to_array().map(|n| n as usize);
    let [x, y, z] = slab.first_point.to_array().map(|n| n as usize);
    let (rows, length) = (slab.points.y as usize, slab.points.x as usize);
    let first = x + points[0] * (y + row % rows + points[1] * (z + row / rows));
    first..first + length
}
