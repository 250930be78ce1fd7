//! What cannot be done is an error: no panic, no hang, no allocation beforehand.

use super::{bytes, on_cpu, read};
use crate::common;
use glam::{Mat3, Vec3};
use isoforge::extract::{ExtractError, Extractor, Options, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::gpu::{GpuError, GpuMesh};
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::{Grid, GridError, MAX_CELLS};
use isoforge::stage::classify::BrickRecord;

fn grid(cells: [u32; 3]) -> Grid {
    Grid::new(cells, Vec3::ZERO, Mat3::IDENTITY).unwrap()
}

#[test]
fn the_default_limits_of_webgpu_are_enough() {
    let Some(gpu) = common::own_device(|_| wgpu::Limits::default()) else { return };
    let extractor = Extractor::new(gpu).unwrap();
    let (torus, grid) = common::named("torus", 30);
    let volume = common::small_brain();
    for (source, iso) in [(Source::Field(&torus, grid), 0.0), (Source::Volume(&volume), 10.0)] {
        let options = Options::new(iso);
        let found = read(&extractor, &extractor.extract(&source, &options).unwrap());
        let twin = on_cpu(&source, &options);
        assert_eq!(found.triangles, twin.triangles);
        assert!(!extractor.gpu().is_software() || bytes(&found) == bytes(&twin));
    }
}

/// Goes red when `Grid::new` looks at the nearest corner alone.
#[test]
fn grids_whose_points_are_one() {
    let far = |origin, step: Vec3| Grid::new([8; 3], origin, Mat3::from_diagonal(step));
    for (axis, origin, step) in [
        ('x', Vec3::splat(1e9), Vec3::ONE),
        ('y', Vec3::new(0.0, -1e9, 0.0), Vec3::ONE),
        ('z', Vec3::new(0.0, 0.0, 3.9999998), Vec3::new(1.0, 1.0, 2e-7)),
    ] {
        assert_eq!(far(origin, step), Err(GridError::TooFar { axis }));
    }
    // A map's metres, and a step that is lost on one of the world's axes alone.
    assert!(far(Vec3::new(5e5, 5.5e6, 0.0), Vec3::ONE).is_ok());
    let leaning = Mat3::from_cols(Vec3::new(1e-9, 1.0, 0.0), Vec3::X, Vec3::Z);
    assert!(Grid::new([8; 3], Vec3::splat(10.0), leaning).is_ok());
}

/// Where the difference of an edge's ends overflows the vertex lies between them all the same.
///
/// Goes red when `crossing` leaves the halves out (src/stage/emit/cpu/crossings.rs, shaders/emit.wgsl), and when `cross` there does not
/// take it for a rare case.
#[test]
fn between_the_largest_numbers() {
    let mut values = vec![-f32::MAX; 8];
    values[0] = f32::MAX;
    let volume = isoforge::volume::Volume::new(grid([1; 3]), values).unwrap();
    let source = Source::Volume(&volume);
    for (iso, place) in [(0.0, 0.5), (f32::MAX / 2.0, 0.25), (-f32::MAX / 2.0, 0.75)] {
        let mesh = on_cpu(&source, &Options::new(iso));
        let found: Vec<Vec3> = mesh.vertices.iter().map(|v| v.at()).collect();
        assert_eq!(found, [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * place));
        if let Some(extractor) = common::extractor() {
            let other = read(extractor, &extractor.extract(&source, &Options::new(iso)).unwrap());
            assert!(!extractor.gpu().is_software() || bytes(&mesh) == bytes(&other));
        }
    }
}

#[test]
fn huge_grids() {
    let sphere = common::named("sphere", 1).0;
    assert!(matches!(
        Grid::new([MAX_CELLS + 1, 1, 1], Vec3::ZERO, Mat3::IDENTITY),
        Err(GridError::Cells { axis: 'x', .. })
    ));
    // So many bricks that 32 bits do not count them.
    for cells in [[MAX_CELLS; 3], [MAX_CELLS, 1, MAX_CELLS], [MAX_CELLS, MAX_CELLS, 1]] {
        let source = Source::Field(&sphere, grid(cells));
        let options = Options { memory_budget: 1 << 30, ..Options::new(1.0) };
        let found = extract_on_cpu(&source, &options, &|_| {});
        assert!(matches!(found, Err(ExtractError::TooManyBricks { .. })), "{cells:?}");
        if let Some(extractor) = common::extractor() {
            let found = extractor.extract(&source, &options);
            assert!(matches!(found, Err(ExtractError::TooManyBricks { .. })), "{cells:?}");
        }
    }
    // So many that they are counted, but fit nowhere.
    for cells in [[MAX_CELLS, 1 << 15, 1], [1, MAX_CELLS, 1 << 15], [1 << 15, 1, MAX_CELLS], [4095; 3]] {
        let source = Source::Field(&sphere, grid(cells));
        let options = Options { memory_budget: 1 << 20, ..Options::new(1.0) };
        // Culled, they take what their surface takes.
        let found = extract_on_cpu(&source, &Options { cull: false, ..options }, &|_| {});
        assert!(matches!(found, Err(ExtractError::Budget { .. })), "{cells:?}");
        if let Some(extractor) = common::extractor() {
            let found = extractor.extract(&source, &options);
            assert!(matches!(found, Err(ExtractError::Budget { .. })), "{cells:?}: {found:?}");
        }
    }
    // A device that does not bind even the least slab, however much memory there is.
    let limits = |all| wgpu::Limits { max_storage_buffer_binding_size: 64 << 10, ..all };
    if let Some(gpu) = common::own_device(limits) {
        let grid = grid([MAX_CELLS, 1 << 15, 1]);
        let found = Extractor::new(gpu).unwrap().extract(&Source::Field(&sphere, grid), &Options::new(1.0));
        assert!(matches!(found, Err(ExtractError::Binding { .. })), "{found:?}");
    }
}

#[test]
fn too_small_a_budget() {
    let (sphere, grid) = common::named("sphere", 40);
    let volume = common::small_brain();
    for source in [Source::Field(&sphere, grid), Source::Volume(&volume)] {
        for memory_budget in [0, 1, 1000, 5000] {
            let options = Options { memory_budget, ..Options::new(1.0) };
            let is_budget = |found: Result<(), ExtractError>| match found {
                Err(ExtractError::Budget { needed, budget, .. }) => {
                    needed > budget && budget == memory_budget
                }
                _ => false,
            };
            assert!(is_budget(extract_on_cpu(&source, &options, &|_| {}).map(|_| ())), "{memory_budget}");
            if let Some(extractor) = common::extractor() {
                assert!(is_budget(extractor.extract(&source, &options).map(|_| ())), "{memory_budget}");
                assert!(is_budget(extractor.prepare(&source, memory_budget).map(|_| ())), "{memory_budget}");
            }
        }
        // Enough for everything but the mesh.
        let mut report = extract_on_cpu(&source, &Options::new(1.0), &|_| {}).unwrap().1;
        if let Source::Volume(_) = source {
            // Of so few triangles that its records are made in place, where they do not fit twice.
            let options = Options { memory_budget: report.peak_bytes - 1, ..Options::new(1.0) };
            report = extract_on_cpu(&source, &options, &|_| {}).unwrap().1;
            assert!(report.peak_bytes < options.memory_budget);
        }
        let options = Options { memory_budget: report.peak_bytes - 1, ..Options::new(1.0) };
        let found = extract_on_cpu(&source, &options, &|_| {});
        assert!(matches!(found, Err(ExtractError::Budget { needed, .. }) if needed == report.peak_bytes));
        let options = Options { memory_budget: report.peak_bytes, ..Options::new(1.0) };
        assert!(extract_on_cpu(&source, &options, &|_| {}).is_ok());
    }
}

/// Of bricks with few triangles the records take the most while they are gathered: twice. Goes red when `peak_bytes` leaves that out, and when
/// the budget does.
#[test]
fn records_count_twice_while_they_are_gathered() {
    let wave = |axis: Expr| ((axis - 4.0) * std::f64::consts::FRAC_PI_4).cos();
    let field = GraphField::new(&(wave(x()) + wave(y()) + wave(z())), Sense::Above);
    let grid = Grid::from_bounds([64; 3], Vec3::ZERO, Vec3::splat(64.0)).unwrap();
    let wave = |at: f32| ((at - 4.0) * std::f32::consts::FRAC_PI_4).cos();
    let volume = common::sampled(grid, |p| p.to_array().map(wave).iter().sum());
    let run = |source: &Source<'_>, memory_budget| {
        extract_on_cpu(source, &Options { memory_budget, ..Options::new(2.9) }, &|_| {})
    };
    let source = Source::Field(&field, grid);
    let (mesh, report) = run(&source, u64::MAX).unwrap();
    // A point of each of 8³ bricks.
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (6 * 512, 8 * 512));
    let record = size_of::<BrickRecord>() as u64;
    assert!(report.peak_bytes > 2 * 512 * record, "{}", report.peak_bytes);
    assert!(run(&source, report.peak_bytes).is_ok());
    assert!(matches!(run(&source, report.peak_bytes - 1), Err(ExtractError::Budget { .. })));
    // A volume's are made in place where they do not fit twice.
    let source = Source::Volume(&volume);
    let (mesh, report) = run(&source, u64::MAX).unwrap();
    let (in_place, less) = run(&source, report.peak_bytes - 1).unwrap();
    assert!(mesh == in_place && less.peak_bytes < report.peak_bytes, "{less:?}");
    let held = volume.values().bytes().len() as u64;
    assert!(report.peak_bytes > held + 2 * 512 * record, "{report:?}");
}

