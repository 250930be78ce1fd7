//! The kernels of the refiner, compiled when they are first asked for.

use crate::field::Wgsl;
use crate::gpu::kernel::{Kernel, Latest};
use crate::gpu::{Gpu, GpuError};
use crate::stage::shaders;
use std::sync::{Arc, OnceLock};

/// Half-edges from one vertex that are sorted: in the worst case in half the square of that many iterations, and
/// lavapipe ends an invocation's loops in silence after 65,535.
pub(in crate::refine) const LONGEST_FAN: u32 = 320;

/// All kernels.
#[derive(Debug, Default)]
pub(crate) struct Kernels {
    pub(super) common: OnceLock<Common>,
    /// By the text of value and gradient.
    place: Latest<[Option<Arc<str>>; 2], Kernel>,
}

impl Kernels {
    /// The one kernel that depends on the field.
    pub(super) fn place(&self, gpu: &Gpu, wgsl: &Wgsl) -> Result<Arc<Kernel>, GpuError> {
        let key = [Some(wgsl.value.clone()), wgsl.gradient.clone()];
        self.place.get(key, || Kernel::new(gpu, &shaders::refine_place(wgsl), "place", &[]))
    }
}

/// Those that are the same for all fields.
#[derive(Debug)]
pub(super) struct Common {
    pub inspect_vertices: Kernel,
    pub inspect_triangles: Kernel,
    pub keep_proper: Kernel,
    pub find_longest: Kernel,
    pub start_tasks: Kernel,
    pub count_fans: Kernel,
    pub fill_fans: Kernel,
    pub sort_fans: Kernel,
    pub measure: Kernel,
    pub close: Kernel,
    pub count_parts: Kernel,
    pub middle_tasks: Kernel,
    pub find_bad_start: Kernel,
    pub find_bad: Kernel,
    pub take_back: Kernel,
    pub cut: Kernel,
}

impl Common {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let start = |entry| Kernel::new(gpu, &shaders::refine_start(), entry, &[]);
        let longest_fan = [("longest_fan", f64::from(LONGEST_FAN))];
        let fans = |entry| Kernel::new(gpu, &shaders::refine_edges(), entry, &longest_fan);
        let marks = |entry| Kernel::new(gpu, &shaders::refine_marks(), entry, &[]);
        let tasks = |entry| Kernel::new(gpu, &shaders::refine_tasks(), entry, &[]);
        let cut = |entry| Kernel::new(gpu, &shaders::refine_cut(), entry, &[]);
        Ok(Self {
            inspect_vertices: start("inspect_vertices")?,
            inspect_triangles: start("inspect_triangles")?,
            keep_proper: start("keep_proper")?,
            find_longest: start("find_longest")?,
            start_tasks: tasks("start_tasks")?,
            count_fans: fans("count_fans")?,
            fill_fans: fans("fill_fans")?,
            sort_fans: fans("sort_fans")?,
            measure: marks("measure")?,
            close: marks("close")?,
            count_parts: marks("count_parts")?,
            middle_tasks: tasks("middle_tasks")?,
            find_bad_start: cut("find_bad_start")?,
            find_bad: cut("find_bad")?,
            take_back: cut("take_back")?,
            cut: cut("cut")?,
        })
    }
}
