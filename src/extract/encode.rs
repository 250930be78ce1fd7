//! Recording the stages of one slab into a command encoder.

use super::plan::Slab;
use super::workspace::{MethodKernels, Workspace};
use super::{ExtractError, Extractor, Options, stage_index as at};
use crate::gpu::kernel::{Bindings, binding as b};
use crate::gpu::{GpuError, GpuMesh, Settings, Timer};
use crate::mesh::Vertex;
use crate::stage::classify::Classify;
use crate::stage::dispatches;
use crate::stage::emit::Vertices;
use crate::stage::params::{Params, Work};

/// The kernels of a run that depend on its options.
#[derive(Clone, Copy)]
pub(crate) struct RunKernels<'a> {
    method: &'a MethodKernels,
    /// Classify that takes the samples itself, where it may.
    sampling: Option<&'a Classify>,
    vertices: &'a Vertices,
}

impl<'a> RunKernels<'a> {
    /// Those of runs in `space`, compiled where it is the first such run.
    pub(crate) fn new(
        extractor: &Extractor,
        space: &'a Workspace,
        options: &Options,
    ) -> Result<Self, GpuError> {
        let (gpu, kernels) = (&extractor.gpu, &space.kernels);
        // The tracker has taken the samples before.
        let sampling = match space.is_marked {
            true => None,
            false => kernels.sampling(gpu, options.method, space.is_aligned)?,
        };
        Ok(Self {
            method: kernels.of(gpu, options.method)?,
            sampling,
            vertices: kernels.vertices(gpu, options)?,
        })
    }

    /// With the sample stage, which leaves the samples of all active bricks: classify that takes them itself leaves those with surface.
    pub(super) fn leaving_all_samples(self) -> Self {
        Self { sampling: None, ..self }
    }
}

/// The buffers that emit writes, and the windows of them that are bound.
pub(super) struct Target<'a> {
    pub(super) mesh: &'a GpuMesh,
    pub(super) window: [u32; 2],
    pub(super) capacity: [u32; 2],
    pub(super) first_vertices: [u32; 4],
    pub(super) first_triangle: u32,
}

impl Target<'_> {
    /// Items whose bytes are a whole number of the largest offset alignment (256), by vertices of 24
    /// and triangles of 12 bytes.
    pub(super) const ALIGNED: [u32; 2] = [32, 64];
    pub(super) const BYTES: [u64; 2] = [size_of::<Vertex>() as u64, 12];
}

impl Extractor {
    /// `params` for the kernels of a run in `space`.
    pub(crate) fn settings(&self, space: &Workspace, params: &Params) -> Settings {
        space.uniforms.settings(&self.gpu, &params.uniform(), &params.call())
    }

    /// Records an extraction into the caller's encoder: no readback, no waiting. The mesh's header holds
    /// the draw arguments; when a buffer is too short, it draws nothing and says what is needed.
    ///
    /// A field's parameters and a volume's samples are those that [`Extractor::set_source`] set last when the encoder is submitted.
    ///
    /// Frames after the first with the same workspace and mesh make no buffer and no bind group, whatever iso value, sense or
    /// parameters, if the device has immediates ([`crate::gpu::Gpu::has_immediates`]); without, small buffers and bind
    /// groups each time. Another step of differences or another mesh makes them once more. The workspace keeps the last
    /// mesh's buffers alive.
    ///
    /// # Errors
    /// [`ExtractError::Iso`], [`ExtractError::Epsilon`], [`ExtractError::Delta`]; [`ExtractError::Slabs`] for a grid that needs more than one slab;
    /// [`ExtractError::MeshBuffer`] for more room than the adapter binds; [`ExtractError::Gpu`].
    pub fn encode(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        mesh: &GpuMesh,
    ) -> Result<(), ExtractError> {
        self.encode_timed(space, encoder, options, mesh, &mut Timer::off())
    }

    /// [`Extractor::encode`] with a timer.
    pub(crate) fn encode_timed(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        mesh: &GpuMesh,
        timer: &mut Timer,
    ) -> Result<(), ExtractError> {
        options.check()?;
        let slabs = space.plan.slab_count();
        if slabs > 1 {
            return Err(ExtractError::Slabs { slabs });
        }
        let slab = space.plan.slab(0);
        let capacity = [mesh.vertex_capacity, mesh.triangle_capacity];
        self.fits(capacity, self.gpu.device.limits().max_storage_buffer_binding_size)?;
        let target = Target { mesh, window: [0; 2], capacity, first_vertices: [0; 4], first_triangle: 0 };
        let kernels = RunKernels::new(self, space, options)?;
        space.groups.are_of([&mesh.vertices, &mesh.indices, &mesh.header]);
        self.gpu.guarded("recording", 0, || {
            self.encode_count(space, encoder, options, slab, (Some(&target), kernels), timer);
            self.encode_emit(space, encoder, options, slab, (&target, kernels), timer);
            if !space.is_volume {
                self.encode_header(space, encoder, options, slab, (&target, kernels));
            }
            self.encode_normals(space, encoder, options, slab, &target);
        })?;
        Ok(())
    }

