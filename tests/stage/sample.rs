//! sample: the values of the bricks' points.

use crate::inputs::check;

/// Goes red when `grid_position` (`shaders/shared/grid.wgsl`) adds in another order, when
/// `shaders/sample.wgsl` swaps y and z, and when points past the grid's end are not repeated.
#[test]
fn as_the_twin() {
    check("sample", &["values"]);
}
