//! The last stage: normals of the vertices that emit marked, once the whole mesh is there.

use super::encode::Target;
use super::plan::Slab;
use super::run::Place;
use super::workspace::Workspace;
use super::{ExtractError, Extractor, Options, stage_index as at};
use crate::gpu::kernel::{Bindings, binding as b};
use crate::gpu::{GpuMesh, Timer};
use crate::stage::dispatches;
use crate::stage::params::Params;

/// Some of the mesh's vertices: the first, and how many.
type Window = [u32; 2];

impl Extractor {
    /// Records the stage for a mesh that is recorded, but not yet made.
    pub(super) fn encode_normals(
        &self,
        space: &Workspace,
        encoder: &mut wgpu::CommandEncoder,
        options: &Options,
        slab: Slab,
        target: &Target<'_>,
    ) {
        let [vertex_capacity, triangle_capacity] = target.capacity;
        let params = Params { vertex_capacity, triangle_capacity, ..space.params(options, slab) };
        let settings = self.settings(space, &params);
        let mut bindings = space.bindings(self, &settings);
        bindings
            .set(b::VERTICES, &target.mesh.vertices)
            .set(b::INDICES, &target.mesh.indices)
            .set(b::HEADER, &target.mesh.header);
        let arguments = (&space.dispatches, dispatches::normals(space.plan.batches));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        self.normals.encode_if_marked(&self.gpu, &mut pass, &bindings, arguments);
    }

    /// Runs the stage on a mesh whose slabs are all emitted and whose header is written.
    pub(super) fn run_normals(
        &self,
        space: &Workspace,
        options: &Options,
        mesh: &GpuMesh,
        places: &[Place],
        timer: &mut Timer,
    ) -> Result<(), ExtractError> {
        let gpu = &self.gpu;
        let windows = self.windows(mesh.vertex_capacity);
        let submit = |timer: &mut Timer, record: &dyn Fn(&mut wgpu::ComputePass<'_>)| {
            gpu.guarded("normals", 0, || {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                record(&mut timer.pass(&mut encoder, "normals", at::NORMALS));
                gpu.queue.submit([encoder.finish()]);
            })
        };
        for slab in space.plan.slabs().filter(|slab| places[slab.index].count[1] > 0) {
            let place = &places[slab.index];
            let near: Vec<Window> = space.plan.slabs_beside(slab).map(|i| vertices_of(&places[i])).collect();
            let near = windows.iter().filter(|window| near.iter().any(|n| overlap(window, n)));
            let near: Vec<Window> = near.copied().collect();
            submit(timer, &|pass| {
                for &marked in &near {
                    for &neighbours in &near {
                        self.record_neighbours(space, pass, options, mesh, place, [marked, neighbours]);
                    }
                }
            })?;
        }
        submit(timer, &|pass| {
            for [vertex_window, vertex_capacity] in windows.iter().copied() {
                let params = space.params(options, space.plan.slab(0));
                let settings = self.settings(space, &Params { vertex_window, vertex_capacity, ..params });
                let mut bindings = space.bindings(self, &settings);
                set_vertices(&mut bindings, b::VERTICES, mesh, [vertex_window, vertex_capacity]);
                bindings.set(b::HEADER, &mesh.header);
                self.normals.encode_average(gpu, pass, &bindings, vertex_capacity);
            }
        })?;
        Ok(())
    }

    /// Adds what the slab's triangles have in one window of vertices to what is marked in another.
    fn record_neighbours(
        &self,
        space: &Workspace,
        pass: &mut wgpu::ComputePass<'_>,
        options: &Options,
        mesh: &GpuMesh,
        place: &Place,
        [marked, neighbours]: [Window; 2],
    ) {
        let target = super::run::target(mesh, place);
        // No capacity: the same window.
        let [neighbour_window, neighbour_capacity] = if marked == neighbours { [0; 2] } else { neighbours };
        let settings = self.settings(
            space,
            &Params {
                first_triangle: target.first_triangle,
                triangle_window: target.window[1],
                triangle_capacity: target.capacity[1],
                vertex_window: marked[0],
                vertex_capacity: marked[1],
                neighbour_window,
                neighbour_capacity,
                ..space.params(options, space.plan.slab(0))
            },
        );
        let mut bindings = space.bindings(self, &settings);
        set_vertices(&mut bindings, b::VERTICES, mesh, marked);
        if marked != neighbours {
            set_vertices(&mut bindings, b::NEIGHBOURS, mesh, neighbours);
        }
        let [from, size] = [target.window[1], target.capacity[1]].map(|n| u64::from(n) * Target::BYTES[1]);
        bindings.set_window(b::INDICES, &mesh.indices, from, size).set(b::HEADER, &mesh.header);
        self.normals.encode_add_neighbours(&self.gpu, pass, &bindings, place.count[1]);
    }

    /// The mesh's vertices in windows that can be bound and do not overlap.
    fn windows(&self, vertices: u32) -> Vec<Window> {
        let binding = self.gpu.device.limits().max_storage_buffer_binding_size;
        let most = u32::try_from(binding / Target::BYTES[0]).unwrap_or(u32::MAX);
        let most = most - most % Target::ALIGNED[0];
        let first = (0..vertices).step_by(most.max(Target::ALIGNED[0]) as usize);
        first.map(|first| [first, most.min(vertices - first)]).collect()
    }
}

fn set_vertices<'a>(bindings: &mut Bindings<'a>, number: usize, mesh: &'a GpuMesh, window: Window) {
    let [from, size] = window.map(|n| u64::from(n) * Target::BYTES[0]);
    bindings.set_window(number, &mesh.vertices, from, size);
}

fn vertices_of(place: &Place) -> Window {
    [place.first[0], place.count[0]]
}

fn overlap(a: &Window, b: &Window) -> bool {
    let end = |w: &Window| u64::from(w[0]) + u64::from(w[1]);
    u64::from(a[0]) < end(b) && u64::from(b[0]) < end(a)
}
