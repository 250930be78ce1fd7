//! What cannot be tracked, and what is said of it.

use glam::Vec3;
use isoforge::extract::{ExtractError, Options, Source};
use isoforge::field::user::UserField;
use isoforge::field::{NoForm, Sense};
use isoforge::graph::{GraphField, shapes::*};
use isoforge::grid::Grid;
use isoforge::track::{Seeds, TrackError, Why, track};

fn ball() -> GraphField {
    GraphField::new(&sphere(0.3), Sense::Below)
}

fn grid(n: u32) -> Grid {
    Grid::from_bounds([n; 3], -Vec3::ONE, Vec3::ONE).expect("a grid")
}

fn run(seeds: &Seeds) -> Result<(usize, isoforge::track::TrackReport), TrackError> {
    let done = track(&Source::Field(&ball(), grid(40)), &Options::new(0.0), seeds, &|_| {});
    done.map(|(mesh, _, told)| (mesh.triangles.len(), told))
}

fn at(points: &[Vec3]) -> Seeds {
    Seeds { points: points.to_vec(), ..Seeds::default() }
}

#[test]
fn seeds_that_lead_nowhere_are_named() {
    let (outside, far) = (Vec3::new(0.0, 7.0, 0.0), Vec3::new(0.9, 0.9, 0.9));
    let (triangles, told) = run(&at(&[far, Vec3::ZERO, outside])).expect("one leads to the ball");
    assert!(triangles > 100);
    let missed: Vec<_> = told.missed.iter().map(|m| (m.seed, m.point, m.why)).collect();
    assert_eq!(missed, [(0, far, Why::NoSurface), (2, outside, Why::Outside)]);

    let error = run(&at(&[outside, far])).expect_err("none leads to it");
    let text = error.to_string();
    assert!(matches!(&error, TrackError::NothingReached { missed } if missed.len() == 2));
    assert!(text.contains("seed 0 at [0, 7, 0] lies outside") && text.contains("seed 1"), "{text}");
    // Beside a coarse lattice it is only said.
    let (triangles, told) = run(&Seeds { coarse: Some(4), ..at(&[outside]) }).expect("the lattice finds it");
    assert!(triangles > 100 && told.missed.len() == 1);
}

/// Seeds on the grid's border, and outside of it by what rounding makes.
#[test]
fn seeds_on_the_border() {
    for point in [Vec3::NEG_ONE, Vec3::ONE, Vec3::new(1.0, -1.0, 0.0), Vec3::splat(1.000_001)] {
        let (_, told) = run(&Seeds { coarse: Some(4), ..at(&[point]) }).expect("a mesh");
        assert_eq!(told.missed.iter().map(|m| m.why).collect::<Vec<_>>(), [Why::NoSurface], "{point}");
    }
    let (_, told) =
        run(&at(&[Vec3::new(0.0, 0.0, 1.0), Vec3::new(-1.0, 0.0, 0.0)])).expect("they walk inwards");
    assert!(told.missed.is_empty());
}

#[test]
fn settings_that_make_no_sense() {
    assert!(matches!(run(&Seeds::default()), Err(TrackError::NoSeeds)));
    assert!(matches!(run(&Seeds { coarse: Some(0), ..Seeds::default() }), Err(TrackError::CoarseStep)));
    assert!(matches!(run(&Seeds { search: Some(0), ..Seeds::default() }), Err(TrackError::SearchSize)));
    let seeds = at(&[Vec3::ZERO, Vec3::new(0.0, f32::NAN, 0.0)]);
    assert!(matches!(run(&seeds), Err(TrackError::SeedNotFinite { seed: 1, .. })));
    for huge in [u32::MAX, 1 << 31, 41] {
        for seeds in [
            Seeds { coarse: Some(huge), ..Seeds::default() },
            Seeds { search: Some(huge), ..Seeds::default() },
        ] {
            let (triangles, _) = run(&seeds).expect("a large step is no error");
            assert_eq!(triangles, 0);
        }
    }
    let text = "fn density(p: vec3<f32>) -> f32 { return 1.0 / p.x; }";
    let unbounded = UserField::new(text, "poles", Sense::Below).expect("a field");
    let seeds = Seeds { search: Some(u32::MAX), ..Seeds::default() };
    let found = track(&Source::Field(&unbounded, grid(40)), &Options::new(0.0), &seeds, &|_| {}).map(drop);
    assert!(found.is_ok(), "{found:?}");
    let options = Options::new(f32::NAN);
    let found = track(&Source::Field(&ball(), grid(8)), &options, &at(&[Vec3::ZERO]), &|_| {});
    assert!(matches!(found, Err(TrackError::Extract(ExtractError::Iso(_)))));
}

#[test]
fn limits() {
    let too_many = Source::Field(&ball(), grid(1 << 20));
    let found = track(&too_many, &Options::new(0.0), &at(&[Vec3::ZERO]), &|_| {});
    assert!(matches!(found, Err(TrackError::Extract(ExtractError::TooManyBricks { .. }))));
    let options = Options { memory_budget: 10_000, ..Options::new(0.0) };
    for seeds in [at(&[Vec3::ZERO]), Seeds { search: Some(1), ..Seeds::default() }] {
        let found = track(&Source::Field(&ball(), grid(200)), &options, &seeds, &|_| {});
        assert!(matches!(found, Err(TrackError::Extract(ExtractError::Budget { .. }))), "{seeds:?}");
    }
    let wide = Grid::from_bounds([1500, 1500, 8], -Vec3::ONE, Vec3::ONE).expect("a grid");
    let options = Options { memory_budget: 20 << 20, ..options };
    let seeds = Seeds { coarse: Some(1), ..Seeds::default() };
    let found = track(&Source::Field(&ball(), wide), &options, &seeds, &|_| {}).map(drop);
    let Err(TrackError::Extract(ExtractError::Budget { what, needed, budget })) = found else {
        panic!("{found:?}");
    };
    assert!(what.contains("lattice") && needed > budget && budget == 20 << 20, "{what}: {needed}, {budget}");
    let text = "fn density(p: vec3<f32>) -> f32 { return p.x; }";
    let black_box = UserField::new(text, "plane", Sense::Below).expect("a field").as_written();
    let found = track(&Source::Field(&black_box, grid(8)), &Options::new(0.0), &at(&[Vec3::ZERO]), &|_| {});
    assert!(matches!(found, Err(TrackError::Extract(ExtractError::NoForm(NoForm::Cpu)))));
}
