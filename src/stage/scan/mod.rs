//! scan: exclusive prefix sums of counters. Shader: `shaders/scan.wgsl`.
//!
//! Theory: reduce-then-scan (Merrill & Grimshaw 2009 give the alternatives). Practice: three
//! dispatches, deterministic, with no workgroup waiting for another, at three counters a brick.

pub mod cpu;

use super::shaders;
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Form, Gpu, GpuError};

/// Invocations a workgroup, and items that one sums.
pub(super) fn group_and_run(form: Form) -> (u32, u32) {
    match form {
        Form::Serial => (64, 64),
        Form::Shared | Form::Subgroup => (256, 1),
    }
}

/// What is scanned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scanned {
    /// The bits of the brick map, which make the list of active bricks.
    Map,
    /// The counts of the active bricks; those that make anything are listed for emit.
    Bricks,
    /// As many pairs of counts as the slab has bricks.
    Counts,
}

/// The kernels of the stage.
#[derive(Debug)]
pub struct Scan {
    reduce: Kernel,
    scan_partials: Kernel,
    apply: Kernel,
    /// Items of a workgroup.
    of_group: u32,
}

impl Scan {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, scanned: Scanned) -> Result<Self, GpuError> {
        let source = shaders::scan(scanned, gpu.scan_form());
        let (group, run) = group_and_run(gpu.scan_form());
        let kernel = |entry| Kernel::new(gpu, &source, entry, &[]);
        Ok(Self {
            reduce: kernel("reduce")?,
            scan_partials: kernel("scan_partials")?,
            apply: kernel("apply")?,
            of_group: group * run,
        })
    }

    /// Bytes of the partial sums of so many items: three words and one unused for each workgroup of the form that has the smallest ones.
    pub fn partial_bytes(items: u64) -> u64 {
        let of_group = Form::ALL.map(|form| {
            let (group, run) = group_and_run(form);
            u64::from(group * run)
        });
        16 * items.div_ceil(of_group.into_iter().min().unwrap_or(1)).max(1)
    }

    /// Scans at most `items` items and one more for the total: words of the map, or counts.
    pub fn encode(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, bindings: &Bindings<'_>, items: u32) {
        let groups = items.div_ceil(self.of_group).max(1);
        self.reduce.dispatch(gpu, pass, bindings, groups);
        self.scan_partials.dispatch(gpu, pass, bindings, 1);
        self.apply.dispatch(gpu, pass, bindings, groups);
    }
}
