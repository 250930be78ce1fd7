//! Whole extractions: GPU against CPU, cut against uncut, both ways to call.

mod common;

use glam::Vec3;
use isoforge::extract::{Extractor, Options, Source, extract_on_cpu};
use isoforge::field::named::Named;
use isoforge::grid::Grid;

fn cube(n: u32, half: f32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::splat(-half), Vec3::splat(half)).unwrap()
}

#[test]
fn torus() {
    let Some(gpu) = common::gpu() else { return };
    let extractor = Extractor::new(gpu.clone()).unwrap();
    for name in ["torus", "sphere", "gyroid", "cube", "octahedron"] {
        let field = Named::new(name).unwrap();
        let grid = cube(37, field.definition().half_edge);
        let source = Source::Field(&field, grid);
        let options = Options::new(field.definition().iso);
        let on_gpu = extractor.extract(&source, &options).unwrap();
        let (on_cpu, report) = extract_on_cpu(&source, &options, &|_| {}).unwrap();
        let back = on_gpu.mesh.read(gpu).unwrap();
        eprintln!("{name} {:?}\n{report:?}", on_gpu.report);
        assert_eq!(back.triangles.len(), on_cpu.triangles.len());
        assert_eq!(back.triangles, on_cpu.triangles);
        assert!(back.vertices == on_cpu.vertices);
    }
}

#[test]
fn noise() {
    let Some(gpu) = common::gpu() else { return };
    let extractor = Extractor::new(gpu.clone()).unwrap();
    for (i, cells) in [[1, 1, 1], [7, 9, 33], [8, 8, 8], [7, 7, 7], [9, 9, 9], [16, 15, 17], [40, 3, 5]]
        .into_iter()
        .enumerate()
    {
        let grid = Grid::from_bounds(cells, Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)).unwrap();
        let volume = common::noise(grid, i as u64);
        let source = Source::Volume(&volume);
        let options = Options::new(0.0);
        let on_gpu = extractor.extract(&source, &options).unwrap();
        let (on_cpu, report) = extract_on_cpu(&source, &options, &|_| {}).unwrap();
        let back = on_gpu.mesh.read(gpu).unwrap();
        assert_eq!(back.triangles, on_cpu.triangles, "{cells:?}");
        assert!(back.vertices == on_cpu.vertices);
        assert_eq!(report.non_finite, on_gpu.report.non_finite);
    }
}
