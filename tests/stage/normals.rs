//! normals: those of emit, and of the vertices that it marked.

use crate::inputs::check;

/// Goes red when `mark` (`shaders/shared/unit.wgsl`) takes the edge's other end for the inner one, and when `parts`
/// (`shaders/normals.wgsl`) rounds down.
#[test]
fn as_the_twin() {
    check("normals", &["normals"]);
}
