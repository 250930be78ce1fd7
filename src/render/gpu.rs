//! Draws a mesh from its GPU buffers.

use super::shade::{Frame, SLOPE_BIAS, base};
use super::style::unmultiply;
use super::wire::Wire;
use super::{Camera, RenderError, Style};
use crate::gpu::{Gpu, GpuError, GpuMesh};
use image::RgbaImage;

/// Not an sRGB format: see the module's remark on colours.
const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Copies from textures want rows that start at multiples of this.
const ROW: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

/// The vertex shaders of surfaces: without and with a colour a vertex.
const NEUTRAL: &str = "mesh_vertex";
const COLOURED: &str = "coloured_vertex";
/// The colours, in linear light.
const COLOUR_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<[f32; 3]>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![2 => Float32x3],
};

/// Draws meshes into pictures; holds the pipelines, so make one and use it for many pictures.
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    samples: u32,
    layout: wgpu::BindGroupLayout,
    mesh: wgpu::RenderPipeline,
    /// As `mesh`, but pushed back a little, under lines.
    mesh_behind: wgpu::RenderPipeline,
    /// The same two, with a colour a vertex.
    coloured: [wgpu::RenderPipeline; 2],
    lines: wgpu::RenderPipeline,
    wire: Wire,
}

/// What one picture is drawn into.
struct Targets {
    colour: wgpu::TextureView,
    resolved: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
    /// The texture to read back.
    picture: wgpu::Texture,
}

impl Renderer {
    /// Builds the pipelines on `gpu`.
    ///
    /// # Errors
    /// [`RenderError::Gpu`].
    pub fn new(gpu: &Gpu) -> Result<Self, RenderError> {
        Self::with_line_window(gpu, Wire::WINDOW)
    }

