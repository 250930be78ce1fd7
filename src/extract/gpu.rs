//! The GPU path: [`Extractor`] holds the pipelines, [`Workspace`] the buffers for one source, and
//! [`Options`] the cheap settings of a call.

use super::plan::{Limits, Plan, Slab};
use super::{ExtractError, Options, Report, STAGES, Source, check, stage_index as at};
use crate::field::user::MAX_ITERATIONS;
use crate::field::{PARAMETER_VECTORS, Wgsl};
use crate::gpu::kernel::{Bindings, binding as b};
use crate::gpu::{Gpu, GpuError, GpuMesh, MESH_HEADER_BYTES, MeshHeader, Timer};
use crate::grid::Grid;
use crate::mesh::Vertex;
use crate::stage::classify::{BrickRecord, Classify};
use crate::stage::cull::{Cull, Range};
use crate::stage::emit::Emit;
use crate::stage::params::{Params, Work};
use crate::stage::sample::Sample;
use crate::stage::scan::Scan;
use crate::stage::shaders::Samples;
use crate::table::MARCHING_CUBES;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use wgpu::BufferUsages as U;

/// The kernels that depend on where samples come from.
#[derive(Debug)]
struct SourceKernels {
    range: Range,
    sample: Option<Sample>,
    classify: Classify,
    emit: Emit,
}

impl SourceKernels {
    fn new(gpu: &Gpu, samples: Samples<'_>) -> Result<Self, GpuError> {
        let sample = match samples {
            Samples::Volume => None,
            Samples::Field(wgsl) => Some(Sample::new(gpu, wgsl)?),
        };
        Ok(Self {
            range: Range::new(gpu, samples)?,
            sample,
            classify: Classify::new(gpu, samples)?,
            emit: Emit::new(gpu, samples)?,
        })
    }
}

/// The pipelines of extraction on one device, compiled once; a field's are compiled when it is first
/// seen, and changing its parameters compiles nothing.
#[derive(Debug)]
pub struct Extractor {
    gpu: Gpu,
    cull: Cull,
    scan_marks: Scan,
    scan_counts: Scan,
    table: wgpu::Buffer,
    volume: Arc<SourceKernels>,
    fields: Mutex<HashMap<String, Arc<SourceKernels>>>,
}

/// The buffers for extracting one source: its samples where it is a volume, and the scratch.
#[derive(Debug)]
pub struct Workspace {
    grid: Grid,
    sense: crate::field::Sense,
    is_volume: bool,
    plan: Plan,
    kernels: Arc<SourceKernels>,
    field_parameters: wgpu::Buffer,
    source: wgpu::Buffer,
    /// Ranges of the slab's bricks; small where the source is a field.
    ranges: wgpu::Buffer,
    /// One word: samples of the slab that are not finite, counted with the ranges.
    odd: wgpu::Buffer,
    marks: wgpu::Buffer,
    partials: wgpu::Buffer,
    slots: wgpu::Buffer,
    active: wgpu::Buffer,
    records: wgpu::Buffer,
    counts: wgpu::Buffer,
    dispatches: wgpu::Buffer,
    work: wgpu::Buffer,
    work_start: wgpu::Buffer,
    /// Takes the header while the mesh does not exist yet.
    header: wgpu::Buffer,
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

/// A mesh and how it was made.
#[derive(Debug)]
pub struct Extraction {
    /// The mesh, on the GPU.
    pub mesh: GpuMesh,
    /// Counts, bytes and times.
    pub report: Report,
}

/// Where a slab's vertices and triangles lie in the whole mesh.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    first: [u32; 2],
    count: [u32; 2],
}

/// The buffers that emit writes, and the windows of them that are bound.
struct Target<'a> {
    mesh: &'a GpuMesh,
    window: [u32; 2],
    capacity: [u32; 2],
    first: [u32; 2],
}

