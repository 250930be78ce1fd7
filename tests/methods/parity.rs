//! Both backends, and all ways of extracting, with each method.

use crate::common::{self, Random, noise};
use crate::{bytes, on_cpu, on_gpu, options};
use glam::{Mat3, Vec3};
use isoforge::compare::compare;
use isoforge::extract::{
    ExtractError, Extractor, Incremental, Method, Options, Placement, Source, extract_on_cpu, extract_planes,
};
use isoforge::field::Sense;
use isoforge::field::named::Named;
use isoforge::field::user::UserField;
use isoforge::gpu::Form;
use isoforge::grid::Grid;
use isoforge::mesh::write;
use isoforge::track::{Seeds, track};
use isoforge::volume::{OpenOptions, Planes, RawLayout, Scalar, Volume};

fn grid(cells: [u32; 3]) -> Grid {
    Grid::new(cells, Vec3::new(-3.0, 0.5, 100.0), Mat3::from_diagonal(Vec3::new(0.3, 1.0, 2.7))).unwrap()
}

/// Noise, ties, a real volume: every kind of cell, and of border.
fn volumes() -> Vec<(String, Volume, f32)> {
    let mut all = Vec::new();
    for (i, cells) in
        [[1, 1, 1], [7, 9, 33], [8, 8, 8], [17, 16, 15], [1, 40, 8], [33, 9, 17]].into_iter().enumerate()
    {
        all.push((format!("noise {cells:?}"), noise(grid(cells), i as u64), 0.0));
        let mut random = Random(7 + i as u64);
        let values = (0..grid(cells).point_count()).map(|_| (random.next() % 5) as f32).collect();
        all.push((format!("ties {cells:?}"), Volume::new(grid(cells), values).unwrap(), 2.0));
    }
    let mirrored = Mat3::from_diagonal(Vec3::new(0.5, -1.0, 1.0));
    let mirrored = Grid::new([19, 11, 14], Vec3::ZERO, mirrored).unwrap();
    all.push(("mirrored".into(), noise(mirrored, 4), 0.1));
    // Plateaus, whose gradients say nothing: the normals of many vertices are their neighbours'.
    let mut random = Random(3);
    let values = (0..mirrored.point_count())
        .map(|_| if random.next().is_multiple_of(3) { 1.0 } else { -1.0 })
        .collect();
    all.push(("two values".into(), Volume::new(mirrored, values).unwrap(), 0.0));
    all.push(("brain_24".into(), common::small_brain(), 30.0));
    all
}

fn fields() -> Vec<(&'static str, Named, Grid, f32)> {
    let gyroid = Named::new("gyroid").unwrap().with("period", 0.4).unwrap();
    let (_, cube) = common::named("torus", 21);
    let oblique = Mat3::from_rotation_z(0.7) * Mat3::from_rotation_x(-1.1) * 0.17;
    let (torus, _) = common::named("torus", 1);
    let turned = Grid::new([9, 17, 8], Vec3::new(-1.3, -1.2, -1.5), oblique).unwrap();
    vec![("gyroid, short", gyroid, cube, 0.2), ("torus, turned", torus, turned, 0.0)]
}

/// Stage by stage: each twin gets the GPU's bytes.
///
/// Goes red when `tunnel` (shaders/shared/trilinear.wgsl) takes the ends of lines C and D for each other, when `first_centre`
/// (shaders/emit/cubes.wgsl) leaves a row out, when `vertex_on` (shaders/emit/tetrahedra.wgsl) counts direction 7 twice, and when
/// `classify` (shaders/classify/tetrahedra.wgsl) forgets the rows y = 8; also when `undecided_cells` (shaders/cases/mc33.wgsl) leaves out the
/// symmetric ones, and `add_undecided` (shaders/classify/serial.wgsl) the row behind a cell's.
#[test]
fn stages_agree() {
    let Some(extractor) = common::extractor() else { return };
    let software = extractor.gpu().is_software();
    let check = |name: &str, source: &Source<'_>, iso: f32, placement: Placement| {
        for (sense, options) in
            [None, Some(Sense::Below)].into_iter().flat_map(|s| options(iso).map(|o| (s, o)))
        {
            let options = Options { sense, placement, ..options };
            let found = compare(extractor, source, &options).unwrap();
            for row in &found.rows {
                let holds = if software { row.differing == 0 } else { row.agrees() };
                assert!(holds, "{name}, {options:?}: {row:?}");
            }
        }
    };
    for (name, volume, iso) in volumes() {
        for placement in [Placement::Linear, Placement::Midpoint] {
            check(&name, &Source::Volume(&volume), iso, placement);
        }
    }
    for (name, field, grid, iso) in fields() {
        for placement in [Placement::Linear, Placement::Midpoint, Placement::Snapped { epsilon: 1e-4 }] {
            check(name, &Source::Field(&field, grid), iso, placement);
        }
    }
}

/// Of a field that only a GPU evaluates, what can be compared is, and a note says what is not.
#[test]
fn black_boxes_are_compared_as_far_as_that_goes() {
    let Some(extractor) = common::extractor() else { return };
    let source = "fn density(p: vec3<f32>) -> f32 {
        var s = 0.0;
        for (var i = 0; i < 5; i++) { s += abs(fract(p.x * f32(i)) - p.y) * p.z; }
        return s;
    }";
    let field = UserField::new(source, "user.wgsl", Sense::Below).unwrap().as_written();
    let (_, grid) = common::named("cube", 21);
    for options in options(0.3) {
        for placement in [Placement::Linear, Placement::Snapped { epsilon: 1e-4 }] {
            let options = Options { placement, ..options };
            let found = compare(extractor, &Source::Field(&field, grid), &options).unwrap();
            assert!(found.agrees() && !found.is_empty(), "{options:?}:\n{found}");
            let has = |what| found.rows.iter().any(|row| row.what == what);
            let is_told = found.notes.iter().any(|note| note.contains("snapped positions"));
            assert!(has("indices") && has("positions") != is_told, "{options:?}:\n{found}");
            assert_eq!(is_told, placement != Placement::Linear);
        }
    }
}