    /// The header once more, since only emit's gradients may have run away.
    fn encode_header(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        slab: Slab,
        (target, kernels): (&Target<'_>, RunKernels<'_>),
    ) {
        let [vertex_capacity, triangle_capacity] = target.capacity;
        let params = Params { vertex_capacity, triangle_capacity, ..space.params(options, slab) };
        let settings = self.settings(space, &params);
        let mut bindings = space.bindings(self, &settings);
        bindings.set(b::HEADER, &target.mesh.header);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        kernels.method.emit.encode_totals(&self.gpu, &mut pass, &bindings);
    }

    /// cull, sample, classify, scan: everything up to the totals.
    pub(super) fn encode_count(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        slab: Slab,
        (target, kernels): (Option<&Target<'_>>, RunKernels<'_>),
        timer: &mut Timer,
    ) {
        let gpu = &self.gpu;
        let mut params = space.params(options, slab);
        if let Some(target) = target {
            [params.vertex_capacity, params.triangle_capacity] = target.capacity;
        }
        encoder.copy_buffer_to_buffer(&space.work_start, 0, &space.work, 0, size_of::<Work>() as u64);
        encoder.copy_buffer_to_buffer(&space.odd, 0, &space.work, Workspace::NON_FINITE, 4);
        let settings = self.settings(space, &params);
        let bindings = space.bindings(self, &settings);
        let bounds = space.kernels.bounds.as_ref().filter(|_| options.cull && !space.is_marked);
        if bounds.is_some() {
            encoder.clear_buffer(&space.map, 0, None);
        }
        {
            let mut pass = timer.pass(encoder, "cull", at::CULL);
            if let Some(bounds) = bounds {
                bounds.encode(gpu, &mut pass, &bindings, slab.extent, space.box_dispatches());
            } else if !space.is_marked {
                self.cull.encode(gpu, &mut pass, &bindings, slab.bricks(), space.is_volume);
            }
            self.scan_map.encode(gpu, &mut pass, &bindings, slab.bricks().div_ceil(32));
            self.cull.encode_arrange(gpu, &mut pass, &bindings);
        }
        for batch in 0..space.plan.batches {
            params.first_slot = batch * space.plan.batch_slots;
            let settings = self.settings(space, &params);
            let bindings = space.bindings(self, &settings);
            let offset = dispatches::active(batch);
            if kernels.sampling.is_none() {
                self.encode_sample(space, encoder, &bindings, offset, timer);
            }
            let mut pass = timer.pass(encoder, "classify", at::CLASSIFY);
            let classify = kernels.sampling.unwrap_or(&kernels.method.classify);
            classify.encode(gpu, &mut pass, &bindings, &space.dispatches, offset);
        }
        let mut pass = timer.pass(encoder, "scan", at::SCAN);
        self.scan_bricks.encode(gpu, &mut pass, &bindings, space.plan.slots);
        let mut with_header = bindings.clone();
        if let Some(target) = target {
            with_header.set(b::HEADER, &target.mesh.header);
        }
        kernels.method.emit.encode_totals(gpu, &mut pass, &with_header);
    }

    /// Whether classify takes the samples of such runs itself.
    pub(crate) fn takes_samples(&self, space: &Workspace, options: &Options) -> Result<bool, GpuError> {
        Ok(RunKernels::new(self, space, options)?.sampling.is_some())
    }

    /// Takes the samples of all active bricks of a run that was one batch, where its source is a field.
    pub(crate) fn sample_all(&self, space: &Workspace, options: &Options) -> Result<(), GpuError> {
        let settings = self.settings(space, &space.params(options, space.plan.slab(0)));
        self.gpu.guarded("samples", 0, || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let bindings = space.bindings(self, &settings);
            self.encode_sample(space, &mut encoder, &bindings, dispatches::active(0), &mut Timer::off());
            self.gpu.queue.submit([encoder.finish()]);
        })
    }

    fn encode_sample(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &Bindings<'_>,
        offset: u64,
        timer: &mut Timer,
    ) {
        if let Some(sample) = &space.sample {
            let mut pass = timer.pass(encoder, "sample", at::SAMPLE);
            sample.encode(&self.gpu, &mut pass, bindings, &space.dispatches, offset);
        }
    }

    pub(super) fn encode_emit(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        slab: Slab,
        (target, kernels): (&Target<'_>, RunKernels<'_>),
        timer: &mut Timer,
    ) {
        let mut params = space.params(options, slab);
        (params.first_vertices, params.first_triangle) = (target.first_vertices, target.first_triangle);
        [params.vertex_window, params.triangle_window] = target.window;
        [params.vertex_capacity, params.triangle_capacity] = target.capacity;
        let [from, size] = [target.window, target.capacity]
            .map(|items| [0, 1].map(|i| u64::from(items[i]) * Target::BYTES[i]));
        for batch in 0..space.plan.batches {
            params.first_slot = batch * space.plan.batch_slots;
            let settings = self.settings(space, &params);
            let mut bindings = space.bindings(self, &settings);
            bindings.set_window(b::VERTICES, &target.mesh.vertices, from[0], size[0]);
            bindings.set_window(b::INDICES, &target.mesh.indices, from[1], size[1]);
            if space.plan.batches > 1 {
                // The batch's samples were overwritten by later batches.
                self.encode_sample(space, encoder, &bindings, dispatches::own(batch), timer);
            }
            let mut pass = timer.pass(encoder, "emit", at::EMIT);
            let to = (&space.dispatches, dispatches::emitting(batch));
            kernels.method.emit.encode(&self.gpu, &mut pass, &bindings, kernels.vertices, to);
        }
    }
}
