//! Lines from triangles, on the GPU: `shaders/render/wire.wgsl`.

use super::gpu::uniform;
use crate::gpu::{Gpu, GpuError, GpuMesh, MESH_HEADER_BYTES};

/// The shader's uniform `Window`; that of `bounds.wgsl` has the same shape.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Window {
    pub first: u32,
    pub count: u32,
    pub capacity: u32,
    /// `windows` in wire.wgsl, `stride` in bounds.wgsl.
    pub extra: u32,
}

/// Bytes of the shader's `Arguments`, and where its draw arguments start.
pub(super) const ARGUMENTS: u64 = 32;
pub(super) const DRAW: u64 = 12;

/// Bytes of lines that a triangle gives.
const LINE_BYTES: u64 = 24;

/// How many items of `bytes` bytes one dispatch of 64 threads a group can bind and reach, at most
/// `wanted`. A multiple of 64, so that windows start at allowed offsets whatever the item.
pub(super) fn window(limits: &wgpu::Limits, bytes: u64, wanted: u32) -> u32 {
    let bound = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / bytes;
    let reached = u64::from(limits.max_compute_workgroups_per_dimension) * 64;
    let most = bound.min(reached).min(u64::from(wanted.min(u32::MAX - 63))) as u32;
    (most / 64 * 64).max(64)
}

/// The part of `buffer` that window `number` of `count` items of `bytes` bytes covers.
pub(super) fn slice(buffer: &wgpu::Buffer, number: u32, count: u32, bytes: u64) -> wgpu::BufferBinding<'_> {
    let offset = u64::from(number) * u64::from(count) * bytes;
    let size = buffer.size().saturating_sub(offset).min(u64::from(count) * bytes);
    wgpu::BufferBinding { buffer, offset, size: wgpu::BufferSize::new(size) }
}

pub(super) fn storage(binding: u32, read_only: bool, bytes: u64) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BufferBindingType::Storage { read_only };
    layout_entry(binding, ty, bytes)
}

pub(super) fn layout_entry(
    binding: u32,
    ty: wgpu::BufferBindingType,
    bytes: u64,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: wgpu::BufferSize::new(bytes),
        },
        count: None,
    }
}

/// The pipelines.
#[derive(Debug)]
pub(super) struct Wire {
    layout: wgpu::BindGroupLayout,
    arguments_layout: wgpu::BindGroupLayout,
    arguments: wgpu::ComputePipeline,
    lines: wgpu::ComputePipeline,
    /// The most triangles at a time.
    window: u32,
}

/// The buffers of one picture.
pub(super) struct Prepared {
    lines: wgpu::Buffer,
    arguments: wgpu::Buffer,
    arguments_group: wgpu::BindGroup,
    /// One a window.
    bind_groups: Vec<wgpu::BindGroup>,
}

impl Wire {
    /// Triangles at a time, by default: 24 MiB of lines.
    pub const WINDOW: u32 = 1 << 20;

