//! The GPU path: [`Extractor`] holds the pipelines, [`Workspace`] the buffers for one source, and
//! [`Options`] the cheap settings of a call.

use super::encode::Target;
use super::plan::{self, Limits, Plan, Slab};
use super::workspace::{SourceKernels, Workspace};
use super::{ExtractError, Options, Report, STAGES, Source, check, stage_index as at};
use crate::field::user::MAX_ITERATIONS;
use crate::field::{PARAMETER_VECTORS, Wgsl};
use crate::gpu::{Gpu, GpuError, GpuMesh, MeshHeader, Timer};
use crate::grid::Grid;
use crate::stage::cull::Cull;
use crate::stage::params::Work;
use crate::stage::scan::Scan;
use crate::stage::shaders::Samples;
use crate::table::MARCHING_CUBES;
use glam::UVec3;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use wgpu::BufferUsages as U;

/// The pipelines of extraction on one device, compiled once; a field's are compiled when it is first
/// seen, and changing its parameters compiles nothing.
#[derive(Debug)]
pub struct Extractor {
    pub(super) gpu: Gpu,
    pub(super) cull: Cull,
    pub(super) scan_marks: Scan,
    pub(super) scan_counts: Scan,
    pub(super) table: wgpu::Buffer,
    pub(super) volume: Arc<SourceKernels>,
    pub(super) fields: Mutex<HashMap<[Arc<str>; 3], Arc<SourceKernels>>>,
}

/// A mesh and how it was made.
#[derive(Debug)]
pub struct Extraction {
    /// The mesh, on the GPU.
    pub mesh: GpuMesh,
    /// Counts, bytes and times.
    pub report: Report,
}

/// How a run ended.
enum Run {
    Done(Box<Extraction>),
    /// What there is to do does not fit beside the mesh: bytes of the mesh, and of reading it back.
    Short {
        mesh: u64,
        read: u64,
    },
}

/// Where a slab's vertices and triangles lie in the whole mesh.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    first: [u32; 2],
    count: [u32; 2],
}

impl Extractor {
    /// Compiles the pipelines on `gpu`: one that the crate opened ([`Gpu::open`]) or the caller's own
    /// ([`Gpu::from_device`]).
    ///
    /// # Errors
    /// [`ExtractError::Gpu`].
    pub fn new(gpu: Gpu) -> Result<Self, ExtractError> {
        let table = gpu.buffer("table", 2048, U::UNIFORM | U::COPY_DST)?;
        gpu.write(&table, bytemuck::cast_slice(MARCHING_CUBES.words()))?;
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
        let none = || Arc::from("");
        let [gradient, interval] = [&wgsl.gradient, &wgsl.interval].map(|t| t.clone().unwrap_or_else(none));
        let key = [wgsl.value.clone(), gradient, interval];
        if let Some(kernels) = fields.get(&key) {
            return Ok(kernels.clone());
        }
        let kernels = Arc::new(SourceKernels::new(&self.gpu, Samples::Field(wgsl))?);
        fields.insert(key, kernels.clone());
        Ok(kernels)
    }

    /// Makes the buffers for `source` within `memory_budget` bytes, and uploads a volume that fits in
    /// one slab.
    ///
    /// # Errors
    /// [`ExtractError::Gpu`], [`ExtractError::NoForm`], [`ExtractError::Budget`],
    /// [`ExtractError::Binding`], [`ExtractError::TooManyBricks`].
    pub fn prepare(&self, source: &Source<'_>, memory_budget: u64) -> Result<Workspace, ExtractError> {
        Ok(self.prepare_cut(source, memory_budget, UVec3::MAX)?.0)
    }

