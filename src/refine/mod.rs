//! The adaptive refiner: splits the edges of a mesh where the surface bends, and puts the new vertices on the surface.
//!
//! Theory: Velho, "Simple and efficient polygonization of implicit surfaces", 1996. An edge whose end
//! normals differ is split at its midpoint, which is projected on the surface; since both triangles at an edge share
//! its midpoint, no crack opens. A triangle with one, two or three split edges becomes two, three or four.
//!
//! Practice: all vertices of the start mesh are projected first, with exact normals. Then, level by level:
//!
//! ```text
//! edges ─► marks: not flat ─► closure: the longest, too ─► midpoints, projected ─► flips taken back ─► triangles
//! ```
//!
//! How it differs from the paper: an edge that lies in the tangent plane at one of its ends is flat, too; a triangle with a split edge also gets its longest edge split (Rivara 1984), so that
//! triangles keep their shape while only the edges along a bend are split; and midpoints are sought along
//! the sum of the normals at the ends, where these differ much from the line on which the tangent planes there meet:
//! so vertices come to lie on the sharp edges of a solid.
//!
//! Meshes on the GPU are refined there ([`crate::extract::Extractor::refine`]): this is the twin of that, file by file.
//!
//! Vertices of the start mesh keep their numbers; new ones follow in the order of their edges, level after level.
//! The parts of a triangle stand where it stood. All of that follows from the mesh and the field alone.

mod edges;
mod error;
mod gpu;
mod place;
mod split;

pub use error::RefineError;
pub(crate) use gpu::Kernels;
pub use gpu::{Counted, Refining};

use crate::field::unit::{has_direction, length, unit};
use crate::field::{NoForm, Surface};
use crate::grid::Grid;
use crate::mesh::{Mesh, Vertex};
use edges::Edges;
use glam::{Mat3, Vec3};
use place::{Tally, Task, place};
use rayon::prelude::*;
use split::{NONE, area, close, cut, faces_outwards, is_flat, part_count};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// The most levels that [`Settings::depth`] may ask for.
pub const MOST_LEVELS: u32 = 10;
/// Triangles that one task looks at.
const CHUNK: usize = 2048;

/// How far a mesh is refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The cosine of the largest angle between the normals at the ends of an edge that counts as flat. Above −1, at
    /// most 1.
    pub flatness: f32,
    /// How near vertices come to the surface, in world units, finite and over 0. Edges of at most twice that length
    /// are not split.
    pub epsilon: f32,
    /// The longest step towards the surface at a time, in world units, finite and over 0; half of what a vertex may move
    /// (half of its edge) if it is none, or longer. Smaller ones take more steps: for fields whose gradient says little.
    pub step: Option<f32>,
    /// Levels, each of which may halve an edge: 0 projects the start mesh alone, [`MOST_LEVELS`] is the most.
    pub depth: u32,
    /// The box (lowest, highest corner) at whose faces the mesh was cut off, if there is one: vertices and edges on a
    /// face stay on it. Without it an open border moves freely.
    pub border: Option<[Vec3; 2]>,
    /// The most triangles of the result.
    pub most_triangles: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            flatness: 0.95,
            epsilon: 1e-4,
            step: None,
            depth: 5,
            border: None,
            most_triangles: u64::from(u32::MAX) / 3,
        }
    }
}

impl Settings {
    /// The same for a mesh that was extracted on `grid`: its border stays on the grid's hull. Nothing is known of the
    /// hull where the grid's axes are not the world's.
    #[must_use]
    pub fn on(self, grid: &Grid) -> Self {
        let steps = Vec3::new(grid.step().x_axis.x, grid.step().y_axis.y, grid.step().z_axis.z);
        if grid.step() != Mat3::from_diagonal(steps) {
            return Self { border: None, ..self };
        }
        let [a, b] = [grid.origin(), grid.position(grid.cells().as_vec3())];
        Self { border: Some([a.min(b), a.max(b)]), ..self }
    }

    /// How near a face of the border a point counts as on it; 0 where there is none.
    fn near(&self) -> Vec3 {
        self.border.map_or(Vec3::ZERO, |[low, high]| (high - low) * 1e-5)
    }

    /// What half an edge is multiplied by for the distance from a tangent plane up to which it is flat.
    fn least(&self) -> f32 {
        ((1.0 - self.flatness) * 0.5).sqrt()
    }

