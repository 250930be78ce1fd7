//! The GPU path: [`Extractor`] holds the pipelines, [`Workspace`] the buffers for one source, and
//! [`Options`] the cheap settings of a call.

use super::encode::{RunKernels, Target};
use super::plan::{Limits, Most, Plan, RECORD_BYTES, Slab};
use super::workspace::{SourceKernels, Workspace};
use super::{ExtractError, Options, Source, check};
use crate::field::{PARAMETER_VECTORS, Wgsl};
use crate::gpu::kernel::{Latest, binding as b};
use crate::gpu::{Gpu, GpuError, Timer};
use crate::grid::Grid;
use crate::stage::cull::Cull;
use crate::stage::normals::Normals;
use crate::stage::scan::{Scan, Scanned};
use crate::stage::shaders::{self, Samples};
use crate::volume::Scalar;
use std::sync::Arc;
use std::time::Instant;
use wgpu::BufferUsages as U;

/// The WGSL of a field.
type Texts = [Arc<str>; 4];

/// The pipelines of extraction on one device, compiled once; a field's are compiled when it is first
/// seen (those of the last 64 are kept), and changing its parameters compiles nothing.
#[derive(Debug)]
pub struct Extractor {
    pub(crate) gpu: Gpu,
    pub(super) cull: Cull,
    pub(super) scan_map: Scan,
    pub(super) scan_bricks: Scan,
    pub(crate) scan_counts: Scan,
    pub(super) normals: Normals,
    pub(super) table: wgpu::Buffer,
    /// Of volumes, by the type of their samples.
    volumes: Latest<Scalar, SourceKernels>,
    pub(crate) track: crate::track::Kernels,
    pub(crate) refine: crate::refine::Kernels,
    fields: Latest<Texts, SourceKernels>,
}

impl Extractor {
    /// Compiles the pipelines that all sources share on `gpu`: one that the crate opened ([`Gpu::open`]) or the caller's own
    /// ([`Gpu::from_device`]).
    ///
    /// # Errors
    /// [`ExtractError::Gpu`].
    pub fn new(gpu: Gpu) -> Result<Self, ExtractError> {
        let words = shaders::table_words();
        let table = gpu.buffer("table", 4 * words.len() as u64, U::STORAGE | U::COPY_DST)?;
        gpu.write(&table, bytemuck::cast_slice(&words))?;
        Ok(Self {
            cull: Cull::new(&gpu)?,
            scan_map: Scan::new(&gpu, Scanned::Map)?,
            scan_bricks: Scan::new(&gpu, Scanned::Bricks)?,
            scan_counts: Scan::new(&gpu, Scanned::Counts)?,
            normals: Normals::new(&gpu)?,
            table,
            volumes: Default::default(),
            track: Default::default(),
            refine: Default::default(),
            fields: Default::default(),
            gpu,
        })
    }

