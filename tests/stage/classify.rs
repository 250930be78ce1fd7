//! classify: masks, prefix sums and counts.

use crate::inputs::check;

/// Goes red when `crossed_edges` (`shaders/shared/row.wgsl`) takes the +y edges from the +z row, when the
/// inside test (`shaders/shared/inside.wgsl`) calls a tie inside, and when `before` in
/// `shaders/classify.wgsl` sums from another plane's row.
#[test]
fn as_the_twin() {
    check("classify", &["edge masks and prefixes", "counts"]);
}