    /// As [`Renderer::new`], but makes the lines of a wireframe from at most `triangles` triangles
    /// at a time (at least 64), which takes 24 bytes each.
    ///
    /// # Errors
    /// [`RenderError::Gpu`].
    pub fn with_line_window(gpu: &Gpu, triangles: u32) -> Result<Self, RenderError> {
        let samples = if four_samples(gpu)? { 4 } else { 1 };
        let wire = Wire::new(gpu, triangles)?;
        let made = gpu.guarded("render pipelines", 0, || {
            let device = &gpu.device;
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("render mesh"),
                source: wgpu::ShaderSource::Wgsl(super::shaders::MESH.into()),
            });
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("render frame"),
                entries: &[wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                    ty: wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Uniform,
                        has_dynamic_offset: false,
                        min_binding_size: wgpu::BufferSize::new(size_of::<Frame>() as u64),
                    },
                    count: None,
                }],
            });
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("render"),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let pipelines = Plan { device, layout: &pipeline_layout, module: &module, samples };
            let mesh = pipelines.mesh(NEUTRAL, 0.0);
            let mesh_behind = pipelines.mesh(NEUTRAL, SLOPE_BIAS);
            let coloured = [0.0, SLOPE_BIAS].map(|bias| pipelines.mesh(COLOURED, bias));
            (mesh, mesh_behind, coloured, pipelines.lines(), layout)
        })?;
        let (mesh, mesh_behind, coloured, lines, layout) = made;
        Ok(Self { gpu: gpu.clone(), samples, layout, mesh, mesh_behind, coloured, lines, wire })
    }

    /// Samples a pixel: 4, or 1 on an adapter that cannot do 4.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Draws `mesh` and reads the picture back. The mesh itself stays on the GPU: it is drawn
    /// through the indirect arguments in its header, so one that overflowed gives the background.
    ///
    /// # Errors
    /// [`RenderError::TooLargeForAdapter`], [`RenderError::Gpu`].
    pub fn render(&self, mesh: &GpuMesh, camera: &Camera, style: &Style) -> Result<RgbaImage, RenderError> {
        self.draw(mesh, None, camera, style)
    }

    /// As [`Renderer::render`], of a material with a colour (sRGB) for each vertex, in the order of `mesh`; vertices beyond
    /// the last colour are neutral. Only [`Shade::Lit`](super::Shade::Lit) shows them.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_coloured(
        &self,
        mesh: &GpuMesh,
        colours: &[[u8; 3]],
        camera: &Camera,
        style: &Style,
    ) -> Result<RgbaImage, RenderError> {
        let bases: Vec<[f32; 3]> =
            (0..mesh.vertex_capacity.max(1) as usize).map(|i| base(colours, i).to_array()).collect();
        let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
        let buffer = self.gpu.buffer("vertex colours", size_of_val(&bases[..]) as u64, usage)?;
        self.gpu.write(&buffer, bytemuck::cast_slice(&bases))?;
        self.draw(mesh, Some(&buffer), camera, style)
    }

    fn draw(
        &self,
        mesh: &GpuMesh,
        colours: Option<&wgpu::Buffer>,
        camera: &Camera,
        style: &Style,
    ) -> Result<RgbaImage, RenderError> {
        let [width, height] = camera.size;
        let limits = self.gpu.device.limits();
        let row = (width * 4).next_multiple_of(ROW);
        let bytes = u64::from(row) * u64::from(height);
        let limit = limits.max_texture_dimension_2d;
        if width > limit || height > limit || bytes > limits.max_buffer_size {
            return Err(RenderError::TooLargeForAdapter { width, height, limit });
        }
        let targets = self.targets(width, height)?;
        let frame = self.gpu.buffer("render frame", size_of::<Frame>() as u64, uniform())?;
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let pixels = self.gpu.buffer("picture", bytes, usage)?;
        let wire = if style.wireframe { Some(self.wire.prepare(&self.gpu, mesh)?) } else { None };
        self.gpu.guarded("drawing", bytes, || {
            self.gpu.queue.write_buffer(&frame, 0, bytemuck::bytes_of(&Frame::new(camera, style)));
            let bind_group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("render frame"),
                layout: &self.layout,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: frame.as_entire_binding() }],
            });
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = targets.begin(&mut encoder, Some(style.clear()));
                pass.set_bind_group(0, &bind_group, &[]);
                let [plain, behind] = match colours {
                    Some(colours) => {
                        pass.set_vertex_buffer(1, colours.slice(..));
                        self.coloured.each_ref()
                    }
                    None => [&self.mesh, &self.mesh_behind],
                };
                pass.set_pipeline(if wire.is_some() { behind } else { plain });
                mesh.draw(&mut pass);
            }
            if let Some(wire) = &wire {
                self.wire.encode(&mut encoder, wire, |encoder, lines, arguments, offset| {
                    let mut pass = targets.begin(encoder, None);
                    pass.set_bind_group(0, &bind_group, &[]);
                    pass.set_pipeline(&self.lines);
                    pass.set_vertex_buffer(0, mesh.vertices.slice(..));
                    pass.set_index_buffer(lines.slice(..), wgpu::IndexFormat::Uint32);
                    pass.draw_indexed_indirect(arguments, offset);
                });
            }
            encoder.copy_texture_to_buffer(
                targets.picture.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &pixels,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(row),
                        rows_per_image: None,
                    },
                },
                targets.picture.size(),
            );
            self.gpu.queue.submit([encoder.finish()]);
        })?;
        let mut out: Vec<u8> = self.gpu.read(&pixels, bytes)?;
        // In place: a large picture in memory twice is much.
        let (from, to) = (row as usize, width as usize * 4);
        for y in 1..height as usize {
            out.copy_within(y * from..y * from + to, y * to);
        }
        out.truncate(to * height as usize);
        unmultiply(&mut out);
        RgbaImage::from_raw(width, height, out)
            .ok_or_else(|| GpuError::Refused("the picture came back short".into()).into())
    }

    fn targets(&self, width: u32, height: u32) -> Result<Targets, GpuError> {
        let pixels = u64::from(width) * u64::from(height);
        let bytes = pixels * (4 + 8 * u64::from(self.samples));
        self.gpu.guarded("the picture", bytes, || {
            let texture = |label, format, samples, usage| {
                self.gpu.device.create_texture(&wgpu::TextureDescriptor {
                    label: Some(label),
                    size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: samples,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage,
                    view_formats: &[],
                })
            };
            let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
            let picture = texture("picture", COLOUR, 1, attachment | wgpu::TextureUsages::COPY_SRC);
            let depth = texture("depth", DEPTH, self.samples, attachment);
            let view = |t: &wgpu::Texture| t.create_view(&Default::default());
            let (colour, resolved) = if self.samples > 1 {
                (view(&texture("samples", COLOUR, self.samples, attachment)), Some(view(&picture)))
            } else {
                (view(&picture), None)
            };
            Targets { colour, resolved, depth: view(&depth), picture }
        })
    }
}

