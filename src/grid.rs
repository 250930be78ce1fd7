//! The regular grid of sample points, and its cut into bricks.
//!
//! A grid has `cells` cubes along x, y, z and one more sample point than cells along each axis.
//! Points are numbered with x fastest: `index = x + points.x * (y + points.y * z)`.
//!
//! A **brick** owns 8×8×8 *points* (and, through them, each point's +x, +y and +z edge and the
//! cell whose lowest corner the point is). Because the last points of the grid own edges as well,
//! the number of bricks along an axis is `cells / 8 + 1`: a brick may own points but no cells.
//! Bricks are numbered like points, x fastest.

use glam::{Mat3, UVec3, Vec3};

/// Points along each edge of a brick.
pub const BRICK: u32 = 8;
/// Samples that a brick reads, 9³.
pub const SAMPLES_PER_BRICK: usize = 729;
/// The most cells an axis can have: indices along an axis stay exact in `f32`.
pub const MAX_CELLS: u32 = 1 << 20;

/// Why a grid was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// An axis with no cell, or with more than [`MAX_CELLS`].
    #[error("the grid has {cells} cells along {axis}; it takes 1 to {MAX_CELLS}")]
    Cells {
        /// `x`, `y` or `z`.
        axis: char,
        /// The number asked for.
        cells: u64,
    },
    /// Origin, corner or spacing is NaN or infinite.
    #[error("the grid's {what} must be finite: give ordinary numbers")]
    NotFinite {
        /// Which quantity.
        what: &'static str,
    },
    /// So far from the origin that neighbouring points are one and the same in `f32`.
    #[error(
        "the grid is so far from the origin that a step along {axis} changes no coordinate: move it nearer, or take longer steps"
    )]
    TooFar {
        /// `x`, `y` or `z`.
        axis: char,
    },
    /// The steps span no volume.
    #[error("the grid's steps span no volume: each side must be longer than zero")]
    Flat,
}

/// A regular grid of sample points in world space.
///
/// Point `(x, y, z)` lies at `origin + step * (x, y, z)`; column `a` of `step` is the way from a
/// point to the next along grid axis `a`, in world units. A grid may be rotated, sheared or
/// mirrored (negative determinant); triangles are wound for that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    cells: UVec3,
    /// Of point (margin, margin, margin).
    origin: Vec3,
    step: Mat3,
    /// Whole, as a number to subtract from coordinates.
    margin: f32,
}

impl Grid {
    /// A grid of `cells` cells from `origin` with the columns of `step` as steps.
    ///
    /// # Errors
    /// [`GridError`] if an axis has no cell or more than [`MAX_CELLS`], if a number is not
    /// finite, if the steps span no volume, or are lost so far from the origin.
    pub fn new(cells: [u32; 3], origin: Vec3, step: Mat3) -> Result<Self, GridError> {
        for (axis, &n) in ['x', 'y', 'z'].iter().zip(&cells) {
            if n == 0 || n > MAX_CELLS {
                return Err(GridError::Cells { axis: *axis, cells: u64::from(n) });
            }
        }
        if !origin.is_finite() {
            return Err(GridError::NotFinite { what: "origin" });
        }
        if !step.is_finite() {
            return Err(GridError::NotFinite { what: "spacing" });
        }
        let cells = UVec3::from(cells);
        let far = origin + step * cells.as_vec3();
        if !far.is_finite() {
            return Err(GridError::NotFinite { what: "far corner" });
        }
        let inverse = step.as_dmat3().inverse();
        let determinant = step.as_dmat3().determinant();
        if determinant == 0.0 || !determinant.is_finite() || !inverse.as_mat3().is_finite() {
            return Err(GridError::Flat);
        }
        for (axis, way) in ['x', 'y', 'z'].into_iter().zip([step.x_axis, step.y_axis, step.z_axis]) {
            if origin + way == origin || far - way == far {
                return Err(GridError::TooFar { axis });
            }
        }
        Ok(Self { cells, origin, step, margin: 0.0 })
    }

    /// A grid of `cells` cells that fills the axis-aligned box from `lo` to `hi`.
    ///
    /// # Errors
    /// As [`Grid::new`].
    pub fn from_bounds(cells: [u32; 3], lo: Vec3, hi: Vec3) -> Result<Self, GridError> {
        if !lo.is_finite() || !hi.is_finite() {
            return Err(GridError::NotFinite { what: "bounds" });
        }
        if !(hi.x > lo.x && hi.y > lo.y && hi.z > lo.z) {
            return Err(GridError::Flat);
        }
        let spacing = (hi - lo) / UVec3::from(cells).max(UVec3::ONE).as_vec3();
        Self::new(cells, lo, Mat3::from_diagonal(spacing))
    }