#[test]
fn iso_values_that_are_not_finite() {
    let (sphere, grid) = common::named("sphere", 8);
    let source = Source::Field(&sphere, grid);
    for iso in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let options = Options::new(iso);
        assert!(matches!(extract_on_cpu(&source, &options, &|_| {}), Err(ExtractError::Iso(_))));
        if let Some(extractor) = common::extractor() {
            assert!(matches!(extractor.extract(&source, &options), Err(ExtractError::Iso(_))));
        }
    }
}

/// A mesh that fits slab by slab but is longer than one buffer of the device.
#[test]
fn meshes_longer_than_a_buffer() {
    let limits =
        |all| wgpu::Limits { max_storage_buffer_binding_size: 1 << 20, max_buffer_size: 1 << 20, ..all };
    let Some(gpu) = common::own_device(limits) else { return };
    let extractor = Extractor::new(gpu).unwrap();
    let (gyroid, _) = common::named("gyroid", 1);
    let grid = Grid::from_bounds([40, 40, 90], Vec3::ZERO, Vec3::new(4.0, 4.0, 9.0)).unwrap();
    let found = extractor.extract(&Source::Field(&gyroid, grid), &Options::new(0.0));
    let Err(ExtractError::MeshBuffer { needed, limit, .. }) = found else { panic!("{found:?}") };
    assert!(needed > limit && limit <= 1 << 20);
    // The same asked of the buffers themselves.
    let found = GpuMesh::with_capacity(extractor.gpu(), 50_000, 10).map(|_| ());
    assert!(matches!(found, Err(GpuError::OutOfMemory { bytes, .. }) if bytes > limit), "{found:?}");
}

