//! The surface tracker: continuation from seeds (Wyvill, McPheeters & Wyvill 1986; Bloomenthal 1988), at a cost that
//! grows with the surface and not with the grid.
//!
//! Seeds lead to crossed edges of the grid. From the bricks that hold these the surface is followed: where two
//! points that a brick shares with the next one lie on different sides of iso, the surface crosses an edge between
//! shared points, and the next brick joins the frontier. So the bricks reached hold whole components of the mesh:
//! of every crossed edge all four cells and the owner. Their sorted list takes the place of what cull leaves,
//! and the stages after it make the mesh; the triangles, and their order, are those of the sweep
//! ([`crate::extract::extract_on_cpu`]).
//!
//! Bricks may hold pieces of components that no seed lies on. Those are followed with the others (their vertices
//! would have no numbers otherwise) and leave the mesh at the end, unless seeds were looked for in the whole grid:
//! then what was found is wanted.
//!
//! Why bricks and not cells one by one: a cell's step evaluates four new corners, of which neighbours share most, one
//! place at a time; a brick takes 9³ samples, which a field evaluates many at a time, and goes
//! through the same stages as in the sweep. `benches/NOTES.md` has both measured.
//!
//! Nothing is as large as the grid: 10,000³ cells are a matter of the surface in them.

mod components;
mod cpu;
mod error;
mod gpu;
mod search;
mod seeds;

pub use cpu::track;
pub use error::TrackError;
pub(crate) use gpu::Kernels;

use glam::{UVec3, Vec3};

/// Where the surface is looked for. The three ways can be joined; at least one is needed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Seeds {
    /// Points in world units: centres of components, or the caller's. If the surface crosses the cell that holds
    /// the point, its pieces there are followed. Else the surface is looked for along the grid's axes
    /// from the nearest grid point, in the order +z, −z, +x, −x, +y, −y, and the first that is met is followed.
    pub points: Vec<Vec3>,
    /// Look between the points of a lattice of every so many grid points (1 or more), the grid's border
    /// included. It finds whatever separates two neighbours of the lattice.
    pub coarse: Option<u32>,
    /// Look by the field's intervals, from the whole grid down to boxes of at most so many cells an axis (1 or more;
    /// the next lower power of two is taken), between whose corners the surface is looked for. With 1 it
    /// finds every component of the sampled grid. Where a field has no intervals, and in a volume, it is the
    /// coarse lattice of that step.
    pub search: Option<u32>,
}

/// What a track did beside what [`crate::extract::Report`] says, whose `active_bricks` are those reached.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackReport {
    /// The seeds of [`Seeds::points`] that led to no surface.
    pub missed: Vec<Missed>,
    /// Rounds of bricks until there were no more.
    pub rounds: u32,
    /// Samples taken to find seeds: single points of the grid.
    pub probes: u64,
    /// Components of the mesh.
    pub components: Option<u64>,
    /// Components that shared bricks with those of the mesh and were left out.
    pub dropped: Option<u64>,
    /// What [`Seeds::search`] found.
    pub search: Option<SearchReport>,
}

/// A seed that led to no surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missed {
    /// Its place in [`Seeds::points`].
    pub seed: usize,
    /// Where it lies.
    pub point: Vec3,
    /// Why.
    pub why: Why,
}

/// Why a seed led to no surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Why {
    /// It lies outside the grid.
    #[error("lies outside the grid")]
    Outside,
    /// From it no surface is met along any axis.
    #[error("meets no surface along the grid's axes")]
    NoSurface,
}

/// What a search by intervals found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SearchReport {
    /// Cells along the smallest boxes.
    pub cells: u32,
    /// Boxes, of any size, that intervals prove to be without surface.
    pub empty: u64,
    /// Smallest boxes in which the surface was found.
    pub crossed: u64,
    /// Smallest boxes that intervals do not prove empty, between whose corners there is no crossing, and of which
    /// not all was reached either: a component could lie in them unseen, if it fits. Of single cells (`cells` 1)
    /// only what is thinner than a cell, which no sweep finds either.
    pub undecided: u64,
    /// Whether the source has intervals. If not, nothing was proven, and the search was a coarse lattice.
    pub by_intervals: bool,
}

impl SearchReport {
    /// Whether every component of the sampled grid was found. If not, those that cross no edge of a lattice of
    /// `cells` may be missing.
    pub fn is_complete(&self) -> bool {
        self.cells == 1 || (self.by_intervals && self.undecided == 0)
    }
}

/// An edge of the grid: from a point to the next along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Edge {
    point: UVec3,
    axis: usize,
}

/// Where continuation starts.
#[derive(Debug, Default)]
struct Starts {
    /// Edges that points led to: what is not connected with one of them leaves the mesh, where there are no others.
    edges: Vec<Edge>,
    /// Bricks that looking through the grid led to.
    bricks: Vec<u32>,
    /// Boxes of the search that are not decided yet: their first cells.
    open: Vec<UVec3>,
}

/// Which of some grid points are inside.
type Probe<'a> = &'a (dyn Fn(&[UVec3]) -> Result<Vec<bool>, TrackError> + Sync);

/// The lowest corner of a cell and its seven others, bits zyx.
fn corners(first: UVec3, end: UVec3) -> [UVec3; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|k: u32| {
        let up = UVec3::new(k & 1, k >> 1 & 1, k >> 2);
        first + up * (end - first)
    })
}