    /// Cells along x, y, z.
    pub fn cells(&self) -> UVec3 {
        self.cells
    }

    /// Sample points along x, y, z.
    pub fn points(&self) -> UVec3 {
        self.cells + UVec3::ONE
    }

    /// Number of sample points.
    pub fn point_count(&self) -> u64 {
        let p = self.points();
        u64::from(p.x) * u64::from(p.y) * u64::from(p.z)
    }

    /// World position of point (0, 0, 0).
    pub fn origin(&self) -> Vec3 {
        if self.margin == 0.0 { self.origin } else { self.position(Vec3::ZERO) }
    }

    /// The grid with a layer of points around it, two cells more along each axis. Its other points have the positions that
    /// they have in this one, to the bit.
    ///
    /// # Errors
    /// As [`Grid::new`].
    pub(crate) fn wider(&self) -> Result<Self, GridError> {
        let wider = Self { margin: self.margin + 1.0, ..*self };
        Self::new((self.cells + 2).to_array(), wider.origin(), self.step)?;
        Ok(Self { cells: self.cells + 2, ..wider })
    }

    /// Layers of points that [`Grid::wider`] has put around the grid.
    pub(crate) fn margin(&self) -> f32 {
        self.margin
    }

    /// World position of the first point within them.
    pub(crate) fn domain_origin(&self) -> Vec3 {
        self.origin
    }

    /// World steps along the grid axes, one a column.
    pub fn step(&self) -> Mat3 {
        self.step
    }

    /// Bricks along x, y, z.
    pub fn bricks(&self) -> UVec3 {
        self.cells / BRICK + UVec3::ONE
    }

    /// Number of bricks.
    pub fn brick_count(&self) -> u64 {
        let b = self.bricks();
        u64::from(b.x) * u64::from(b.y) * u64::from(b.z)
    }

    /// World position at grid coordinates `q` (whole numbers are points).
    ///
    /// The order of operations is that of `grid_position` in `shaders/shared/grid.wgsl`, so both
    /// give the same bits of points.
    #[inline(always)]
    pub fn position(&self, q: Vec3) -> Vec3 {
        let p = q - self.margin;
        self.origin + ((self.step.x_axis * p.x + self.step.y_axis * p.y) + self.step.z_axis * p.z)
    }

    /// Whether the steps are left-handed, so that triangles must be wound the other way round.
    pub fn is_mirrored(&self) -> bool {
        self.step.as_dmat3().determinant() < 0.0
    }

    /// What turns a gradient in grid coordinates into one in world coordinates: the inverse
    /// transpose of `step`.
    pub fn gradient_to_world(&self) -> Mat3 {
        self.step.as_dmat3().inverse().transpose().as_mat3()
    }

    /// The shortest step, in world units. In `f64`, where the squares of no `f32` over- or underflow.
    pub fn shortest_step(&self) -> f64 {
        let s = self.step.as_dmat3();
        s.x_axis.length().min(s.y_axis.length()).min(s.z_axis.length())
    }

    /// How near to the border of the domain, in grid steps, a vertex lies on it: more where rounding of its coordinates does.
    pub(crate) fn on_border(&self) -> f32 {
        let far = self.position(self.cells().as_vec3()).abs().max(self.origin().abs()).max_element();
        let rounding = 4.0 * f64::from(far) * f64::from(f32::EPSILON) / self.shortest_step();
        rounding.clamp(1e-3, 0.25) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_cover_every_point() {
        for cells in [1, 7, 8, 9, 15, 16, 17] {
            let grid = Grid::from_bounds([cells; 3], Vec3::ZERO, Vec3::ONE).unwrap();
            assert!(grid.bricks().x * BRICK >= grid.points().x);
            assert!((grid.bricks().x - 1) * BRICK < grid.points().x);
        }
    }

    #[test]
    fn bad_grids_are_refused() {
        let n = [4; 3];
        assert!(matches!(
            Grid::from_bounds([4, 0, 4], Vec3::ZERO, Vec3::ONE),
            Err(GridError::Cells { axis: 'y', .. })
        ));
        assert!(matches!(
            Grid::from_bounds([1 << 30; 3], Vec3::ZERO, Vec3::ONE),
            Err(GridError::Cells { .. })
        ));
        assert!(matches!(Grid::from_bounds(n, Vec3::NAN, Vec3::ONE), Err(GridError::NotFinite { .. })));
        assert!(matches!(Grid::from_bounds(n, Vec3::ZERO, Vec3::INFINITY), Err(GridError::NotFinite { .. })));
        assert_eq!(Grid::from_bounds(n, Vec3::ONE, Vec3::ONE), Err(GridError::Flat));
        assert_eq!(Grid::new(n, Vec3::ZERO, Mat3::ZERO), Err(GridError::Flat));
    }
}
