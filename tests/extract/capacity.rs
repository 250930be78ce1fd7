//! `encode` into the caller's encoder, with buffers that are long enough or not.
//!
//! Goes red when `totals` or either emit kernel (`shaders/emit.wgsl`) is off by one item about the capacity.

use super::{bytes, read};
use crate::common;
use glam::Vec3;
use isoforge::extract::{ExtractError, Extractor, Options, Source};
use isoforge::gpu::{GpuMesh, MeshHeader, Overflow};
use isoforge::mesh::{Mesh, Vertex};

const SENTINEL: u8 = 0xa5;

/// Encodes into buffers full of sentinels; gives the header and all bytes of the buffers.
fn encode(
    extractor: &Extractor,
    source: &Source<'_>,
    iso: f32,
    capacity: [u32; 2],
) -> (MeshHeader, Vec<u8>, Vec<u8>, GpuMesh) {
    let gpu = extractor.gpu();
    let space = extractor.prepare(source, u64::MAX).unwrap();
    let mesh = GpuMesh::with_capacity(gpu, capacity[0], capacity[1]).unwrap();
    for buffer in [&mesh.vertices, &mesh.indices, &mesh.header] {
        gpu.queue.write_buffer(buffer, 0, &vec![SENTINEL; buffer.size() as usize]);
    }
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    extractor.encode(&space, &mut encoder, &Options::new(iso), &mesh).unwrap();
    gpu.queue.submit([encoder.finish()]);
    let header = mesh.read_header(gpu).unwrap();
    let vertices = gpu.read(&mesh.vertices, mesh.vertices.size()).unwrap();
    let indices = gpu.read(&mesh.indices, mesh.indices.size()).unwrap();
    (header, vertices, indices, mesh)
}

fn check(extractor: &Extractor, source: &Source<'_>, iso: f32) {
    let expected = extractor.extract(source, &Options::new(iso)).unwrap();
    let mesh = read(extractor, &expected);
    let exact = [mesh.vertices.len() as u32, mesh.triangles.len() as u32];
    let [v, t] = exact;
    assert!(v > 64 && t > 64);
    let short = [[v - 1, t], [v, t - 1], [v / 2, t / 3], [0, t], [v, 0], [0, 0], [1, 1]];
    for capacity in short.into_iter().chain([exact, [v + 100, t + 1], [2 * v, 3 * t]]) {
        let (header, vertices, indices, on_gpu) = encode(extractor, source, iso, capacity);
        let missing = [capacity[0] < v, capacity[1] < t];
        let flags = [Overflow::Vertices, Overflow::Triangles]
            .iter()
            .zip(missing)
            .map(|(flag, is)| if is { *flag as u32 } else { 0 })
            .sum::<u32>();
        let complete = flags == 0;
        let wanted = MeshHeader {
            index_count: if complete { 3 * t } else { 0 },
            instance_count: 1,
            vertices: v,
            triangles: t,
            active_bricks: expected.report.active_bricks as u32,
            overflow: flags,
            non_finite: expected.report.non_finite as u32,
            ..MeshHeader::default()
        };
        assert_eq!(header, wanted, "{capacity:?} of {exact:?}");
        // What there is room for is the mesh, and behind it nothing was touched.
        let (expected_vertices, expected_indices) = bytes(&mesh);
        let filled = capacity[0].min(v) as usize * size_of::<Vertex>();
        if complete {
            assert!(vertices[..filled] == expected_vertices[..filled], "{capacity:?} of {exact:?}");
        }
        // Normals of singular vertices need all triangles.
        let written: &[Vertex] = bytemuck::cast_slice(&vertices[..filled]);
        for (found, expected) in written.iter().zip(&mesh.vertices) {
            let length = Vec3::from(found.normal).length();
            assert!(found.position == expected.position && (length - 1.0).abs() < 1e-5, "{found:?}");
        }
        assert!(vertices[filled..].iter().all(|b| *b == SENTINEL), "{capacity:?} of {exact:?}: vertices");
        let filled = capacity[1].min(t) as usize * 12;
        assert!(indices[..filled] == expected_indices[..filled], "{capacity:?} of {exact:?}");
        assert!(indices[filled..].iter().all(|b| *b == SENTINEL), "{capacity:?} of {exact:?}: indices");
        let back = on_gpu.read(extractor.gpu()).unwrap();
        assert!(if complete { bytes(&back) == bytes(&mesh) } else { back == Mesh::default() });
    }
}

#[test]
fn fields_and_volumes() {
    let Some(extractor) = common::extractor() else { return };
    let (torus, grid) = common::named("torus", 23);
    check(extractor, &Source::Field(&torus, grid), 0.0);
    check(extractor, &Source::Volume(&common::small_brain()), 35.0);
    check(extractor, &Source::Volume(&common::noise(grid, 1)), 0.0);
}

/// Settings are those of the call, not of the last call before the submission.
#[test]
fn several_in_one_encoder() {
    let Some(extractor) = common::extractor() else { return };
    let gpu = extractor.gpu();
    let volume = common::small_brain();
    let source = Source::Volume(&volume);
    let space = extractor.prepare(&source, u64::MAX).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let meshes: Vec<_> = [10.0, 60.0, 35.0]
        .map(|iso| {
            let mesh = GpuMesh::with_capacity(gpu, 40_000, 80_000).unwrap();
            extractor.encode(&space, &mut encoder, &Options::new(iso), &mesh).unwrap();
            (iso, mesh)
        })
        .into();
    gpu.queue.submit([encoder.finish()]);
    for (iso, mesh) in meshes {
        let alone = extractor.extract(&source, &Options::new(iso)).unwrap();
        let (mesh, alone) = (mesh.read(gpu).unwrap(), read(extractor, &alone));
        assert!(!mesh.triangles.is_empty() && bytes(&mesh) == bytes(&alone), "iso {iso}");
    }
}

#[test]
fn refusals() {
    let Some(extractor) = common::extractor() else { return };
    let gpu = extractor.gpu();
    let volume = common::small_brain();
    let source = Source::Volume(&volume);
    let mesh = GpuMesh::with_capacity(gpu, 10, 10).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let space = extractor.prepare(&source, u64::MAX).unwrap();
    let found = extractor.encode(&space, &mut encoder, &Options::new(f32::NAN), &mesh);
    assert!(matches!(found, Err(ExtractError::Iso(_))));
    let need = space.plan().bytes;
    let space = extractor.prepare(&source, need).unwrap();
    assert!(space.plan().slab_count() > 1, "half of the budget is the mesh's");
    let found = extractor.encode(&space, &mut encoder, &Options::new(10.0), &mesh);
    assert!(matches!(found, Err(ExtractError::Slabs { slabs }) if slabs > 1));
}

/// Buffers longer than the device binds cannot be written: said at once, not by a mesh that never comes.
#[test]
fn capacities_beyond_what_the_device_binds() {
    let limits = |all| wgpu::Limits { max_storage_buffer_binding_size: 256 << 10, ..all };
    let Some(gpu) = common::own_device(limits) else { return };
    let extractor = Extractor::new(gpu.clone()).unwrap();
    let (torus, grid) = common::named("torus", 10);
    let space = extractor.prepare(&Source::Field(&torus, grid), u64::MAX).unwrap();
    for capacity in [[20_000, 10], [10, 40_000]] {
        let mesh = GpuMesh::with_capacity(&gpu, capacity[0], capacity[1]).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let found = extractor.encode(&space, &mut encoder, &Options::new(0.0), &mesh);
        assert!(matches!(found, Err(ExtractError::MeshBuffer { .. })), "{found:?}");
    }
}
