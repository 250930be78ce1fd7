//! The mesh checker: is this mesh closed, manifold, consistently wound; and where is it not?
//!
//! A triangle is *proper* when it names three different vertices that exist. Improper triangles are
//! counted (`bad_indices`, `degenerate_triangles`) and then take no part in edges, fans, components
//! and the Euler number: a triangle that repeats a vertex is what is left of a contracted edge, and
//! its two neighbours meet directly.

use glam::DVec3;
use rayon::prelude::*;

pub use super::report::{Defect, DefectKind, PLACES, Report};
use super::{Mesh, Vertex};

/// Triangles or vertices one parallel piece of work holds. Fixed, so that sums do not depend on the
/// number of threads.
const CHUNK: usize = 1 << 14;

impl Mesh {
    /// Counts what makes the mesh open, non-manifold, or badly wound, and says where; see [`Report`].
    ///
    /// Takes any mesh, however broken: bad indices and NaN positions are counted.
    pub fn check(&self) -> Report {
        check(self)
    }
}

/// Whether a triangle repeats a vertex or has no area, equal and collinear positions alike.
///
/// The cross product is taken in f64, where it is exact for corners of like magnitude. A triangle
/// with a bad index or a NaN corner has no known area, and is not degenerate by this.
pub(super) fn is_degenerate(vertices: &[Vertex], [a, b, c]: [u32; 3]) -> bool {
    if a == b || b == c || c == a {
        return true;
    }
    let at = |i: u32| vertices.get(i as usize).map(|v| v.at().as_dvec3());
    match (at(a), at(b), at(c)) {
        (Some(a), Some(b), Some(c)) => (b - a).cross(c - a) == DVec3::ZERO,
        _ => false,
    }
}

/// The first few places of each kind.
#[derive(Default)]
struct Places(Vec<Defect>);

impl Places {
    /// Whether a place of this kind is still wanted, `so_far` of them having been counted before it.
    fn note(&mut self, so_far: usize, defect: impl FnOnce() -> Defect) {
        if so_far < PLACES {
            self.0.push(defect());
        }
    }
}

fn place(mesh: &Mesh, kind: DefectKind, vertices: &[u32], triangles: &[usize]) -> Defect {
    let positions = vertices.iter().map_while(|&v| Some(mesh.vertices.get(v as usize)?.position)).collect();
    Defect { kind, vertices: vertices.to_vec(), triangles: triangles.to_vec(), positions }
}

/// See [`Mesh::check`].
pub fn check(mesh: &Mesh) -> Report {
    let bounds = mesh.bounds();
    let mut places = Vec::new();

    let mut non_finite_vertices = 0;
    for (i, vertex) in mesh.vertices.iter().enumerate() {
        if !vertex.at().is_finite() {
            if non_finite_vertices < PLACES {
                places.push(place(mesh, DefectKind::NonFiniteVertex, &[i as u32], &[]));
            }
            non_finite_vertices += 1;
        }
    }

    // The box centre as origin: far from the world's origin the volume would drown in cancellation.
    let centre = bounds.map_or(DVec3::ZERO, |(lo, hi)| (lo.as_dvec3() + hi.as_dvec3()) / 2.0);
    let faces: Vec<Faces> = mesh
        .triangles
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, triangles)| Faces::of(mesh, chunk * CHUNK, triangles, centre))
        .collect();
    let rings = Rings::of(mesh);
    let around: Vec<Around> = (0..mesh.vertices.len().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| Around::of(mesh, &rings, chunk * CHUNK))
        .collect();

    let (bad_indices, degenerate_triangles) =
        faces.iter().fold((0, 0), |(bad, flat), f| (bad + f.bad, flat + f.degenerate));
    let (area, volume) = faces.iter().fold((0.0, 0.0), |(a, v), f| (a + f.area, v + f.volume));
    let sum = |count: fn(&Around) -> usize| around.iter().map(count).sum::<usize>();
    let (used, edges) = (sum(|a| a.used), sum(|a| a.edges));

    places.extend(faces.into_iter().flat_map(|f| f.places.0));
    let mut report = Report {
        vertices: mesh.vertices.len(),
        triangles: mesh.triangles.len(),
        boundary_edges: sum(|a| a.boundary),
        non_manifold_edges: sum(|a| a.crowded),
        non_manifold_vertices: sum(|a| a.pinched),
        misoriented_edges: sum(|a| a.misoriented),
        degenerate_triangles,
        duplicate_triangles: sum(|a| a.duplicates),
        components: used - rings.joins,
        euler: used as i64 - edges as i64 + rings.proper as i64,
        genus: None,
        area,
        volume: volume / 6.0,
        bounds: bounds.map(|(lo, hi)| [lo.to_array(), hi.to_array()]),
        unused_vertices: unused(mesh),
        bad_indices,
        non_finite_vertices,
        boundary_loops: loops(mesh.vertices.len(), around.iter().flat_map(|a| &a.border)),
        defects: Vec::new(),
    };
    if report.is_closed_manifold() {
        // Σ (2 − χ) / 2 over the components.
        report.genus = Some(report.components as i64 - report.euler / 2);
    }
    places.extend(around.into_iter().flat_map(|a| a.places.0));
    places.sort_by_key(|defect| defect.kind);
    let mut taken = (DefectKind::BadIndex, 0);
    places.retain(|defect| {
        taken = (defect.kind, if taken.0 == defect.kind { taken.1 + 1 } else { 1 });
        taken.1 <= PLACES
    });
    report.defects = places;
    report
}