impl Targets {
    /// A pass that starts from the colour `clear`, or goes on from what is there.
    fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        clear: Option<[u8; 4]>,
    ) -> wgpu::RenderPass<'e> {
        let load = match clear.map(|c| c.map(|c| f64::from(c) / 255.0)) {
            Some([r, g, b, a]) => wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
            None => wgpu::LoadOp::Load,
        };
        let depth_load = if clear.is_some() { wgpu::LoadOp::Clear(1.0) } else { wgpu::LoadOp::Load };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("render"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.colour,
                depth_slice: None,
                resolve_target: self.resolved.as_ref(),
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: depth_load, store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }
}

/// What the pipelines have in common.
struct Plan<'a> {
    device: &'a wgpu::Device,
    layout: &'a wgpu::PipelineLayout,
    module: &'a wgpu::ShaderModule,
    samples: u32,
}

impl Plan<'_> {
    fn mesh(&self, vertex: &str, slope_scale: f32) -> wgpu::RenderPipeline {
        let depth = wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            // No clamp: not every adapter has it.
            bias: wgpu::DepthBiasState { constant: 0, slope_scale, clamp: 0.0 },
        };
        let topology = wgpu::PrimitiveTopology::TriangleList;
        self.pipeline([vertex, "mesh_fragment"], topology, depth, None)
    }

    fn lines(&self) -> wgpu::RenderPipeline {
        let depth = wgpu::DepthStencilState {
            format: DEPTH,
            // Lines cover only part of the light behind them, so they hide no other lines.
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::LessEqual),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        let blend = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        self.pipeline(["line_vertex", "line_fragment"], wgpu::PrimitiveTopology::LineList, depth, blend)
    }

    fn pipeline(
        &self,
        [vertex, fragment]: [&str; 2],
        topology: wgpu::PrimitiveTopology,
        depth: wgpu::DepthStencilState,
        blend: Option<wgpu::BlendState>,
    ) -> wgpu::RenderPipeline {
        let of_mesh = [Some(GpuMesh::VERTEX_LAYOUT)];
        let with_colours = [Some(GpuMesh::VERTEX_LAYOUT), Some(COLOUR_LAYOUT)];
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(vertex),
            layout: Some(self.layout),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: if vertex == COLOURED { &with_colours } else { &of_mesh },
            },
            primitive: wgpu::PrimitiveState {
                topology,
                front_face: wgpu::FrontFace::Ccw,
                cull_mode: None,
                ..Default::default()
            },
            depth_stencil: Some(depth),
            multisample: wgpu::MultisampleState { count: self.samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: self.module,
                entry_point: Some(fragment),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: COLOUR,
                    blend,
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

pub(super) fn uniform() -> wgpu::BufferUsages {
    wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST
}

/// Whether the device draws with 4 samples a pixel. The adapter, which could be asked, may be the
/// caller's and out of reach; so two small textures are tried.
fn four_samples(gpu: &Gpu) -> Result<bool, GpuError> {
    let tried = gpu.guarded("4 samples a pixel", 0, || {
        for format in [COLOUR, DEPTH] {
            let _ = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("4 samples a pixel"),
                size: wgpu::Extent3d { width: 4, height: 4, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 4,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
        }
    });
    match tried {
        Ok(()) => Ok(true),
        Err(GpuError::Refused(_)) => Ok(false),
        Err(e) => Err(e),
    }
}
