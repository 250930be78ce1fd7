//! The forms of the kernels ([`Form`]): all give the same bytes.

use crate::common;
use glam::{Mat3, Vec3};
use isoforge::compare::compare;
use isoforge::extract::{Extractor, Options, Source, extract_on_cpu};
use isoforge::field::named::Named;
use isoforge::field::{Field, Sense};
use isoforge::gpu::Form;
use isoforge::graph::{GraphField, x, y, z};
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

fn forms(default: &Extractor) -> Vec<(Form, Extractor)> {
    let some = |form| Some((form, Extractor::new(default.gpu().with_form(form)?).unwrap()));
    Form::ALL.into_iter().filter_map(some).collect()
}

/// Goes red when `rows_at` of `shaders/brick/shared_rows.wgsl` takes row + 8 for row + 9, when `turn_columns` there shifts by z + 1, when `group_before` of
/// `shaders/group/shared.wgsl` leaves out its last step, and when that of `subgroup.wgsl` does not add the subgroups
/// before; `reduce` of `shaders/scan.wgsl` without the last value shows in the cube alone.
/// `shaders/classify/serial.wgsl` with `row_here` in place of `next_here` gives another mesh, too.
#[test]
fn give_the_same_bytes() {
    let Some(default) = common::extractor() else { return };
    let forms = forms(default);
    let info = &default.gpu().info;
    let subgroups = default.gpu().device.features().contains(wgpu::Features::SUBGROUP)
        && info.subgroup_min_size == info.subgroup_max_size
        && info.subgroup_max_size <= 32;
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

/// What classify keeps of the samples that it takes itself. Goes red when `keep_samples` (shaders/source/evaluate.wgsl) writes a sample less.
#[test]
fn samples_are_kept_for_emit() {
    let Some(default) = common::extractor() else { return };
    for (form, extractor) in forms(default).into_iter().filter(|(form, _)| *form != Form::Serial) {
        for (field, grid) in fields().into_iter().take(3) {
            let options = Options::new(field.definition().iso);
            let found = compare(&extractor, &Source::Field(&field, grid), &options).unwrap();
            let kept = found.rows.iter().find(|row| row.what == "samples kept for emit");
            let kept = kept.unwrap_or_else(|| panic!("{form:?}: not compared"));
            assert!(kept.compared >= 729 && kept.differing == 0, "{form:?}: {kept:?}");
            assert!(found.agrees(), "{form:?}: {found}");
        }
    }
}

/// Fields whose values have parts that take x and y, or z, alone, where classify takes the samples itself: along the world's axes
/// by these parts, where they are not too large, and elsewhere point by point.
///
/// Goes red when `load_levels` (shaders/source/evaluate/planes.wgsl) makes eight levels, when `load_columns` (shaders/source/evaluate.wgsl) takes
/// a column for each row of x or forgets the upper half of the flags, and when `keep_samples` there leaves out the first.
#[test]
fn fields_in_parts() {
    let Some(default) = common::extractor() else { return };
    let forms = forms(default);
    let waves = |count: i32| {
        let wave = |k: i32| {
            let k = f64::from(k);
            (x() * (k + 0.5) + y()).sin() * (z() * (k + 1.0)).cos() / (k + 1.0)
        };
        (1..count).map(wave).fold(wave(0), |sum, next| sum + next)
    };
    let cases = [
        ("both and coordinates", (x() * 3.0).sin() * y() + z() * (z() * 2.0).cos() + x() * y() * z()),
        ("no z", x().square() + y().square() - 1.0),
        ("x alone", (x() * 4.0).cos()),
        ("no number where x is below 0", x().sqrt() - z().cos() * 0.4 + y() * 0.1),
        ("few waves", waves(5)),
        ("more waves than a column may have", waves(36)),
    ];
    let most = [Vec3::splat(-1.9), Vec3::splat(2.1)];
    let along = Grid::from_bounds([37, 22, 19], most[0], most[1]).unwrap();
    let mirrored = Grid::new(along.cells().into(), most[1], along.step() * -1.0).unwrap();
    let turned = Grid::new(along.cells().into(), most[0], Mat3::from_rotation_x(0.3) * along.step()).unwrap();
    for (what, expr) in cases {
        let field = GraphField::new(&expr, Sense::Below);
        assert!(field.wgsl().unwrap().planes.is_some(), "{what}");
        for grid in [along, mirrored, turned] {
            let source = Source::Field(&field, grid);
            let options = Options { cull: false, ..Options::new(0.1) };
            let (expected, report) = extract_on_cpu(&source, &options, &|_| {}).unwrap();
            assert!(!expected.triangles.is_empty(), "{what}");
            assert_eq!(report.non_finite > 0, what.starts_with("no number"), "{what}");
            for (form, extractor) in &forms {
                let found = extractor.extract(&source, &options).unwrap();
                assert_eq!(found.report.non_finite, report.non_finite, "{what}, {form:?}, {grid:?}");
                let mesh = found.mesh.read(extractor.gpu()).unwrap();
                assert_eq!(mesh.triangles, expected.triangles, "{what}, {form:?}, {grid:?}");
                assert!(!extractor.gpu().is_software() || mesh == expected, "{what}, {form:?}, {grid:?}");
            }
        }
    }
}
