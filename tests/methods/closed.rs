//! Closed, manifold by edge and by vertex, consistently wound, with each method: noise, what is not finite, ties, labels, plateaus.

use crate::common::{self, Random};
use crate::{on_cpu, on_gpu, options};
use glam::{Mat3, Vec3};
use isoforge::extract::{Method, Options, Source};
use isoforge::field::named::Named;
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::volume::Volume;

/// The mesh of each backend that there is.
fn meshes(source: &Source<'_>, options: &Options) -> Vec<Mesh> {
    let gpu = common::extractor().map(|extractor| on_gpu(extractor, source, options));
    std::iter::once(on_cpu(source, options)).chain(gpu).collect()
}

/// A volume whose outermost samples are outside.
fn padded(cells: [u32; 3], mut value: impl FnMut([u64; 3]) -> f32, outside: f32) -> Volume {
    let grid = Grid::new(cells, Vec3::ZERO, Mat3::from_diagonal(Vec3::new(0.5, 1.0, 0.8))).unwrap();
    let n = grid.points().to_array().map(u64::from);
    let values = (0..grid.point_count()).map(|i| {
        let at = [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
        let value = value(at);
        let is_border = (0..3).any(|axis| at[axis] == 0 || at[axis] + 1 == n[axis]);
        if is_border { outside } else { value }
    });
    Volume::new(grid, values.collect()).unwrap()
}

fn assert_sound(mesh: &Mesh, name: &str) {
    let report = mesh.check();
    assert!(report.is_closed_manifold(), "{name}: {report}");
    let wrong =
        [report.misoriented_edges, report.bad_indices, report.non_finite_vertices, report.unused_vertices];
    assert_eq!(wrong, [0; 4], "{name}: {report}");
    assert!(report.volume > 0.0, "{name}: {report}");
}

#[test]
fn whatever_the_samples() {
    let mut random = Random(5);
    let mut volumes = Vec::new();
    for cells in [[9, 9, 9], [23, 17, 9], [8, 16, 31]] {
        volumes.push(("noise", padded(cells, |_| random.unit() - 0.4, -1.0), 0.0));
        let odd = |random: &mut Random| match random.next() % 12 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            _ => random.unit() - 0.4,
        };
        volumes.push(("not finite", padded(cells, |_| odd(&mut random), f32::NAN), 0.0));
        // Near each other, so that many faces and bodies are undecided by the corners.
        let near = |[x, y, z]: [u64; 3]| if (x + y + z).is_multiple_of(2) { 1.0 } else { -1.0 };
        volumes.push(("checkers", padded(cells, |at| near(at) * (0.9 + 0.1 * random.unit()), -1.0), 0.0));
        // So small that their differences are not normal numbers.
        volumes.push(("tiny", padded(cells, |_| (random.unit() - 0.4) * 1e-38, -1e-38), 0.0));
        volumes.push(("huge", padded(cells, |_| (random.unit() - 0.4) * 3e38, -3e38), 1e37));
    }
    for (name, volume, iso) in volumes {
        for options in options(iso) {
            for mesh in meshes(&Source::Volume(&volume), &options) {
                assert_sound(&mesh, &format!("{name}, {options:?}"));
            }
        }
    }
}

/// Samples equal to iso: integers, labels, plateaus. Zero-area triangles are gone when asked for, and the mesh is still closed.
#[test]
fn ties_too() {
    let mut random = Random(9);
    let mut volumes = Vec::new();
    for cells in [[9, 9, 9], [17, 16, 9]] {
        volumes.push(("integers", padded(cells, |_| (random.next() % 4) as f32, 0.0), vec![0.0, 1.0, 2.0]));
        // Regions of labels, as a segmentation has them.
        let label = |[x, y, z]: [u64; 3]| ((x / 3 * 7 + y / 4 * 5 + z / 3 * 11) % 30) as f32;
        volumes.push(("labels", padded(cells, label, 0.0), vec![0.5, 7.0, 14.0, 28.0]));
        let plateau = |[x, y, z]: [u64; 3]| if x > 3 && y > 2 && z < 6 { 100.0 } else { 40.0 };
        volumes.push(("plateaus", padded(cells, plateau, 0.0), vec![40.0, 99.0]));
        volumes.push(("bytes", padded(cells, |_| (random.next() % 256) as f32, 0.0), vec![100.0, 100.5]));
    }
    let mut removed = 0;
    for (name, volume, isos) in volumes {
        for options in isos.iter().flat_map(|&iso| options(iso)) {
            for mut mesh in meshes(&Source::Volume(&volume), &options) {
                let name = format!("{name}, {options:?}");
                assert_sound(&mesh, &name);
                let before = mesh.check();
                mesh.remove_degenerate();
                let after = mesh.check();
                assert_eq!(after.degenerate_triangles, 0, "{name}: {after}");
                assert_eq!(
                    [after.boundary_edges, after.non_manifold_edges, after.misoriented_edges],
                    [0; 3],
                    "{name}: {after}"
                );
                assert!((after.volume - before.volume).abs() < 1e-6 * before.volume, "{name}");
                removed += before.degenerate_triangles;
            }
        }
    }
    assert!(removed > 1000, "{removed}");
}

/// Diagonal edges have vertices on one line, of which a flip makes two at one place on the gyroid.
#[test]
fn nothing_thin_is_left() {
    let field = Named::new("gyroid").unwrap();
    for cells in [20, 33, 48] {
        let grid = Grid::from_bounds([cells; 3], Vec3::NEG_ONE, Vec3::ONE).unwrap();
        for method in Method::ALL {
            let options = Options { method, ..Options::new(0.0) };
            let mut mesh = on_cpu(&Source::Field(&field, grid), &options);
            let before = mesh.check();
            mesh.remove_degenerate();
            let after = mesh.check();
            assert_eq!(
                [after.degenerate_triangles, after.non_manifold_edges, after.misoriented_edges],
                [0; 3],
                "{cells}, {method:?}: {after}"
            );
            assert!((after.area - before.area).abs() < 1e-9 * before.area, "{cells}, {method:?}");
        }
    }
}
