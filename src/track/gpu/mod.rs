//! Continuation on the GPU: the frontier of bricks in indirect dispatches. Shader: `shaders/track.wgsl`.

mod components;

use super::cpu::starts;
use super::{Seeds, Starts, TrackError, TrackReport, search};
use crate::extract::{ExtractError, Extraction, Extractor, Job, Options, Source, Workspace};
use crate::field::user::MAX_ITERATIONS;
use crate::gpu::kernel::{Kernel, Latest};
use crate::gpu::{Gpu, GpuError};
use crate::stage::params::Work;
use crate::stage::shaders;
use crate::volume::Scalar;
use components::Components;
use std::collections::HashSet;
use std::sync::OnceLock;

/// Rounds that are recorded before it is asked whether there are more: a round without bricks costs next to nothing.
const ROUNDS: u32 = 16;

/// The kernels of the tracker, compiled when they are first asked for.
#[derive(Debug, Default)]
pub(crate) struct Kernels {
    /// Of fields, and of volumes by their samples' type.
    follow: Latest<Option<Scalar>, Follow>,
    components: OnceLock<Components>,
}

#[derive(Debug)]
struct Follow {
    begin: Kernel,
    advance: Kernel,
    spread: Kernel,
}

impl Follow {
    fn new(gpu: &Gpu, of_volume: Option<Scalar>) -> Result<Self, GpuError> {
        let source = shaders::track(of_volume);
        Ok(Self {
            begin: Kernel::new(gpu, &source, "begin", &[])?,
            advance: Kernel::new(gpu, &source, "advance", &[])?,
            spread: Kernel::new(gpu, &source, "spread", &[])?,
        })
    }
}

impl Extractor {
    /// Tracks the surface from `seeds`, as [`crate::track::track`] does, and leaves the mesh on the GPU.
    ///
    /// Seeds are looked for on the CPU; where a GPU rounds otherwise, a seed whose edge is crossed by less than that may
    /// get lost. The grid must fit in one slab. Of a volume the report's `non_finite` counts all samples.
    ///
    /// # Errors
    /// As [`crate::track::track`] and [`Extractor::extract`], [`TrackError::Slabs`], [`TrackError::Labels`].
    pub fn track(
        &self,
        source: &Source<'_>,
        options: &Options,
        seeds: &Seeds,
        progress: &dyn Fn(f64),
    ) -> Result<(Extraction, TrackReport), TrackError> {
        let job = Job::new(source, options)?;
        let (starts, mut told) = starts(&job, seeds, options.memory_budget)?;
        progress(0.1);
        let budget = options.memory_budget;
        let is_all = seeds.coarse.is_some() || seeds.search.is_some();
        // What the mesh takes beside the scratch, as far as it is known, and what a slab that did takes.
        let (mut beside, mut scratch) = (0, 0);
        let short = |what, beside: u64, scratch: u64| {
            // A plan's scratch is at most half of what there is: twice as much room has place for this one.
            let needed = beside.saturating_add(scratch.saturating_mul(2));
            TrackError::from(ExtractError::Budget { what, needed, budget })
        };
        let mut most = self.most(source, options);
        let mut old = None;
        let too_large = || {
            let bricks = source.grid().brick_count();
            TrackError::Slabs { bricks, adapter: self.gpu.info.name.clone() }
        };
        let mut what = "the mesh with the scratch";
        let extraction = loop {
            let room = Options { memory_budget: budget.saturating_sub(beside), ..*options };
            let mut space = match self.prepare_cut(source, &room, most, old.take()) {
                Err(ExtractError::Budget { .. }) if beside > 0 => return Err(short(what, beside, scratch)),
                prepared => prepared?.0,
            };
            if space.plan.slab_count() > 1 {
                return Err(if beside > 0 { short(what, beside, scratch) } else { too_large() });
            }
            if let Some(slots) = self.follow(&mut space, options, &starts, &mut told)? {
                if space.plan.slots < most.slots.min(space.plan.bricks) {
                    return Err(too_large());
                }
                most.slots = slots;
                old = Some(space);
                continue;
            }
            progress(0.5);
            let made = self.extract_in(&space, source, options, &|_| {}).map_err(TrackError::from);
            let made = made.and_then(|mut extraction| {
                if !is_all {
                    self.keep_reached(&space, options, &starts.edges, &mut extraction, &mut told)?;
                }
                Ok(extraction)
            });
            match made {
                // The scratch left too little: once more, with what all else leaves.
                Err(TrackError::Extract(ExtractError::Budget { what: of, needed, .. }))
                    if needed.saturating_sub(space.plan.bytes) > beside =>
                {
                    (what, beside, scratch) = (of, needed - space.plan.bytes, space.plan.bytes);
                }
                // The mesh is more than the adapter binds.
                Err(TrackError::Extract(ExtractError::Binding { .. })) => return Err(too_large()),
                made => break made?,
            }
        };
        progress(1.0);
        Ok((extraction, told))
    }

    /// Sets the bits of the bricks that the surface leads to; or says for how many there should be room, where there are
    /// more than slots.
    fn follow(
        &self,
        space: &mut Workspace,
        options: &Options,
        starts: &Starts,
        told: &mut TrackReport,
    ) -> Result<Option<u32>, TrackError> {
        let slots = space.plan.slots;
        if starts.bricks.len() > slots as usize {
            return Ok(Some(starts.bricks.len() as u32));
        }
        let gpu = &self.gpu;
        let kernels = self.track.follow.get(space.scalar, || Follow::new(gpu, space.scalar))?;
        let work = Work {
            queued: starts.bricks.len() as u32,
            batch_slots: space.plan.batch_slots,
            slots,
            ..Work::default()
        };
        gpu.write(&space.work, bytemuck::bytes_of(&work))?;
        gpu.write(&space.counts, bytemuck::cast_slice(&starts.bricks))?;
        let params = self.settings(space, &space.params(options, space.plan.slab(0)));
        let mut is_first = true;
        let work = loop {
            gpu.guarded("tracking", space.plan.bytes, || {
                let bindings = space.bindings(self, &params);
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                if is_first {
                    encoder.clear_buffer(&space.map, 0, None);
                }
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                if is_first {
                    kernels.begin.dispatch(gpu, &mut pass, &bindings, work.queued.div_ceil(64));
                }
                for _ in 0..ROUNDS {
                    kernels.advance.dispatch(gpu, &mut pass, &bindings, 1);
                    if let Some(sample) = &space.sample {
                        sample.encode(gpu, &mut pass, &bindings, &space.dispatches, 0);
                    }
                    kernels.spread.dispatch_indirect(gpu, &mut pass, &bindings, &space.dispatches, 0);
                }
                drop(pass);
                gpu.queue.submit([encoder.finish()]);
            })?;
            is_first = false;
            let work: Work = gpu.read_one(&space.work)?;
            if work.runaway != 0 {
                return Err(ExtractError::Runaway { limit: MAX_ITERATIONS }.into());
            }
            if work.queued > slots {
                // How many more there are is not known.
                return Ok(Some(slots.saturating_mul(4).max(work.queued).min(space.plan.bricks)));
            }
            if work.taken == work.queued {
                break work;
            }
        };
        told.rounds = work.rounds;
        if let Some(search) = told.search.as_mut().filter(|search| search.by_intervals) {
            let reached: Vec<u32> = gpu.read(&space.counts, work.queued.into())?;
            let reached = HashSet::from_iter(reached);
            let params = space.params(options, space.plan.slab(0));
            search.undecided = search::undecided(&params, search.cells, &starts.open, &reached);
        }
        space.is_marked = true;
        Ok(None)
    }
}
