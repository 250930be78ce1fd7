//! emit: vertices, normals and indices.

use crate::inputs::{cases, check, holds};

/// Goes red when `vertex_on` (`shaders/emit.wgsl`) forgets the row's prefix, when `crossing` measures from
/// the other end, when triangles of mirrored grids are not turned, and when one-sided differences
/// (`shaders/source/volume.wgsl`) are halved.
#[test]
fn as_the_twin() {
    check("emit", &["indices", "number of vertices", "positions"]);
}

/// Both whole paths from the same source: the same bytes on a software adapter.
#[test]
fn whole_paths_agree() {
    for case in cases() {
        for row in case.found.rows.iter().filter(|row| row.stage == "whole") {
            assert!(holds(row), "{}: {row:?}", case.name);
        }
    }
}
