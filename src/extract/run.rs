//! One extraction on the GPU: counting slab by slab, one allocation of the whole mesh, emitting.

use super::encode::{RunKernels, Target};
use super::plan::{self, Most, Plan, RECORD_BYTES, Slab};
use super::workspace::Workspace;
use super::{ExtractError, Extractor, Options, Report, STAGES, Source, check, stage_index as at};
use crate::field::user::MAX_ITERATIONS;
use crate::gpu::{GpuMesh, MeshHeader, Timer};
use crate::stage::params::Work;
use wgpu::BufferUsages as U;

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
    /// So many active bricks need room.
    Slots(u32),
    /// What there is to do does not fit beside the mesh: bytes of the mesh, and of reading it back.
    Short {
        mesh: u64,
        read: u64,
    },
}

/// Where a slab's vertices and triangles lie in the whole mesh.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) first: [u32; 2],
    pub(super) count: [u32; 2],
}

impl Extractor {
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
        // How many active bricks there are is known once they are counted, which is cheap; but a volume is long on its way.
        let mut most = match (source, self.most(source, options)) {
            (Source::Field(..), most) if u64::from(most.slots) < source.grid().brick_count() => {
                Most::at_first()
            }
            (_, most) => most,
        };
        let mut uploaded: Option<f64> = None;
        let mut old = None;
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
            let (space, upload) = match self.prepare_cut(
                source,
                &Options { memory_budget: budget - mesh, ..*options },
                most,
                old.take(),
            ) {
                Err(ExtractError::Budget { needed, .. }) if mesh > 0 => {
                    return Err(short(needed, mesh, read));
                }
                prepared => prepared?,
            };
            if let Some(seconds) = upload {
                *uploaded.get_or_insert(0.0) += seconds;
            }
            match (self.run(&space, source, options, read_back, progress), plan::finer(space.plan.own)) {
                // A slab's part of the mesh is more than the adapter binds: smaller slabs.
                (Err(ExtractError::Binding { .. }), Some(finer)) => most.own = finer,
                (Err(error), _) => return Err(error),
                (Ok(Run::Slots(needed)), finer) if space.plan.slots < most.slots.min(space.plan.bricks) => {
                    // More active bricks than the adapter binds records of: smaller slabs.
                    most.own =
                        finer.ok_or_else(|| self.unbindable(&space, u64::from(needed) * RECORD_BYTES))?;
                }
                (Ok(Run::Slots(needed)), _) => {
                    most.slots = needed;
                    old = Some(space);
                }
                (Ok(Run::Short { mesh: of_mesh, read: of_read }), _) => {
                    let least = space.plan.least_bytes;
                    if of_mesh.saturating_add(least.max(of_read)) > budget {
                        return Err(short(least, of_mesh, of_read));
                    }
                    // The mesh leaves less room than the scratch took: as much scratch as there is room for.
                    (mesh, read) = (of_mesh, of_read);
                }
                (Ok(Run::Done(mut extraction)), _) => {
                    if let Some(uploaded) = uploaded {
                        *extraction.report.seconds[at::UPLOAD].get_or_insert(0.0) += uploaded;
                    }
                    return Ok(*extraction);
                }
            }
        }
    }

    /// Extracts with the buffers of `space`, which `source` was prepared for: counts, reads the totals
    /// back once, allocates exactly, emits. `progress` hears how much is done, from 0 to 1. `source` may be another than the one
    /// before, as [`Extractor::set_source`] says. Calls from several threads on one workspace wait for each other; `progress` must not
    /// wait for one of them.
    ///
    /// # Errors
    /// [`ExtractError::Busy`], [`ExtractError::OtherSource`], [`ExtractError::Iso`], [`ExtractError::Epsilon`], [`ExtractError::Delta`], [`ExtractError::NoForm`],
    /// [`ExtractError::TooManyParameters`], [`ExtractError::TooManyBricks`], [`ExtractError::Gpu`], [`ExtractError::Budget`], [`ExtractError::TooLarge`],
    /// [`ExtractError::Slots`], [`ExtractError::Runaway`]; [`ExtractError::Binding`] if a slab's part of the mesh is more than
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
            Run::Slots(needed) => Err(ExtractError::Slots { needed, slots: space.plan.slots }),
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
        let _turn = space.turn()?;
        let done = self.run_slabs(space, source, options, read_back, progress);
        // They would keep a mesh alive that nobody wants any more.
        space.groups.forget();
        done
    }

    fn run_slabs(
        &self,
        space: &Workspace,
        source: &Source<'_>,
        options: &Options,
        read_back: bool,
        progress: &dyn Fn(f64),
    ) -> Result<Run, ExtractError> {
        check(source, options)?;
        let mut seconds = [None; STAGES.len()];
        self.take_source(space, source, &mut seconds[at::UPLOAD])?;
        let gpu = &self.gpu;
        let kernels = RunKernels::new(self, space, options)?;
        let slabs = space.plan.slab_count();
        let cut = slabs > 1;
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
                self.encode_count(space, &mut encoder, options, slab, (None, kernels), &mut timer);
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
        let needed = works.iter().map(|w| w.needed_slots).max().unwrap_or(0);
        if needed > space.plan.slots {
            return Ok(Run::Slots(needed));
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
        let mut is_marked = false;
        for (slab, place) in space.plan.slabs().zip(&places) {
            if place.count != [0; 2] {
                if cut {
                    self.upload_timed(space, source, slab, &mut seconds[at::UPLOAD])?;
                }
                gpu.guarded("extraction", space.plan.bytes, || {
                    let mut encoder = gpu.device.create_command_encoder(&Default::default());
                    if cut {
                        self.encode_count(space, &mut encoder, options, slab, (None, kernels), &mut timer);
                    }
                    let target = Target {
                        first_vertices: first_vertices(&space.plan, slab, &works, &places),
                        ..target(&mesh, place)
                    };
                    self.encode_emit(space, &mut encoder, options, slab, (&target, kernels), &mut timer);
                    gpu.queue.submit([encoder.finish()]);
                })?;
                timer.collect(gpu, &mut seconds)?;
                is_marked |= self.after_emit(space)?.singular != 0;
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
        if is_marked {
            self.run_normals(space, options, &mesh, &places, &mut timer)?;
        }
        timer.collect(gpu, &mut seconds)?;
        gpu.wait()?;
        let report = Report {
            vertices: header.vertices.into(),
            triangles: header.triangles.into(),
            bricks: space.grid.brick_count(),
            active_bricks: active_bricks.into(),
            non_finite: works.iter().map(|w| u64::from(w.non_finite)).sum(),
            open_edges: None,
            slabs: slabs as u64,
            peak_bytes,
            scratch_bytes: space.plan.scratch_bytes,
            seconds,
        };
        Ok(Run::Done(Box::new(Extraction { mesh, report })))
    }

    /// Waits for the slab at hand, and gives what emit counted, unless a loop of the user's ran away in it.
    fn after_emit(&self, space: &Workspace) -> Result<Work, ExtractError> {
        let work: Work = self.gpu.read_one(&space.work)?;
        if work.runaway != 0 { Err(ExtractError::Runaway { limit: MAX_ITERATIONS }) } else { Ok(work) }
    }

    pub(super) fn unbindable(&self, space: &Workspace, needed: u64) -> ExtractError {
        ExtractError::Binding {
            bricks: space.plan.bricks.into(),
            needed,
            limit: self.gpu.device.limits().max_storage_buffer_binding_size,
            adapter: self.gpu.info.name.clone(),
        }
    }

    /// Vertices and triangles of the whole mesh, if the adapter holds them and binds each slab's part.
    fn bindable(&self, space: &Workspace, places: &[Place]) -> Result<[u32; 2], ExtractError> {
        let total = places.last().map_or([0; 2], |p| [p.first[0] + p.count[0], p.first[1] + p.count[1]]);
        let limits = self.gpu.device.limits();
        for place in places {
            for i in 0..2 {
                let needed = (u64::from(place.count[i]) + u64::from(Target::ALIGNED[i])) * Target::BYTES[i];
                if needed > limits.max_storage_buffer_binding_size {
                    return Err(self.unbindable(space, needed));
                }
            }
        }
        // The mesh's buffers have one item to spare, and whole blocks of 16 bytes.
        self.fits(total, limits.max_buffer_size.saturating_sub(40))?;
        Ok(total)
    }
}

/// The windows of the mesh's buffers that hold a slab's part, aligned as bindings must be.
pub(super) fn target<'a>(mesh: &'a GpuMesh, place: &Place) -> Target<'a> {
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
