//! cull: the ranges, the brick map and the active list.

use crate::common;
use crate::inputs::{cases, check};
use isoforge::extract::{Options, Source};

/// Goes red when `range` (`shaders/cull.wgsl`) reads eight samples of a row instead of nine, and when
/// `straddles` asks for `outermost > iso_key`. That `arrange` counts the halo's bricks among the
/// own (`own_active`) shows only in a cut grid (`tests/extract/cut.rs`).
#[test]
fn as_the_twin() {
    check("cull", &["range of each brick", "bits of the brick map", "brick map", "active list"]);
}

#[test]
fn leaves_out_what_holds_no_surface() {
    let ball = cases().iter().filter(|case| case.name.starts_with("ball"));
    for case in ball {
        let active = case.found.rows.iter().find(|row| row.what == "active list").unwrap().compared;
        // 9 x 5 x 6 bricks; a sphere of radius 12.5 passes through at most 6³ of any.
        assert!((8..120).contains(&active), "{}: {active} bricks", case.name);
    }
    let Some(extractor) = common::extractor() else { return };
    let volume = common::small_brain();
    for (iso, expected) in [(-29.0, 0), (153.0, 0), (1e30, 0)] {
        let found = extractor.extract(&Source::Volume(&volume), &Options::new(iso)).unwrap();
        assert_eq!(found.report.active_bricks, expected, "iso {iso}");
    }
}
