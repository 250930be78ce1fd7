//! One workspace, many calls; and the memory of the CPU path.

use crate::common;
use glam::Vec3;
use isoforge::extract::{ExtractError, Extractor, Options, STAGES, Source, extract_on_cpu, stage_index};
use isoforge::field::Sense;
use isoforge::field::named::Named;
use isoforge::gpu::{AdapterChoice, Gpu, GpuMesh, Overflow, Timer};
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

/// Goes red when a buffer is made larger than `Plan` counts it, the records by a word a brick for example.
#[test]
fn buffers_are_no_more_than_planned() {
    let Some(extractor) = common::extractor() else { return };
    let torus = Named::new("torus").unwrap();
    let volume = common::noise(cube(70), 3);
    let brain = common::small_brain();
    for n in [8, 40, 100, 300] {
        for source in [Source::Field(&torus, cube(n)), Source::Volume(&volume), Source::Volume(&brain)] {
            let whole = extractor.prepare(&source, u64::MAX).unwrap();
            for part in [100, 70, 50, 30] {
                let Ok(space) = extractor.prepare(&source, whole.plan().bytes * part / 100) else { continue };
                let (made, planned) = (space.buffer_bytes(), space.plan().bytes);
                assert!(made <= planned, "{n}, {part} %: {made} bytes of {planned}");
                // Nor is much planned that is not made, but of volumes what they take in main memory and on their way.
                let is_volume = matches!(source, Source::Volume(_));
                assert!(
                    is_volume || made + (64 << 10) >= planned,
                    "{n}, {part} %: {made} bytes of {planned}"
                );
            }
        }
    }
}

/// A slider: frames after the first make no buffer and no bind group, and each is the mesh of its iso value and
/// parameter. Goes red when bind groups are not kept, and when the settings of one frame are those of another.
#[test]
fn frames_allocate_nothing() {
    if common::gpu().is_none() {
        return;
    }
    // Its own: on that of all tests, what the others make meanwhile would count.
    let gpu = &Gpu::open(AdapterChoice::Best).unwrap();
    let extractor = Extractor::new(gpu.clone()).unwrap();
    let volume = common::small_brain();
    let of_volume = Source::Volume(&volume);
    let thick = |r| Named::new("torus").unwrap().with("r", r).unwrap();
    let tori = [0.3, 0.4, 0.25, 0.35].map(thick);
    for frames in [
        tori.iter().map(|torus| (Source::Field(torus, cube(40)), 0.02)).collect::<Vec<_>>(),
        [20.0, 60.0, 10.0, 35.0].map(|iso| (of_volume, iso)).to_vec(),
    ] {
        let space = extractor.prepare(&frames[0].0, u64::MAX).unwrap();
        let mesh = GpuMesh::with_capacity(gpu, 40_000, 80_000).unwrap();
        let mut made = Vec::new();
        for (source, iso) in &frames {
            let before = gpu.made();
            extractor.set_source(&space, source).unwrap();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            // The other side is inside, every second time.
            let flipped = made.len() % 2 == 1;
            let sense = if flipped { Sense::Above } else { Sense::Below };
            let options = Options { sense: Some(sense), ..Options::new(*iso) };
            extractor.encode(&space, &mut encoder, &options, &mesh).unwrap();
            gpu.queue.submit([encoder.finish()]);
            made.push(gpu.made() - before);
            let expected = extractor.extract(source, &options).unwrap().mesh.read(gpu).unwrap();
            let found = mesh.read(gpu).unwrap();
            assert!(!found.triangles.is_empty());
            assert_eq!(found, expected);
        }
        let allowed = if gpu.has_immediates() { 0 } else { 40 };
        assert!(made[0] > 8 && made[1..].iter().all(|&n| n <= allowed), "{made:?}");
    }
}

/// Grids with more active bricks than there is room for say so, and draw nothing; with the room they ask for they are
/// those of `extract`, which finds it by itself. Goes red when `arrange` (`shaders/cull.wgsl`) does not look at the slots.
#[test]
fn more_active_bricks_than_room() {
    let Some(gpu) = common::gpu() else { return };
    let extractor = Extractor::new(gpu.clone()).unwrap();
    let torus = Named::new("torus").unwrap();
    let volume = common::noise(cube(30), 1);
    for (source, iso) in [(Source::Field(&torus, cube(60)), 0.0), (Source::Volume(&volume), 0.0)] {
        let options = Options::new(iso);
        let expected = extractor.extract(&source, &options).unwrap();
        let needed = expected.report.active_bricks as u32;
        let mesh = GpuMesh::with_capacity(gpu, 100_000, 200_000).unwrap();
        for room in [1, needed - 1, needed] {
            let space = extractor.prepare_for(&source, u64::MAX, room).unwrap();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            extractor.encode(&space, &mut encoder, &options, &mesh).unwrap();
            gpu.queue.submit([encoder.finish()]);
            let header = mesh.read_header(gpu).unwrap();
            assert_eq!(header.active_bricks, needed);
            let again = extractor.extract_in(&space, &source, &options, &|_| {});
            if room < needed {
                assert_eq!((header.overflow, header.index_count), (Overflow::Bricks as u32, 0));
                assert!(
                    matches!(again, Err(ExtractError::Slots { needed: n, slots }) if (n, slots) == (needed, room))
                );
            } else {
                assert_eq!(header.overflow, 0);
                assert_eq!(mesh.read(gpu).unwrap(), expected.mesh.read(gpu).unwrap());
                assert_eq!(again.unwrap().report.triangles, expected.report.triangles);
            }
        }
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