impl Target<'_> {
    /// Items whose bytes are a whole number of the largest offset alignment (256), by vertices of 24
    /// and triangles of 12 bytes.
    const ALIGNED: [u32; 2] = [32, 64];
    const BYTES: [u64; 2] = [size_of::<Vertex>() as u64, 12];
}

impl Extractor {
    /// Compiles the pipelines on `gpu`: one that the crate opened ([`Gpu::open`]) or the caller's own
    /// ([`Gpu::from_device`]).
    ///
    /// # Errors
    /// [`ExtractError::Gpu`].
    pub fn new(gpu: Gpu) -> Result<Self, ExtractError> {
        let table = gpu.buffer("table", 2048, U::UNIFORM | U::COPY_DST)?;
        gpu.queue.write_buffer(&table, 0, bytemuck::cast_slice(MARCHING_CUBES.words()));
        Ok(Self {
            cull: Cull::new(&gpu)?,
            scan_marks: Scan::new(&gpu, true)?,
            scan_counts: Scan::new(&gpu, false)?,
            table,
            volume: Arc::new(SourceKernels::new(&gpu, Samples::Volume)?),
            fields: Mutex::default(),
            gpu,
        })
    }

    /// The device that the pipelines are on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    fn field_kernels(&self, wgsl: &Wgsl) -> Result<Arc<SourceKernels>, GpuError> {
        let mut fields = self.fields.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernels) = fields.get(&wgsl.source) {
            return Ok(kernels.clone());
        }
        let kernels = Arc::new(SourceKernels::new(&self.gpu, Samples::Field(wgsl))?);
        fields.insert(wgsl.source.clone(), kernels.clone());
        Ok(kernels)
    }

    /// Makes the buffers for `source` within `memory_budget` bytes, and uploads a volume that fits in
    /// one slab.
    ///
    /// # Errors
    /// [`ExtractError::Gpu`], [`ExtractError::NoForm`], [`ExtractError::Budget`],
    /// [`ExtractError::Binding`], [`ExtractError::TooManyBricks`].
    pub fn prepare(&self, source: &Source<'_>, memory_budget: u64) -> Result<Workspace, ExtractError> {
        self.prepare_layers(source, memory_budget, u32::MAX)
    }

    fn prepare_layers(
        &self,
        source: &Source<'_>,
        memory_budget: u64,
        most_layers: u32,
    ) -> Result<Workspace, ExtractError> {
        check(source, &Options { memory_budget, ..Options::new(0.0) })?;
        let gpu = &self.gpu;
        let device_limits = gpu.device.limits();
        let limits = Limits {
            binding: device_limits.max_storage_buffer_binding_size.min(device_limits.max_buffer_size),
            budget: memory_budget,
            adapter: &gpu.info.name,
        };
        let is_volume = matches!(source, Source::Volume(_));
        let plan = Plan::new(source.grid(), is_volume, limits, most_layers)?;
        let mut parameters = [0.0f32; 4 * PARAMETER_VECTORS];
        let kernels = match source {
            Source::Volume(_) => self.volume.clone(),
            Source::Field(field, _) => {
                let wgsl = field.wgsl()?;
                parameters.iter_mut().zip(&wgsl.parameters).for_each(|(p, v)| *p = *v);
                self.field_kernels(&wgsl)?
            }
        };
        let n = u64::from(plan.bricks);
        let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
        let buffer = |what, bytes| gpu.buffer(what, bytes, storage);
        let work_start = Work { batch_slots: plan.batch_slots, batches: plan.batches, ..Work::default() };
        let workspace = Workspace {
            grid: *source.grid(),
            sense: source.sense(),
            is_volume,
            kernels,
            field_parameters: gpu.buffer(
                "field parameters",
                size_of_val(&parameters) as u64,
                U::UNIFORM | U::COPY_DST,
            )?,
            source: buffer("samples", plan.source_bytes)?,
            ranges: buffer("brick ranges", 8 * n)?,
            odd: buffer("non-finite samples", 16)?,
            marks: buffer("brick marks", 8 * (n + 1))?,
            partials: buffer("partial sums", 8 * n.div_ceil(64))?,
            slots: buffer("brick map", 4 * n)?,
            active: buffer("active bricks", 4 * n)?,
            records: buffer("brick records", n * size_of::<BrickRecord>() as u64)?,
            counts: buffer("brick counts", 8 * (n + 1))?,
            dispatches: gpu.buffer("dispatches", 24 * u64::from(plan.batches), storage | U::INDIRECT)?,
            work: buffer("work", size_of::<Work>() as u64)?,
            work_start: buffer("work at start", size_of::<Work>() as u64)?,
            header: buffer("header", MESH_HEADER_BYTES)?,
            plan,
        };
        gpu.queue.write_buffer(&workspace.field_parameters, 0, bytemuck::cast_slice(&parameters));
        gpu.queue.write_buffer(&workspace.work_start, 0, bytemuck::bytes_of(&work_start));
        if workspace.plan.slabs.len() == 1 {
            self.upload(&workspace, source, workspace.plan.slabs[0])?;
        }
        Ok(workspace)
    }

    /// Fills the scratch with a pattern, so that what a stage did not write shows.
    pub(crate) fn poison(&self, space: &Workspace) {
        let buffers = space.buffers();
        let scratch = [
            buffers.marks,
            buffers.slots,
            buffers.active,
            buffers.records,
            buffers.counts,
            &space.partials,
            &space.dispatches,
            &space.work,
        ];
        let samples = buffers.has_samples.then_some(buffers.source);
        for buffer in scratch.into_iter().chain(samples) {
            self.gpu.queue.write_buffer(buffer, 0, &vec![0xcd; buffer.size() as usize]);
        }
    }

    /// Puts a volume's slab on the GPU and builds its range table.
    fn upload(&self, space: &Workspace, source: &Source<'_>, slab: Slab) -> Result<(), GpuError> {
        let Source::Volume(volume) = source else { return Ok(()) };
        let plane = (space.grid.points().x * space.grid.points().y) as usize;
        let planes = &volume.values()[slab.planes.0 as usize * plane..slab.planes.1 as usize * plane];
        let params = space.params(&Options::new(0.0), slab);
        self.gpu.guarded("samples", space.plan.source_bytes, || {
            self.gpu.queue.write_buffer(&space.source, 0, bytemuck::cast_slice(planes));
            let params = self.uniform(&params);
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&space.work_start, 0, &space.work, 0, size_of::<Work>() as u64);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            space.kernels.range.encode(&self.gpu, &mut pass, &space.bindings(self, &params), slab.bricks);
            drop(pass);
            encoder.copy_buffer_to_buffer(&space.work, Workspace::NON_FINITE, &space.odd, 0, 4);
            self.gpu.queue.submit([encoder.finish()]);
        })
    }

    fn uniform(&self, params: &Params) -> wgpu::Buffer {
        // Mapped at creation rather than written by the queue: commands already in the caller's
        // encoder keep the settings that they were recorded with.
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("params"),
            size: size_of::<Params>() as u64,
            usage: U::UNIFORM,
            mapped_at_creation: true,
        });
        if let Ok(mut view) = buffer.slice(..).get_mapped_range_mut() {
            view.copy_from_slice(bytemuck::bytes_of(params));
        }
        buffer.unmap();
        buffer
    }

    /// Records an extraction into the caller's encoder: no readback, no waiting. The mesh's header holds
    /// the draw arguments; when a buffer is too short, it draws nothing and says what is needed.
    ///
    /// # Errors
    /// [`ExtractError::Iso`]; [`ExtractError::Slabs`] for a grid that needs more than one slab.
    pub fn encode(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        mesh: &GpuMesh,
    ) -> Result<(), ExtractError> {
        self.encode_timed(space, encoder, options, mesh, &mut Timer::off())
    }

    fn encode_timed(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        mesh: &GpuMesh,
        timer: &mut Timer,
    ) -> Result<(), ExtractError> {
        if !options.iso.is_finite() {
            return Err(ExtractError::Iso(options.iso));
        }
        let [slab] = space.plan.slabs[..] else {
            return Err(ExtractError::Slabs { slabs: space.plan.slabs.len() });
        };
        let capacity = [mesh.vertex_capacity, mesh.triangle_capacity];
        let target = Target { mesh, window: [0; 2], capacity, first: [0; 2] };
        self.encode_count(space, encoder, options, slab, Some(&target), timer);
        self.encode_emit(space, encoder, options, slab, &target, timer);
        Ok(())
    }

    /// cull, sample, classify, scan: everything up to the totals.
    fn encode_count(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        slab: Slab,
        target: Option<&Target<'_>>,
        timer: &mut Timer,
    ) {
        let gpu = &self.gpu;
        let mut params = space.params(options, slab);
        if let Some(target) = target {
            [params.vertex_capacity, params.triangle_capacity] = target.capacity;
        }
        encoder.copy_buffer_to_buffer(&space.work_start, 0, &space.work, 0, size_of::<Work>() as u64);
        encoder.copy_buffer_to_buffer(&space.odd, 0, &space.work, Workspace::NON_FINITE, 4);
        let uniform = self.uniform(&params);
        let bindings = space.bindings(self, &uniform);
        // The scan over marks works on them in place of counts.
        let mut over_marks = bindings.clone();
        over_marks.set(b::COUNTS, &space.marks);
        {
            let mut pass = timer.pass(encoder, "cull", at::CULL);
            self.cull.encode_mark(gpu, &mut pass, &bindings, slab.bricks, space.is_volume);
            self.scan_marks.encode(gpu, &mut pass, &over_marks, slab.bricks);
            self.cull.encode_compact(gpu, &mut pass, &bindings, slab.bricks);
        }
        for batch in 0..space.plan.batches {
            params.first_slot = batch * space.plan.batch_slots;
            let uniform = self.uniform(&params);
            let bindings = space.bindings(self, &uniform);
            let offset = 24 * u64::from(batch);
            self.encode_sample(space, encoder, &bindings, offset, timer);
            let mut pass = timer.pass(encoder, "classify", at::CLASSIFY);
            space.kernels.classify.encode(gpu, &mut pass, &bindings, &space.dispatches, offset);
        }
        let mut pass = timer.pass(encoder, "scan", at::SCAN);
        self.scan_counts.encode(gpu, &mut pass, &bindings, slab.bricks);
        let mut with_header = bindings.clone();
        if let Some(target) = target {
            with_header.set(b::HEADER, &target.mesh.header);
        }
        space.kernels.emit.encode_totals(gpu, &mut pass, &with_header);
    }

    fn encode_sample(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &Bindings<'_>,
        offset: u64,
        timer: &mut Timer,
    ) {
        if let Some(sample) = &space.kernels.sample {
            let mut pass = timer.pass(encoder, "sample", at::SAMPLE);
            sample.encode(&self.gpu, &mut pass, bindings, &space.dispatches, offset);
        }
    }

    fn encode_emit(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        slab: Slab,
        target: &Target<'_>,
        timer: &mut Timer,
    ) {
        let mut params = space.params(options, slab);
        [params.first_vertex, params.first_triangle] = target.first;
        [params.vertex_window, params.triangle_window] = target.window;
        [params.vertex_capacity, params.triangle_capacity] = target.capacity;
        let [from, size] = [target.window, target.capacity]
            .map(|items| [0, 1].map(|i| u64::from(items[i]) * Target::BYTES[i]));
        for batch in 0..space.plan.batches {
            params.first_slot = batch * space.plan.batch_slots;
            let uniform = self.uniform(&params);
            let mut bindings = space.bindings(self, &uniform);
            bindings.set_window(b::VERTICES, &target.mesh.vertices, from[0], size[0]);
            bindings.set_window(b::INDICES, &target.mesh.indices, from[1], size[1]);
            let offset = 24 * u64::from(batch) + 12;
            if space.plan.batches > 1 {
                // The batch's samples were overwritten by later batches.
                self.encode_sample(space, encoder, &bindings, offset, timer);
            }
            let mut pass = timer.pass(encoder, "emit", at::EMIT);
            space.kernels.emit.encode(&self.gpu, &mut pass, &bindings, &space.dispatches, offset);
        }
    }

    /// Extracts `source` with buffers made for it: [`Extractor::prepare`] and
    /// [`Extractor::extract_in`] in one.
    ///
    /// # Errors
    /// As both.
    pub fn extract(&self, source: &Source<'_>, options: &Options) -> Result<Extraction, ExtractError> {
        self.extract_with(source, options, &|_| {})
    }

    /// [`Extractor::extract`]; `progress` hears how much is done, from 0 to 1.
    ///
    /// # Errors
    /// As [`Extractor::extract`].
    pub fn extract_with(
        &self,
        source: &Source<'_>,
        options: &Options,
        progress: &dyn Fn(f64),
    ) -> Result<Extraction, ExtractError> {
        let mut most_layers = u32::MAX;
        loop {
            let start = Instant::now();
            let space = self.prepare_layers(source, options.memory_budget, most_layers)?;
            let upload = start.elapsed().as_secs_f64();
            match self.extract_in(&space, source, options, progress) {
                // A slab's part of the mesh is more than the adapter binds: thinner slabs.
                Err(ExtractError::Binding { .. }) if space.layers() > 1 => {
                    most_layers = space.layers().div_ceil(2)
                }
                Err(error) => return Err(error),
                Ok(mut extraction) => {
                    *extraction.report.seconds[at::UPLOAD].get_or_insert(0.0) += upload;
                    return Ok(extraction);
                }
            }
        }
    }

    /// Extracts with the buffers of `space`, which `source` was prepared for: counts, reads the totals
    /// back once, allocates exactly, emits. `progress` hears how much is done, from 0 to 1.
    ///
    /// # Errors
    /// [`ExtractError::Iso`], [`ExtractError::Gpu`], [`ExtractError::Budget`], [`ExtractError::TooLarge`],
    /// [`ExtractError::Runaway`]; [`ExtractError::Binding`] if a slab's part of the mesh is more than
    /// the adapter binds.
    pub fn extract_in(
        &self,
        space: &Workspace,
        source: &Source<'_>,
        options: &Options,
        progress: &dyn Fn(f64),
    ) -> Result<Extraction, ExtractError> {
        check(source, options)?;
        let gpu = &self.gpu;
        let slabs = &space.plan.slabs;
        let cut = slabs.len() > 1;
        let mut seconds = [None; STAGES.len()];
        let mut timer = Timer::new(gpu)?;
        let mut steps = 0;
        let mut stepped = || {
            steps += 1;
            progress(f64::from(steps) / (2 * slabs.len()) as f64);
        };

        let work_bytes = size_of::<Work>() as u64;
        let usage = U::COPY_DST | U::COPY_SRC;
        let totals = gpu.buffer("totals", work_bytes * slabs.len() as u64, usage)?;
        for (i, &slab) in slabs.iter().enumerate() {
            if cut {
                self.upload_timed(space, source, slab, &mut seconds)?;
            }
            gpu.guarded("extraction", space.plan.bytes, || {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                self.encode_count(space, &mut encoder, options, slab, None, &mut timer);
                encoder.copy_buffer_to_buffer(&space.work, 0, &totals, i as u64 * work_bytes, work_bytes);
                gpu.queue.submit([encoder.finish()]);
            })?;
            if cut {
                timer.collect(gpu, &mut seconds)?;
                gpu.wait()?;
            }
            stepped();
        }
        let works: Vec<Work> =
            bytemuck::pod_collect_to_vec(&gpu.read(&totals, work_bytes * slabs.len() as u64)?);
        if works.iter().any(|w| w.runaway != 0) {
            return Err(ExtractError::Runaway { limit: MAX_ITERATIONS });
        }
        let places = places(&works)?;
        let (mesh, peak_bytes) = self.allocate(space, options, &places)?;
        for (&slab, place) in slabs.iter().zip(&places) {
            if place.count != [0; 2] {
                if cut {
                    self.upload_timed(space, source, slab, &mut seconds)?;
                }
                gpu.guarded("extraction", space.plan.bytes, || {
                    let mut encoder = gpu.device.create_command_encoder(&Default::default());
                    if cut {
                        self.encode_count(space, &mut encoder, options, slab, None, &mut timer);
                    }
                    let target = target(&mesh, place);
                    self.encode_emit(space, &mut encoder, options, slab, &target, &mut timer);
                    gpu.queue.submit([encoder.finish()]);
                })?;
                if cut {
                    timer.collect(gpu, &mut seconds)?;
                    self.check_loops(space)?;
                }
            }
            stepped();
        }
        let active_bricks = works.iter().map(|w| w.own_active).sum();
        let header = MeshHeader {
            index_count: 3 * mesh.triangle_capacity,
            instance_count: 1,
            vertices: mesh.vertex_capacity,
            triangles: mesh.triangle_capacity,
            active_bricks,
            non_finite: works.iter().map(|w| w.non_finite).sum(),
            ..MeshHeader::default()
        };
        gpu.queue.write_buffer(&mesh.header, 0, bytemuck::bytes_of(&header));
        timer.collect(gpu, &mut seconds)?;
        gpu.wait()?;
        self.check_loops(space)?;
        let report = Report {
            vertices: header.vertices.into(),
            triangles: header.triangles.into(),
            bricks: space.grid.brick_count(),
            active_bricks: active_bricks.into(),
            non_finite: works.iter().map(|w| u64::from(w.non_finite)).sum(),
            slabs: slabs.len() as u64,
            peak_bytes,
            seconds,
        };
        Ok(Extraction { mesh, report })
    }

    /// The lowest and highest finite value of `source`: of all samples of a volume, of a coarse grid's for
    /// a field. For telling users why a mesh is empty.
    ///
    /// # Errors
    /// As [`Extractor::extract`].
    pub fn value_range(&self, source: &Source<'_>) -> Result<Option<(f32, f32)>, ExtractError> {
        const CELLS: u32 = 31;
        let Source::Field(field, grid) = source else { return Ok(source.value_range()) };
        let cells = grid.cells().min(glam::UVec3::splat(CELLS));
        let stretch = grid.cells().as_vec3() / cells.as_vec3();
        let step = grid.step() * glam::Mat3::from_diagonal(stretch);
        let Ok(coarse) = Grid::new(cells.into(), grid.origin(), step) else { return Ok(None) };
        let space = self.prepare(&Source::Field(*field, coarse), u64::MAX)?;
        let [slab] = space.plan.slabs[..] else { return Ok(None) };
        let options = Options::new(0.0);
        let params = self.uniform(&space.params(&options, slab));
        self.gpu.guarded("value range", 0, || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            self.encode_count(&space, &mut encoder, &options, slab, None, &mut Timer::off());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            space.kernels.range.encode(&self.gpu, &mut pass, &space.bindings(self, &params), slab.bricks);
            drop(pass);
            self.gpu.queue.submit([encoder.finish()]);
        })?;
        let ranges = self.gpu.read(&space.ranges, 8 * u64::from(slab.bricks))?;
        let ranges: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&ranges);
        Ok(super::widest(&ranges))
    }

    fn upload_timed(
        &self,
        space: &Workspace,
        source: &Source<'_>,
        slab: Slab,
        seconds: &mut [Option<f64>],
    ) -> Result<(), GpuError> {
        let start = Instant::now();
        self.upload(space, source, slab)?;
        *seconds[at::UPLOAD].get_or_insert(0.0) += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Waits for the slab at hand, and looks whether a loop of the user's ran away in it.
    fn check_loops(&self, space: &Workspace) -> Result<(), ExtractError> {
        self.gpu.wait()?;
        if space.is_volume {
            return Ok(());
        }
        let work: Work = bytemuck::pod_read_unaligned(&self.gpu.read(&space.work, size_of::<Work>() as u64)?);
        if work.runaway != 0 { Err(ExtractError::Runaway { limit: MAX_ITERATIONS }) } else { Ok(()) }
    }

    /// The mesh's buffers, exactly as long as needed.
    fn allocate(
        &self,
        space: &Workspace,
        options: &Options,
        places: &[Place],
    ) -> Result<(GpuMesh, u64), ExtractError> {
        let total = places.last().map_or([0; 2], |p| [p.first[0] + p.count[0], p.first[1] + p.count[1]]);
        let mesh_bytes = u64::from(total[0]) * Target::BYTES[0] + u64::from(total[1]) * Target::BYTES[1];
        let (needed, budget) = (space.plan.bytes + mesh_bytes, options.memory_budget);
        if needed > budget {
            return Err(ExtractError::Budget { what: "the mesh with the scratch", needed, budget });
        }
        let limits = self.gpu.device.limits();
        for place in places {
            for i in 0..2 {
                let needed = (u64::from(place.count[i]) + u64::from(Target::ALIGNED[i])) * Target::BYTES[i];
                if needed > limits.max_storage_buffer_binding_size {
                    return Err(ExtractError::Binding {
                        bricks: space.plan.bricks.into(),
                        needed,
                        limit: limits.max_storage_buffer_binding_size,
                        adapter: self.gpu.info.name.clone(),
                    });
                }
            }
        }
        Ok((GpuMesh::with_capacity(&self.gpu, total[0], total[1])?, needed))
    }
}

