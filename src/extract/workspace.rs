//! The buffers for extracting one source on the GPU, and the kernels that depend on the source.

use super::plan::{Plan, Slab};
use super::{ExtractError, Extractor, Method, Options, Source};
use crate::field::{PARAMETER_VECTORS, Sense, Wgsl};
use crate::gpu::kernel::{Bindings, Groups, binding as b, made};
use crate::gpu::settings::Uniforms;
use crate::gpu::{Gpu, GpuError, MESH_HEADER_BYTES, Settings};
use crate::grid::Grid;
use crate::stage::classify::{BrickRecord, Classify};
use crate::stage::cull::map::BrickMap;
use crate::stage::cull::{Bounds, Range};
use crate::stage::dispatches;
use crate::stage::emit::{Emit, Vertices};
use crate::stage::params::{Params, Work};
use crate::stage::sample::{Sample, Samplers};
use crate::stage::scan::Scan;
use crate::stage::shaders::{self, Samples};
use crate::volume::Scalar;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::ThreadId;
use wgpu::BufferUsages as U;

/// Where samples come from, as kernels that are compiled later need it.
#[derive(Debug)]
enum SourceText {
    Volume(Scalar),
    /// The field's text.
    Field(Box<Wgsl>),
}

/// The kernels that depend on where samples come from.
#[derive(Debug)]
pub(crate) struct SourceKernels {
    text: SourceText,
    pub(super) range: Range,
    pub(super) bounds: Option<Bounds>,
    sample: Option<Samplers>,
    /// Those of each method, compiled when it is first asked for.
    methods: [OnceLock<MethodKernels>; Method::ALL.len()],
    /// Classify that takes a field's samples itself, point by point and by planes.
    classify_sampling: [OnceLock<Classify>; 2],
}

/// The kernels that depend on the method, too.
#[derive(Debug)]
pub(crate) struct MethodKernels {
    pub(super) classify: Classify,
    pub(super) emit: Emit,
}

impl SourceKernels {
    pub(super) fn new(gpu: &Gpu, samples: Samples<'_>) -> Result<Self, GpuError> {
        let (text, sample, bounds) = match samples {
            Samples::Volume(scalar) => (SourceText::Volume(scalar), None, None),
            Samples::Field(wgsl) => {
                // The texts ask whether there is data, which may be large.
                let data = wgsl.data.iter().take(1).copied().collect();
                let text = SourceText::Field(Box::new(Wgsl { data, ..wgsl.clone() }));
                (text, Some(Samplers::new(wgsl)), Bounds::new(gpu, wgsl)?)
            }
        };
        let (methods, classify_sampling) = Default::default();
        Ok(Self { text, range: Range::new(gpu, samples)?, bounds, sample, methods, classify_sampling })
    }

    fn samples(&self) -> Samples<'_> {
        match &self.text {
            SourceText::Volume(scalar) => Samples::Volume(*scalar),
            SourceText::Field(wgsl) => Samples::Field(wgsl),
        }
    }

    /// The kernels of a method, compiled on the first call.
    pub(crate) fn of(&self, gpu: &Gpu, method: Method) -> Result<&MethodKernels, GpuError> {
        made(&self.methods[method as usize], || {
            let samples = self.samples();
            let classify = Classify::new(gpu, samples, method)?;
            Ok(MethodKernels { classify, emit: Emit::new(gpu, samples, method)? })
        })
    }

    /// Classify that takes a field's samples itself, where the device's form has it, compiled on the first call. The sample stage
    /// takes those of several batches once more for emit, and finds the same.
    pub(crate) fn sampling(
        &self,
        gpu: &Gpu,
        method: Method,
        is_aligned: bool,
    ) -> Result<Option<&Classify>, GpuError> {
        let SourceText::Field(wgsl) = &self.text else { return Ok(None) };
        if !(gpu.takes_samples() && shaders::classify_samples(wgsl, method, gpu.form())) {
            return Ok(None);
        }
        let by_planes = is_aligned && shaders::shared_planes(wgsl).is_some();
        let place = &self.classify_sampling[usize::from(by_planes)];
        made(place, || Classify::sampling(gpu, wgsl, by_planes)).map(Some)
    }

    /// The kernels that make vertices with the method and the normals of a run, compiled on the first call.
    pub(crate) fn vertices(&self, gpu: &Gpu, options: &Options) -> Result<&Vertices, GpuError> {
        self.of(gpu, options.method)?.emit.vertices(gpu, self.samples(), options.placement, options.normals)
    }
}

/// Who works in a workspace, one at a time.
#[derive(Debug, Default)]
struct Turn {
    lock: Mutex<()>,
    holder: Mutex<Option<ThreadId>>,
}

/// A turn, until it is dropped.
pub(super) struct Held<'a> {
    turn: &'a Turn,
    _lock: MutexGuard<'a, ()>,
}

