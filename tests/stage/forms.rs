//! The forms of the kernels ([`Form`]): all give the same bytes.

use crate::common;
use isoforge::extract::{Extractor, Options, Source};
use isoforge::field::Field;
use isoforge::field::named::Named;
use isoforge::gpu::Form;
use isoforge::grid::Grid;
use isoforge::volume::Volume;

fn volumes() -> Vec<(Volume, f32)> {
    let noise = |cells: [u32; 3], seed| {
        let grid = Grid::from_bounds(cells, glam::Vec3::ZERO, glam::Vec3::ONE).unwrap();
        (common::noise(grid, seed), 0.0)
    };
    vec![(common::small_brain(), 20.0), noise([33, 9, 17], 1), noise([7, 40, 8], 3), noise([64, 63, 65], 6)]
}

fn fields() -> Vec<(Named, Grid)> {
    // The last has so many words in its map that its scan takes several workgroups.
    [("sphere", 37), ("gyroid", 50), ("torus", 8), ("octahedron", 64), ("cube", 300)]
        .map(|(name, n)| common::named(name, n))
        .into()
}

/// Goes red when `rows_at` of `shaders/brick/shared_rows.wgsl` takes row + 8 for row + 9, when `group_before` of
/// `shaders/group/shared.wgsl` leaves out its last step, and when that of `subgroup.wgsl` does not add the subgroups
/// before; `reduce` of `shaders/scan.wgsl` without the last value shows in the cube alone.
#[test]
fn give_the_same_bytes() {
    let Some(default) = common::extractor() else { return };
    let forms: Vec<(Form, Extractor)> = Form::ALL
        .into_iter()
        .filter_map(|form| Some((form, Extractor::new(default.gpu().with_form(form)?).unwrap())))
        .collect();
    assert!(forms.len() >= 2);
    let check = |what: &str, source: &Source<'_>, iso: f32| {
        let mut all = forms.iter().map(|(form, extractor)| {
            let found = extractor.extract(source, &Options::new(iso)).unwrap();
            (form, found.mesh.read(extractor.gpu()).unwrap(), found.report)
        });
        let (_, mesh, report) = all.next().unwrap();
        assert!(!mesh.triangles.is_empty(), "{what}");
        for (form, other, other_report) in all {
            assert!(mesh == other, "{what}: {form:?}");
            assert_eq!(
                (report.active_bricks, report.non_finite),
                (other_report.active_bricks, other_report.non_finite),
                "{what}: {form:?}"
            );
        }
    };
    for (i, (volume, iso)) in volumes().iter().enumerate() {
        check(&format!("volume {i}"), &Source::Volume(volume), *iso);
    }
    for (field, grid) in fields() {
        let definition = field.definition();
        check(definition.name, &Source::Field(&field as &dyn Field, grid), definition.iso);
    }
}