    /// [`Extractor::prepare`] with slabs that own at most `most` bricks an axis, and the seconds of the
    /// upload if there was one.
    fn prepare_cut(
        &self,
        source: &Source<'_>,
        memory_budget: u64,
        most: UVec3,
    ) -> Result<(Workspace, Option<f64>), ExtractError> {
        check(source, &Options { memory_budget, ..Options::new(0.0) })?;
        let gpu = &self.gpu;
        let device_limits = gpu.device.limits();
        let binding = device_limits.max_storage_buffer_binding_size.min(device_limits.max_buffer_size);
        let (kernels, data) = match source {
            Source::Volume(_) => (self.volume.clone(), Arc::default()),
            Source::Field(field, _) => {
                let wgsl = field.wgsl()?;
                (self.field_kernels(&wgsl)?, wgsl.data)
            }
        };
        let data_bytes = size_of_val(&*data) as u64;
        if data_bytes > binding {
            let adapter = gpu.info.name.clone();
            return Err(ExtractError::FieldData { needed: data_bytes, limit: binding, adapter });
        }
        let limits = Limits {
            binding,
            budget: memory_budget,
            // In main memory, on the way, and on the GPU.
            fixed: 3 * data_bytes,
            adapter: &gpu.info.name,
        };
        let is_volume = matches!(source, Source::Volume(_));
        let plan = Plan::new(source.grid(), is_volume, limits, most)?;
        let workspace = Workspace::new(gpu, source, plan, kernels, data)?;
        self.set_source(&workspace, source)?;
        let mut upload = None;
        if workspace.plan.slab_count() == 1 {
            self.upload_timed(&workspace, source, workspace.plan.slab(0), &mut upload)?;
        }
        Ok((workspace, upload))
    }

