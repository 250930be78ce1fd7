//! What the checker reports, for people and for programs.

use std::fmt;

use serde::Serialize;

/// How many places a [`Report`] names for each kind of defect.
pub const PLACES: usize = 5;

/// What is wrong at a [`Defect`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DefectKind {
    /// A triangle names a vertex that does not exist.
    BadIndex,
    /// A vertex position is NaN or infinite.
    NonFiniteVertex,
    /// A triangle repeats a vertex or has no area.
    DegenerateTriangle,
    /// A triangle has the same three vertices as an earlier one.
    DuplicateTriangle,
    /// An edge has a triangle on one side only: the rim of a hole.
    BoundaryEdge,
    /// More than two triangles meet at an edge.
    NonManifoldEdge,
    /// The two triangles at an edge are wound in opposite senses.
    MisorientedEdge,
    /// The triangles around a vertex do not form one fan or one cycle.
    NonManifoldVertex,
}

impl DefectKind {
    fn words(self) -> &'static str {
        match self {
            DefectKind::BadIndex => "bad index",
            DefectKind::NonFiniteVertex => "non-finite vertex",
            DefectKind::DegenerateTriangle => "degenerate triangle",
            DefectKind::DuplicateTriangle => "duplicate triangle",
            DefectKind::BoundaryEdge => "boundary edge",
            DefectKind::NonManifoldEdge => "non-manifold edge",
            DefectKind::MisorientedEdge => "misoriented edge",
            DefectKind::NonManifoldVertex => "non-manifold vertex",
        }
    }
}

/// One place where the mesh is broken. Vertices and triangles are numbered from 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Defect {
    /// What is wrong.
    pub kind: DefectKind,
    /// The vertices concerned: one, the two ends of an edge, or the three of a triangle.
    pub vertices: Vec<u32>,
    /// The triangles concerned (the first few around a vertex).
    pub triangles: Vec<usize>,
    /// The positions of `vertices`; a vertex that does not exist has none, and the list ends early.
    pub positions: Vec<[f32; 3]>,
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |numbers: Vec<String>| numbers.join(", ");
        write!(f, "{}", self.kind.words())?;
        if !self.vertices.is_empty() {
            let word = if self.vertices.len() == 1 { "vertex" } else { "vertices" };
            write!(f, ": {word} {}", list(self.vertices.iter().map(u32::to_string).collect()))?;
        }
        if !self.positions.is_empty() {
            let at = |p: &[f32; 3]| format!("({} {} {})", p[0], p[1], p[2]);
            write!(f, " at {}", list(self.positions.iter().map(at).collect()))?;
        }
        if !self.triangles.is_empty() {
            let word = if self.triangles.len() == 1 { "triangle" } else { "triangles" };
            write!(f, ", {word} {}", list(self.triangles.iter().map(usize::to_string).collect()))?;
        }
        Ok(())
    }
}

/// What [`Mesh::check`](crate::mesh::Mesh::check) found. Serialises to one JSON object whose keys are the field names, in this order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Vertices, used or not.
    pub vertices: usize,
    /// Triangles, proper or not.
    pub triangles: usize,
    /// Edges with exactly one triangle.
    pub boundary_edges: usize,
    /// Edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// Vertices whose triangles do not form one fan or one cycle. The ends of a non-manifold edge
    /// are among them.
    pub non_manifold_vertices: usize,
    /// Edges whose exactly two triangles both run along it in the same direction.
    pub misoriented_edges: usize,
    /// Triangles that repeat a vertex, or whose area is zero.
    pub degenerate_triangles: usize,
    /// Triangles with the vertex set of an earlier triangle, whatever their winding.
    pub duplicate_triangles: usize,
    /// Pieces connected through shared vertices; vertices that no proper triangle uses are not pieces.
    pub components: usize,
    /// Euler number V − E + F over the proper triangles and their vertices.
    pub euler: i64,
    /// Handles, summed over the components; `None` where the mesh is empty, or not a closed,
    /// consistently wound manifold.
    pub genus: Option<i64>,
    /// Surface area.
    pub area: f64,
    /// Enclosed volume by the divergence theorem, positive where triangles are counter-clockwise seen
    /// from outside. Means something only for closed meshes.
    pub volume: f64,
    /// Low and high corner of the box around all finite vertices.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// Vertices that no triangle names.
    pub unused_vertices: usize,
    /// Triangles that name a vertex that does not exist.
    pub bad_indices: usize,
    /// Vertices with a NaN or infinite position.
    pub non_finite_vertices: usize,
    /// Connected pieces of the boundary edges: as many as there are holes, where no two of them touch.
    pub boundary_loops: usize,
    /// The first [`PLACES`] places of each kind of defect, kind by kind, in mesh order.
    pub defects: Vec<Defect>,
}

impl Report {
    /// Whether anything keeps the mesh from being a closed, consistently wound manifold without
    /// zero-area or doubled triangles. Unused vertices are no defect, nor is an empty mesh.
    pub fn has_defects(&self) -> bool {
        self.counts().iter().any(|&(_, count)| count > 0)
    }

    /// Whether every edge of a mesh with triangles has two triangles, wound consistently, and every
    /// vertex one cycle of triangles. Degenerate and duplicate triangles do not matter here.
    pub fn is_closed_manifold(&self) -> bool {
        self.components > 0
            && self.boundary_edges == 0
            && self.non_manifold_edges == 0
            && self.non_manifold_vertices == 0
            && self.misoriented_edges == 0
            && self.bad_indices == 0
    }

    fn counts(&self) -> [(&'static str, usize); 8] {
        [
            ("boundary edges", self.boundary_edges),
            ("non-manifold edges", self.non_manifold_edges),
            ("non-manifold vertices", self.non_manifold_vertices),
            ("misoriented edges", self.misoriented_edges),
            ("degenerate triangles", self.degenerate_triangles),
            ("duplicate triangles", self.duplicate_triangles),
            ("bad indices", self.bad_indices),
            ("non-finite vertices", self.non_finite_vertices),
        ]
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut row = |name: &str, value: String| writeln!(f, "{name:<22}  {value}");
        row("vertices", format!("{} ({} unused)", self.vertices, self.unused_vertices))?;
        row("triangles", self.triangles.to_string())?;
        for (name, count) in self.counts() {
            row(name, count.to_string())?;
        }
        row("boundary loops", self.boundary_loops.to_string())?;
        row("components", self.components.to_string())?;
        row("Euler number", self.euler.to_string())?;
        row("genus", self.genus.map_or("none (not a closed manifold)".into(), |g| g.to_string()))?;
        row("area", self.area.to_string())?;
        let open = if self.is_closed_manifold() { "" } else { " (not closed: means little)" };
        row("volume", format!("{}{open}", self.volume))?;
        let corner = |p: [f32; 3]| format!("({} {} {})", p[0], p[1], p[2]);
        row("bounds", self.bounds.map_or("none".into(), |[lo, hi]| corner(lo) + " to " + &corner(hi)))?;
        if !self.defects.is_empty() {
            writeln!(f, "first places of each kind:")?;
        }
        self.defects.iter().try_for_each(|defect| writeln!(f, "  {defect}"))
    }
}