    /// The device that the pipelines are on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    fn volume_kernels(&self, scalar: Scalar) -> Result<Arc<SourceKernels>, GpuError> {
        self.volumes.get(scalar, || SourceKernels::new(&self.gpu, Samples::Volume(scalar)))
    }

    fn field_kernels(&self, wgsl: &Wgsl) -> Result<Arc<SourceKernels>, GpuError> {
        let none = || Arc::from("");
        let planes = wgsl.planes.as_ref().map(|planes| planes.text.clone());
        let [gradient, interval, planes] =
            [wgsl.gradient.clone(), wgsl.interval.clone(), planes].map(|t| t.unwrap_or_else(none));
        let key = [wgsl.value.clone(), gradient, interval, planes];
        self.fields.get(key, || SourceKernels::new(&self.gpu, Samples::Field(wgsl)))
    }

    /// Makes the buffers for `source` within `memory_budget` bytes, compiles its kernels (with exact normals) and
    /// uploads a volume that fits in one slab. There is room for all bricks of a grid of 256³ cells, and in larger ones
    /// for as many active bricks as a surface without many folds has; [`Extractor::prepare_for`] makes room for more.
    ///
    /// # Errors
    /// [`ExtractError::Gpu`], [`ExtractError::NoForm`], [`ExtractError::TooManyParameters`], [`ExtractError::FieldData`],
    /// [`ExtractError::Budget`], [`ExtractError::Binding`], [`ExtractError::TooManyBricks`].
    pub fn prepare(&self, source: &Source<'_>, memory_budget: u64) -> Result<Workspace, ExtractError> {
        let options = Options { memory_budget, ..Options::new(0.0) };
        Ok(self.prepare_cut(source, &options, self.most(source, &options), None)?.0)
    }

    /// What is asked for at first where nothing is known of the surface: of a field that no interval culls all bricks are
    /// active.
    pub(crate) fn most(&self, source: &Source<'_>, options: &Options) -> Most {
        let is_culled = match source {
            Source::Field(field, _) => options.cull && field.wgsl().is_ok_and(|wgsl| wgsl.interval.is_some()),
            Source::Volume(_) => true,
        };
        if is_culled { Most::guess(source.grid()) } else { Most::all(source.grid()) }
    }

    /// [`Extractor::prepare`] with room for `active_bricks` bricks that hold surface, 433 bytes each and 2916 more for the
    /// samples of a field: what a header with [`crate::gpu::Overflow::Bricks`] or [`ExtractError::Slots`] says.
    ///
    /// # Errors
    /// As [`Extractor::prepare`]; [`ExtractError::Binding`] if the adapter binds no records of so many.
    pub fn prepare_for(
        &self,
        source: &Source<'_>,
        memory_budget: u64,
        active_bricks: u32,
    ) -> Result<Workspace, ExtractError> {
        let options = Options { memory_budget, ..Options::new(0.0) };
        let most = Most { slots: active_bricks.max(1), ..Most::at_first() };
        let space = self.prepare_cut(source, &options, most, None)?.0;
        if space.plan.slots < most.slots.min(space.plan.bricks) {
            return Err(self.unbindable(&space, u64::from(most.slots) * RECORD_BYTES));
        }
        Ok(space)
    }

    /// [`Extractor::prepare`] with slabs as large as `most` allows, and the seconds of the upload if there was one. A
    /// volume that `old` has on the GPU stays there.
    pub(crate) fn prepare_cut(
        &self,
        source: &Source<'_>,
        options: &Options,
        most: Most,
        old: Option<Workspace>,
    ) -> Result<(Workspace, Option<f64>), ExtractError> {
        check(source, options)?;
        let gpu = &self.gpu;
        let device_limits = gpu.device.limits();
        let binding = device_limits.max_storage_buffer_binding_size.min(device_limits.max_buffer_size);
        let (kernels, data) = match source {
            Source::Volume(volume) => (self.volume_kernels(volume.values().scalar())?, Arc::default()),
            Source::Field(field, _) => {
                let wgsl = field.wgsl()?;
                super::check_parameters(&wgsl)?;
                (self.field_kernels(&wgsl)?, wgsl.data)
            }
        };
        kernels.vertices(gpu, options)?;
        let data_bytes = size_of_val(&*data) as u64;
        if data_bytes > binding {
            let adapter = gpu.info.name.clone();
            return Err(ExtractError::FieldData { needed: data_bytes, limit: binding, adapter });
        }
        let limits = Limits {
            binding,
            budget: options.memory_budget,
            // Data in main memory, on the way, and on the GPU; and the buffer of parameters.
            fixed: 3 * data_bytes + 16 * PARAMETER_VECTORS as u64,
            adapter: &gpu.info.name,
        };
        let plan = Plan::new(source.grid(), source.scalar(), limits, most)?;
        let uploaded = old.filter(|_| plan.slab_count() == 1).and_then(Workspace::into_uploaded);
        let workspace = Workspace::new(gpu, source, plan, kernels, data, uploaded)?;
        workspace.kernels.sampling(gpu, options.method, workspace.is_aligned)?;
        let mut upload = None;
        self.take_source(&workspace, source, &mut upload)?;
        Ok((workspace, upload))
    }

    /// Checks that `space` was made for such a source, and takes over a field's parameters and sense, or another volume's samples.
    ///
    /// A workspace serves any source with the same grid and, for fields, the same WGSL, for volumes the same type of samples:
    /// so a changed parameter compiles and allocates nothing, and a volume is uploaded where it is not the one that lies there.
    /// [`Extractor::extract_in`] does this by itself; before [`Extractor::encode`] it is the caller's to do.
    ///
    /// The new parameters and samples reach the GPU before all that is submitted afterwards, **also what was recorded before**: submit
    /// what an encoder has of the old ones first, or have a workspace for each. Iso value and other options are recorded. While another
    /// thread extracts in the workspace, this waits.
    ///
    /// # Errors
    /// [`ExtractError::Busy`], [`ExtractError::OtherSource`], [`ExtractError::TooManyParameters`], [`ExtractError::NoForm`],
    /// [`ExtractError::Gpu`].
    pub fn set_source(&self, space: &Workspace, source: &Source<'_>) -> Result<(), ExtractError> {
        let _turn = space.turn()?;
        self.take_source(space, source, &mut None)
    }

    /// [`Extractor::set_source`]; adds the seconds of an upload.
    pub(super) fn take_source(
        &self,
        space: &Workspace,
        source: &Source<'_>,
        seconds: &mut Option<f64>,
    ) -> Result<(), ExtractError> {
        if source.scalar() != space.scalar || *source.grid() != space.grid {
            return Err(ExtractError::OtherSource);
        }
        let field = match source {
            Source::Field(field, _) => field,
            // Of several slabs each is uploaded when its turn comes.
            Source::Volume(volume) => {
                if space.plan.slab_count() == 1 && space.taken().volume != Some(volume.id()) {
                    space.taken().volume = None;
                    self.upload_timed(space, source, space.plan.slab(0), seconds)?;
                    space.taken().volume = Some(volume.id());
                }
                return Ok(());
            }
        };
        let wgsl = field.wgsl()?;
        super::check_parameters(&wgsl)?;
        let same_data = Arc::ptr_eq(&wgsl.data, &space.field_data) || wgsl.data == space.field_data;
        if !same_data || !Arc::ptr_eq(&self.field_kernels(&wgsl)?, &space.kernels) {
            return Err(ExtractError::OtherSource);
        }
        space.taken().sense = field.sense();
        Ok(self.gpu.write(&space.field_parameters, bytemuck::cast_slice(&wgsl.parameters))?)
    }

    /// Fills the scratch with a pattern, so that what a stage did not write shows.
    pub(crate) fn poison(&self, space: &Workspace) {
        let buffers = space.buffers();
        let scratch = [
            buffers.map,
            buffers.active,
            buffers.records,
            buffers.counts,
            &space.partials,
            &space.boxes,
            &space.dispatches,
            &space.work,
        ];
        let samples = buffers.has_samples.then_some(buffers.source);
        for buffer in scratch.into_iter().chain(samples) {
            self.gpu.queue.write_buffer(buffer, 0, &vec![0xcd; buffer.size() as usize]);
        }
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
        let kernels = RunKernels::new(self, &space, &options)?.leaving_all_samples();
        let params = self.settings(&space, &space.params(&options, slab));
        let (bytes, usage) = (8 * u64::from(slab.bricks()), U::STORAGE | U::COPY_SRC);
        let ranges = self.gpu.buffer("brick ranges", bytes, usage)?;
        self.gpu.guarded("value range", 0, || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            self.encode_count(&space, &mut encoder, &options, slab, (None, kernels), &mut Timer::off());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            let mut bindings = space.bindings(self, &params);
            bindings.set(b::RANGES, &ranges);
            space.kernels.range.encode(&self.gpu, &mut pass, &bindings, slab.bricks());
            drop(pass);
            self.gpu.queue.submit([encoder.finish()]);
        })?;
        Ok(super::widest(&self.gpu.read(&ranges, slab.bricks().into())?))
    }

    pub(super) fn upload_timed(
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
