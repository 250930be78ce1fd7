//! One workspace, many calls; and the memory of the CPU path.

use crate::common;
use glam::Vec3;
use isoforge::extract::{ExtractError, Extractor, Options, STAGES, Source, extract_on_cpu, stage_index};
use isoforge::field::named::Named;
use isoforge::gpu::Timer;
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

/// Compiling and allocating is no upload.
#[test]
fn only_volumes_are_uploaded() {
    let Some(extractor) = common::extractor() else { return };
    let (torus, volume) = (Named::new("torus").unwrap(), common::sampled(cube(40), |p| p.length()));
    for (source, has_upload) in [(Source::Field(&torus, cube(40)), false), (Source::Volume(&volume), true)] {
        let whole = extractor.extract(&source, &Options::new(0.3)).unwrap().report;
        let options = Options { memory_budget: whole.peak_bytes * 4 / 5, ..Options::new(0.3) };
        let cut = extractor.extract(&source, &options).unwrap().report;
        assert!(cut.slabs > 1 || !has_upload, "{cut:?}");
        for report in [whole, cut] {
            assert_eq!(report.seconds[stage_index::UPLOAD].is_some(), has_upload, "{report:?}");
        }
    }
}

/// A sum that leaves passes out would be taken for the whole.
#[test]
fn a_stage_with_untimed_passes_has_no_time() {
    let Some(gpu) = common::gpu() else { return };
    let mut timer = Timer::new(gpu).unwrap();
    let mut seconds = [None; STAGES.len()];
    let mut run = |stages: &[usize]| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        stages.iter().for_each(|&stage| drop(timer.pass(&mut encoder, "empty", stage)));
        gpu.queue.submit([encoder.finish()]);
        timer.collect(gpu, &mut seconds).unwrap();
    };
    let mut stages = vec![stage_index::CULL; 1000];
    stages.extend([stage_index::EMIT; 100]);
    run(&stages);
    run(&[stage_index::EMIT]);
    let has_timer = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    assert_eq!(seconds[stage_index::CULL].is_some(), has_timer);
    assert_eq!(seconds[stage_index::EMIT], None);
}