/// The windows of the mesh's buffers that hold a slab's part, aligned as bindings must be.
fn target<'a>(mesh: &'a GpuMesh, place: &Place) -> Target<'a> {
    let window = [0, 1].map(|i| place.first[i] - place.first[i] % Target::ALIGNED[i]);
    let capacity = [0, 1].map(|i| place.first[i] + place.count[i] - window[i]);
    Target { mesh, window, capacity, first: place.first }
}

/// Where each slab's part of the mesh begins.
fn places(works: &[Work]) -> Result<Vec<Place>, ExtractError> {
    let [mut vertices, mut triangles] = [0u64; 2];
    let mut places = Vec::with_capacity(works.len());
    for work in works {
        let first = [vertices, triangles].map(|n| n as u32);
        places.push(Place { first, count: [work.vertices, work.triangles] });
        vertices += u64::from(work.vertices);
        triangles += u64::from(work.triangles);
        if vertices > u64::from(u32::MAX) || 3 * triangles > u64::from(u32::MAX) {
            return Err(ExtractError::TooLarge { vertices, triangles });
        }
    }
    Ok(places)
}

impl Workspace {
    /// Where in `Work` the count of samples that are not finite lies.
    const NON_FINITE: u64 = std::mem::offset_of!(Work, non_finite) as u64;

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

    fn layers(&self) -> u32 {
        let bricks = self.grid.bricks();
        self.plan.slabs[0].own_bricks / (bricks.x * bricks.y)
    }

    fn params(&self, options: &Options, slab: Slab) -> Params {
        Params {
            first_plane: if self.is_volume { slab.planes.0 } else { 0 },
            first_brick: slab.first_brick,
            slab_bricks: slab.bricks,
            own_bricks: slab.own_bricks,
            ..Params::new(&self.grid, options.iso, options.sense.unwrap_or(self.sense))
        }
    }

    fn bindings<'a>(&'a self, extractor: &'a Extractor, params: &'a wgpu::Buffer) -> Bindings<'a> {
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
            .set(b::FIELD, &self.field_parameters);
        bindings
    }
}
