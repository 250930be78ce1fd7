//! From a source of samples and an iso value to a mesh: on the GPU ([`Extractor`]), or by the CPU twins
//! ([`extract_on_cpu`]).

mod border;
mod cap;
mod cpu;
mod cpu_extractor;
mod encode;
mod gpu;
mod incremental;
mod kept;
mod normals;
mod plan;
mod planes;
mod run;
mod upload;
mod workspace;

pub use crate::field::differences::Normals;
pub use crate::stage::method::{Method, Placement};
pub use cap::{CapError, Capped, CappedField};
pub(crate) use cpu::{Clock, Job, RECORDS};
pub use cpu_extractor::{CpuExtractor, extract_on_cpu};
pub use gpu::Extractor;
pub use incremental::{Incremental, Update};
pub(crate) use kept::{KEPT_BYTES, Kept};
pub use plan::Plan;
pub use planes::{PlanesError, extract_planes};
pub use run::Extraction;
pub use workspace::Workspace;

use crate::field::{Field, NoForm, PARAMETER_VECTORS, Sense, Wgsl};
use crate::gpu::GpuError;
use crate::grid::{Grid, SAMPLES_PER_BRICK};
use crate::stage::inside::from_order_key;
use crate::stage::params::Params;
use crate::stage::sample::cpu::sample;
use crate::volume::{Scalar, Volume};
use rayon::prelude::*;

/// What is meshed.
#[derive(Debug, Clone, Copy)]
pub enum Source<'a> {
    /// A field, evaluated at the points of a grid.
    Field(&'a dyn Field, Grid),
    /// A volume, on its own grid.
    Volume(&'a Volume),
}

impl Source<'_> {
    /// The grid of sample points.
    pub fn grid(&self) -> &Grid {
        match self {
            Source::Field(_, grid) => grid,
            Source::Volume(volume) => volume.grid(),
        }
    }

    /// The type of a volume's samples.
    pub(crate) fn scalar(&self) -> Option<Scalar> {
        match self {
            Source::Field(..) => None,
            Source::Volume(volume) => Some(volume.values().scalar()),
        }
    }

    /// The lowest and highest finite sample, evaluated on the CPU; `None` if there is none, or if only a GPU
    /// evaluates the field.
    pub fn value_range(&self) -> Option<(f32, f32)> {
        match self {
            Source::Volume(volume) => volume.finite_range(),
            Source::Field(field, grid) => {
                let params = Params::new(grid, 0.0, Sense::Below);
                let brick_range = |brick| {
                    let mut samples = [0.0; SAMPLES_PER_BRICK];
                    sample(&params, *field, params.brick_origin(brick), &mut samples).ok()?;
                    let finite = samples.into_iter().filter(|v| v.is_finite());
                    finite.map(|v| (v, v)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
                };
                let ranges = (0..params.slab_bricks).into_par_iter().filter_map(brick_range);
                ranges.reduce_with(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            }
        }
    }

    /// Which side of iso is inside unless the caller says otherwise: volumes are density-like.
    pub fn sense(&self) -> Sense {
        match self {
            Source::Field(field, _) => field.sense(),
            Source::Volume(_) => Sense::Above,
        }
    }
}

/// The settings of one extraction; changing them uploads nothing, and compiles nothing but the kernel of another
/// kind of normals when it is first asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The iso value, in the units of the samples.
    pub iso: f32,
    /// How cells become triangles.
    pub method: Method,
    /// Where vertices lie on their edges and within cells.
    pub placement: Placement,
    /// Which side is inside, where it is not the source's own sense.
    pub sense: Option<Sense>,
    /// What the normals of a field come from; those of a volume are differences of its samples.
    pub normals: Normals,
    /// Whether a field's bricks are culled by its intervals. It changes no mesh, only the time; without, all of a large grid's bricks want
    /// room in the workspace that [`Extractor::encode`] works in ([`Extractor::prepare_for`]).
    pub cull: bool,
    /// The most bytes that buffers (of GPU or CPU, the mesh included) may take.
    pub memory_budget: u64,
}

impl Options {
    /// The settings for an iso value, with all of memory.
    pub fn new(iso: f32) -> Self {
        Self {
            iso,
            method: Method::default(),
            placement: Placement::default(),
            sense: None,
            normals: Normals::Exact,
            cull: true,
            memory_budget: u64::MAX,
        }
    }

    /// Whether the numbers make sense.
    pub(crate) fn check(&self) -> Result<(), ExtractError> {
        if !self.iso.is_finite() {
            return Err(ExtractError::Iso(self.iso));
        }
        if let Placement::Snapped { epsilon } = self.placement
            && !(epsilon.is_finite() && epsilon > 0.0)
        {
            return Err(ExtractError::Epsilon(epsilon));
        }
        match self.normals.delta() {
            Some(delta) if !(delta.is_finite() && delta > 0.0) => Err(ExtractError::Delta(delta)),
            _ => Ok(()),
        }
    }
}

/// The parts of an extraction that are timed. Where one takes another in, only the whole is timed: classify takes the samples on many
/// GPUs, and is done while the table of brick ranges is made on a volume's first extraction on the CPU.
pub const STAGES: [&str; 8] = ["read", "upload", "cull", "sample", "classify", "scan", "emit", "normals"];

/// Indices into [`Report::seconds`].
#[allow(missing_docs, reason = "the names say it all")]
pub mod stage_index {
    pub const READ: usize = 0;
    pub const UPLOAD: usize = 1;
    pub const CULL: usize = 2;
    pub const SAMPLE: usize = 3;
    pub const CLASSIFY: usize = 4;
    pub const SCAN: usize = 5;
    pub const EMIT: usize = 6;
    pub const NORMALS: usize = 7;
}

/// What an extraction did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Bricks of the grid.
    pub bricks: u64,
    /// Bricks that cull kept.
    pub active_bricks: u64,
    /// Samples that were NaN or infinite; they count as outside.
    pub non_finite: u64,
    /// Edges of the mesh that are open because the domain ends, where they were counted: by [`extract_planes`]. Of a mesh in
    /// memory, [`Mesh::open_edges_at_border`](crate::mesh::Mesh::open_edges_at_border) tells.
    pub open_edges: Option<u64>,
    /// Slabs that the grid was cut into.
    pub slabs: u64,
    /// The most bytes that buffers took at one time, the mesh included.
    pub peak_bytes: u64,
    /// Of these, what is neither samples nor mesh nor a volume's table of ranges: lists, maps and records of a slab's
    /// bricks. It follows the active bricks: under a byte a cell of them.
    pub scratch_bytes: u64,
    /// Seconds of each of [`STAGES`]; none where it was not done or not measured.
    pub seconds: [Option<f64>; STAGES.len()],
}

