//! The box around a mesh, found on the GPU: `shaders/render/bounds.wgsl`.

use super::RenderError;
use super::gpu::uniform;
use super::wire::{Window, layout_entry, slice, storage, window};
use crate::gpu::{Gpu, GpuMesh, MESH_HEADER_BYTES};
use crate::stage::inside::from_order_key;
use glam::Vec3;

/// Bytes of a vertex.
const VERTEX: u64 = size_of::<crate::mesh::Vertex>() as u64;
/// Vertices that one thread looks at before its six atomics.
const EACH: u32 = 64;
/// Vertices a window.
const WINDOW: u32 = 1 << 24;
/// The keys of an empty box.
const EMPTY: [u32; 6] = [u32::MAX, u32::MAX, u32::MAX, 0, 0, 0];

/// The smallest axis-aligned box around the finite vertices of `mesh`, as (low, high) corner, like
/// [`crate::mesh::Mesh::bounds`]. `None` without any, or if the mesh overflowed. Only the six
/// numbers are read back.
///
/// # Errors
/// [`RenderError::Gpu`].
pub fn gpu_bounds(gpu: &Gpu, mesh: &GpuMesh) -> Result<Option<(Vec3, Vec3)>, RenderError> {
    use wgpu::BufferUsages as U;
    let capacity = mesh.vertex_capacity;
    let count = window(&gpu.device.limits(), VERTEX, WINDOW).min(capacity.next_multiple_of(64).max(64));
    let windows = capacity.div_ceil(count).max(1);
    let groups = count.div_ceil(64 * EACH);
    let step = gpu.device.limits().min_uniform_buffer_offset_alignment.max(16);
    let uniforms = gpu.buffer("bounds windows", u64::from(windows) * u64::from(step), uniform())?;
    let keys = gpu.buffer("bounds", 24, U::STORAGE | U::COPY_SRC | U::COPY_DST)?;
    let mut words = vec![0u8; windows as usize * step as usize];
    for (number, bytes) in (0..windows).zip(words.chunks_exact_mut(step as usize)) {
        let window = Window { first: number * count, count, capacity, extra: groups * 64 };
        bytes[..size_of::<Window>()].copy_from_slice(bytemuck::bytes_of(&window));
    }
    gpu.guarded("bounds", words.len() as u64, || {
        let device = &gpu.device;
        gpu.queue.write_buffer(&uniforms, 0, &words);
        gpu.queue.write_buffer(&keys, 0, bytemuck::bytes_of(&EMPTY));
        let (layout, pipeline) = pipeline(device);
        let mut encoder = device.create_command_encoder(&Default::default());
        for number in 0..windows {
            let window = wgpu::BufferBinding {
                buffer: &uniforms,
                offset: u64::from(number) * u64::from(step),
                size: wgpu::BufferSize::new(size_of::<Window>() as u64),
            };
            let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("bounds"),
                layout: &layout,
                entries: &[
                    entry(0, wgpu::BindingResource::Buffer(window)),
                    entry(1, mesh.header.as_entire_binding()),
                    entry(2, wgpu::BindingResource::Buffer(slice(&mesh.vertices, number, count, VERTEX))),
                    entry(3, keys.as_entire_binding()),
                ],
            });
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        gpu.queue.submit([encoder.finish()]);
    })?;
    let keys: [u32; 6] = gpu.read_one(&keys)?;
    if keys == EMPTY {
        return Ok(None);
    }
    let [lx, ly, lz, hx, hy, hz] = keys.map(from_order_key);
    Ok(Some((Vec3::new(lx, ly, lz), Vec3::new(hx, hy, hz))))
}

fn pipeline(device: &wgpu::Device) -> (wgpu::BindGroupLayout, wgpu::ComputePipeline) {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("bounds"),
        source: wgpu::ShaderSource::Wgsl(super::shaders::bounds().into()),
    });
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("bounds"),
        entries: &[
            layout_entry(0, wgpu::BufferBindingType::Uniform, size_of::<Window>() as u64),
            storage(1, true, MESH_HEADER_BYTES),
            storage(2, true, 4),
            storage(3, false, 24),
        ],
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("bounds"),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("bounds"),
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some("bounds"),
        compilation_options: Default::default(),
        cache: None,
    });
    (layout, pipeline)
}