/// The vertices of duplicate triangles, of edges that are not manifold or not wound alike, and those whose triangles are not
/// one fan or cycle: a vertex may be there several times.
pub(super) fn faulty_vertices(mesh: &Mesh) -> Vec<u32> {
    let rings = Rings::of(mesh);
    let chunks = (0..mesh.vertices.len().div_ceil(CHUNK)).into_par_iter();
    chunks.flat_map_iter(|chunk| Around::of(mesh, &rings, chunk * CHUNK).faulty).collect()
}

/// The connected pieces of a border.
fn loops<'a>(vertices: usize, border: impl Iterator<Item = &'a [u32; 2]>) -> usize {
    let mut parent: Vec<u32> = Vec::new();
    let mut is_on = Vec::new();
    let mut pieces = 0;
    for &[a, b] in border {
        if parent.is_empty() {
            parent = (0..vertices as u32).collect();
            is_on = vec![false; vertices];
        }
        for v in [a, b] {
            pieces += usize::from(!std::mem::replace(&mut is_on[v as usize], true));
        }
        pieces -= usize::from(join(&mut parent, a, b));
    }
    pieces
}

/// Vertices that no triangle names.
pub(super) fn unused(mesh: &Mesh) -> usize {
    let mut named = vec![false; mesh.vertices.len()];
    for &v in mesh.triangles.iter().flatten() {
        if let Some(named) = named.get_mut(v as usize) {
            *named = true;
        }
    }
    named.iter().filter(|&&named| !named).count()
}

