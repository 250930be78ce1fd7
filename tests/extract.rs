//! Whole extractions: GPU against CPU, cut against uncut, both ways to call, and what goes wrong.

#[path = "extract/capacity.rs"]
mod capacity;
mod common;
#[path = "extract/cut.rs"]
mod cut;
#[path = "extract/device.rs"]
mod device;
#[path = "extract/differences.rs"]
mod differences;
#[path = "extract/fail.rs"]
mod fail;
#[path = "extract/reuse.rs"]
mod reuse;
#[path = "extract/shared.rs"]
mod shared;
#[path = "extract/singular.rs"]
mod singular;
#[path = "extract/typed.rs"]
mod typed;
#[path = "extract/user.rs"]
mod user;
#[path = "extract/workspace.rs"]
mod workspace;

use glam::{Mat3, Vec3};
use isoforge::extract::{Extraction, Extractor, Options, Source, extract_on_cpu};
use isoforge::field::{Field, NoForm, Points, Sense, Wgsl, named};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;

/// The bytes of a mesh: NaN equals itself, −0 differs from 0.
fn bytes(mesh: &Mesh) -> (&[u8], &[u8]) {
    (bytemuck::cast_slice(&mesh.vertices), bytemuck::cast_slice(&mesh.triangles))
}

fn read(extractor: &Extractor, extraction: &Extraction) -> Mesh {
    extraction.mesh.read(extractor.gpu()).unwrap()
}

fn on_cpu(source: &Source<'_>, options: &Options) -> Mesh {
    extract_on_cpu(source, options, &|_| {}).unwrap().0
}

/// Two runs on the GPU and one on the CPU, and that they agree: bit for bit on a software adapter, and in
/// the triangles' number within the comparison's tolerance else (which the stage tests look into).
fn same_everywhere(name: &str, source: &Source<'_>, options: &Options) {
    let Some(extractor) = common::extractor() else { return };
    let first = extractor.extract(source, options).unwrap();
    let mesh = read(extractor, &first);
    let again = extractor.extract(source, options).unwrap();
    assert!(bytes(&mesh) == bytes(&read(extractor, &again)), "{name}: two runs differ");
    let (twin, report) = extract_on_cpu(source, options, &|_| {}).unwrap();
    let counted = |report: &isoforge::extract::Report| {
        [report.bricks, report.active_bricks, report.non_finite, report.vertices, report.triangles]
    };
    if extractor.gpu().is_software() {
        assert!(bytes(&mesh) == bytes(&twin), "{name}: the backends differ");
        assert_eq!(counted(&first.report), counted(&report), "{name}");
    }
    assert_eq!(first.report.vertices as usize, mesh.vertices.len(), "{name}");
    let header = first.mesh.read_header(extractor.gpu()).unwrap();
    assert_eq!(
        [header.index_count, header.instance_count, header.vertices, header.overflow, header.runaway],
        [3 * mesh.triangles.len() as u32, 1, mesh.vertices.len() as u32, 0, 0],
        "{name}"
    );
    assert_eq!(u64::from(header.non_finite), first.report.non_finite, "{name}");
    assert_eq!(u64::from(header.active_bricks), first.report.active_bricks, "{name}");
}

#[test]
fn fields() {
    for definition in named::ALL {
        for n in [1, 8, 37] {
            let (field, grid) = common::named(definition.name, n);
            let options = Options::new(definition.iso);
            same_everywhere(definition.name, &Source::Field(&field, grid), &options);
        }
    }
}

#[test]
fn volumes() {
    let sizes = [[1, 1, 1], [7, 9, 33], [8, 8, 8], [7, 7, 7], [9, 9, 9], [16, 15, 17], [40, 3, 5]];
    for (i, cells) in sizes.into_iter().enumerate() {
        let grid = Grid::from_bounds(cells, Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)).unwrap();
        let volume = common::noise(grid, i as u64);
        same_everywhere(&format!("noise {cells:?}"), &Source::Volume(&volume), &Options::new(0.0));
    }
    same_everywhere("brain_24", &Source::Volume(&common::small_brain()), &Options::new(10.0));
}

#[test]
fn one_workspace_serves_every_iso_value() {
    let Some(extractor) = common::extractor() else { return };
    let volume = common::small_brain();
    let (torus, grid) = common::named("torus", 19);
    for (source, values) in [
        (Source::Volume(&volume), [10.0, 60.0, -40.0, 10.0, 152.0, 1000.0, 0.0]),
        (Source::Field(&torus, grid), [0.0, 0.3, -0.1, 0.0, 5.0, -9.0, 0.0]),
    ] {
        let space = extractor.prepare(&source, u64::MAX).unwrap();
        for iso in values {
            for sense in [None, Some(Sense::Below), Some(Sense::Above)] {
                let options = Options { sense, ..Options::new(iso) };
                let found = extractor.extract_in(&space, &source, &options, &|_| {}).unwrap();
                let fresh = extractor.extract(&source, &options).unwrap();
                assert!(bytes(&read(extractor, &found)) == bytes(&read(extractor, &fresh)), "iso {iso}");
                assert_eq!(found.report.active_bricks, fresh.report.active_bricks);
                assert_eq!(found.report.non_finite, fresh.report.non_finite);
            }
        }
    }
}

