//! Keeping the components of a mesh that seeds lie on. Shader: `shaders/components.wgsl`.

use crate::extract::{ExtractError, Extraction, Extractor, Options, Workspace};
use crate::gpu::kernel::{Bindings, Kernel, binding as b, made};
use crate::gpu::{Gpu, GpuError, GpuMesh, MeshHeader};
use crate::stage::params::Params;
use crate::stage::scan::Scan;
use crate::stage::shaders;
use crate::track::{Edge, TrackError, TrackReport};
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages as U;

/// Rounds of labels that are recorded before it is asked whether they are final.
const ROUNDS: u32 = 4;
/// Items a workgroup.
const LANES: u32 = 64;

#[derive(Debug)]
pub(super) struct Components {
    label: Kernel,
    hook: Kernel,
    jump: Kernel,
    keep: Kernel,
    mark: Kernel,
    gather: Kernel,
}

impl Components {
    fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let source = shaders::components();
        let kernel = |entry| Kernel::new(gpu, &source, entry, &[]);
        Ok(Self {
            label: kernel("label")?,
            hook: kernel("hook")?,
            jump: kernel("jump")?,
            keep: kernel("keep")?,
            mark: kernel("mark")?,
            gather: kernel("gather")?,
        })
    }
}

/// As in the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
struct Labelled {
    changed: u32,
    kept: u32,
    dropped: u32,
    starts: u32,
    vertices: u32,
    triangles: u32,
}

impl Extractor {
    /// Leaves out of the mesh the components that hold no vertex of `edges`. The mesh is that of the whole of `space`,
    /// which has still its map, records and offsets.
    pub(super) fn keep_reached(
        &self,
        space: &Workspace,
        options: &Options,
        edges: &[Edge],
        extraction: &mut Extraction,
        told: &mut TrackReport,
    ) -> Result<(), TrackError> {
        let gpu = &self.gpu;
        let mesh = &extraction.mesh;
        let [vertices, triangles] = [mesh.vertex_capacity, mesh.triangle_capacity];
        let items = vertices.max(triangles);
        if items == 0 {
            (told.components, told.dropped) = (Some(0), Some(0));
            return Ok(());
        }
        let kernels = made(&self.track.components, || Components::new(gpu))?;
        let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
        let n = u64::from(items);
        let [labels, marks, partials] = [4 * u64::from(vertices), 8 * (n + 1), Scan::partial_bytes(n)];
        let limit = gpu.device.limits().max_storage_buffer_binding_size;
        let needed = marks.max(24 * u64::from(vertices)).max(12 * u64::from(triangles));
        if needed > limit {
            return Err(TrackError::Labels { needed, limit, adapter: gpu.info.name.clone() });
        }
        let peak = extraction.report.peak_bytes
            + labels
            + marks
            + partials
            + 16 * edges.len() as u64
            + GpuMesh::bytes_for(vertices, triangles);
        if peak > options.memory_budget {
            let what = "the mesh with the labels of its components";
            return Err(ExtractError::Budget { what, needed: peak, budget: options.memory_budget }.into());
        }
        extraction.report.peak_bytes = peak;

        let labels = gpu.buffer("labels", labels, storage)?;
        let marks = gpu.buffer("marks of the mesh", marks, storage)?;
        let partials = gpu.buffer("partial sums", partials, storage)?;
        let starts: Vec<[u32; 4]> =
            edges.iter().map(|e| [e.point.x, e.point.y, e.point.z, e.axis as u32]).collect();
        let edges = gpu.buffer("edges", size_of_val(&starts[..]) as u64, storage)?;
        gpu.write(&edges, bytemuck::cast_slice(&starts))?;
        let labelled = gpu.buffer("labelled", size_of::<Labelled>() as u64, storage)?;
        let at_first = Labelled { starts: starts.len() as u32, ..Labelled::default() };
        gpu.write(&labelled, bytemuck::bytes_of(&at_first))?;

        let settings = space.params(options, space.plan.slab(0));
        let of_grid = self.settings(space, &settings);
        // Scans and the like go over the mesh as they do over bricks.
        let of_mesh = self.settings(space, &Params { slab_bricks: items, ..settings });
        let mut bindings = space.bindings(self, &of_grid);
        bindings
            .set(b::VERTICES, &mesh.vertices)
            .set(b::INDICES, &mesh.indices)
            .set(b::HEADER, &mesh.header)
            .set(b::MARKS, &marks)
            .set(b::PARTIALS, &partials)
            .set(b::LABELS, &labels)
            .set(b::LABELLED, &labelled)
            .set(b::EDGES, &edges);
        let mut over_mesh = bindings.clone();
        over_mesh.set_settings(&of_mesh);
        let mut over_marks = over_mesh.clone();
        over_marks.set(b::COUNTS, &marks);

        let submit = |record: &dyn Fn(&mut wgpu::CommandEncoder)| {
            gpu.guarded("components", peak, || {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                record(&mut encoder);
                gpu.queue.submit([encoder.finish()]);
            })
        };
        let run = |encoder: &mut wgpu::CommandEncoder, bindings: &Bindings<'_>, all: &[(&Kernel, u32)]| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            for &(kernel, items) in all {
                kernel.dispatch(gpu, &mut pass, bindings, items.div_ceil(LANES));
            }
        };
        submit(&|encoder| run(encoder, &bindings, &[(&kernels.label, vertices)]))?;
        loop {
            submit(&|encoder| {
                for round in 0..ROUNDS {
                    if round + 1 == ROUNDS {
                        encoder.clear_buffer(&labelled, 0, Some(4));
                    }
                    let jump = (&kernels.jump, vertices);
                    run(encoder, &bindings, &[(&kernels.hook, triangles), jump, jump]);
                }
            })?;
            if gpu.read_one::<Labelled>(&labelled)?.changed == 0 {
                break;
            }
        }
        submit(&|encoder| {
            run(encoder, &bindings, &[(&kernels.keep, starts.len() as u32)]);
            run(encoder, &over_mesh, &[(&kernels.mark, items)]);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            self.scan_counts.encode(gpu, &mut pass, &over_marks, items);
            drop(pass);
            let place = std::mem::offset_of!(Labelled, vertices) as u64;
            encoder.copy_buffer_to_buffer(&marks, 8 * n, &labelled, place, 8);
        })?;
        let found: Labelled = gpu.read_one(&labelled)?;
        (told.components, told.dropped) = (Some(found.kept.into()), Some(found.dropped.into()));
        if found.dropped == 0 {
            return Ok(());
        }
        let kept = GpuMesh::with_capacity(gpu, found.vertices, found.triangles)?;
        over_mesh.set(b::KEPT_VERTICES, &kept.vertices).set(b::KEPT_INDICES, &kept.indices);
        submit(&|encoder| run(encoder, &over_mesh, &[(&kernels.gather, items)]))?;
        let header = MeshHeader {
            index_count: 3 * found.triangles,
            vertices: found.vertices,
            triangles: found.triangles,
            ..mesh.read_header(gpu)?
        };
        gpu.write(&kept.header, bytemuck::bytes_of(&header))?;
        gpu.wait()?;
        (extraction.report.vertices, extraction.report.triangles) =
            (found.vertices.into(), found.triangles.into());
        extraction.mesh = kept;
        Ok(())
    }
}
