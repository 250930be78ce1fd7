//! Seeds that are looked for in the whole grid.

use crate::assert_same;
use crate::common::Random;
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::graph::{GraphField, shapes::*};
use isoforge::grid::Grid;
use isoforge::track::{Seeds, track};

/// A large ball, and tiny ones around single grid points that a coarse lattice steps over. The search finds all of them.
/// Goes red when the search drops some of the boxes whose interval straddles iso.
#[test]
fn tiny_components() {
    let mut random = Random(3);
    let cells = 96;
    let spacing = 1.0 / f64::from(cells);
    let mut all = vec![sphere(0.2).translate([0.5, 0.5, 0.5])];
    for i in 0..20 {
        // Odd points: no lattice of step 8 has them.
        let mut odd = || (1 + 2 * (random.next() % 47)) as f64 * spacing;
        let at = [odd(), if i % 2 == 0 { 0.1 } else { 0.9 } + 0.3 * spacing, odd()];
        all.push(sphere(0.8 * spacing).translate(at));
    }
    let field = GraphField::new(&union(all), Sense::Below);
    let grid = Grid::from_bounds([cells; 3], Vec3::ZERO, Vec3::ONE).expect("a grid");
    let source = Source::Field(&field, grid);
    let options = Options::new(0.0);
    let (sweep, _) = extract_on_cpu(&source, &options, &|_| {}).expect("a mesh");
    assert!(sweep.check().components > 15);

    let with = |seeds| track(&source, &options, &seeds, &|_| {}).expect("a mesh");
    let (coarse, _, _) = with(Seeds { coarse: Some(8), ..Seeds::default() });
    assert_eq!(coarse.check().components, 1, "a coarse lattice steps over the tiny ones");
    let (found, _, told) = with(Seeds { search: Some(1), ..Seeds::default() });
    assert_same("search", &found, &sweep);
    let search = told.search.expect("a search");
    assert!(search.is_complete() && search.by_intervals && search.empty > 100, "{search:?}");
    assert!(told.probes < 100_000, "far fewer than the 912673 points of the grid: {told:?}");

    // Larger boxes miss some, and say so.
    let (found, _, told) = with(Seeds { search: Some(8), ..Seeds::default() });
    let search = told.search.expect("a search");
    assert_eq!(search.is_complete(), found.triangles.len() == sweep.triangles.len(), "{search:?}");
    assert!(!search.is_complete() && search.undecided >= 10, "{search:?}");
}

/// One ball: the boxes that were not decided by their corners are once the bricks around them are reached.
#[test]
fn all_is_decided_for_a_ball() {
    let field = GraphField::new(&sphere(0.3), Sense::Below);
    let grid = Grid::from_bounds([100; 3], -Vec3::ONE, Vec3::ONE).expect("a grid");
    for cells in [1, 2, 3, 4, 8] {
        let seeds = Seeds { search: Some(cells), ..Seeds::default() };
        let (mesh, _, told) =
            track(&Source::Field(&field, grid), &Options::new(0.0), &seeds, &|_| {}).expect("a mesh");
        let search = told.search.expect("a search");
        assert_eq!(search.cells, 1 << cells.ilog2());
        assert!(search.is_complete(), "{search:?}");
        assert!(mesh.check().is_closed_manifold());
    }
}

/// A field without intervals is looked through by a lattice, and the report says so.
#[test]
fn without_intervals() {
    let field = isoforge::field::Closure::new(Sense::Below, |p: Vec3| p.length() - 0.3);
    let grid = Grid::from_bounds([40; 3], -Vec3::ONE, Vec3::ONE).expect("a grid");
    let seeds = Seeds { search: Some(4), ..Seeds::default() };
    let (mesh, _, told) =
        track(&Source::Field(&field, grid), &Options::new(0.0), &seeds, &|_| {}).expect("a mesh");
    let search = told.search.expect("a search");
    assert!(!search.by_intervals && !search.is_complete() && search.empty == 0, "{search:?}");
    assert!(mesh.check().is_closed_manifold() && !mesh.triangles.is_empty());
}
