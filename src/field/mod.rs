//! Density fields: what the sample stage evaluates.

/// Which side of the iso value is inside the solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// Distance-like: inside is below the iso value (spheres, tori, CSG distances).
    Below,
    /// Density-like: inside is above the iso value (blobs, CT volumes).
    Above,
}
