//! Sharp features on the uniform grid: dual contouring (Ju, Losasso, Schaefer & Warren 2002, *Dual contouring of Hermite
//! data*), manifold by one vertex for each sheet of a cell (Nielson 2004, *Dual marching cubes*).
//!
//! Every crossed edge of the grid makes a polygon of the vertices of the cells around it, and every vertex lies on the
//! feature that the surface has in its cell: on the edge where two smooth sides meet, in the corner where three do, and
//! on the smooth surface elsewhere. The sheets are the loops that the marching cubes table draws around a cell, so the
//! mesh has the topology of the uniform extraction's on the same grid.
//!
//! - Two cells may share two sheets' segments through one ambiguous face, where both have both on one sheet. Four
//!   polygons would then meet at one edge of the mesh; each segment gets a vertex of its own in the face instead.
//! - The mesh reaches the grid's border: where a sheet leaves the grid through a face, the segment there gets a
//!   vertex, and so does every crossed edge in the border. Surfaces are open there, as the uniform extraction's.
//! - A feature point may lie up to a cell beyond its cell, where no corner of the grid tells of a thin edge. Where that,
//!   or a vertex in its cell, turns a triangle over, the polygon's vertices go to the feature's other vertices beside
//!   them, then back to their cells, and at last to the mean of their crossings.
//! - A corner is seen from several cells. One vertex takes it, and those with it that would tear a third side off:
//!   between them are triangles without area, which [`Mesh::remove_degenerate`] takes out.

mod hermite;
mod place;
mod polygons;
mod qef;
mod sheets;

use crate::field::{NoForm, Surface};
use crate::grid::Grid;
use crate::mesh::{Mesh, Vertex};
use crate::stage::cull::bounds::cull_field;
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::stage::sample::row::Sampler;
use glam::{DVec3, IVec3, UVec3};
use hermite::{Cell, Crossing, Frame, Scene, brick_data, edge_key};
use place::{Corner, Kind, Placed, Wanted, place};
use polygons::Polygons;
use qef::Plane;
use rayon::prelude::*;
use sheets::{Loop, SHEETS, others};
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Corners that lie closer together are one; in cells.
const SAME: f64 = 0.05;
/// Bricks that one task takes.
const TASK: usize = 16;

/// What an extraction did.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize)]
pub struct SharpReport {
    /// Cells that the surface crosses.
    pub cells: u64,
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Sheets with an edge, where two smooth sides meet.
    pub edges: u64,
    /// Sheets with a corner or a tip.
    pub corners: u64,
    /// Vertices that were moved back into their cells.
    pub clamped: u64,
    /// Vertices at the mean of their crossings: no point of the surface was found, or it turned a triangle over.
    pub fallbacks: u64,
    /// Vertices where the field has no gradient, or one that is not finite.
    pub singular: u64,
    /// Polygons, each around a crossed edge, of which a triangle looks against the surface's normal all the same.
    pub flipped: u64,
    /// Samples that were NaN or infinite; they count as outside.
    pub non_finite: u64,
    /// The most bytes that crossings, sheets, polygons and mesh took at one time.
    #[serde(skip)]
    pub peak_bytes: u64,
}

/// Why an extraction failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SharpError {
    /// Only a GPU evaluates the field.
    #[error(transparent)]
    NoForm(#[from] NoForm),
    /// The iso value is NaN or infinite.
    #[error("the iso value is {0}: give a finite number")]
    Iso(f32),
    /// More bytes needed than allowed.
    #[error(
        "{what} needs {needed} bytes, over the memory budget of {budget} bytes: raise the budget or coarsen the grid"
    )]
    Budget {
        /// What needs them.
        what: &'static str,
        /// How many.
        needed: u64,
        /// How many there are.
        budget: u64,
    },
    /// More bricks than 32-bit numbers can count.
    #[error("the grid has {bricks} bricks of 8³ cells, more than 32-bit numbers count: coarsen it")]
    TooManyBricks {
        /// How many.
        bricks: u64,
    },
    /// More crossed edges, or more vertices, than 32-bit numbers can count.
    #[error(
        "the mesh needs {vertices} vertices or crossed edges, more than 32-bit indices count: coarsen the grid"
    )]
    TooLarge {
        /// How many.
        vertices: u64,
    },
}