fn is_lost<T>(found: Result<T, ExtractError>) -> bool {
    match found {
        Err(ExtractError::Gpu(GpuError::Lost(_))) => true,
        Err(error) => panic!("{error:?}"),
        Ok(_) => false,
    }
}

#[test]
fn a_lost_device_is_said_to_be_lost() {
    let (torus, grid) = common::named("torus", 12);
    let volume = common::small_brain();
    for (source, iso) in [(Source::Field(&torus, grid), 0.0), (Source::Volume(&volume), 10.0)] {
        let options = Options::new(iso);
        let Some(gpu) = common::own_device(|all| all) else { return };
        let extractor = Extractor::new(gpu.clone()).unwrap();
        let space = extractor.prepare(&source, u64::MAX).unwrap();
        let found = extractor.extract_in(&space, &source, &options, &|_| {}).unwrap();
        let mesh = GpuMesh::with_capacity(&gpu, 10_000, 20_000).unwrap();
        gpu.device.destroy();
        assert!(is_lost(extractor.extract_in(&space, &source, &options, &|_| {})));
        assert!(is_lost(extractor.extract(&source, &options)));
        assert!(is_lost(extractor.prepare(&source, u64::MAX)));
        assert!(matches!(found.mesh.read(&gpu), Err(GpuError::Lost(_))));
        assert!(is_lost(Extractor::new(gpu.clone())));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        assert!(is_lost(extractor.encode(&space, &mut encoder, &options, &mesh)));
    }
    // Nobody has waited since: recording alone finds out, too.
    if let Some(gpu) = common::own_device(|all| all) {
        let extractor = Extractor::new(gpu.clone()).unwrap();
        let space = extractor.prepare(&Source::Field(&torus, grid), u64::MAX).unwrap();
        let mesh = GpuMesh::with_capacity(&gpu, 10_000, 20_000).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        gpu.device.destroy();
        assert!(is_lost(extractor.encode(&space, &mut encoder, &Options::new(0.0), &mesh)));
    }
    // Lost while nobody looks, between preparing and the first call.
    let source = Source::Field(&torus, grid);
    let Some(gpu) = common::own_device(|all| all) else { return };
    let extractor = Extractor::new(gpu.clone()).unwrap();
    gpu.device.destroy();
    assert!(is_lost(extractor.extract(&source, &Options::new(0.0))));
}

/// A closure is extracted on the CPU, and on a GPU once there is WGSL for it.
#[test]
fn a_closure_without_wgsl_stays_on_the_cpu() {
    use isoforge::field::user::UserField;
    use isoforge::field::{Closure, Sense};
    let grid = Grid::from_bounds([20; 3], Vec3::NEG_ONE, Vec3::ONE).unwrap();
    let closure = Closure::new(Sense::Below, |p: Vec3| p.x * p.x + p.y * p.y + p.z * p.z);
    let options = Options::new(0.5);
    let (mesh, _) = extract_on_cpu(&Source::Field(&closure, grid), &options, &|_| {}).unwrap();
    assert_eq!((mesh.check().boundary_edges, mesh.check().genus), (0, Some(0)));
    let Some(extractor) = common::extractor() else { return };
    let error = extractor.extract(&Source::Field(&closure, grid), &options).unwrap_err();
    assert!(error.to_string().contains("on the CPU"), "{error}");
    let text = "fn density(p: vec3<f32>) -> f32 { return dot(p, p); }";
    let both = closure.with_wgsl(UserField::new(text, "ball", Sense::Below).unwrap());
    let gpu = extractor.extract(&Source::Field(&both, grid), &options).unwrap();
    assert_eq!(gpu.report.triangles as usize, mesh.triangles.len());
}
