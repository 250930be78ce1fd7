//! The buffers for extracting one source on the GPU, and the kernels that depend on the source.

use super::plan::{Plan, Slab};
use super::{Extractor, Options, Source};
use crate::field::PARAMETER_VECTORS;
use crate::gpu::kernel::{Bindings, binding as b};
use crate::gpu::{Gpu, GpuError, MESH_HEADER_BYTES};
use crate::grid::Grid;
use crate::stage::classify::{BrickRecord, Classify};
use crate::stage::cull::{Bounds, Range};
use crate::stage::emit::Emit;
use crate::stage::normals::Normals;
use crate::stage::params::{Params, Work};
use crate::stage::sample::Sample;
use crate::stage::shaders::Samples;
use std::sync::Arc;
use wgpu::BufferUsages as U;

/// The kernels that depend on where samples come from.
#[derive(Debug)]
pub(crate) struct SourceKernels {
    pub(super) range: Range,
    pub(super) bounds: Option<Bounds>,
    pub(crate) sample: Option<Sample>,
    pub(super) classify: Classify,
    pub(super) emit: Emit,
}

impl SourceKernels {
    pub(super) fn new(gpu: &Gpu, samples: Samples<'_>) -> Result<Self, GpuError> {
        let (sample, bounds) = match samples {
            Samples::Volume => (None, None),
            Samples::Field(wgsl) => (Some(Sample::new(gpu, wgsl)?), Bounds::new(gpu, wgsl)?),
        };
        Ok(Self {
            range: Range::new(gpu, samples)?,
            bounds,
            sample,
            classify: Classify::new(gpu, samples)?,
            emit: Emit::new(gpu, samples)?,
        })
    }
}

/// The buffers for extracting one source: its samples where it is a volume, and the scratch.
#[derive(Debug)]
pub struct Workspace {
    pub(super) grid: Grid,
    pub(super) sense: crate::field::Sense,
    pub(crate) is_volume: bool,
    /// Whether the marks are set already, once, for the one slab that there is: cull leaves them as they are.
    pub(crate) is_marked: bool,
    pub(crate) plan: Plan,
    pub(crate) kernels: Arc<SourceKernels>,
    pub(super) field_parameters: wgpu::Buffer,
    /// Lists and samples that the field reads.
    pub(super) field_data: Arc<[u32]>,
    pub(super) field_data_buffer: wgpu::Buffer,
    pub(super) source: wgpu::Buffer,
    /// Ranges of the slab's bricks: 8 bytes each, also where the source is a field, whose are needed only for
    /// an empty mesh.
    pub(super) ranges: wgpu::Buffer,
    /// One word: samples of the slab that are not finite, counted with the ranges.
    pub(super) odd: wgpu::Buffer,
    pub(crate) marks: wgpu::Buffer,
    pub(super) partials: wgpu::Buffer,
    pub(crate) slots: wgpu::Buffer,
    pub(super) active: wgpu::Buffer,
    pub(super) records: wgpu::Buffer,
    pub(super) counts: wgpu::Buffer,
    pub(crate) dispatches: wgpu::Buffer,
    pub(crate) work: wgpu::Buffer,
    pub(super) work_start: wgpu::Buffer,
    /// Takes the header while the mesh does not exist yet.
    pub(super) header: wgpu::Buffer,
}

/// What the stages leave in a [`Workspace`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct StageBuffers<'a> {
    /// Whether `source` holds the samples of a field's bricks.
    pub has_samples: bool,
    pub source: &'a wgpu::Buffer,
    pub ranges: &'a wgpu::Buffer,
    pub marks: &'a wgpu::Buffer,
    pub slots: &'a wgpu::Buffer,
    pub active: &'a wgpu::Buffer,
    pub records: &'a wgpu::Buffer,
    pub counts: &'a wgpu::Buffer,
}