/// Bytes that a crossed edge takes at most, with its polygon: as found by its brick and then with the others, or with what is
/// made of it.
const EDGE_BYTES: usize = size_of::<Crossing>() + 4 + 16 + 16 + 4 + 2 * size_of::<DVec3>() + 24;
/// Bytes that a sheet takes, with its cell and its vertex, and those of half as many segments.
const SHEET_BYTES: usize =
    size_of::<Cell>() + size_of::<Sheet>() + 3 * size_of::<Placed>() + size_of::<Vertex>();

/// The mesh of `surface` on `grid`, with its edges and corners, if what is kept for it takes at most `memory_budget` bytes.
/// `progress` hears how much of the work is done, from 0 to 1.
///
/// Closed, manifold and oriented, but for where the surface leaves the grid; one vertex for each sheet of a
/// cell, with the exact normal; on a feature the mean of its sides'. Same bytes on any number of threads.
///
/// # Errors
/// [`SharpError`].
pub fn extract(
    surface: &Surface<'_>,
    grid: &Grid,
    memory_budget: u64,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, SharpReport), SharpError> {
    if !surface.iso().is_finite() {
        return Err(SharpError::Iso(surface.iso()));
    }
    let bricks = grid.brick_count();
    if bricks >= u64::from(u32::MAX) {
        return Err(SharpError::TooManyBricks { bricks });
    }
    let params = Params::new(grid, surface.iso(), surface.sense());
    let scene = Scene {
        params,
        inside: Inside::new(surface.iso(), surface.sense()),
        culled: cull_field(&params, surface.field()),
        surface: *surface,
        frame: Frame::new(grid),
    };
    let mut report = SharpReport::default();
    let hermite = Hermite::new(&scene, grid, memory_budget, &mut report, &|part| progress(0.4 * part))?;
    let sheets = Sheets::new(&scene, &hermite, &|part| progress(0.4 + 0.5 * part))?;
    let mut polygons = Polygons::new(&scene, grid, &hermite, &sheets)?;
    progress(0.95);
    polygons.unfold(&scene, &hermite, &sheets, &mut report);
    let triangles = polygons.triangles();
    let count = |kind| sheets.placed.iter().filter(|p| p.kind == kind).count() as u64;
    (report.edges, report.corners) = (count(Kind::Edge), count(Kind::Corner));
    report.singular = polygons.vertices.iter().filter(|p| p.singular).count() as u64;
    report.fallbacks = polygons.vertices.iter().filter(|p| p.fallback).count() as u64;
    report.clamped = polygons.vertices.iter().filter(|p| p.clamped && !p.fallback).count() as u64;
    let vertex = |p: &Placed| Vertex {
        position: p.at.as_vec3().into(),
        // Plus 0: −0 becomes +0.
        normal: (p.normal.as_vec3() + glam::Vec3::ZERO).into(),
    };
    let vertices: Vec<Vertex> = polygons.vertices.par_iter().map(vertex).collect();
    (report.vertices, report.triangles) = (vertices.len() as u64, triangles.len() as u64);
    progress(1.0);
    Ok((Mesh { vertices, triangles }, report))
}

/// All crossed edges and mixed cells.
struct Hermite {
    /// Bricks that have any, in order.
    bricks: Vec<u32>,
    slots: HashMap<u32, u32>,
    /// The first crossing of each brick, and the end.
    first: Vec<u32>,
    crossings: Vec<Crossing>,
    cells: Vec<Vec<Cell>>,
    extent: UVec3,
}

