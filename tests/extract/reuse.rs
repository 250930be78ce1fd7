//! `CpuExtractor`: the meshes are those of `extract_on_cpu`, in memory that is used again.

use crate::common::{self, noise};
use glam::{Mat3, Vec3};
use isoforge::extract::{CpuExtractor, ExtractError, Options, Source, extract_on_cpu};
use isoforge::field::{Closure, Sense};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::volume::Volume;

/// Calls of all kinds one after another, larger and smaller ones: nothing of the one before is left. Goes red when `Kept::clear`
/// forgets the counts.
#[test]
fn the_same_meshes() {
    let volumes: Vec<Volume> = [[20, 17, 16], [7, 8, 23], [65, 40, 33], [1, 1, 1], [31, 30, 20]]
        .into_iter()
        .enumerate()
        .map(|(i, cells)| noise(Grid::from_bounds(cells, -Vec3::ONE, Vec3::ONE).unwrap(), i as u64))
        .collect();
    let (gyroid, grid) = common::named("gyroid", 30);
    let (steiner, small) = common::named("steiner", 17);
    let mut sources: Vec<Source<'_>> = volumes.iter().map(Source::Volume).collect();
    sources.extend([Source::Field(&gyroid, grid), Source::Field(&steiner, small)]);
    // Nearly all of it is NaN, and in no brick is there surface.
    let odd = common::sampled(grid, |p| if p.x > 0.0 { f32::NAN } else { 1.0 });
    sources.push(Source::Volume(&odd));

    let mut extractor = CpuExtractor::default();
    for round in 0..2 {
        for (i, source) in sources.iter().enumerate() {
            for (iso, sense) in [(0.1, Sense::Above), (1e9, Sense::Above), (-0.2, Sense::Below)] {
                for cull in [true, false] {
                    let options = Options { sense: Some(sense), cull, ..Options::new(iso) };
                    let (mesh, report) = extract_on_cpu(source, &options, &|_| {}).unwrap();
                    let reused = extractor.extract(source, &options, &|_| {}).unwrap();
                    let found = extractor.mesh();
                    assert!(super::bytes(found) == super::bytes(&mesh), "source {i} at {iso}, round {round}");
                    let numbers = |r: &isoforge::extract::Report| {
                        [r.vertices, r.triangles, r.active_bricks, r.non_finite]
                    };
                    assert_eq!(numbers(&reused), numbers(&report), "source {i} at {iso}");
                    // The first extraction of a volume has its records twice for a moment.
                    assert!(reused.peak_bytes <= report.peak_bytes, "source {i} at {iso}");
                }
            }
        }
    }
    let refused = extractor.extract(&sources[0], &Options::new(f32::NAN), &|_| {});
    assert!(matches!(refused, Err(ExtractError::Iso(_))) && extractor.mesh().vertices.is_empty());
    let tight = Options { memory_budget: 100_000, ..Options::new(0.0) };
    let refused = extractor.extract(&sources[2], &tight, &|_| {});
    assert!(matches!(refused, Err(ExtractError::Budget { .. })) && extractor.mesh().triangles.is_empty());
}

/// A volume's first extraction, which classifies a few rows of bricks at a time as it makes the table of ranges, and the second, which
/// reads the table: both have what a field with the same samples gives. Of long rows one is taken at a time, of shorter ones several.
/// Goes red when `range_of` (src/stage/cull/cpu.rs) leaves out `first` in the number that `then` gets, and when it gives its tasks back in another order.
#[test]
fn long_rows_of_volumes() {
    for (cells, sense) in
        [([1000, 40, 9], Sense::Above), ([300, 90, 20], Sense::Below), ([40, 200, 17], Sense::Above)]
    {
        let grid = Grid::new(cells, Vec3::ZERO, Mat3::IDENTITY).unwrap();
        let function = |p: Vec3| (p.x * 0.7).sin() + (p.y * 0.9).cos() + (p.z * 1.3).sin();
        let volume = common::sampled(grid, function);
        let closure = Closure::new(sense, function);
        let options = Options { sense: Some(sense), cull: false, ..Options::new(0.3) };
        let extract = |source| extract_on_cpu(&source, &options, &|_| {}).unwrap().0;
        let [first, second] = [(); 2].map(|()| extract(Source::Volume(&volume)));
        assert!(super::bytes(&first) == super::bytes(&second), "{cells:?}");
        let of_field = extract(Source::Field(&closure, grid));
        let positions = |mesh: &Mesh| mesh.vertices.iter().map(|v| v.position).collect::<Vec<_>>();
        assert!(first.triangles.len() > 50_000, "{}", first.triangles.len());
        assert!(first.triangles == of_field.triangles, "{cells:?}");
        assert!(positions(&first) == positions(&of_field), "{cells:?}");
    }
}

/// Goes red when `resize` makes new memory each time.
#[test]
fn the_same_memory() {
    let (gyroid, grid) = common::named("gyroid", 60);
    let volume = common::sampled(grid, |p| (p.x * 5.0).sin() + (p.y * 4.0).cos() + p.z);
    for source in [Source::Volume(&volume), Source::Field(&gyroid, grid)] {
        let mut extractor = CpuExtractor::default();
        let mut places = |iso| {
            extractor.extract(&source, &Options::new(iso), &|_| {}).unwrap();
            let mesh = extractor.mesh();
            assert!(mesh.triangles.len() > 1000);
            (
                mesh.vertices.as_ptr(),
                mesh.triangles.as_ptr(),
                mesh.vertices.capacity(),
                mesh.triangles.capacity(),
            )
        };
        let isos = [0.05, 0.0, 0.1, -0.1];
        // Whichever is the largest, it was there once.
        let first = isos.map(&mut places)[3];
        for iso in isos {
            assert_eq!(places(iso), first, "at {iso}");
        }
    }
}
