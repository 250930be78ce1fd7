//! Every stage on volumes, grids and iso values that nobody chose.

use crate::common;
use crate::inputs::{SENSES, holds};
use glam::{Mat3, Vec3};
use isoforge::compare::compare;
use isoforge::extract::{Options, Source};
use isoforge::grid::Grid;
use proptest::prelude::*;

fn grids() -> impl Strategy<Value = Grid> {
    let step = prop::array::uniform9(-1.0f32..1.0);
    let origin = prop::array::uniform3(-50.0f32..50.0);
    (prop::array::uniform3(1u32..27), origin, step).prop_filter_map("flat", |(cells, origin, step)| {
        let step = Mat3::from_cols_array(&step);
        (step.determinant().abs() > 1e-3).then(|| Grid::new(cells, Vec3::from(origin), step).ok())?
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn as_the_twins(grid in grids(), seed in any::<u64>(), pick in any::<prop::sample::Index>(), sense in 0usize..2) {
        if let Some(extractor) = common::extractor() {
            let volume = common::noise(grid, seed);
            // Half of the iso values tie with a sample.
            let chosen = volume.values().get(pick.index(volume.values().len()));
            let iso = if seed.is_multiple_of(2) && chosen.is_finite() { chosen } else { 0.2 };
            let options = Options { sense: Some(SENSES[sense]), ..Options::new(iso) };
            let found = compare(extractor, &Source::Volume(&volume), &options).unwrap();
            prop_assert!(found.rows.iter().all(holds), "iso {iso}:\n{found}");
        }
    }
}