impl Turn {
    fn holder(&self) -> MutexGuard<'_, Option<ThreadId>> {
        self.holder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for other threads. A thread does not wait for itself, as in a call from within its own progress, or of a task of
    /// rayon's that it begins while it waits for others.
    fn take(&self) -> Result<Held<'_>, ExtractError> {
        let own = std::thread::current().id();
        if *self.holder() == Some(own) {
            return Err(ExtractError::Busy);
        }
        let lock = self.lock.lock().unwrap_or_else(PoisonError::into_inner);
        *self.holder() = Some(own);
        Ok(Held { turn: self, _lock: lock })
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        *self.turn.holder() = None;
    }
}

/// What a workspace takes over of a source.
#[derive(Debug, Clone, Copy)]
pub(super) struct Taken {
    pub(super) sense: Sense,
    /// The volume whose samples lie on the GPU, all of them.
    pub(super) volume: Option<u64>,
}

/// The buffers for extracting one source: its samples where it is a volume, and the scratch.
///
/// What one extraction leaves in them the next overwrites: [`Extractor::extract_in`] of several threads waits for its turn, and
/// what [`Extractor::encode`] records works in the order in which it is submitted. While an `extract_in` runs, nothing that was
/// recorded with the same workspace may be submitted.
#[derive(Debug)]
pub struct Workspace {
    pub(super) grid: Grid,
    pub(super) taken: Mutex<Taken>,
    turn: Turn,
    /// Whether the grid's axes are the world's.
    pub(super) is_aligned: bool,
    pub(crate) is_volume: bool,
    /// The type of a volume's samples.
    pub(crate) scalar: Option<Scalar>,
    /// Whether the bits of the map are set already, once, for the one slab that there is: cull leaves them as they are.
    pub(crate) is_marked: bool,
    pub(crate) plan: Plan,
    pub(crate) kernels: Arc<SourceKernels>,
    /// The sample stage for the grid, where the source is a field.
    pub(crate) sample: Option<Arc<Sample>>,
    pub(super) field_parameters: wgpu::Buffer,
    /// Lists and samples that the field reads.
    pub(super) field_data: Arc<[u32]>,
    pub(super) field_data_buffer: wgpu::Buffer,
    pub(super) source: wgpu::Buffer,
    /// Ranges of the slab's bricks, 8 bytes each, where the source is a volume.
    pub(super) ranges: wgpu::Buffer,
    /// One word: samples of the slab that are not finite, counted with the ranges.
    pub(super) odd: wgpu::Buffer,
    pub(crate) map: wgpu::Buffer,
    /// Boxes of bricks that may hold surface, where the source is a field.
    pub(super) boxes: wgpu::Buffer,
    pub(super) partials: wgpu::Buffer,
    /// The active bricks; behind room for all, the slots of those that make anything; behind these, where those of each batch begin.
    pub(super) active: wgpu::Buffer,
    pub(super) records: wgpu::Buffer,
    pub(crate) counts: wgpu::Buffer,
    pub(crate) dispatches: wgpu::Buffer,
    pub(crate) work: wgpu::Buffer,
    pub(super) work_start: wgpu::Buffer,
    /// The bind groups of the last frame's mesh.
    pub(super) groups: Groups,
    pub(super) uniforms: Uniforms,
    /// Takes the header while the mesh does not exist yet.
    pub(super) header: wgpu::Buffer,
}

/// What a volume that lies on the GPU takes.
#[derive(Debug)]
pub(super) struct Uploaded {
    source: wgpu::Buffer,
    ranges: wgpu::Buffer,
    odd: wgpu::Buffer,
}

