//! Grids of which no array could be made.

use glam::Vec3;
use isoforge::extract::{Options, Source};
use isoforge::field::Sense;
use isoforge::graph::{GraphField, shapes::*};
use isoforge::grid::Grid;
use isoforge::track::{Seeds, track};

/// 10,000³ cells with a ball of 60 cells in radius, by a point and by search; also at the very end of the grid, where brick
/// numbers are highest.
/// Goes red when anything is as large as the grid: the budget is 60 MB.
#[test]
fn ten_thousand_cubed() {
    let grid = Grid::from_bounds([10_000; 3], Vec3::ZERO, Vec3::splat(10_000.0)).expect("a grid");
    let options = Options { memory_budget: 60 << 20, ..Options::new(0.0) };
    for at in [5_003.3, 9_939.2, 9_999.0] {
        let ball = sphere(60.0).translate([at; 3]);
        let field = GraphField::new(&ball, Sense::Below);
        for seeds in [
            Seeds { points: vec![Vec3::splat(at as f32)], ..Seeds::default() },
            Seeds { search: Some(16), ..Seeds::default() },
        ] {
            let (mesh, report, told) =
                track(&Source::Field(&field, grid), &options, &seeds, &|_| {}).expect("a mesh");
            let found = mesh.check();
            assert_eq!(found.components, 1, "{told:?}");
            let whole = at < 9_940.0;
            assert_eq!(found.is_closed_manifold(), whole, "at {at}");
            if whole {
                let volume = 4.0 / 3.0 * std::f64::consts::PI * 60f64.powi(3);
                assert!((found.volume / volume - 1.0).abs() < 0.01, "{} for {volume}", found.volume);
            }
            assert!(report.active_bricks < 2000 && report.bricks > 1_900_000_000);
        }
    }
}