impl Workspace {
    /// Makes the buffers that `plan` asks for.
    pub(super) fn new(
        gpu: &Gpu,
        source: &Source<'_>,
        plan: Plan,
        kernels: Arc<SourceKernels>,
        field_data: Arc<[u32]>,
    ) -> Result<Self, GpuError> {
        let n = u64::from(plan.bricks);
        let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
        let buffer = |what, bytes| gpu.buffer(what, bytes, storage);
        let work_start = Work { batch_slots: plan.batch_slots, batches: plan.batches, ..Work::default() };
        let workspace = Workspace {
            grid: *source.grid(),
            sense: source.sense(),
            is_volume: matches!(source, Source::Volume(_)),
            is_marked: false,
            kernels,
            field_parameters: gpu.buffer(
                "field parameters",
                16 * PARAMETER_VECTORS as u64,
                U::UNIFORM | U::COPY_DST,
            )?,
            field_data_buffer: buffer("field data", size_of_val(&*field_data) as u64)?,
            field_data,
            source: buffer("samples", plan.source_bytes)?,
            ranges: buffer("brick ranges", 8 * n)?,
            odd: buffer("non-finite samples", 16)?,
            marks: buffer("brick marks", 8 * (n + 1))?,
            partials: buffer("partial sums", 8 * n.div_ceil(64))?,
            slots: buffer("brick map", 4 * n)?,
            active: buffer("active bricks", 4 * n)?,
            records: buffer("brick records", n * size_of::<BrickRecord>() as u64)?,
            counts: buffer("brick counts", 8 * (n + 1))?,
            dispatches: gpu.buffer(
                "dispatches",
                24 * u64::from(plan.batches) + Normals::ARGUMENT_BYTES,
                storage | U::INDIRECT,
            )?,
            work: buffer("work", size_of::<Work>() as u64)?,
            work_start: buffer("work at start", size_of::<Work>() as u64)?,
            header: buffer("header", MESH_HEADER_BYTES)?,
            plan,
        };
        gpu.write(&workspace.work_start, bytemuck::bytes_of(&work_start))?;
        gpu.write(&workspace.field_data_buffer, bytemuck::cast_slice(&workspace.field_data))?;
        Ok(workspace)
    }

    /// Where in `Work` the count of samples that are not finite lies.
    pub(super) const NON_FINITE: u64 = std::mem::offset_of!(Work, non_finite) as u64;

    /// How the grid was cut, and the bytes of the buffers.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The buffers that a run leaves behind, for comparing stages.
    pub(crate) fn buffers(&self) -> StageBuffers<'_> {
        StageBuffers {
            has_samples: !self.is_volume,
            source: &self.source,
            ranges: &self.ranges,
            marks: &self.marks,
            slots: &self.slots,
            active: &self.active,
            records: &self.records,
            counts: &self.counts,
        }
    }

    pub(crate) fn params(&self, options: &Options, slab: Slab) -> Params {
        let sense = options.sense.unwrap_or(self.sense);
        Params {
            own_bricks: slab.own_bricks,
            slab_first: slab.first.into(),
            slab_bricks: slab.bricks(),
            slab_extent: slab.extent.into(),
            source_first: slab.first_point.into(),
            source_extent: slab.points.into(),
            ..Params::new(&self.grid, options.iso, sense).with_normals(options.normals)
        }
    }

    pub(crate) fn bindings<'a>(&'a self, extractor: &'a Extractor, params: &'a wgpu::Buffer) -> Bindings<'a> {
        let mut bindings = Bindings::default();
        bindings
            .set(b::PARAMS, params)
            .set(b::WORK, &self.work)
            .set(b::SOURCE, &self.source)
            .set(b::SAMPLES, &self.source)
            .set(b::RANGES, &self.ranges)
            .set(b::MARKS, &self.marks)
            .set(b::SLOTS, &self.slots)
            .set(b::ACTIVE, &self.active)
            .set(b::DISPATCHES, &self.dispatches)
            .set(b::RECORDS, &self.records)
            .set(b::COUNTS, &self.counts)
            .set(b::TABLE, &extractor.table)
            .set(b::PARTIALS, &self.partials)
            .set(b::HEADER, &self.header)
            .set(b::FIELD, &self.field_parameters)
            .set(b::FIELD_DATA, &self.field_data_buffer)
            // Stands for a second window where there is none.
            .set(b::NEIGHBOURS, &self.odd);
        bindings
    }
}
