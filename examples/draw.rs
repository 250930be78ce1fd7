//! Draws an isoforge mesh with a render pipeline of one's own: one command encoder holds the
//! extraction (`encode`) and the draw call, and nothing is read back in between.
//!
//! `cargo run --release --example draw -- picture.png` draws a gyroid into a picture; a program with a
//! window does the same with the surface's texture.

use glam::{Mat4, Vec3};
use isoforge::extract::{Extractor, Options, Source};
use isoforge::field::named::Named;
use isoforge::gpu::{AdapterChoice, Gpu, GpuMesh};
use isoforge::grid::Grid;

const SIZE: u32 = 512;
const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

const SHADER: &str = "
    @group(0) @binding(0) var<uniform> view: mat4x4<f32>;
    struct Corner { @builtin(position) clip: vec4<f32>, @location(0) normal: vec3<f32> }
    @vertex fn corner(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Corner {
        return Corner(view * vec4<f32>(position, 1.0), normal);
    }
    @fragment fn colour(corner: Corner) -> @location(0) vec4<f32> {
        return vec4<f32>(normalize(corner.normal) * 0.5 + 0.5, 1.0);
    }";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "draw.png".into());
    // A renderer has these already: `Gpu::from_device(device, queue, adapter.get_info())`.
    let gpu = Gpu::open(AdapterChoice::Best)?;
    let extractor = Extractor::new(gpu.clone())?;

    let field = Named::new("gyroid")?;
    let grid = Grid::from_bounds([96; 3], Vec3::splat(-1.0), Vec3::splat(1.0))?;
    let space = extractor.prepare(&Source::Field(&field, grid), 1 << 30)?;
    let mesh = GpuMesh::with_capacity(&gpu, 200_000, 400_000)?;

    let (pipeline, group) = pipeline(&gpu);
    let colour = texture(&gpu, COLOUR, wgpu::TextureUsages::COPY_SRC);
    let depth = texture(&gpu, DEPTH, wgpu::TextureUsages::empty());
    let (colour_view, depth_view) =
        (colour.create_view(&Default::default()), depth.create_view(&Default::default()));

    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    extractor.encode(&space, &mut encoder, &Options::new(0.0), &mesh)?;
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &colour_view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        mesh.draw(&mut pass);
    }
    let pixels = gpu.buffer(
        "pixels",
        u64::from(SIZE * SIZE * 4),
        wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
    )?;
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(SIZE * 4), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        colour.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &pixels, layout },
        colour.size(),
    );
    gpu.queue.submit([encoder.finish()]);

    let header = mesh.read_header(&gpu)?;
    assert_eq!(header.overflow, 0, "needs {} vertices, {} triangles", header.vertices, header.triangles);
    image::save_buffer(
        &path,
        &gpu.read::<u8>(&pixels, u64::from(SIZE * SIZE * 4))?,
        SIZE,
        SIZE,
        image::ColorType::Rgba8,
    )?;
    println!("{path}: {} triangles drawn, none of them read back", header.triangles);
    Ok(())
}

fn pipeline(gpu: &Gpu) -> (wgpu::RenderPipeline, wgpu::BindGroup) {
    let device = &gpu.device;
    let source = wgpu::ShaderSource::Wgsl(SHADER.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("own pipeline"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[Some(GpuMesh::VERTEX_LAYOUT)],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(COLOUR.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let projection = glam::camera::rh::proj::directx::perspective(0.8, 1.0, 0.1, 100.0);
    let view: Mat4 =
        projection * glam::camera::rh::view::look_at_mat4(Vec3::new(3.7, 2.5, 1.9), Vec3::ZERO, Vec3::Z);
    let uniform = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&view));
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
    });
    (pipeline, group)
}

fn texture(gpu: &Gpu, format: wgpu::TextureFormat, more: wgpu::TextureUsages) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE, height: SIZE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | more,
        view_formats: &[],
    })
}
