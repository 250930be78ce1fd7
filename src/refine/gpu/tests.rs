use super::*;
use crate::extract::{Options, Source, extract_on_cpu};
use crate::field::Sense;
use crate::gpu::{AdapterChoice, Gpu};
use crate::graph::{GraphField, shapes::*};
use crate::grid::Grid;
use crate::refine::refine;
use glam::Vec3;

/// In these tests all buffers are poisoned: nothing is read that was not written. (`tests/refine/gpu.rs` has the others.)
/// Goes red without the `clear_buffer` of `fans` and that of `longest`.
#[test]
fn in_poisoned_buffers() {
    if std::env::var("ISOFORGE_TESTS").is_ok_and(|v| v == "cpu") {
        return;
    }
    let extractor = Extractor::new(Gpu::open(AdapterChoice::Best).unwrap()).unwrap();
    let field =
        GraphField::new(&sphere(1.0).difference(sphere(0.8).translate([0.55, 0.35, 0.4])), Sense::Below);
    let grid = Grid::from_bounds([14; 3], Vec3::splat(-0.9), Vec3::splat(1.2)).unwrap();
    let (mut mesh, _) = extract_on_cpu(&Source::Field(&field, grid), &Options::new(0.0), &|_| {}).unwrap();
    mesh.triangles.push([1, 2, 1]);
    let surface = Surface::new(&field, 0.0, Sense::Below, 1e-3).unwrap();
    let settings = Settings { depth: 3, ..Settings::default().on(&grid) };
    let (wanted, _) = refine(&surface, &mesh, &settings, &|_| {}).unwrap();
    let given = GpuMesh::upload(&extractor.gpu, &mesh).unwrap();
    let (found, _) = extractor.refine(&surface, &given, &settings, &|_| {}).unwrap();
    let found = found.read(&extractor.gpu).unwrap();
    if extractor.gpu.is_software() {
        assert_eq!(found, wanted);
    }
    assert!(found.triangles.iter().flatten().all(|&v| (v as usize) < found.vertices.len()));
}
