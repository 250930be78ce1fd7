//! What all levels of a mesh use: buffers, submissions, scans, counts.

use super::kernels::Common;
use super::{At, Counted, Refining};
use crate::extract::{ExtractError, Extractor, check_parameters};
use crate::field::{PARAMETER_VECTORS, Surface, Wgsl};
use crate::gpu::kernel::{Bindings, Kernel, binding as b, made};
use crate::gpu::{Gpu, GpuError, GpuMesh};
use crate::refine::{RefineError, Settings};
use crate::stage::params::{Params, Work};
use crate::stage::scan::Scan;
use std::sync::Arc;
use wgpu::BufferUsages as U;

/// Items a workgroup.
const LANES: u32 = 64;
/// Buffers that shaders write, and that are copied from and to.
pub(super) const STORAGE: U = U::STORAGE.union(U::COPY_SRC).union(U::COPY_DST);

/// What all levels of a mesh use.
pub(super) struct Run<'a> {
    extractor: &'a Extractor,
    pub(super) settings: &'a Settings,
    pub(super) kernels: &'a Common,
    pub(super) place: Arc<Kernel>,
    pub(super) plain: Refining,
    field_parameters: wgpu::Buffer,
    field_data: wgpu::Buffer,
    counted: wgpu::Buffer,
}

impl<'a> Run<'a> {
    pub(super) fn new(
        extractor: &'a Extractor,
        surface: &Surface<'_>,
        settings: &'a Settings,
    ) -> Result<Self, RefineError> {
        let gpu = &extractor.gpu;
        let wgsl = surface.field().wgsl()?;
        let field_data = Self::field_data(gpu, &wgsl)?;
        check_parameters(&wgsl)?;
        let parameter_bytes = 16 * PARAMETER_VECTORS as u64;
        let field_parameters = gpu.buffer("field parameters", parameter_bytes, U::UNIFORM | U::COPY_DST)?;
        gpu.write(&field_parameters, bytemuck::cast_slice(&wgsl.parameters))?;
        // The scan is bound to it as `Work`, which it does not look at.
        let counted = size_of::<Counted>().max(size_of::<Work>()) as u64;
        Ok(Self {
            kernels: made(&extractor.refine.common, || Common::new(gpu))?,
            place: extractor.refine.place(gpu, &wgsl)?,
            plain: Refining::new(surface, settings, wgsl.gradient.is_some()),
            counted: gpu.buffer("counted", counted, STORAGE)?,
            extractor,
            settings,
            field_parameters,
            field_data,
        })
    }

    fn field_data(gpu: &Gpu, wgsl: &Wgsl) -> Result<wgpu::Buffer, RefineError> {
        let needed = size_of_val(&*wgsl.data) as u64;
        let limit = gpu.device.limits().max_storage_buffer_binding_size;
        if needed > limit {
            let adapter = gpu.info.name.clone();
            return Err(ExtractError::FieldData { needed, limit, adapter }.into());
        }
        let buffer = gpu.buffer("field data", needed, STORAGE)?;
        gpu.write(&buffer, bytemuck::cast_slice(&wgsl.data))?;
        Ok(buffer)
    }
}

impl Run<'_> {
    pub(super) fn gpu(&self) -> &Gpu {
        &self.extractor.gpu
    }

    pub(super) fn uniform(&self, params: Refining) -> wgpu::Buffer {
        self.gpu().uniform(&params)
    }

    pub(super) fn bindings<'b>(&'b self, params: &'b wgpu::Buffer) -> Bindings<'b> {
        let mut bindings = Bindings::default();
        bindings
            .set(b::PARAMS, params)
            .set(b::WORK, &self.counted)
            .set(b::FIELD, &self.field_parameters)
            .set(b::FIELD_DATA, &self.field_data);
        bindings
    }

    /// Room for a mesh of so many vertices and triangles.
    pub(super) fn at(&self, size: [u32; 2]) -> Result<At, RefineError> {
        let mesh_bytes = GpuMesh::buffer_bytes(size[0], size[1]).map(Gpu::padded);
        self.bindable("the refined mesh's vertices", mesh_bytes[0])?;
        self.bindable("the refined mesh's triangles", mesh_bytes[1])?;
        let mesh = GpuMesh::with_capacity(self.gpu(), size[0], size[1])?;
        self.poison(&mesh.vertices);
        self.poison(&mesh.indices);
        Ok(At { mesh, states: self.buffer("states of vertices", 4 * u64::from(size[0]))?, size })
    }

    pub(super) fn partials(&self, items: u32) -> Result<wgpu::Buffer, RefineError> {
        self.buffer("partial sums", Scan::partial_bytes(items.into()))
    }

    pub(super) fn buffer(&self, what: &'static str, bytes: u64) -> Result<wgpu::Buffer, RefineError> {
        self.bindable(what, bytes)?;
        let buffer = self.gpu().buffer(what, bytes, STORAGE)?;
        self.poison(&buffer);
        Ok(buffer)
    }

    pub(super) fn bindable(&self, what: &'static str, needed: u64) -> Result<(), RefineError> {
        let limits = self.gpu().device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if needed > limit {
            return Err(RefineError::Binding { what, needed, limit, adapter: self.gpu().info.name.clone() });
        }
        Ok(())
    }

    /// In this crate's own tests what a shader did not write shows.
    pub(super) fn poison(&self, buffer: &wgpu::Buffer) {
        if cfg!(test) {
            self.gpu().queue.write_buffer(buffer, 0, &vec![0xcd; buffer.size() as usize]);
        }
    }

    pub(super) fn submit(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<(), GpuError> {
        let gpu = self.gpu();
        gpu.guarded("refining", 0, || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            record(&mut encoder);
            gpu.queue.submit([encoder.finish()]);
        })
    }

    /// Kernels over so many items each, one after the other.
    pub(super) fn dispatch(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &Bindings<'_>,
        all: &[(&Kernel, u32)],
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        for &(kernel, items) in all {
            kernel.dispatch(self.gpu(), &mut pass, bindings, items.div_ceil(LANES));
        }
    }

    /// The exclusive prefix sums of so many pairs, in place, and the total behind.
    pub(super) fn scan(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pairs: &wgpu::Buffer,
        partials: &wgpu::Buffer,
        items: u32,
    ) {
        // The stage scans what there is an item a brick of.
        let params = Params { slab_bricks: items, ..Params::default() };
        let params = crate::gpu::Settings::new(self.gpu(), &params.uniform(), &params.call());
        let mut bindings = Bindings::default();
        bindings
            .set_settings(&params)
            .set(b::WORK, &self.counted)
            .set(b::COUNTS, pairs)
            .set(b::PARTIALS, partials);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        self.extractor.scan_counts.encode(self.gpu(), &mut pass, &bindings, items);
    }

    pub(super) fn begin_count(&self) -> Result<(), GpuError> {
        self.gpu().write(&self.counted, bytemuck::bytes_of(&Counted::NONE))
    }

    pub(super) fn forget_change(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.counted, std::mem::offset_of!(Counted, changed) as u64, Some(4));
    }

    pub(super) fn counted(&self) -> Result<Counted, GpuError> {
        self.gpu().read_one(&self.counted)
    }
}