    pub fn new(gpu: &Gpu, triangles: u32) -> Result<Self, GpuError> {
        let window = window(&gpu.device.limits(), LINE_BYTES, triangles);
        gpu.guarded("wireframe pipelines", 0, || {
            let device = &gpu.device;
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("render wire"),
                source: wgpu::ShaderSource::Wgsl(super::shaders::wire().into()),
            });
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("render wire"),
                entries: &[
                    layout_entry(0, wgpu::BufferBindingType::Uniform, size_of::<Window>() as u64),
                    storage(1, true, MESH_HEADER_BYTES),
                    storage(2, true, 4),
                    storage(3, false, 4),
                ],
            });
            let arguments_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("render wire arguments"),
                entries: &[storage(0, false, ARGUMENTS)],
            });
            let pipeline = |entry, groups: &[Option<&wgpu::BindGroupLayout>]| {
                let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some(entry),
                    bind_group_layouts: groups,
                    immediate_size: 0,
                });
                device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry),
                    layout: Some(&layout),
                    module: &module,
                    entry_point: Some(entry),
                    compilation_options: Default::default(),
                    cache: None,
                })
            };
            let arguments = pipeline("wire_arguments", &[Some(&layout), Some(&arguments_layout)]);
            let lines = pipeline("wire_lines", &[Some(&layout)]);
            Self { layout, arguments_layout, arguments, lines, window }
        })
    }

    /// Makes room for the lines of `mesh`.
    pub fn prepare(&self, gpu: &Gpu, mesh: &GpuMesh) -> Result<Prepared, GpuError> {
        use wgpu::BufferUsages as U;
        let capacity = mesh.triangle_capacity;
        let count = self.window.min(capacity.next_multiple_of(64).max(64));
        let windows = capacity.div_ceil(count).max(1);
        let step = gpu.device.limits().min_uniform_buffer_offset_alignment.max(16);
        let uniforms = gpu.buffer("wire windows", u64::from(windows) * u64::from(step), uniform())?;
        let lines = gpu.buffer("wire lines", u64::from(count) * LINE_BYTES, U::STORAGE | U::INDEX)?;
        let arguments =
            gpu.buffer("wire arguments", u64::from(windows) * ARGUMENTS, U::STORAGE | U::INDIRECT)?;
        let mut words = vec![0u8; windows as usize * step as usize];
        for (number, bytes) in (0..windows).zip(words.chunks_exact_mut(step as usize)) {
            let window = Window { first: number * count, count, capacity, extra: windows };
            bytes[..size_of::<Window>()].copy_from_slice(bytemuck::bytes_of(&window));
        }
        let (arguments_group, bind_groups) = gpu.guarded("wire windows", words.len() as u64, || {
            gpu.queue.write_buffer(&uniforms, 0, &words);
            let bind = |number: u32| {
                let window = wgpu::BufferBinding {
                    buffer: &uniforms,
                    offset: u64::from(number) * u64::from(step),
                    size: wgpu::BufferSize::new(size_of::<Window>() as u64),
                };
                let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("wire window"),
                    layout: &self.layout,
                    entries: &[
                        entry(0, wgpu::BindingResource::Buffer(window)),
                        entry(1, mesh.header.as_entire_binding()),
                        entry(2, wgpu::BindingResource::Buffer(slice(&mesh.indices, number, count, 12))),
                        entry(3, lines.as_entire_binding()),
                    ],
                })
            };
            let arguments_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("wire arguments"),
                layout: &self.arguments_layout,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: arguments.as_entire_binding() }],
            });
            (arguments_group, (0..windows).map(bind).collect())
        })?;
        Ok(Prepared { lines, arguments, arguments_group, bind_groups })
    }

    /// Makes the lines of each window and has `draw` draw them before the next takes their place;
    /// it gets the line indices, and where the indirect arguments are.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        prepared: &Prepared,
        draw: impl Fn(&mut wgpu::CommandEncoder, &wgpu::Buffer, &wgpu::Buffer, u64),
    ) {
        let windows = prepared.bind_groups.len() as u32;
        for (number, bind_group) in prepared.bind_groups.iter().enumerate() {
            let at = number as u64 * ARGUMENTS;
            if number == 0 {
                let mut pass = compute(encoder);
                pass.set_bind_group(0, bind_group, &[]);
                pass.set_bind_group(1, &prepared.arguments_group, &[]);
                pass.set_pipeline(&self.arguments);
                pass.dispatch_workgroups(windows.div_ceil(64), 1, 1);
            }
            {
                let mut pass = compute(encoder);
                pass.set_bind_group(0, bind_group, &[]);
                pass.set_pipeline(&self.lines);
                pass.dispatch_workgroups_indirect(&prepared.arguments, at);
            }
            draw(encoder, &prepared.lines, &prepared.arguments, at + DRAW);
        }
    }
}

fn compute(encoder: &mut wgpu::CommandEncoder) -> wgpu::ComputePass<'_> {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("wire"), timestamp_writes: None })
}