    /// Checks that `space` was made for such a source, and takes over a field's parameters.
    ///
    /// A workspace serves any source with the same grid and, for fields, the same WGSL: so a changed
    /// parameter compiles and allocates nothing. [`Extractor::extract_in`] does this by itself; before
    /// [`Extractor::encode`] it is the caller's to do. A volume's samples are those it was prepared with.
    ///
    /// # Errors
    /// [`ExtractError::OtherSource`], [`ExtractError::TooManyParameters`], [`ExtractError::NoForm`],
    /// [`ExtractError::Gpu`].
    pub fn set_source(&self, space: &Workspace, source: &Source<'_>) -> Result<(), ExtractError> {
        let same_kind = matches!(source, Source::Volume(_)) == space.is_volume;
        if !same_kind || *source.grid() != space.grid {
            return Err(ExtractError::OtherSource);
        }
        let Source::Field(field, _) = source else { return Ok(()) };
        let wgsl = field.wgsl()?;
        let same_data = Arc::ptr_eq(&wgsl.data, &space.field_data) || wgsl.data == space.field_data;
        if !same_data || !Arc::ptr_eq(&self.field_kernels(&wgsl)?, &space.kernels) {
            return Err(ExtractError::OtherSource);
        }
        let given = wgsl.parameters.len();
        // The last place stays 0 (shaders/graph/exact.wgsl).
        if given >= 4 * PARAMETER_VECTORS {
            return Err(ExtractError::TooManyParameters { given });
        }
        Ok(self.gpu.write(&space.field_parameters, bytemuck::cast_slice(&wgsl.parameters))?)
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

    /// Extracts `source` with buffers made for it: [`Extractor::prepare`] and
    /// [`Extractor::extract_in`] in one.
    ///
    /// # Errors
    /// As both.
    pub fn extract(&self, source: &Source<'_>, options: &Options) -> Result<Extraction, ExtractError> {
        self.extract_with(source, options, false, &|_| {})
    }

    /// [`Extractor::extract`]; `progress` hears how much is done, from 0 to 1. With `read_back` the budget
    /// must also hold what [`GpuMesh::read`] takes beside the mesh, so that a mesh that cannot be read is
    /// refused before it is made.
    ///
    /// # Errors
    /// As [`Extractor::extract`].
    pub fn extract_with(
        &self,
        source: &Source<'_>,
        options: &Options,
        read_back: bool,
        progress: &dyn Fn(f64),
    ) -> Result<Extraction, ExtractError> {
        let budget = options.memory_budget;
        let mut most = UVec3::MAX;
        // Known once the mesh is counted.
        let (mut mesh, mut read) = (0, 0);
        // The one figure that suffices: what `least` bytes of scratch and the mesh take, and reading it.
        let short = |least: u64, mesh: u64, read: u64| {
            let [scratch, read] = [least, read].map(|bytes| mesh.saturating_add(bytes));
            let what = if read > scratch {
                "the mesh on the GPU and in main memory"
            } else {
                "the mesh with the scratch"
            };
            ExtractError::Budget { what, needed: scratch.max(read), budget }
        };
        loop {
            let (space, upload) = match self.prepare_cut(source, budget - mesh, most) {
                Err(ExtractError::Budget { needed, .. }) if mesh > 0 => {
                    return Err(short(needed, mesh, read));
                }
                prepared => prepared?,
            };
            match (self.run(&space, source, options, read_back, progress), plan::finer(space.plan.own)) {
                // A slab's part of the mesh is more than the adapter binds: smaller slabs.
                (Err(ExtractError::Binding { .. }), Some(finer)) => most = finer,
                (Err(error), _) => return Err(error),
                (Ok(Run::Short { mesh: of_mesh, read: of_read }), _) => {
                    let least = space.plan.least_bytes;
                    if of_mesh.saturating_add(least.max(of_read)) > budget {
                        return Err(short(least, of_mesh, of_read));
                    }
                    // The mesh leaves less room than the scratch took: as much scratch as there is room for.
                    (mesh, read) = (of_mesh, of_read);
                }
                (Ok(Run::Done(mut extraction)), _) => {
                    if let Some(upload) = upload {
                        *extraction.report.seconds[at::UPLOAD].get_or_insert(0.0) += upload;
                    }
                    return Ok(*extraction);
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
    /// the adapter binds; [`ExtractError::MeshBuffer`] if the whole is more than a buffer of it.
    pub fn extract_in(
        &self,
        space: &Workspace,
        source: &Source<'_>,
        options: &Options,
        progress: &dyn Fn(f64),
    ) -> Result<Extraction, ExtractError> {
        match self.run(space, source, options, false, progress)? {
            Run::Done(extraction) => Ok(*extraction),
            Run::Short { mesh, .. } => {
                let (needed, budget) = (space.plan.bytes + mesh, options.memory_budget);
                Err(ExtractError::Budget { what: "the mesh with the scratch", needed, budget })
            }
        }
    }

    fn run(
        &self,
        space: &Workspace,
        source: &Source<'_>,
        options: &Options,
        read_back: bool,
        progress: &dyn Fn(f64),
    ) -> Result<Run, ExtractError> {
        check(source, options)?;
        self.set_source(space, source)?;
        let gpu = &self.gpu;
        let slabs = space.plan.slab_count();
        let cut = slabs > 1;
        let mut seconds = [None; STAGES.len()];
        let mut timer = Timer::new(gpu)?;
        let mut steps = 0;
        let mut stepped = || {
            steps += 1;
            progress(f64::from(steps) / (2 * slabs) as f64);
        };

        let work_bytes = size_of::<Work>() as u64;
        let usage = U::COPY_DST | U::COPY_SRC;
        let totals = gpu.buffer("totals", work_bytes * slabs as u64, usage)?;
        for slab in space.plan.slabs() {
            if cut {
                self.upload_timed(space, source, slab, &mut seconds[at::UPLOAD])?;
            }
            gpu.guarded("extraction", space.plan.bytes, || {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                self.encode_count(space, &mut encoder, options, slab, None, &mut timer);
                encoder.copy_buffer_to_buffer(
                    &space.work,
                    0,
                    &totals,
                    slab.index as u64 * work_bytes,
                    work_bytes,
                );
                gpu.queue.submit([encoder.finish()]);
            })?;
            if cut {
                timer.collect(gpu, &mut seconds)?;
                gpu.wait()?;
            }
            stepped();
        }
        let works: Vec<Work> = gpu.read(&totals, slabs as u64)?;
        if works.iter().any(|w| w.runaway != 0) {
            return Err(ExtractError::Runaway { limit: MAX_ITERATIONS });
        }
        let places = places(&works)?;
        let total = self.bindable(space, &places)?;
        let mesh_bytes = GpuMesh::bytes_for(total[0], total[1]);
        let read = if read_back { GpuMesh::read_bytes_for(total[0], total[1]) } else { 0 };
        let peak_bytes = mesh_bytes + space.plan.bytes.max(read);
        if peak_bytes > options.memory_budget {
            return Ok(Run::Short { mesh: mesh_bytes, read });
        }
        let mesh = GpuMesh::with_capacity(gpu, total[0], total[1])?;
        for (slab, place) in space.plan.slabs().zip(&places) {
            if place.count != [0; 2] {
                if cut {
                    self.upload_timed(space, source, slab, &mut seconds[at::UPLOAD])?;
                }
                gpu.guarded("extraction", space.plan.bytes, || {
                    let mut encoder = gpu.device.create_command_encoder(&Default::default());
                    if cut {
                        self.encode_count(space, &mut encoder, options, slab, None, &mut timer);
                    }
                    let target = Target {
                        first_vertices: first_vertices(&space.plan, slab, &works, &places),
                        ..target(&mesh, place)
                    };
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
            non_finite: works.iter().fold(0, |sum, w| sum.saturating_add(w.non_finite)),
            ..MeshHeader::default()
        };
        gpu.write(&mesh.header, bytemuck::bytes_of(&header))?;
        timer.collect(gpu, &mut seconds)?;
        gpu.wait()?;
        self.check_loops(space)?;
        let report = Report {
            vertices: header.vertices.into(),
            triangles: header.triangles.into(),
            bricks: space.grid.brick_count(),
            active_bricks: active_bricks.into(),
            non_finite: works.iter().map(|w| u64::from(w.non_finite)).sum(),
            slabs: slabs as u64,
            peak_bytes,
            seconds,
        };
        Ok(Run::Done(Box::new(Extraction { mesh, report })))
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
        let slab = space.plan.slab(0);
        let options = Options { cull: false, ..Options::new(0.0) };
        let params = self.uniform(&space.params(&options, slab));
        self.gpu.guarded("value range", 0, || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            self.encode_count(&space, &mut encoder, &options, slab, None, &mut Timer::off());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            space.kernels.range.encode(&self.gpu, &mut pass, &space.bindings(self, &params), slab.bricks());
            drop(pass);
            self.gpu.queue.submit([encoder.finish()]);
        })?;
        Ok(super::widest(&self.gpu.read(&space.ranges, slab.bricks().into())?))
    }

    fn upload_timed(
        &self,
        space: &Workspace,
        source: &Source<'_>,
        slab: Slab,
        seconds: &mut Option<f64>,
    ) -> Result<(), GpuError> {
        let Source::Volume(volume) = source else { return Ok(()) };
        let start = Instant::now();
        self.upload(space, volume, slab)?;
        *seconds.get_or_insert(0.0) += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Waits for the slab at hand, and looks whether a loop of the user's ran away in it.
    fn check_loops(&self, space: &Workspace) -> Result<(), ExtractError> {
        self.gpu.wait()?;
        if space.is_volume {
            return Ok(());
        }
        let work: Work = self.gpu.read_one(&space.work)?;
        if work.runaway != 0 { Err(ExtractError::Runaway { limit: MAX_ITERATIONS }) } else { Ok(()) }
    }

    /// Vertices and triangles of the whole mesh, if the adapter holds them and binds each slab's part.
    fn bindable(&self, space: &Workspace, places: &[Place]) -> Result<[u32; 2], ExtractError> {
        let total = places.last().map_or([0; 2], |p| [p.first[0] + p.count[0], p.first[1] + p.count[1]]);
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
        // The mesh's buffers have one item to spare, and whole blocks of 16 bytes.
        self.fits(total, limits.max_buffer_size.saturating_sub(40))?;
        Ok(total)
    }

    /// Whether so many vertices and triangles take at most `limit` bytes each.
    pub(super) fn fits(&self, items: [u32; 2], limit: u64) -> Result<(), ExtractError> {
        for i in 0..2 {
            let needed = u64::from(items[i]) * Target::BYTES[i];
            if needed > limit {
                let what = ["the mesh's vertices", "the mesh's triangles"][i];
                return Err(ExtractError::MeshBuffer {
                    what,
                    needed,
                    limit,
                    adapter: self.gpu.info.name.clone(),
                });
            }
        }
        Ok(())
    }
}

/// The windows of the mesh's buffers that hold a slab's part, aligned as bindings must be.
fn target<'a>(mesh: &'a GpuMesh, place: &Place) -> Target<'a> {
    let window = [0, 1].map(|i| place.first[i] - place.first[i] % Target::ALIGNED[i]);
    let capacity = [0, 1].map(|i| place.first[i] + place.count[i] - window[i]);
    Target { mesh, window, capacity, first_vertices: [0; 4], first_triangle: place.first[1] }
}

/// What makes an offset within `slab` a vertex's number in the whole mesh, for each run of its bricks.
fn first_vertices(plan: &Plan, slab: Slab, works: &[Work], places: &[Place]) -> [u32; 4] {
    [0, 1, 2, 3].map(|run| {
        let (run, beginning) = plan.run_of_halo(slab, run);
        places[beginning].first[0].wrapping_sub(works[slab.index].run_vertices[run])
    })
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