#[test]
fn an_iso_value_that_nothing_crosses_gives_an_empty_mesh() {
    let (sphere, grid) = common::named("sphere", 9);
    let volume = common::small_brain();
    for (source, iso) in [(Source::Field(&sphere, grid), -1.0), (Source::Volume(&volume), f32::MAX)] {
        let options = Options::new(iso);
        assert_eq!(on_cpu(&source, &options), Mesh::default());
        if let Some(extractor) = common::extractor() {
            let found = extractor.extract(&source, &options).unwrap();
            assert_eq!(read(extractor, &found), Mesh::default());
            let header = found.mesh.read_header(extractor.gpu()).unwrap();
            assert_eq!([header.index_count, header.vertices, header.triangles, header.overflow], [0; 4]);
        }
    }
}

/// A ball with holes of NaN and infinities, as a field with both forms.
#[derive(Debug)]
struct Holes;

impl Holes {
    fn value(x: f32, y: f32, z: f32) -> f32 {
        if x > 0.41 && y > 0.1 {
            f32::NAN
        } else if y < -0.52 {
            f32::INFINITY
        } else if z > 0.63 {
            f32::NEG_INFINITY
        } else {
            (x * x + y * y) + z * z
        }
    }
}

impl Field for Holes {
    fn sense(&self) -> Sense {
        Sense::Below
    }
    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        points.map(out, Holes::value);
        Ok(())
    }
    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        // What is not finite comes from parameters: WGSL has no such constants.
        let source = "fn density(p: vec3<f32>) -> f32 {
            let odd = field_parameters[0];
            if p.x > 0.41 && p.y > 0.1 { return odd.x; }
            if p.y < -0.52 { return odd.y; }
            if p.z > 0.63 { return odd.z; }
            return (p.x * p.x + p.y * p.y) + p.z * p.z;
        }";
        let parameters = vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        Ok(Wgsl {
            value: source.into(),
            gradient: None,
            interval: None,
            planes: None,
            data: std::sync::Arc::default(),
            parameters,
            counts_loops: false,
        })
    }
}

#[test]
fn samples_that_are_not_finite_are_outside_and_counted() {
    for cells in [[20, 17, 16], [7, 8, 23], [1, 1, 1]] {
        let grid = Grid::from_bounds(cells, -Vec3::ONE, Vec3::ONE).unwrap();
        let volume = common::sampled(grid, |p| Holes::value(p.x, p.y, p.z));
        let expected = volume.values().iter().filter(|v| !v.is_finite()).count() as u64;
        assert!(expected > 0);
        // What is not finite is outside: as a large number on the outer side is.
        let plain = common::sampled(grid, |p| {
            let v = Holes::value(p.x, p.y, p.z);
            if v.is_finite() { v } else { 1e30 }
        });
        let options = Options { sense: Some(Sense::Below), ..Options::new(0.8) };
        let triangles = on_cpu(&Source::Volume(&plain), &options).triangles;
        for source in [Source::Volume(&volume), Source::Field(&Holes, grid)] {
            let (mesh, report) = extract_on_cpu(&source, &options, &|_| {}).unwrap();
            assert_eq!((report.non_finite, &mesh.triangles), (expected, &triangles), "{cells:?}");
            assert!(mesh.vertices.iter().all(|v| v.at().is_finite()));
            same_everywhere("holes", &source, &options);
            if let Some(extractor) = common::extractor() {
                let found = extractor.extract(&source, &options).unwrap();
                assert_eq!(found.report.non_finite, expected, "{cells:?}");
            }
        }
    }
}

#[test]
fn progress_goes_up_to_one() {
    let (sphere, grid) = common::named("sphere", 40);
    let source = Source::Field(&sphere, grid);
    let told = std::sync::Mutex::new(Vec::new());
    extract_on_cpu(&source, &Options::new(1.0), &|part| told.lock().unwrap().push(part)).unwrap();
    let told = told.into_inner().unwrap();
    assert!(told.iter().all(|part| (0.0..=1.0).contains(part)) && told.contains(&1.0), "{told:?}");
    if let Some(extractor) = common::extractor() {
        let told = std::cell::RefCell::new(Vec::new());
        let space = extractor.prepare(&source, u64::MAX).unwrap();
        let tell = |part| told.borrow_mut().push(part);
        extractor.extract_in(&space, &source, &Options::new(1.0), &tell).unwrap();
        let told = told.into_inner();
        assert!(told.is_sorted() && told.last() == Some(&1.0), "{told:?}");
    }
}

#[test]
fn rotated_and_mirrored_grids() {
    let step = Mat3::from_rotation_y(0.4) * Mat3::from_diagonal(Vec3::new(0.1, -0.13, 0.09));
    let grid = Grid::new([23, 21, 25], Vec3::new(-1.2, 1.3, -1.0), step).unwrap();
    for definition in named::ALL {
        let (field, _) = common::named(definition.name, 1);
        let options = Options::new(definition.iso);
        same_everywhere(definition.name, &Source::Field(&field, grid), &options);
    }
}
