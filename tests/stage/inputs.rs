//! What the stages are compared on, and the comparisons, made once for all of them.

use crate::common::{self, noise, sampled};
use glam::{Mat3, Vec3};
use isoforge::compare::{Comparison, Row, compare};
use isoforge::extract::{Options, Source};
use isoforge::field::Sense;
use isoforge::field::named::Named;
use isoforge::grid::Grid;
use isoforge::volume::Volume;
use std::sync::OnceLock;

pub const SENSES: [Sense; 2] = [Sense::Below, Sense::Above];

/// Sizes around the borders of bricks, and thin ones: cells along x, y, z.
pub const SIZES: [[u32; 3]; 14] = [
    [1, 1, 1],
    [7, 7, 7],
    [8, 8, 8],
    [9, 9, 9],
    [15, 15, 15],
    [16, 16, 16],
    [17, 17, 17],
    [7, 9, 33],
    [16, 8, 7],
    [1, 40, 8],
    [40, 3, 5],
    [15, 1, 16],
    [2, 17, 1],
    [65, 2, 2],
];

enum Input {
    Field(Named, Grid),
    Volume(Volume),
}

/// A comparison and what it was made of.
pub struct Case {
    pub name: String,
    pub found: Comparison,
}

/// Ordinary, sheared, rotated and mirrored steps.
pub fn steps() -> [(&'static str, Mat3); 4] {
    let sheared =
        Mat3::from_cols(Vec3::new(0.5, 0.1, -0.05), Vec3::new(0.2, 0.7, 0.0), Vec3::new(-0.3, 0.25, 1.5));
    [
        ("anisotropic", Mat3::from_diagonal(Vec3::new(0.3, 1.0, 2.7))),
        ("sheared", sheared),
        ("rotated", Mat3::from_rotation_z(0.7) * Mat3::from_rotation_x(-1.1)),
        ("mirrored", sheared * Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0))),
    ]
}

fn volumes() -> Vec<(String, Volume, f32)> {
    let mut all = Vec::new();
    let mut add = |name: String, volume, iso| all.push((name, volume, iso));
    for (i, cells) in SIZES.into_iter().enumerate() {
        let (kind, step) = steps()[i % 4];
        let grid = Grid::new(cells, Vec3::new(-3.0, 0.5, 100.0), step).unwrap();
        add(format!("noise {cells:?} {kind}"), noise(grid, i as u64), 0.0);
    }
    for (kind, step) in steps() {
        let grid = Grid::new([19, 11, 14], Vec3::ZERO, step).unwrap();
        add(format!("noise {kind}"), noise(grid, 3), 0.1);
        // Whole numbers: every other sample ties with iso.
        let mut random = common::Random(7);
        let values = (0..grid.point_count()).map(|_| (random.next() % 5) as f32).collect();
        add(format!("ties {kind}"), Volume::new(grid, values).unwrap(), 2.0);
    }
    // Culling has something to leave out, bricks of NaN alone, and one brick beside a border.
    let grid = Grid::from_bounds([70, 33, 47], Vec3::ZERO, Vec3::new(70.0, 33.0, 47.0)).unwrap();
    let ball = |p: Vec3| 12.5 - p.distance(Vec3::new(20.0, 16.0, 24.0));
    add("ball".into(), sampled(grid, ball), 0.0);
    let holes = |p: Vec3| if p.x < 21.0 { f32::NAN } else { ball(p) };
    add("half a ball beside NaN".into(), sampled(grid, holes), 0.0);
    add("all NaN".into(), sampled(grid, |_| f32::NAN), 0.0);
    add("all equal to iso".into(), sampled(grid, |_| 4.0), 4.0);
    let corner = |p: Vec3| if p.distance(Vec3::new(8.0, 8.0, 8.0)) < 0.5 { 1.0 } else { f32::NEG_INFINITY };
    add("one point at a brick's border".into(), sampled(grid, corner), 0.5);
    let huge = |p: Vec3| (p.x - 30.3) * 1e37;
    add("differences that overflow".into(), sampled(grid, huge), 1e36);
    add("brain_24".into(), common::small_brain(), 10.0);
    all.extend(
        common::large_volumes().into_iter().map(|(name, volume, iso)| (name.to_string(), volume, iso)),
    );
    all
}