/// Why an extraction failed.
#[derive(Debug, Clone, thiserror::Error)]
pub enum ExtractError {
    /// The GPU failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The field has no form for this backend.
    #[error(transparent)]
    NoForm(#[from] NoForm),
    /// An extraction works in the workspace, and the call came from within it: from its progress, or as a task of rayon's on its
    /// thread.
    #[error(
        "an extraction works in the workspace on this very thread: call again when it is done, or prepare a workspace for each"
    )]
    Busy,
    /// The iso value is NaN or infinite.
    #[error("the iso value is {0}: give a finite number")]
    Iso(f32),
    /// The tolerance of snapped vertices is NaN, infinite, 0 or below.
    #[error("vertices are to lie within {0} of the surface: give a finite number over 0, in world units")]
    Epsilon(f32),
    /// The step of differences is NaN, infinite, 0 or below.
    #[error(
        "the step of the normals' differences is {0}: give a finite number over 0, in world units, or none for a \
         hundredth of the grid's shortest step"
    )]
    Delta(f32),
    /// More bytes needed than allowed.
    #[error(
        "{what} needs {needed} bytes, over the memory budget of {budget} bytes: raise the budget \
         (`Options::memory_budget`) or coarsen the grid"
    )]
    Budget {
        /// What needs them.
        what: &'static str,
        /// How many.
        needed: u64,
        /// How many there are.
        budget: u64,
    },
    /// More active bricks than a workspace has room for.
    #[error(
        "the surface lies in {needed} bricks, and the workspace has room for {slots}: make one with \
         `Extractor::prepare_for`"
    )]
    Slots {
        /// Bricks that may hold surface, of the slab that has most.
        needed: u32,
        /// How many there is room for.
        slots: u32,
    },
    /// The least slab of bricks is more than the adapter can bind.
    #[error(
        "the smallest slab of the grid, {bricks} bricks, needs a binding of {needed} bytes, and the adapter {adapter} binds at most \
         {limit}: coarsen the grid"
    )]
    Binding {
        /// Bricks of the slab with its halo.
        bricks: u64,
        /// Bytes of the largest buffer.
        needed: u64,
        /// Bytes that the adapter binds.
        limit: u64,
        /// Its name.
        adapter: String,
    },
    /// What a field reads (blobs, samples of a volume in a graph) is more than the adapter binds.
    #[error(
        "the field's lists and volumes take {needed} bytes, and the adapter {adapter} binds at most {limit}: \
         extract on the CPU"
    )]
    FieldData {
        /// Their bytes.
        needed: u64,
        /// Bytes that the adapter binds.
        limit: u64,
        /// Its name.
        adapter: String,
    },
    /// The mesh, or the room that the caller gave it, is more than one buffer of the adapter.
    #[error(
        "{what} take {needed} bytes, and a buffer of the adapter {adapter} at most {limit}: coarsen the grid, \
         or give less room"
    )]
    MeshBuffer {
        /// Vertices or triangles.
        what: &'static str,
        /// Their bytes.
        needed: u64,
        /// Bytes that the adapter allows.
        limit: u64,
        /// Its name.
        adapter: String,
    },
    /// More vertices or indices than 32-bit numbers can count.
    #[error(
        "the mesh has {vertices} vertices and {triangles} triangles, more than 32-bit indices count: coarsen the grid"
    )]
    TooLarge {
        /// Vertices.
        vertices: u64,
        /// Triangles.
        triangles: u64,
    },
    /// More bricks than 32-bit numbers can count.
    #[error("the grid has {bricks} bricks of 8³ cells, more than 32-bit numbers count: coarsen it")]
    TooManyBricks {
        /// How many.
        bricks: u64,
    },
    /// A loop of a user's WGSL ran away.
    #[error(
        "a loop in `density` was stopped: one invocation, which evaluates the function 3 to 36 times, made over \
         {limit} iterations; it may have no end: bound it, or do less in it"
    )]
    Runaway {
        /// Iterations that one invocation may make.
        limit: u32,
    },
    /// A workspace was given another source than it was prepared for.
    #[error("the workspace was prepared for another source: prepare one for this grid and field")]
    OtherSource,
    /// A field with more parameters than its buffer has places for.
    #[error(
        "the field has {given} parameters, and a GPU has room for {}: make numbers that do not change constants, or \
         extract on the CPU", 4 * PARAMETER_VECTORS
    )]
    TooManyParameters {
        /// How many it has.
        given: usize,
    },
    /// `encode` was asked for a grid that needs several slabs.
    #[error("the grid needs {slabs} slabs on this adapter or budget, and `encode` takes one: use `extract`")]
    Slabs {
        /// How many.
        slabs: usize,
    },
}

/// The lowest and highest value of any brick, from their ranges of order keys. A brick with samples that
/// are not finite has the widest range, which says nothing.
fn widest(ranges: &[[u32; 2]]) -> Option<(f32, f32)> {
    let known = ranges.iter().filter(|[low, high]| low <= high && [*low, *high] != [0, u32::MAX]);
    let keys = known.copied().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    keys.map(|[low, high]| (from_order_key(low), from_order_key(high)))
}

/// Whether a field's parameters have places. Before anything is compiled: a compiler refuses the places that are missing.
pub(crate) fn check_parameters(wgsl: &Wgsl) -> Result<(), ExtractError> {
    let given = wgsl.parameters.len();
    if given > 4 * PARAMETER_VECTORS {
        return Err(ExtractError::TooManyParameters { given });
    }
    Ok(())
}

/// Checks that hold for both backends.
fn check(source: &Source<'_>, options: &Options) -> Result<(), ExtractError> {
    options.check()?;
    let bricks = source.grid().brick_count();
    // Slabs number their bricks, and one past the last, in 32 bits.
    if bricks >= u64::from(u32::MAX) {
        return Err(ExtractError::TooManyBricks { bricks });
    }
    Ok(())
}
