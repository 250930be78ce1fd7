//! One workspace, many calls; and the memory of the CPU path.

use crate::common;
use glam::Vec3;
use isoforge::extract::{ExtractError, Extractor, Options, Source, extract_on_cpu};
use isoforge::field::named::Named;
use isoforge::grid::Grid;

fn cube(n: u32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::splat(-1.5), Vec3::splat(1.5)).unwrap()
}

#[test]
fn a_changed_parameter_needs_no_new_workspace() {
    let Some(gpu) = common::gpu() else { return };
    let extractor = Extractor::new(gpu.clone()).unwrap();
    let thin = Named::new("torus").unwrap().with("r", 0.2).unwrap();
    let thick = Named::new("torus").unwrap().with("r", 0.4).unwrap();
    let space = extractor.prepare(&Source::Field(&thin, cube(24)), u64::MAX).unwrap();
    for field in [&thin, &thick, &thin] {
        let source = Source::Field(field, cube(24));
        let again = extractor.extract_in(&space, &source, &Options::new(0.0), &|_| {}).unwrap();
        let fresh = extractor.extract(&source, &Options::new(0.0)).unwrap();
        assert_eq!(again.mesh.read(gpu).unwrap(), fresh.mesh.read(gpu).unwrap());
    }
}

#[test]
fn a_workspace_of_another_source_is_refused() {
    let Some(gpu) = common::gpu() else { return };
    let extractor = Extractor::new(gpu.clone()).unwrap();
    let (torus, gyroid) = (Named::new("torus").unwrap(), Named::new("gyroid").unwrap());
    let volume = common::noise(cube(24), 1);
    let space = extractor.prepare(&Source::Field(&torus, cube(24)), u64::MAX).unwrap();
    for source in [Source::Field(&torus, cube(25)), Source::Field(&gyroid, cube(24)), Source::Volume(&volume)]
    {
        let result = extractor.extract_in(&space, &source, &Options::new(0.0), &|_| {});
        assert!(matches!(result, Err(ExtractError::OtherSource)));
    }
}

#[test]
fn memory_of_the_cpu_path_follows_the_surface() {
    let torus = Named::new("torus").unwrap();
    let source = Source::Field(&torus, cube(128));
    let (mesh, report) = extract_on_cpu(&source, &Options::new(0.0), &|_| {}).unwrap();
    // 20 bytes a brick of the grid; 428 for those with surface, fewer than one a hundred vertices.
    let most = 20 * report.bricks + 428 * report.vertices / 20 + 36 * report.triangles;
    assert!(report.peak_bytes < most, "{} against {most}", report.peak_bytes);
    let options = Options { memory_budget: report.peak_bytes, ..Options::new(0.0) };
    assert_eq!(extract_on_cpu(&source, &options, &|_| {}).unwrap().0, mesh);
    let options = Options { memory_budget: report.peak_bytes - 1, ..options };
    assert!(matches!(extract_on_cpu(&source, &options, &|_| {}), Err(ExtractError::Budget { .. })));
}