/// Each named field on a grid that shows it, and the cases that a formula makes special.
fn fields() -> Vec<(String, Named, Grid, f32)> {
    let mut all = Vec::new();
    for definition in isoforge::field::named::ALL {
        // 24 cells over 3 units: samples of the norm balls tie with iso.
        for n in [24, 37] {
            let (field, grid) = common::named(definition.name, n);
            all.push((format!("{} {n}", definition.name), field, grid, definition.iso));
        }
        let (field, _) = common::named(definition.name, 1);
        for (kind, step) in steps() {
            let grid = Grid::new([9, 17, 8], Vec3::new(-1.3, -1.2, -1.5), step * 0.17).unwrap();
            all.push((format!("{} {kind}", definition.name), field.clone(), grid, definition.iso));
        }
    }
    let torus = || Named::new("torus").unwrap();
    let (_, grid) = common::named("torus", 21);
    // R = 0 is a sphere of radius r, where the value only touches 0.
    all.push(("torus R=0 at 0".into(), torus().with("R", 0.0).unwrap(), grid, 0.0));
    all.push(("torus R=0".into(), torus().with("R", 0.0).unwrap(), grid, 0.01));
    all.push(("torus r=R=0".into(), torus().with("R", 0.0).unwrap().with("r", 0.0).unwrap(), grid, 0.3));
    all.push(("gyroid, short".into(), Named::new("gyroid").unwrap().with("period", 0.3).unwrap(), grid, 0.2));
    all
}

fn inputs() -> Vec<(String, Input, f32, Vec<Option<Sense>>)> {
    let mut all = Vec::new();
    for (name, volume, iso) in volumes() {
        // Both senses, once for the large ones.
        let both = volume.grid().point_count() < 200_000;
        let senses = if both { SENSES.map(Some).to_vec() } else { vec![None] };
        all.push((name, Input::Volume(volume), iso, senses));
    }
    for (name, field, grid, iso) in fields() {
        all.push((name, Input::Field(field, grid), iso, vec![None, Some(Sense::Above)]));
    }
    all
}

/// Every comparison, made on the first call; none in a CPU-only run.
pub fn cases() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        let Some(extractor) = common::extractor() else { return Vec::new() };
        let mut cases = Vec::new();
        for (name, input, iso, senses) in inputs() {
            let source = match &input {
                Input::Field(field, grid) => Source::Field(field, *grid),
                Input::Volume(volume) => Source::Volume(volume),
            };
            for sense in senses {
                let name = format!("{name}, {sense:?}");
                let options = Options { sense, ..Options::new(iso) };
                let found = compare(extractor, &source, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
                cases.push(Case { name, found });
            }
        }
        cases
    })
}

/// Whether a row is as it must be here: on a software adapter bit for bit, else within its tolerance.
pub fn holds(row: &Row) -> bool {
    let software = common::gpu().is_some_and(|gpu| gpu.is_software());
    if software { row.differing == 0 } else { row.agrees() }
}

/// Checks the rows of `stage` in every case, and that each of `outputs` was compared and, somewhere, not
/// empty.
pub fn check(stage: &str, outputs: &[&str]) {
    let cases = cases();
    let mut wrong = Vec::new();
    for case in cases {
        for row in case.found.rows.iter().filter(|row| row.stage == stage && !holds(row)) {
            wrong.push(format!("{}: {row:?}", case.name));
        }
    }
    assert!(wrong.is_empty(), "{} rows differ:\n{}", wrong.len(), wrong.join("\n"));
    let rows = || cases.iter().flat_map(|case| &case.found.rows).filter(|row| row.stage == stage);
    for output in outputs {
        let compared: usize = rows().filter(|row| row.what == *output).map(|row| row.compared).sum();
        assert!(compared > 100 || cases.is_empty(), "{stage}: {output}: {compared} values compared");
    }
    // On real GPUs alone; tests/stage/forms.rs asks for it.
    let named = |row: &Row| outputs.contains(&row.what) || row.what == "samples kept for emit";
    assert!(rows().all(named), "{stage} has outputs that no test names");
}