    /// 0 for each axis across which both points lie on the same face of the border, else 1.
    fn free(&self, p: Vec3, q: Vec3) -> Vec3 {
        let Some([low, high]) = self.border else { return Vec3::ONE };
        let near = self.near();
        let on = |k: usize, face: f32| (p[k] - face).abs() <= near[k] && (q[k] - face).abs() <= near[k];
        let free = |k: usize| if on(k, low[k]) || on(k, high[k]) { 0.0 } else { 1.0 };
        Vec3::new(free(0), free(1), free(2))
    }

    /// Whether a point lies in the box of the border.
    fn holds(&self, p: Vec3) -> bool {
        let near = self.near();
        self.border.is_none_or(|[low, high]| p.cmpge(low - near).all() && p.cmple(high + near).all())
    }

    /// Whether the numbers make sense.
    ///
    /// # Errors
    /// [`RefineError::Flatness`], [`RefineError::Epsilon`], [`RefineError::Step`], [`RefineError::Depth`], [`RefineError::Border`].
    pub fn check(&self) -> Result<(), RefineError> {
        if !(self.flatness > -1.0 && self.flatness <= 1.0) {
            return Err(RefineError::Flatness(self.flatness));
        }
        if !(self.epsilon > 0.0 && self.epsilon.is_finite()) {
            return Err(RefineError::Epsilon(self.epsilon));
        }
        if let Some(step) = self.step.filter(|step| !(*step > 0.0 && step.is_finite())) {
            return Err(RefineError::Step(step));
        }
        if self.depth > MOST_LEVELS {
            return Err(RefineError::Depth(self.depth));
        }
        match self.border {
            Some([low, high]) if !(low.is_finite() && high.is_finite() && low.cmplt(high).all()) => {
                Err(RefineError::Border)
            }
            _ => Ok(()),
        }
    }

    /// [`Settings::check`], and whether there is such a surface.
    fn check_for(&self, surface: &Surface<'_>) -> Result<(), RefineError> {
        if !surface.iso().is_finite() {
            return Err(RefineError::Iso(surface.iso()));
        }
        self.check()
    }
}

/// The mesh after a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Level {
    /// Its vertices.
    pub vertices: u64,
    /// Its triangles.
    pub triangles: u64,
    /// Edges that were split because they were not flat.
    pub bent: u64,
    /// Edges that were split for the shape of their triangles.
    pub for_shape: u64,
}

/// What refining did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RefineReport {
    /// The start, and each level that split an edge.
    pub levels: Vec<Level>,
    /// Vertices that were put on the surface.
    pub projected: u64,
    /// Vertices for which no surface was found near: they stayed where they were, or at the middle of their edge.
    pub not_converged: u64,
    /// Vertices that were taken back because a triangle would have been flipped, or a far sheet reached.
    pub taken_back: u64,
    /// Vertices at which the gradient is zero or not finite.
    pub singular: u64,
    /// Triangles of the start mesh that name a vertex twice, which were left out.
    pub improper: u64,
    /// How long it took.
    pub seconds: f64,
}

/// Refines `mesh`, of any extraction method, on the `surface` that it was made of. `progress` hears how much of the
/// work is done, from 0 to 1.
///
/// Each vertex that was projected ([`crate::field::project`]) lies within `epsilon` of the surface; the report counts
/// those that were not. A closed mesh stays closed, and of the same topology. Triangles that name a vertex twice are
/// left out. The result is the same for any number of threads.
///
/// # Errors
/// [`RefineError`]: bad settings, a mesh with bad indices or vertices that are not finite, a result beyond the limit.
pub fn refine(
    surface: &Surface<'_>,
    mesh: &Mesh,
    settings: &Settings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, RefineReport), RefineError> {
    let since = Instant::now();
    settings.check_for(surface)?;
    let mut mesh = proper(mesh, settings)?;
    let mut report = RefineReport { improper: mesh.1, ..RefineReport::default() };
    let mesh = &mut mesh.0;
    let (mut tally, mut placed) = start(surface, mesh, settings)?;
    let level = |mesh: &Mesh, [bent, for_shape]: [u64; 2]| Level {
        vertices: mesh.vertices.len() as u64,
        triangles: mesh.triangles.len() as u64,
        bent,
        for_shape,
    };
    report.levels.push(level(mesh, [0; 2]));
    for number in 1..=settings.depth {
        // Levels grow; that each takes twice as long as the one before is a guess.
        progress(f64::exp2(f64::from(number) - f64::from(settings.depth) - 1.0));
        let Some((splits, of_level)) = refine_once(surface, mesh, &mut placed, settings, number)? else {
            break;
        };
        tally += of_level;
        report.levels.push(level(mesh, splits));
    }
    progress(1.0);
    let Tally { projected, not_converged, singular, taken_back } = tally;
    report = RefineReport { projected, not_converged, singular, taken_back, ..report };
    report.seconds = since.elapsed().as_secs_f64();
    Ok((std::mem::take(mesh), report))
}