/// What the stages leave in a [`Workspace`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct StageBuffers<'a> {
    /// Whether `source` holds the samples of a field's bricks.
    pub has_samples: bool,
    pub source: &'a wgpu::Buffer,
    pub ranges: &'a wgpu::Buffer,
    pub map: &'a wgpu::Buffer,
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
        uploaded: Option<Uploaded>,
    ) -> Result<Self, GpuError> {
        let (bricks, slots) = (u64::from(plan.bricks), u64::from(plan.slots));
        let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
        let buffer = |what, bytes| gpu.buffer(what, bytes, storage);
        let work_start = Work {
            batch_slots: plan.batch_slots,
            batches: plan.batches,
            slots: plan.slots,
            ..Work::default()
        };
        let scalar = source.scalar();
        let is_volume = scalar.is_some();
        let volume = match source {
            Source::Volume(volume) if uploaded.is_some() => Some(volume.id()),
            Source::Volume(_) | Source::Field(..) => None,
        };
        let Uploaded { source: samples, ranges, odd } = match uploaded {
            Some(uploaded) => uploaded,
            None => Uploaded {
                source: buffer("samples", plan.source_bytes)?,
                ranges: buffer("brick ranges", if is_volume { 8 * bricks } else { 0 })?,
                odd: buffer("non-finite samples", 16)?,
            },
        };
        let is_aligned = Params::new(source.grid(), 0.0, source.sense()).is_aligned();
        let sample = kernels.sample.as_ref().map(|samplers| samplers.get(gpu, is_aligned)).transpose()?;
        let words = BrickMap::word_count(bricks);
        let workspace = Workspace {
            grid: *source.grid(),
            taken: Mutex::new(Taken { sense: source.sense(), volume }),
            turn: Turn::default(),
            is_aligned,
            is_volume,
            scalar,
            is_marked: false,
            kernels,
            sample,
            field_parameters: gpu.buffer(
                "field parameters",
                16 * PARAMETER_VECTORS as u64,
                U::UNIFORM | U::COPY_DST,
            )?,
            field_data_buffer: buffer("field data", size_of_val(&*field_data) as u64)?,
            field_data,
            source: samples,
            ranges,
            odd,
            map: buffer("brick map", 8 * words)?,
            boxes: buffer("boxes of bricks", if is_volume { 0 } else { plan.box_bytes() })?,
            partials: buffer("partial sums", Scan::partial_bytes(words.max(slots)))?,
            active: buffer("active bricks", 4 * (2 * slots + u64::from(plan.batches) + 1))?,
            records: buffer("brick records", slots * size_of::<BrickRecord>() as u64)?,
            counts: buffer("brick counts", 8 * (slots + 1))?,
            dispatches: gpu.buffer("dispatches", dispatches::bytes(plan.batches), storage | U::INDIRECT)?,
            work: buffer("work", size_of::<Work>() as u64)?,
            work_start: buffer("work at start", size_of::<Work>() as u64)?,
            groups: Groups::default(),
            uniforms: Uniforms::default(),
            header: buffer("header", MESH_HEADER_BYTES)?,
            plan,
        };
        gpu.write(&workspace.work_start, bytemuck::bytes_of(&work_start))?;
        gpu.write(&workspace.field_data_buffer, bytemuck::cast_slice(&workspace.field_data))?;
        Ok(workspace)
    }

    /// What the workspace has of its source.
    pub(super) fn taken(&self) -> MutexGuard<'_, Taken> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// To be held by what changes the source or runs from count to emit.
    ///
    /// # Errors
    /// [`ExtractError::Busy`] on the thread that holds it.
    pub(super) fn turn(&self) -> Result<Held<'_>, ExtractError> {
        self.turn.take()
    }

    /// Where in `Work` the count of samples that are not finite lies.
    pub(super) const NON_FINITE: u64 = std::mem::offset_of!(Work, non_finite) as u64;

    /// The buffers of a volume that fits in one slab, of a workspace that is not needed any more.
    pub(super) fn into_uploaded(self) -> Option<Uploaded> {
        let keeps = self.is_volume && self.plan.slab_count() == 1;
        keeps.then_some(Uploaded { source: self.source, ranges: self.ranges, odd: self.odd })
    }

    /// Where the arguments of the dispatches over boxes lie.
    pub(super) fn box_dispatches(&self) -> (&wgpu::Buffer, u64) {
        (&self.dispatches, dispatches::boxes(self.plan.batches))
    }

    /// The bytes of all buffers: no more than the plan says, which counts what a volume takes on its way, too.
    pub fn buffer_bytes(&self) -> u64 {
        let all = [
            &self.field_parameters,
            &self.field_data_buffer,
            &self.source,
            &self.ranges,
            &self.odd,
            &self.map,
            &self.boxes,
            &self.partials,
            &self.active,
            &self.records,
            &self.counts,
            &self.dispatches,
            &self.work,
            &self.work_start,
            &self.header,
        ];
        all.into_iter().map(wgpu::Buffer::size).sum()
    }

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
            map: &self.map,
            active: &self.active,
            records: &self.records,
            counts: &self.counts,
        }
    }

    pub(crate) fn params(&self, options: &Options, slab: Slab) -> Params {
        let sense = options.sense.unwrap_or(self.taken().sense);
        Params {
            own_bricks: slab.own_bricks,
            slab_first: slab.first.into(),
            slab_bricks: slab.bricks(),
            slab_extent: slab.extent.into(),
            source_first: slab.first_point.into(),
            source_extent: slab.points.into(),
            ..Params::new(&self.grid, options.iso, sense)
                .with_normals(options.normals)
                .with_method(options.method, options.placement)
        }
    }

    pub(crate) fn bindings<'a>(&'a self, extractor: &'a Extractor, settings: &'a Settings) -> Bindings<'a> {
        let mut bindings = Bindings::default();
        bindings
            .set_settings(settings)
            .set(b::WORK, &self.work)
            .set(b::SOURCE, &self.source)
            .set(b::SAMPLES, &self.source)
            .set(b::RANGES, &self.ranges)
            .set(b::MAP, &self.map)
            .set(b::BOXES, &self.boxes)
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
        // Without immediates each call has a buffer of its own, and no bind group would be found again.
        if extractor.gpu.has_immediates() {
            bindings.keep_in(&self.groups);
        }
        bindings
    }
}