fn is_proper(mesh: &Mesh, [a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a && (a.max(b).max(c) as usize) < mesh.vertices.len()
}

/// What a run of triangles says by itself.
#[derive(Default)]
struct Faces {
    bad: usize,
    degenerate: usize,
    area: f64,
    volume: f64,
    places: Places,
}

impl Faces {
    fn of(mesh: &Mesh, first: usize, triangles: &[[u32; 3]], centre: DVec3) -> Self {
        let mut sums = Faces::default();
        for (i, &triangle) in triangles.iter().enumerate() {
            if is_degenerate(&mesh.vertices, triangle) {
                let kind = DefectKind::DegenerateTriangle;
                sums.places.note(sums.degenerate, || place(mesh, kind, &triangle, &[first + i]));
                sums.degenerate += 1;
            }
            let at = |v: u32| mesh.vertices.get(v as usize).map(|v| v.at().as_dvec3() - centre);
            let [Some(a), Some(b), Some(c)] = triangle.map(at) else {
                let lost: Vec<u32> =
                    triangle.into_iter().filter(|&v| v as usize >= mesh.vertices.len()).collect();
                let kind = DefectKind::BadIndex;
                sums.places.note(sums.bad, || place(mesh, kind, &lost, &[first + i]));
                sums.bad += 1;
                continue;
            };
            let normal = (b - a).cross(c - a);
            if normal.is_finite() {
                sums.area += normal.length() / 2.0;
                sums.volume += a.dot(b.cross(c));
            }
        }
        sums
    }
}

/// The proper triangles around each vertex: those of vertex v are `triangles[start[v]..start[v + 1]]`.
struct Rings {
    start: Vec<usize>,
    triangles: Vec<u32>,
    proper: usize,
    /// Vertices joined to a component that already had a vertex: used vertices − components.
    joins: usize,
}

impl Rings {
    fn of(mesh: &Mesh) -> Self {
        let proper = || mesh.triangles.iter().enumerate().filter(|&(_, &triangle)| is_proper(mesh, triangle));
        let mut start = vec![0; mesh.vertices.len() + 1];
        let mut parent: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        let (mut count, mut joins) = (0, 0);
        for (_, &[a, b, c]) in proper() {
            count += 1;
            for v in [a, b, c] {
                start[v as usize] += 1;
            }
            joins += usize::from(join(&mut parent, a, b)) + usize::from(join(&mut parent, b, c));
        }
        // Counts to ends; filling then walks each end back to its start.
        let mut end = 0;
        for slot in &mut start {
            end += *slot;
            *slot = end;
        }
        let mut triangles = vec![0; end];
        for (i, &triangle) in mesh.triangles.iter().enumerate().rev() {
            if is_proper(mesh, triangle) {
                for v in triangle {
                    start[v as usize] -= 1;
                    triangles[start[v as usize]] = i as u32;
                }
            }
        }
        Rings { start, triangles, proper: count, joins }
    }

    fn around(&self, v: usize) -> &[u32] {
        &self.triangles[self.start[v]..self.start[v + 1]]
    }
}

/// The representative of `v`: the lowest number joined to it.
pub(crate) fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

/// Joins the sets of `a` and `b`; whether they were two.
pub(crate) fn join(parent: &mut [u32], a: u32, b: u32) -> bool {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
    a != b
}

/// What the surroundings of a run of vertices say. An edge is counted at its lower vertex, a triangle
/// at its lowest.
#[derive(Default)]
struct Around {
    used: usize,
    edges: usize,
    boundary: usize,
    crowded: usize,
    misoriented: usize,
    duplicates: usize,
    pinched: usize,
    /// The ends of each boundary edge.
    border: Vec<[u32; 2]>,
    /// Vertices of whatever else is wrong.
    faulty: Vec<u32>,
    places: Places,
}

/// Working space for one vertex, kept from vertex to vertex.
#[derive(Default)]
struct Scratch {
    /// (other end, 2 × place in the ring + 1 where the triangle comes in along the edge).
    spokes: Vec<(u32, u32)>,
    fan: Vec<u32>,
    lowest: Vec<(u32, u32, u32)>,
}

impl Around {
    fn of(mesh: &Mesh, rings: &Rings, first: usize) -> Self {
        let mut counts = Around::default();
        let mut scratch = Scratch::default();
        for v in first..(first + CHUNK).min(mesh.vertices.len()) {
            if !rings.around(v).is_empty() {
                counts.used += 1;
                counts.look(mesh, v as u32, rings.around(v), &mut scratch);
            }
        }
        counts
    }

    fn look(&mut self, mesh: &Mesh, v: u32, ring: &[u32], Scratch { spokes, fan, lowest }: &mut Scratch) {
        spokes.clear();
        lowest.clear();
        for (i, &t) in (0u32..).zip(ring) {
            let [a, b, c] = mesh.triangles[t as usize];
            let (next, last) = if a == v {
                (b, c)
            } else if b == v {
                (c, a)
            } else {
                (a, b)
            };
            spokes.push((next, 2 * i));
            spokes.push((last, 2 * i + 1));
            if v < next && v < last {
                lowest.push((next.min(last), next.max(last), t));
            }
        }
        spokes.sort_unstable();
        fan.clear();
        fan.extend(0..ring.len() as u32);
        let (mut fans, mut crowded) = (ring.len(), false);
        for edge in spokes.chunk_by(|a, b| a.0 == b.0) {
            crowded |= edge.len() > 2;
            for pair in edge.windows(2) {
                fans -= usize::from(join(fan, pair[0].1 / 2, pair[1].1 / 2));
            }
            if v < edge[0].0 {
                self.edge(mesh, v, edge, ring);
            }
        }
        if fans > 1 || crowded {
            let some: Vec<usize> = ring.iter().take(8).map(|&t| t as usize).collect();
            let kind = DefectKind::NonManifoldVertex;
            self.faulty.push(v);
            self.places.note(self.pinched, || place(mesh, kind, &[v], &some));
            self.pinched += 1;
        }
        lowest.sort_unstable();
        for pair in lowest.windows(2) {
            if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
                let (again, kind) = (pair[1].2 as usize, DefectKind::DuplicateTriangle);
                let doubled = mesh.triangles[again];
                self.faulty.extend(doubled);
                self.places
                    .note(self.duplicates, || place(mesh, kind, &doubled, &[pair[0].2 as usize, again]));
                self.duplicates += 1;
            }
        }
    }

    fn edge(&mut self, mesh: &Mesh, v: u32, edge: &[(u32, u32)], ring: &[u32]) {
        self.edges += 1;
        if edge.len() == 1 {
            self.border.push([v, edge[0].0]);
        }
        let (count, kind) = match edge {
            [_] => (&mut self.boundary, DefectKind::BoundaryEdge),
            [a, b] if a.1 % 2 == b.1 % 2 => (&mut self.misoriented, DefectKind::MisorientedEdge),
            [_, _] => return,
            _ => (&mut self.crowded, DefectKind::NonManifoldEdge),
        };
        if edge.len() > 1 {
            self.faulty.extend([v, edge[0].0]);
        }
        let at = || edge.iter().take(8).map(|&(_, i)| ring[i as usize / 2] as usize).collect::<Vec<_>>();
        self.places.note(*count, || place(mesh, kind, &[v, edge[0].0], &at()));
        *count += 1;
    }
}
