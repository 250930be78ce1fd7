//! The refiner on the GPU: the mesh stays there. Shaders: `shaders/refine/`.
//!
//! The same steps as on the CPU, with the same result bit for bit where the adapter rounds as the CPU does. What depends
//! on no order (marks that are only ever set, counts) is done by atomics; what does is numbered by scans. A level is
//! three submissions, after each of which a few numbers are read: edges, and marks until no more are set; how large the
//! next mesh is; its vertices and triangles, until none is turned over.

mod kernels;
mod params;
mod run;

pub(crate) use kernels::Kernels;
pub(super) use kernels::LONGEST_FAN;
pub use params::{Counted, Refining};

use super::{Level, RefineError, RefineReport, Settings};
use crate::extract::Extractor;
use crate::field::Surface;
use crate::gpu::kernel::{Bindings, Kernel, binding as b};
use crate::gpu::{GpuMesh, MeshHeader};
use crate::mesh::{Mesh, Vertex};
use run::{Run, STORAGE};
use std::time::Instant;

/// Rounds of marks, and of vertices that are taken back, that are recorded before it is asked whether they were the last.
const CLOSINGS: u32 = 8;
const TAKE_BACKS: u32 = 4;
/// Bytes of a vertex, and of a vertex that is to be placed.
const VERTEX: u64 = size_of::<Vertex>() as u64;
const TASK: u64 = 32;

impl Extractor {
    /// Refines `mesh` on the `surface` that it was made of, as [`crate::refine::refine`] does, and leaves the result on the
    /// GPU; `mesh` stays as it is. On an adapter that rounds as the CPU does it has the same bytes. `progress` hears how much
    /// of the work is done, from 0 to 1.
    ///
    /// What the CPU refines, too, and the GPU does not, [`RefineError::is_of_gpu`] tells.
    ///
    /// # Errors
    /// As [`crate::refine::refine`], and [`RefineError::NoForm`] for a field without WGSL; [`RefineError::NoNormal`],
    /// [`RefineError::Crowded`], [`RefineError::CutShort`], [`RefineError::Binding`], [`RefineError::Extract`],
    /// [`RefineError::Gpu`].
    pub fn refine(
        &self,
        surface: &Surface<'_>,
        mesh: &GpuMesh,
        settings: &Settings,
        progress: &dyn Fn(f64),
    ) -> Result<(GpuMesh, RefineReport), RefineError> {
        let since = Instant::now();
        settings.check_for(surface)?;
        let header = mesh.read_header(&self.gpu)?;
        let mut report = RefineReport::default();
        if !header.is_whole() || header.triangles == 0 {
            report.levels.push(level([0; 2], [0; 2]));
            progress(1.0);
            return Ok((GpuMesh::upload(&self.gpu, &Mesh::default())?, report));
        }
        let (vertices, triangles) = (u64::from(header.vertices), u64::from(header.triangles));
        if vertices >= u64::from(u32::MAX) || triangles > settings.most_triangles {
            return Err(settings.too_large(0, vertices, triangles));
        }
        let run = Run::new(self, surface, settings)?;
        let mut at = run.start(mesh, [header.vertices, header.triangles], &mut report)?;
        report.levels.push(level(at.size, [0; 2]));
        for number in 1..=settings.depth {
            // As on the CPU.
            progress(f64::exp2(f64::from(number) - f64::from(settings.depth) - 1.0));
            let Some((next, splits)) = run.level(&at, number, &mut report)? else { break };
            at = next;
            report.levels.push(level(at.size, splits));
        }
        let [vertices, triangles] = at.size;
        let header =
            MeshHeader { index_count: 3 * triangles, instance_count: 1, vertices, triangles, ..header };
        self.gpu.write(&at.mesh.header, bytemuck::bytes_of(&header))?;
        self.gpu.wait()?;
        progress(1.0);
        report.seconds = since.elapsed().as_secs_f64();
        Ok((at.mesh, report))
    }
}

fn level([vertices, triangles]: [u32; 2], [bent, for_shape]: [u32; 2]) -> Level {
    Level {
        vertices: vertices.into(),
        triangles: triangles.into(),
        bent: bent.into(),
        for_shape: for_shape.into(),
    }
}

/// The mesh after a level, and what is known of each vertex.
struct At {
    mesh: GpuMesh,
    states: wgpu::Buffer,
    /// Vertices and triangles.
    size: [u32; 2],
}