impl Hermite {
    fn new(
        scene: &Scene<'_>,
        grid: &Grid,
        budget: u64,
        report: &mut SharpReport,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, SharpError> {
        let (active, done, bytes) = (&scene.culled.active, AtomicUsize::new(0), AtomicU64::new(0));
        let found = active.par_chunks(TASK).map(|bricks| {
            let mut sampler = Sampler::default();
            let mut found = Vec::new();
            for &brick in bricks {
                let data = brick_data(scene, brick, &mut sampler)?;
                let sheets: usize = data.cells.iter().map(|cell| SHEETS[cell.case as usize].len()).sum();
                let own = (data.crossings.len() * EDGE_BYTES + sheets * SHEET_BYTES) as u64;
                // Lists have more room than they need: measured, a fifth to a quarter.
                let own = own + own.div_ceil(4);
                // Over the budget it is only counted, so that the error tells what suffices.
                if bytes.fetch_add(own, Ordering::Relaxed) + own <= budget {
                    found.push((brick, data));
                }
            }
            let done = done.fetch_add(bricks.len(), Ordering::Relaxed) + bricks.len();
            progress(done as f64 / active.len() as f64);
            Ok(found)
        });
        let found: Vec<_> = found.collect::<Result<Vec<_>, NoForm>>()?;
        report.peak_bytes = bytes.into_inner();
        if report.peak_bytes > budget {
            let what = "the mesh with its crossings and sheets";
            return Err(SharpError::Budget { what, needed: report.peak_bytes, budget });
        }
        let mut all = Self {
            bricks: Vec::new(),
            slots: HashMap::new(),
            first: vec![0],
            crossings: Vec::new(),
            cells: Vec::new(),
            extent: grid.bricks(),
        };
        for (brick, data) in found.into_iter().flatten() {
            report.non_finite += data.non_finite;
            report.cells += data.cells.len() as u64;
            if data.crossings.is_empty() && data.cells.is_empty() {
                continue;
            }
            all.slots.insert(brick, all.bricks.len() as u32);
            all.bricks.push(brick);
            all.crossings.extend(data.crossings);
            all.cells.push(data.cells);
            let end = u32::try_from(all.crossings.len());
            all.first.push(end.map_err(|_| SharpError::TooLarge { vertices: all.crossings.len() as u64 })?);
        }
        Ok(all)
    }

    fn brick_of(&self, point: UVec3) -> u32 {
        let b = point / 8;
        b.x + self.extent.x * (b.y + self.extent.y * b.z)
    }

    /// The number of a crossed edge.
    fn edge(&self, point: UVec3, axis: u8) -> Option<u32> {
        let slot = *self.slots.get(&self.brick_of(point))? as usize;
        let own = &self.crossings[self.first[slot] as usize..self.first[slot + 1] as usize];
        let key = edge_key(point, axis);
        let at = own.binary_search_by_key(&key, |c| edge_key(c.point, c.axis)).ok()?;
        Some(self.first[slot] + at as u32)
    }

    /// The number of edge `e` of the cell at `cell`.
    fn edge_of_cell(&self, cell: UVec3, e: u8) -> Option<u32> {
        let axis = usize::from(e / 4);
        let [b, c] = others(axis);
        let mut point = cell;
        point[b] += u32::from(e & 1);
        point[c] += u32::from(e >> 1 & 1);
        self.edge(point, axis as u8)
    }

    /// What is asked of the vertex near these crossed edges.
    fn wanted(&self, scene: &Scene<'_>, edges: &[u32], low: DVec3, high: DVec3) -> Wanted {
        let crossings = || edges.iter().map(|&e| &self.crossings[e as usize]);
        let outward = crossings().map(|c| outward(scene, c)).sum();
        let planes = crossings().map(|c| Plane { at: c.at, normal: c.normal }).collect();
        Wanted { low, high, face: None, planes, outward }
    }
}

/// The way along a crossed edge, out of the solid.
fn outward(scene: &Scene<'_>, crossing: &Crossing) -> DVec3 {
    let along = scene.frame.along(usize::from(crossing.axis));
    if crossing.rises { along } else { -along }
}

/// A sheet of a cell.
struct Sheet {
    cell: UVec3,
    case: u8,
    index: u8,
    /// Where its crossed edges begin, in the order of its loop.
    first: u32,
}

/// All sheets with their vertices.
struct Sheets {
    all: Vec<Sheet>,
    edges: Vec<u32>,
    placed: Vec<Placed>,
    /// The corners that the sheets see, in their order.
    corners: Vec<Corner>,
}

impl Sheets {
    fn new(
        scene: &Scene<'_>,
        hermite: &Hermite,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, SharpError> {
        let (slots, done) = (hermite.bricks.len(), AtomicUsize::new(0));
        let of_slot = |slot: usize| {
            let mut own =
                Self { all: Vec::new(), edges: Vec::new(), placed: Vec::new(), corners: Vec::new() };
            let mut wanted = Vec::new();
            for &Cell { at, case } in &hermite.cells[slot] {
                for (index, sheet) in SHEETS[case as usize].iter().enumerate() {
                    let first = own.edges.len() as u32;
                    // A crossed edge is never missing: its owner sampled the same two points.
                    own.edges.extend(sheet.edges.iter().filter_map(|&e| hermite.edge_of_cell(at, e)));
                    let edges = &own.edges[first as usize..];
                    wanted.push(hermite.wanted(scene, edges, at.as_dvec3(), (at + 1).as_dvec3()));
                    own.all.push(Sheet { cell: at, case, index: index as u8, first });
                }
            }
            (own.placed, own.corners) = place(&scene.nearby(hermite.bricks[slot]), &wanted)?;
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / slots as f64);
            Ok(own)
        };
        let found: Vec<Self> = (0..slots).into_par_iter().map(of_slot).collect::<Result<_, NoForm>>()?;
        let mut all = Self { all: Vec::new(), edges: Vec::new(), placed: Vec::new(), corners: Vec::new() };
        for own in found {
            let (first, before) = (all.edges.len() as u32, all.all.len());
            all.corners.extend(own.corners.into_iter().map(|c| Corner { by: c.by + before, ..c }));
            all.all.extend(own.all.into_iter().map(|s| Sheet { first: s.first + first, ..s }));
            all.edges.extend(own.edges);
            all.placed.extend(own.placed);
        }
        // Four sheets at most at an edge: their edges are counted in 32 bits where sheets and crossings are.
        if all.edges.len() > u32::MAX as usize {
            return Err(SharpError::TooLarge { vertices: all.edges.len() as u64 });
        }
        all.take_corners(scene);
        Ok(all)
    }

