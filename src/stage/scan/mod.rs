//! scan: exclusive prefix sums of pairs of counters. Shader: `shaders/scan.wgsl`.
//!
//! Theory: reduce-then-scan (Merrill & Grimshaw 2009 give the alternatives). Practice: three
//! dispatches, deterministic, with no workgroup waiting for another, at one counter a brick.

pub mod cpu;

use super::shaders;
use crate::gpu::kernel::{Bindings, Kernel};
use crate::gpu::{Gpu, GpuError};

/// Items that one invocation sums, and invocations a workgroup.
pub const RUN: u32 = 64;

/// The kernels of the stage.
#[derive(Debug)]
pub struct Scan {
    reduce: Kernel,
    scan_partials: Kernel,
    apply: Kernel,
}

impl Scan {
    /// Compiles the kernels, for the marks of a slab's bricks or the counts of its active bricks.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, over_bricks: bool) -> Result<Self, GpuError> {
        let source = shaders::scan();
        let constants = [("over_bricks", f64::from(u8::from(over_bricks)))];
        Ok(Self {
            reduce: Kernel::new(gpu, &source, "reduce", &constants)?,
            scan_partials: Kernel::new(gpu, &source, "scan_partials", &constants)?,
            apply: Kernel::new(gpu, &source, "apply", &constants)?,
        })
    }

    /// Scans the buffer bound as counts, of at most `items` items and one more for the total.
    pub fn encode(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, bindings: &Bindings<'_>, items: u32) {
        let groups = items.div_ceil(RUN * RUN).max(1);
        self.reduce.dispatch(gpu, pass, bindings, groups);
        self.scan_partials.dispatch(gpu, pass, bindings, 1);
        self.apply.dispatch(gpu, pass, bindings, groups);
    }
}