/// The mesh without the triangles that name a vertex twice, and how many those are.
fn proper(mesh: &Mesh, settings: &Settings) -> Result<(Mesh, u64), RefineError> {
    let vertices = mesh.vertices.len();
    if vertices as u64 >= u64::from(u32::MAX) || mesh.triangles.len() as u64 > settings.most_triangles {
        return Err(settings.too_large(0, vertices as u64, mesh.triangles.len() as u64));
    }
    if let Some(vertex) = mesh.vertices.iter().position(|v| !v.at().is_finite()) {
        return Err(RefineError::NotFinite { vertex });
    }
    let bad = |&t: &usize| mesh.triangles[t].iter().any(|&i| i as usize >= vertices);
    if let Some(triangle) = (0..mesh.triangles.len()).find(bad) {
        return Err(RefineError::BadIndex { triangle, vertices });
    }
    let is_proper = |&&[a, b, c]: &&[u32; 3]| a != b && b != c && c != a;
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().filter(is_proper).copied().collect();
    let improper = (mesh.triangles.len() - triangles.len()) as u64;
    Ok((Mesh { vertices: mesh.vertices.clone(), triangles }, improper))
}

impl Settings {
    fn too_large(&self, level: u32, vertices: u64, triangles: u64) -> RefineError {
        RefineError::TooLarge {
            level,
            vertices,
            triangles,
            limit: self.most_triangles.min(u64::from(u32::MAX) / 3),
        }
    }
}

/// Puts the vertices of the start mesh on the surface; which of them lie on it.
fn start(surface: &Surface<'_>, mesh: &mut Mesh, settings: &Settings) -> Result<(Tally, Vec<bool>), NoForm> {
    let mut longest = vec![0.0f32; mesh.vertices.len()];
    let mut sums = Vec::new();
    for triangle in &mesh.triangles {
        let at = triangle.map(|i| mesh.vertices[i as usize].at());
        for k in 0..3 {
            let edge = length(at[(k + 1) % 3] - at[k]);
            for end in [triangle[k], triangle[(k + 1) % 3]] {
                let most = &mut longest[end as usize];
                *most = most.max(edge);
            }
        }
    }
    // Files may have no normals: those of the triangles around stand in.
    if mesh.vertices.iter().any(|v| !has_direction(v.normal.into())) {
        sums.resize(mesh.vertices.len(), Vec3::ZERO);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize].at());
            let area = (b - a).cross(c - a);
            triangle.iter().for_each(|&i| sums[i as usize] += area);
        }
    }
    for (i, vertex) in mesh.vertices.iter_mut().enumerate() {
        let own = Vec3::from(vertex.normal);
        let normal = if has_direction(own) { own } else { sums[i] };
        vertex.normal = if has_direction(normal) { unit(normal).into() } else { [0.0; 3] };
    }
    let start = mesh.vertices.clone();
    let tasks: Vec<Task> = start.iter().zip(&longest).map(|(v, l)| Task::of_start(settings, v, *l)).collect();
    let mut placed = vec![false; start.len()];
    let mut tally = place(surface, settings, &tasks, &mut mesh.vertices, &mut placed)?;
    let taken_back = take_back(&mut mesh.vertices, &mut placed, 0, &tasks, |vertices, moved, bad| {
        mesh.triangles.par_iter().for_each(|&triangle| {
            if !triangle.iter().any(|&i| moved[i as usize]) {
                return;
            }
            let before = area(&start, triangle);
            if before != Vec3::ZERO && !faces_outwards(vertices, triangle, before) {
                triangle.iter().for_each(|&i| bad[i as usize].store(true, Ordering::Relaxed));
            }
        });
    });
    tally.taken_back += taken_back;
    tally.projected -= taken_back;
    Ok((tally, placed))
}

/// Takes vertices back to their fallbacks, as long as `find` names such that are placed: of `vertices` from `first` on,
/// by their numbers from there. How many they were.
fn take_back(
    vertices: &mut [Vertex],
    placed: &mut [bool],
    first: usize,
    tasks: &[Task],
    find: impl Fn(&[Vertex], &[bool], &[AtomicBool]),
) -> u64 {
    let mut all = 0;
    // Only triangles of which a vertex has moved are worth a look.
    let mut moved = vec![true; placed.len()];
    loop {
        let bad: Vec<AtomicBool> = placed.iter().map(|_| false.into()).collect();
        find(vertices, &moved, &bad);
        let mut count = 0;
        for (i, bad) in bad.into_iter().enumerate() {
            moved[i] = bad.into_inner() && placed[i];
            if moved[i] {
                placed[i] = false;
                vertices[first + i] = tasks[i].fallback;
                count += 1;
            }
        }
        all += count;
        if count == 0 {
            return all;
        }
    }
}

