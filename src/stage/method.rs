//! The methods that the stages have.

/// How the cells of the uniform grid become triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Method {
    /// Marching cubes (Lorensen & Cline 1987) by a table whose faces agree: closed and manifold.
    #[default]
    MarchingCubes,
    /// Its topologically correct form: in each cell the mesh is what the trilinear interpolant of the samples is
    /// (Chernyaev 1995, with vertices within the cell where one is needed).
    Mc33,
    /// Marching tetrahedra on the Coxeter–Freudenthal (Kuhn) split of a cell in six: vertices on grid edges, face diagonals
    /// and body diagonals; no case is ambiguous.
    Tetrahedra,
}

impl Method {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::MarchingCubes, Self::Mc33, Self::Tetrahedra];
}
