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
/// `shaders/classify/serial.wgsl` with `row_here` in place of `next_here` gives another mesh, too.
#[test]
fn give_the_same_bytes() {
    let Some(default) = common::extractor() else { return };
    let forms: Vec<(Form, Extractor)> = Form::ALL
        .into_iter()
        .filter_map(|form| Some((form, Extractor::new(default.gpu().with_form(form)?).unwrap())))
        .collect();
    let subgroups = default.gpu().device.features().contains(wgpu::Features::SUBGROUP);
    assert!(forms.len() >= 2 && (forms.len() == 3 || !subgroups), "{forms:?}");
    let check_within = |what: &str, source: &Source<'_>, iso: f32, memory_budget: u64| {
        let mut all = forms.iter().map(|(form, extractor)| {
            let found = extractor.extract(source, &Options { memory_budget, ..Options::new(iso) }).unwrap();
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
        report
    };
    let check = |what: &str, source: &Source<'_>, iso: f32| check_within(what, source, iso, u64::MAX);
    for (i, (volume, iso)) in volumes().iter().enumerate() {
        check(&format!("volume {i}"), &Source::Volume(volume), *iso);
    }
    for (field, grid) in fields() {
        let definition = field.definition();
        check(definition.name, &Source::Field(&field as &dyn Field, grid), definition.iso);
    }
    // In batches and in slabs: the samples of a batch lie where those of the one before did.
    let (gyroid, grid) = common::named("gyroid", 70);
    let source = Source::Field(&gyroid as &dyn Field, grid);
    let needed = check("gyroid", &source, 0.0).peak_bytes;
    let batches = |budget: u64| forms[1].1.prepare(&source, budget).unwrap().plan().batches;
    assert!(batches(needed * 3 / 5) >= 2, "{}", batches(needed * 3 / 5));
    check_within("gyroid in batches", &source, 0.0, needed * 3 / 5);
    let (volume, iso) = &volumes()[3];
    let source = Source::Volume(volume);
    let needed = check("noise", &source, *iso).peak_bytes;
    let cut = check_within("noise in slabs", &source, *iso, needed * 19 / 20);
    assert!(cut.slabs > 1, "{}", cut.slabs);
}