/// One level, with what lies on the surface: the edges that were split because they were not flat and for shape, or nothing if all are flat.
fn refine_once(
    surface: &Surface<'_>,
    mesh: &mut Mesh,
    on_surface: &mut Vec<bool>,
    settings: &Settings,
    number: u32,
) -> Result<Option<([u64; 2], Tally)>, RefineError> {
    let edges = Edges::new(mesh.vertices.len(), &mesh.triangles);
    let at = |i: u32| &mesh.vertices[i as usize];
    let lengths: Vec<f32> = edges.ends.par_iter().map(|&[a, b]| length(at(b).at() - at(a).at())).collect();
    // Where no surface was found splitting finds none either, but goes on.
    let is_near = |a: u32, b: u32| on_surface[a as usize] && on_surface[b as usize];
    let bent = |(&[a, b], &length): (&[u32; 2], &f32)| {
        is_near(a, b) && length > 2.0 * settings.epsilon && !is_flat(at(a), at(b), length, settings)
    };
    let mut marks: Vec<bool> = edges.ends.par_iter().zip(&lengths).map(bent).collect();
    let bent = marks.iter().filter(|&&m| m).count();
    if bent == 0 {
        return Ok(None);
    }
    close(&edges, &lengths, &mut marks);

    let first = mesh.vertices.len();
    let mut middles = vec![NONE; marks.len()];
    let mut split = Vec::with_capacity(2 * bent);
    for (edge, _) in marks.iter().enumerate().filter(|(_, m)| **m) {
        middles[edge] = (first + split.len()) as u32;
        split.push(edges.ends[edge]);
    }
    let middles_of = |of: &[u32; 3]| of.map(|edge| middles[edge as usize]);
    let counts = edges.of.par_iter().map(|of| u64::from(part_count(middles_of(of))));
    let (vertices, triangles) = ((first + split.len()) as u64, counts.sum());
    let most = settings.most_triangles.min(u64::from(u32::MAX) / 3);
    if vertices >= u64::from(u32::MAX) || triangles > most {
        return Err(settings.too_large(number, vertices, triangles));
    }

    let tasks: Vec<Task> = split.par_iter().map(|&[a, b]| Task::of_middle(settings, at(a), at(b))).collect();
    let mut placed = vec![false; split.len()];
    mesh.vertices.resize(first + split.len(), Vertex::default());
    let mut tally = place(surface, settings, &tasks, &mut mesh.vertices[first..], &mut placed)?;
    let taken_back = take_back(&mut mesh.vertices, &mut placed, first, &tasks, |vertices, moved, bad| {
        mesh.triangles.par_iter().zip(&edges.of).with_min_len(CHUNK).for_each(|(&corners, of)| {
            let middles = middles_of(of);
            if !middles.iter().any(|&m| m != NONE && moved[m as usize - first]) {
                return;
            }
            let whole = area(vertices, corners);
            if whole == Vec3::ZERO {
                return;
            }
            if !cut(vertices, corners, middles).as_slice().iter().all(|&t| faces_outwards(vertices, t, whole))
            {
                // One at a time, the one that went farthest: what the others have gained may stay.
                let far = |m: u32| {
                    let (vertex, task) = (&vertices[m as usize], &tasks[m as usize - first]);
                    length(vertex.at() - task.fallback.at())
                };
                let moved = middles.into_iter().filter(|&m| m != NONE).map(|m| (far(m), m));
                let farthest = moved.fold((0.0, NONE), |a, b| if b.0 > a.0 { b } else { a });
                if farthest.1 != NONE {
                    bad[farthest.1 as usize - first].store(true, Ordering::Relaxed);
                }
            }
        });
    });
    tally.taken_back += taken_back;
    tally.projected -= taken_back;
    on_surface.append(&mut placed);

    let chunks = mesh.triangles.par_chunks(CHUNK).zip(edges.of.par_chunks(CHUNK));
    let parts: Vec<Vec<[u32; 3]>> = chunks
        .map(|(triangles, of)| {
            let mut parts = Vec::with_capacity(2 * triangles.len());
            for (&corners, of) in triangles.iter().zip(of) {
                parts.extend_from_slice(cut(&mesh.vertices, corners, middles_of(of)).as_slice());
            }
            parts
        })
        .collect();
    mesh.triangles = parts.concat();
    Ok(Some(([bent as u64, (split.len() - bent) as u64], tally)))
}