impl Run<'_> {
    /// The start mesh, its vertices on the surface.
    fn start(
        &self,
        mesh: &GpuMesh,
        [vertices, all]: [u32; 2],
        report: &mut RefineReport,
    ) -> Result<At, RefineError> {
        let kernels = self.kernels;
        self.bindable("the mesh's vertices", mesh.vertices.size())?;
        self.bindable("the mesh's triangles", mesh.indices.size())?;
        let splits = self.buffer("marks of triangles", 8 * (u64::from(all) + 1))?;
        let partials = self.partials(all)?;
        let params = self.uniform(Refining { vertices, triangles: all, tasks: vertices, ..self.plain });
        let mut of_given = self.bindings(&params);
        of_given.set(b::VERTICES, &mesh.vertices).set(b::INDICES, &mesh.indices).set(b::SPLITS, &splits);
        self.begin_count()?;
        self.submit(|encoder| {
            let inspect = [(&kernels.inspect_vertices, vertices), (&kernels.inspect_triangles, all)];
            self.dispatch(encoder, &of_given, &inspect);
        })?;
        let found = self.counted()?;
        let named = |number: u32| (number != u32::MAX).then_some(number as usize);
        if let Some(vertex) = named(found.not_finite) {
            return Err(RefineError::NotFinite { vertex });
        }
        if let Some(triangle) = named(found.bad_triangle) {
            return Err(RefineError::BadIndex { triangle, vertices: vertices as usize });
        }
        if let Some(vertex) = named(found.without_normal) {
            return Err(RefineError::NoNormal { vertex });
        }
        report.improper = found.improper.into();
        let triangles = all - found.improper;

        let at = self.at([vertices, triangles])?;
        let n = u64::from(vertices);
        let longest = self.buffer("longest edges", 4 * n)?;
        let tasks = self.buffer("vertices to place", TASK * n)?;
        let fallbacks = self.buffer("fallbacks", VERTEX * n)?;
        of_given.set(b::KEPT_INDICES, &at.mesh.indices);
        let params = self.uniform(Refining { vertices, triangles, tasks: vertices, ..self.plain });
        let mut bindings = self.bindings(&params);
        bindings
            .set(b::VERTICES, &mesh.vertices)
            .set(b::INDICES, &at.mesh.indices)
            .set(b::LENGTHS, &longest)
            .set(b::TASKS, &tasks)
            .set(b::FALLBACKS, &fallbacks)
            .set(b::STATES, &at.states);
        let mut of_result = bindings.clone();
        of_result.set(b::VERTICES, &at.mesh.vertices);
        let take_back = |encoder: &mut wgpu::CommandEncoder| {
            self.take_back(encoder, &of_result, (&kernels.find_bad_start, triangles), vertices);
        };
        self.submit(|encoder| {
            if found.improper == 0 {
                let bytes = 12 * u64::from(triangles);
                encoder.copy_buffer_to_buffer(&mesh.indices, 0, &at.mesh.indices, 0, bytes);
            } else {
                self.scan(encoder, &splits, &partials, all);
                self.dispatch(encoder, &of_given, &[(&kernels.keep_proper, all)]);
            }
            encoder.clear_buffer(&longest, 0, None);
            let tasks = [(&kernels.find_longest, triangles), (&kernels.start_tasks, vertices)];
            self.dispatch(encoder, &bindings, &tasks);
            self.dispatch(encoder, &of_result, &[(&*self.place, vertices)]);
            take_back(encoder);
        })?;
        self.until_unchanged(take_back, vertices, report)?;
        Ok(at)
    }

    /// One level: the mesh after it, and the edges that were split because they were not flat, and for shape. Nothing if
    /// all are flat.
    fn level(
        &self,
        at: &At,
        number: u32,
        report: &mut RefineReport,
    ) -> Result<Option<(At, [u32; 2])>, RefineError> {
        let (gpu, kernels, [vertices, triangles]) = (self.gpu(), self.kernels, at.size);
        let half_edges = 3 * triangles;
        let (v, h) = (u64::from(vertices), u64::from(half_edges));
        let fans = self.buffer("edges of vertices", 8 * (v + 1))?;
        let lists = self.buffer("half-edges", 4 * h)?;
        let edge_of = self.buffer("edges of half-edges", 4 * h)?;
        let lengths = self.buffer("lengths of edges", 4 * h)?;
        let splits = self.buffer("splits", 8 * (h + 1))?;
        let partials = self.partials(vertices.max(half_edges))?;
        let totals = gpu.buffer("totals", 8, STORAGE)?;
        let params = Refining { vertices, triangles, first: vertices, ..self.plain };
        let uniform = self.uniform(params);
        let mut bindings = self.bindings(&uniform);
        bindings
            .set(b::VERTICES, &at.mesh.vertices)
            .set(b::INDICES, &at.mesh.indices)
            .set(b::FANS, &fans)
            .set(b::HALF_EDGES, &lists)
            .set(b::EDGE_OF, &edge_of)
            .set(b::LENGTHS, &lengths)
            .set(b::SPLITS, &splits)
            .set(b::STATES, &at.states);
        let close = |encoder: &mut wgpu::CommandEncoder| {
            self.dispatch(encoder, &bindings, &[(&kernels.close, triangles); CLOSINGS as usize - 1]);
            self.forget_change(encoder);
            self.dispatch(encoder, &bindings, &[(&kernels.close, triangles)]);
        };
        self.begin_count()?;
        self.submit(|encoder| {
            encoder.clear_buffer(&fans, 0, None);
            self.dispatch(encoder, &bindings, &[(&kernels.count_fans, half_edges)]);
            self.scan(encoder, &fans, &partials, vertices);
            let edges = [(&kernels.fill_fans, half_edges), (&kernels.sort_fans, vertices)];
            self.dispatch(encoder, &bindings, &edges);
            self.dispatch(encoder, &bindings, &[(&kernels.measure, half_edges)]);
            close(encoder);
        })?;
        let mut marked = self.counted()?;
        if marked.crowded != 0 {
            return Err(RefineError::Crowded);
        }
        if marked.bent == 0 {
            return Ok(None);
        }
        while marked.changed != 0 {
            self.submit(close)?;
            marked = self.counted()?;
        }
        self.submit(|encoder| {
            self.dispatch(encoder, &bindings, &[(&kernels.count_parts, triangles)]);
            self.scan(encoder, &splits, &partials, half_edges);
            encoder.copy_buffer_to_buffer(&splits, 8 * h, &totals, 0, 8);
        })?;
        let [split, parts]: [u32; 2] = gpu.read_one(&totals)?;
        let (all_vertices, all_triangles) = (v + u64::from(split), u64::from(parts));
        let most = self.settings.most_triangles.min(u64::from(u32::MAX) / 3);
        if all_vertices >= u64::from(u32::MAX) || all_triangles > most {
            return Err(self.settings.too_large(number, all_vertices, all_triangles));
        }

        let next = self.at([vertices + split, parts])?;
        let tasks = self.buffer("vertices to place", TASK * u64::from(split))?;
        let fallbacks = self.buffer("fallbacks", VERTEX * u64::from(split))?;
        let uniform = self.uniform(Refining { tasks: split, ..params });
        bindings.set(b::PARAMS, &uniform).set(b::TASKS, &tasks).set(b::FALLBACKS, &fallbacks);
        let mut of_next = bindings.clone();
        of_next
            .set(b::VERTICES, &next.mesh.vertices)
            .set(b::STATES, &next.states)
            .set(b::KEPT_INDICES, &next.mesh.indices);
        let take_back_and_cut = |encoder: &mut wgpu::CommandEncoder| {
            self.take_back(encoder, &of_next, (&kernels.find_bad, triangles), split);
            self.dispatch(encoder, &of_next, &[(&kernels.cut, triangles)]);
        };
        self.begin_count()?;
        self.submit(|encoder| {
            encoder.copy_buffer_to_buffer(&at.mesh.vertices, 0, &next.mesh.vertices, 0, VERTEX * v);
            encoder.copy_buffer_to_buffer(&at.states, 0, &next.states, 0, 4 * v);
            self.dispatch(encoder, &bindings, &[(&kernels.middle_tasks, half_edges)]);
            self.dispatch(encoder, &of_next, &[(&*self.place, split)]);
            take_back_and_cut(encoder);
        })?;
        self.until_unchanged(take_back_and_cut, split, report)?;
        Ok(Some((next, [marked.bent, split - marked.bent])))
    }

    /// Rounds of taking vertices back.
    fn take_back(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &Bindings<'_>,
        find: (&Kernel, u32),
        tasks: u32,
    ) {
        for round in 1..=TAKE_BACKS {
            if round == TAKE_BACKS {
                self.forget_change(encoder);
            }
            self.dispatch(encoder, bindings, &[find, (&self.kernels.take_back, tasks)]);
        }
    }

    /// Asks for `rounds` until they change nothing, and adds to the report what became of so many vertices.
    fn until_unchanged(
        &self,
        rounds: impl Fn(&mut wgpu::CommandEncoder),
        placed: u32,
        report: &mut RefineReport,
    ) -> Result<(), RefineError> {
        let mut counted = self.counted()?;
        while counted.changed != 0 {
            self.submit(&rounds)?;
            counted = self.counted()?;
        }
        if counted.cut_short != 0 || counted.runaway != 0 {
            return Err(RefineError::CutShort);
        }
        let taken_back = u64::from(counted.astray) + u64::from(counted.taken_back);
        let not_converged = u64::from(counted.not_converged);
        report.projected += u64::from(placed) - not_converged - taken_back;
        report.not_converged += not_converged;
        report.taken_back += taken_back;
        report.singular += u64::from(counted.singular);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
