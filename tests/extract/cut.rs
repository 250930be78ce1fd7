//! Grids cut into slabs and batches give the bytes of the uncut grid.
//!
//! Goes red when `brick_origin` forgets `slab_first`, when `arrange` counts the halo's bricks in `own_active`,
//! and when `vertex_on` numbers vertices without the slab's first.

use super::{bytes, read};
use crate::common;
use glam::{Mat3, Vec3};
use isoforge::extract::{ExtractError, Extractor, Options, Source};
use isoforge::grid::Grid;
use std::collections::BTreeSet;

/// Extracts within smaller and smaller budgets until none suffices; returns the numbers of slabs and
/// batches that were seen.
fn shrink_budget(extractor: &Extractor, source: &Source<'_>, iso: f32) -> BTreeSet<(u64, u32)> {
    let uncut = extractor.extract(source, &Options::new(iso)).unwrap();
    let mesh = read(extractor, &uncut);
    assert!(!mesh.triangles.is_empty());
    let mut seen = BTreeSet::new();
    let mut budget = 4 * uncut.report.peak_bytes;
    loop {
        let options = Options { memory_budget: budget, ..Options::new(iso) };
        match extractor.extract(source, &options) {
            Ok(found) => {
                assert!(bytes(&mesh) == bytes(&read(extractor, &found)), "within {budget} bytes");
                assert!(found.report.peak_bytes <= budget);
                let counted = [found.report.non_finite, found.report.active_bricks];
                assert_eq!(counted, [uncut.report.non_finite, uncut.report.active_bricks]);
                let space = extractor.prepare(source, budget).unwrap();
                seen.insert((found.report.slabs, space.plan().batches));
            }
            Err(ExtractError::Budget { needed, budget: said, .. }) => {
                assert!(needed > budget && said == budget);
                return seen;
            }
            Err(error) => panic!("within {budget} bytes: {error}"),
        }
        budget = budget * 7 / 8;
    }
}

/// One figure is named, whatever the budget; it suffices, and one byte less does not.
///
/// Goes red when `short` names the scratch at hand rather than the least, or leaves out the reading back.
#[test]
fn the_need_that_is_named_suffices() {
    let Some(extractor) = common::extractor() else { return };
    let (gyroid, _) = common::named("gyroid", 1);
    let box_of = |cells, high| Grid::from_bounds(cells, Vec3::ZERO, high).unwrap();
    // Much mesh, next to none, and a grid that is cut along x too.
    let dense = box_of([24; 3], Vec3::splat(4.0));
    let empty = box_of([50, 40, 60], Vec3::splat(0.3));
    let long = box_of([1100, 12, 9], Vec3::new(3.0, 0.03, 0.03));
    let noise = common::noise(box_of([20, 21, 22], Vec3::ONE), 1);
    let field = |grid| Source::Field(&gyroid, grid);
    let mut met = BTreeSet::new();
    for source in [field(dense), field(empty), field(long), Source::Volume(&noise)] {
        for read_back in [false, true] {
            let run = |memory_budget| {
                let options = Options { memory_budget, ..Options::new(0.1) };
                extractor
                    .extract_with(&source, &options, read_back, &|_| {})
                    .map(|found| found.report.peak_bytes)
            };
            let mut budget = run(u64::MAX).unwrap();
            let mut named = BTreeSet::new();
            while budget > 1000 {
                match run(budget) {
                    Ok(peak) => assert!(peak <= budget),
                    Err(ExtractError::Budget { what, needed, .. }) if what.starts_with("the mesh") => {
                        met.insert(what);
                        named.insert(needed);
                    }
                    // Even the scratch is too much: what the mesh takes is not known yet.
                    Err(ExtractError::Budget { needed, .. }) => {
                        assert!(named.first().is_none_or(|&all| needed < all), "{needed}: {named:?}");
                        let again = run(needed);
                        assert!(matches!(again, Ok(_) | Err(ExtractError::Budget { .. })), "{again:?}");
                    }
                    Err(error) => panic!("within {budget} bytes: {error}"),
                }
                budget = budget * 2 / 3;
            }
            let need = *named.first().unwrap_or(&0);
            assert_eq!(named.len(), 1, "{:?}, {read_back}: {named:?}", source.grid());
            assert!(run(need).is_ok_and(|peak| peak <= need), "{:?}", run(need));
            assert!(run(need - 1).is_err());
        }
    }
    assert_eq!(met.len(), 2, "{met:?}");
}