    /// Gives every corner to one vertex: to that of the cell in which it lies, else of the nearest that sees it.
    fn take_corners(&mut self, scene: &Scene<'_>) {
        let mut corners = self.corners.clone();
        corners.sort_by(|a, b| a.excess.total_cmp(&b.excess).then(a.by.cmp(&b.by)));
        let cell_of = |at: DVec3| scene.frame.local(at).floor().as_ivec3();
        // By cells, the corners that are taken.
        let mut taken: HashMap<IVec3, Vec<DVec3>> = HashMap::new();
        let around = || (0..27).map(|i| IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        for corner in corners {
            let cell = cell_of(corner.at);
            let is_same = |at: &DVec3| at.distance(corner.at) < SAME * scene.frame.cell;
            if around().any(|d| taken.get(&(cell + d)).is_some_and(|all| all.iter().any(is_same))) {
                continue;
            }
            let placed = &mut self.placed[corner.by];
            (placed.at, placed.normal, placed.kind) = (corner.at, corner.normal, Kind::Corner);
            (placed.clamped, placed.fallback) = (false, false);
            taken.entry(cell).or_default().push(corner.at);
        }
    }

    fn loop_of(&self, sheet: u32) -> &'static Loop {
        let Sheet { case, index, .. } = self.all[sheet as usize];
        &SHEETS[case as usize][index as usize]
    }

    /// The numbers of a sheet's crossed edges.
    fn edges_of(&self, sheet: u32) -> &[u32] {
        let first = self.all[sheet as usize].first as usize;
        &self.edges[first..first + self.loop_of(sheet).edges.len()]
    }
}