/// All forms of the kernels, slabs, and batches.
#[test]
fn forms_and_cuts_agree() {
    let Some(default) = common::extractor() else { return };
    let forms = Form::ALL
        .into_iter()
        .filter_map(|form| Some(Extractor::new(default.gpu().with_form(form)?).unwrap()));
    let forms: Vec<Extractor> = forms.collect();
    assert!(forms.len() >= 2);
    // A slanted tube: surface in every layer of bricks, and little of it.
    let volume = common::sampled(Grid::new([43, 45, 117], Vec3::ZERO, Mat3::IDENTITY).unwrap(), |p| {
        4.3 - ((p.x - 9.0).powi(2) + (p.y - 3.0 - p.z * 0.3).powi(2)).sqrt()
            + (p.z * 0.7).sin()
            + (p.x * 31.0).sin()
    });
    let (gyroid, of_gyroid) = common::named("gyroid", 45);
    let mut most = 0;
    for (source, iso) in [(Source::Volume(&volume), 0.0), (Source::Field(&gyroid, of_gyroid), 0.1)] {
        for options in options(iso) {
            let (expected, _) = extract_on_cpu(&source, &options, &|_| {}).unwrap();
            for extractor in &forms {
                let mut memory_budget = extractor.extract(&source, &options).unwrap().report.peak_bytes;
                loop {
                    match extractor.extract(&source, &Options { memory_budget, ..options }) {
                        Ok(found) => {
                            let mesh = found.mesh.read(extractor.gpu()).unwrap();
                            let same = !default.gpu().is_software() || bytes(&mesh) == bytes(&expected);
                            assert!(same, "{options:?}, {memory_budget}");
                            assert_eq!(mesh.triangles, expected.triangles);
                            most = most.max(found.report.slabs);
                        }
                        Err(ExtractError::Budget { .. }) => break,
                        Err(error) => panic!("{error}"),
                    }
                    memory_budget = memory_budget * 3 / 4;
                }
            }
        }
    }
    assert!(most > 3, "{most} slabs");
}

/// Edits give what a full extraction does, a file in parts what the whole volume does, and the tracker what the sweep does.
#[test]
fn the_other_ways_agree() {
    let (_, cube) = common::named("gyroid", 30);
    let mut scene = Incremental::new(cube);
    for options in options(0.1) {
        for i in 0..6 {
            let gyroid = Named::new("gyroid").unwrap().with("thickness", 0.1 * f64::from(i)).unwrap();
            scene.update(&gyroid, &options).unwrap();
            assert!(
                bytes(scene.mesh()) == bytes(&on_cpu(&Source::Field(&gyroid, cube), &options)),
                "{options:?}"
            );
        }
    }
    let dir = tempfile::TempDir::new().unwrap();
    let mut random = Random(11);
    let samples: Vec<u8> = (0..23 * 19 * 41).map(|_| (random.next() % 6) as u8).collect();
    let path = dir.path().join("samples.raw");
    std::fs::write(&path, &samples).unwrap();
    let layout = RawLayout::new([23, 19, 41], Scalar::U8);
    let opening = OpenOptions { raw: Some(layout), ..OpenOptions::default() };
    let volume = isoforge::volume::open(&path, &opening).unwrap().volume;
    for options in options(2.5) {
        let [whole, parts] = ["whole.ply", "parts.ply"].map(|name| dir.path().join(name));
        write::write(&on_cpu(&Source::Volume(&volume), &options), &whole).unwrap();
        let tight = Options { memory_budget: 0, ..options };
        let mut planes = Planes::open(&path, &opening).unwrap();
        let needed = match extract_planes(&mut planes, &tight, &parts, &|_| {}) {
            Err(isoforge::extract::PlanesError::Extract(ExtractError::Budget { needed, .. })) => needed,
            other => panic!("{other:?}"),
        };
        let mut planes = Planes::open(&path, &opening).unwrap();
        let report =
            extract_planes(&mut planes, &Options { memory_budget: needed, ..options }, &parts, &|_| {})
                .unwrap();
        assert!(
            report.slabs > 1 && std::fs::read(&whole).unwrap() == std::fs::read(&parts).unwrap(),
            "{options:?}"
        );
    }
    let seeds = Seeds { search: Some(1), ..Seeds::default() };
    let (gyroid, cube) = common::named("gyroid", 30);
    let source = Source::Field(&gyroid, cube);
    for options in options(0.1) {
        let tracked = track(&source, &options, &seeds, &|_| {});
        if options.method == Method::Tetrahedra {
            assert!(tracked.is_err());
            continue;
        }
        assert!(bytes(&tracked.unwrap().0) == bytes(&on_cpu(&source, &options)), "{options:?}");
        if let Some(extractor) = common::extractor() {
            let (extraction, _) = extractor.track(&source, &options, &seeds, &|_| {}).unwrap();
            let mesh = extraction.mesh.read(extractor.gpu()).unwrap();
            assert_eq!(mesh.triangles, on_gpu(extractor, &source, &options).triangles);
        }
    }
}
