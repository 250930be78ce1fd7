//! Volumes in types of their own: the mesh is, byte for byte, that of the same numbers as `f32`.

use crate::common::{self, Random};
use glam::{Mat3, Vec3};
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::volume::{Scalar, Values, Volume};

fn bits(mesh: &Mesh) -> (&[u32], &[[u32; 3]]) {
    (bytemuck::cast_slice(&mesh.vertices), &mesh.triangles)
}

/// The mesh of a volume is that of its numbers as `f32`, on the CPU and, where `on_gpu`, on the GPU.
#[track_caller]
fn as_f32(name: &str, volume: &Volume, iso: f32, sense: Sense, on_gpu: bool) -> usize {
    let plain = Volume::new(*volume.grid(), volume.values().to_f32()).unwrap();
    let options = Options { sense: Some(sense), ..Options::new(iso) };
    let run = |volume| extract_on_cpu(&Source::Volume(volume), &options, &|_| {}).unwrap();
    let ((mesh, report), (expected, plain_report)) = (run(volume), run(&plain));
    assert!(bits(&mesh) == bits(&expected), "{name} at {iso}, {sense:?}: the meshes differ");
    assert_eq!(report.active_bricks, plain_report.active_bricks, "{name} at {iso}: culled otherwise");
    // With both tables there: while they are made, records take more, for a moment.
    let [typed_peak, plain_peak] = [volume, &plain].map(|volume| run(volume).1.peak_bytes);
    let less = plain_peak - typed_peak;
    assert_eq!(less, plain.bytes() - volume.bytes(), "{name}: the volume's own bytes count");
    if let Some(extractor) = common::extractor().filter(|_| on_gpu) {
        let made = extractor.extract(&Source::Volume(volume), &options).unwrap();
        let mesh = made.mesh.read(common::gpu().unwrap()).unwrap();
        assert!(bits(&mesh) == bits(&expected), "{name} at {iso}, {sense:?}: the GPU's mesh differs");
    }
    mesh.triangles.len()
}

/// Random samples of a type: few values, so that many tie, or all of them, or a few that grow along z, so that culling
/// has something to leave out.
fn random(scalar: Scalar, count: u64, seed: u64) -> Values {
    let mut random = Random(seed);
    let samples = (0..count).map(|i| match seed % 3 {
        0 => random.next() as i64 % 5,
        1 => random.next() as i64,
        _ => {
            random.next() as i64 % 5 + (100 * i / count) as i64
                - if scalar.name().starts_with('i') { 100 } else { 0 }
        }
    });
    match scalar {
        Scalar::U8 => Values::U8(samples.map(|v| v as u8).collect()),
        Scalar::I8 => Values::I8(samples.map(|v| v as i8).collect()),
        Scalar::U16 => Values::U16(samples.map(|v| v as u16).collect()),
        Scalar::I16 => Values::I16(samples.map(|v| v as i16).collect()),
        _ => unreachable!("no type of its own"),
    }
}

/// Goes red when the highest sample of a brick is sought from 0 upwards (`LOWEST` in `volume/values.rs`).
#[test]
fn random_ones_of_odd_sizes() {
    let sizes = [[1, 1, 1], [7, 9, 33], [16, 8, 7], [19, 11, 14], [40, 3, 5], [65, 2, 17], [33, 30, 25]];
    let mut triangles = 0;
    for (i, cells) in sizes.into_iter().enumerate() {
        let step = Mat3::from_diagonal(Vec3::new(0.3, if i % 2 == 0 { 1.0 } else { -1.0 }, 2.7));
        let grid = Grid::new(cells, Vec3::new(-3.0, 0.5, 100.0), step).unwrap();
        for scalar in [Scalar::U8, Scalar::I8, Scalar::U16, Scalar::I16] {
            for seed in 0..3 {
                let volume = Volume::of(grid, random(scalar, grid.point_count(), seed)).unwrap();
                assert_eq!(volume.values().scalar(), scalar);
                assert_eq!(volume.bytes(), grid.point_count() * scalar.size() as u64);
                let (low, high) = volume.finite_range().unwrap();
                // Ties, between samples, beyond all of the type, and at the ends.
                for iso in [1.0, 1.5, -0.5, low, high, (low + high) / 2.0, -1e9, 1e9] {
                    for sense in [Sense::Below, Sense::Above] {
                        let name = format!("{scalar} {cells:?}");
                        let on_gpu = iso == 1.5 && sense == Sense::Above && i % 3 == 0;
                        triangles += as_f32(&name, &volume, iso, sense, on_gpu);
                    }
                }
            }
        }
    }
    assert!(triangles > 1_000_000, "{triangles}");
}

#[test]
fn the_real_ones() {
    let brain = common::small_brain();
    assert_eq!(brain.values().scalar(), Scalar::I16);
    as_f32("the small brain", &brain, 30.0, Sense::Above, true);
    for (name, volume, iso) in common::large_volumes() {
        assert_ne!(volume.values().scalar(), Scalar::F32, "{name}");
        assert!(as_f32(name, &volume, iso, Sense::Above, false) > 0);
        as_f32(name, &volume, iso + 0.25, Sense::Below, false);
    }
}
