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

/// Where on its edge a vertex lies. Vertices within cells, which [`Method::Mc33`] has, lie amid those around them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Placement {
    /// Where the linear interpolant of the samples at the edge's ends is iso.
    #[default]
    Linear,
    /// In the middle: fast, and coarse.
    Midpoint,
    /// Where the field crosses iso, within `epsilon` world units: a few secant and bisection steps. Volumes have
    /// nothing finer than [`Placement::Linear`]. A vertex within a cell goes from amid those around it, as [`Placement::Linear`]
    /// has them, along the field's gradient to the nearest crossing in the cell, or where none is found there, to that
    /// between it and the nearest corner of the other side.
    Snapped {
        /// How near, over 0.
        epsilon: f32,
    },
}

impl Placement {
    /// A number for each kind, from 0 on.
    pub(crate) fn kind(self) -> usize {
        match self {
            Self::Linear => 0,
            Self::Midpoint => 1,
            Self::Snapped { .. } => 2,
        }
    }

    /// How near a snapped vertex lies; 0 where none is snapped.
    pub(crate) fn epsilon(self) -> f32 {
        match self {
            Self::Snapped { epsilon } => epsilon,
            Self::Linear | Self::Midpoint => 0.0,
        }
    }
}