#[test]
fn volumes_by_budget() {
    let Some(extractor) = common::extractor() else { return };
    let cells = [43, 45, 117];
    let grid = Grid::new(cells, Vec3::ZERO, Mat3::from_diagonal(Vec3::new(1.0, 1.1, 0.9))).unwrap();
    // A slanted tube with beads of NaN: every layer of bricks has surface, and borders lie everywhere.
    let volume = common::sampled(grid, |p| {
        let v = 4.3 - ((p.x - 9.0).powi(2) + (p.y - 3.0 - p.z * 0.3).powi(2)).sqrt() + (p.z * 0.7).sin();
        if (p.z as u32 % 16) == 8 && p.x < 6.0 { f32::NAN } else { v }
    });
    let seen = shrink_budget(extractor, &Source::Volume(&volume), 0.0);
    assert!(seen.iter().any(|&(slabs, _)| slabs > 3), "slabs and batches: {seen:?}");
}

#[test]
fn fields_by_budget() {
    let Some(extractor) = common::extractor() else { return };
    let (torus, _) = common::named("torus", 1);
    // Much emptier than the torus' own box, so that the mesh takes little of the budget.
    let (low, high) = (Vec3::new(-4.2, -3.1, -2.5), Vec3::new(3.1, 4.3, 3.6));
    let grid = Grid::from_bounds([62, 59, 101], low, high).unwrap();
    let seen = shrink_budget(extractor, &Source::Field(&torus, grid), 0.0);
    assert!(seen.iter().any(|&(slabs, batches)| slabs == 1 && batches > 3), "slabs and batches: {seen:?}");
    assert!(seen.iter().any(|&(slabs, _)| slabs > 1), "slabs and batches: {seen:?}");
}

/// Wide grids are cut along y and along x too, where one layer or one row of bricks is too much.
///
/// Goes red when `vertex_on` takes any of the four `first_vertices` for another, and when the volume's box
/// is read without `source_first` or with the extent of the grid.
#[test]
fn layers_and_rows_are_cut_too() {
    let Some(extractor) = common::extractor() else { return };
    // A flat pipe across all of the grid, with waves: surface in every brick row, borders everywhere.
    let value = |p: Vec3| (p.x * 0.31).sin() + (p.y * 0.43 + 0.2 * p.z).cos() + (p.z - 9.0) * 0.2;
    for cells in [[1100, 20, 19], [60, 150, 20], [2000, 3, 4]] {
        let grid = Grid::new(cells, Vec3::ZERO, Mat3::IDENTITY).unwrap();
        let [columns, rows, layers] = grid.bricks().to_array().map(u64::from);
        let volume = common::sampled(grid, value);
        let seen = shrink_budget(extractor, &Source::Volume(&volume), 0.1);
        let most = seen.iter().map(|&(slabs, _)| slabs).max().unwrap();
        // More than one slab a layer; where rows are long, more than one a row.
        let least = if columns > 64 { layers * rows * 2 } else { layers * 2 };
        assert!(most >= least, "{cells:?}, slabs and batches: {seen:?}");
    }
    let (gyroid, _) = common::named("gyroid", 1);
    let grid = Grid::from_bounds([1100, 20, 19], Vec3::ZERO, Vec3::new(3.0, 0.06, 0.06)).unwrap();
    let seen = shrink_budget(extractor, &Source::Field(&gyroid, grid), 0.1);
    assert!(seen.iter().any(|&(slabs, _)| slabs >= 3 * 3 * 2), "slabs and batches: {seen:?}");
}

/// A device that binds little cuts everything, and thinner again where a slab's part of the mesh is more
/// than it binds.
#[test]
fn by_what_the_device_binds() {
    let Some(whole) = common::extractor() else { return };
    let (gyroid, _) = common::named("gyroid", 1);
    let grid = Grid::from_bounds([71, 20, 65], Vec3::ZERO, Vec3::new(3.0, 1.0, 2.7)).unwrap();
    let noise = common::noise(Grid::from_bounds([18, 17, 50], Vec3::ZERO, Vec3::ONE).unwrap(), 1);
    let mut slabs = Vec::new();
    for bytes_bound in [1u64 << 20, 400 << 10, 200 << 10] {
        let limits = |all| wgpu::Limits {
            max_storage_buffer_binding_size: bytes_bound,
            max_buffer_size: 1 << 26,
            ..all
        };
        let gpu = common::own_device(limits).unwrap();
        let small = Extractor::new(gpu).unwrap();
        for (source, iso) in [(Source::Field(&gyroid, grid), 0.1), (Source::Volume(&noise), 0.0)] {
            let options = Options::new(iso);
            let expected = read(whole, &whole.extract(&source, &options).unwrap());
            match small.extract(&source, &options) {
                Ok(found) => {
                    assert!(bytes(&expected) == bytes(&read(&small, &found)), "binding {bytes_bound} bytes");
                    slabs.push(found.report.slabs);
                }
                // One layer's part of the mesh is more than the device binds.
                Err(ExtractError::Binding { needed, limit, .. }) => {
                    assert!(needed > limit && limit == bytes_bound)
                }
                Err(error) => panic!("{error}"),
            }
        }
    }
    assert!(slabs.len() > 3 && slabs.iter().any(|&n| n > 3), "{slabs:?}");
}
