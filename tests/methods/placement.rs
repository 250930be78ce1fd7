//! Where vertices lie on their edges.

use crate::{bytes, common, on_cpu, on_gpu, options};
use glam::Vec3;
use isoforge::extract::{ExtractError, Method, Options, Placement, Source, extract_on_cpu};
use isoforge::field::{Field, Points};
use isoforge::mesh::Mesh;

fn meshes(source: &Source<'_>, options: &Options) -> Mesh {
    let mesh = on_cpu(source, options);
    if let Some(extractor) = common::extractor() {
        let other = on_gpu(extractor, source, options);
        assert_eq!(mesh.triangles, other.triangles, "{options:?}");
        assert!(!extractor.gpu().is_software() || bytes(&mesh) == bytes(&other), "{options:?}");
    }
    mesh
}

fn value(field: &dyn Field, p: Vec3) -> f32 {
    let mut out = [0.0];
    field.values(Points { x: &[p.x], y: &[p.y], z: &[p.z] }, &mut out).unwrap();
    out[0]
}

/// Along the edge of each vertex the field changes sides within ε of it. Vertices within cells lie on no edge.
///
/// Goes red when `fraction` (shaders/place/snapped.wgsl) looks the other way, and when `take` (src/stage/emit/cpu/snap.rs) does.
#[test]
fn snapped_vertices_lie_on_the_surface() {
    // Bent strongly within a cell, so that the samples alone place vertices badly; with kinks.
    for (name, n, iso) in
        [("gyroid", 16, 0.3), ("torus", 13, 0.1), ("cube", 9, 0.05), ("octahedron", 15, 0.1)]
    {
        let (field, grid) = common::named(name, n);
        let source = Source::Field(&field, grid);
        let to_steps = grid.step().inverse();
        for options in options(iso) {
            let plain = meshes(&source, &options);
            for epsilon in [1e-2, 1e-4, 1e-30] {
                let mesh = meshes(&source, &Options { placement: Placement::Snapped { epsilon }, ..options });
                assert_eq!(mesh.triangles, plain.triangles);
                let mut worst: f32 = 0.0;
                for vertex in &mesh.vertices {
                    let q = to_steps * (vertex.at() - grid.origin());
                    let off = (q - q.round()).abs();
                    let along = off.max_element();
                    // The axes along which it lies between points: all at the same fraction.
                    let way: Vec3 =
                        (0..3).map(|k| if off[k] > 1e-4 { Vec3::AXES[k] } else { Vec3::ZERO }).sum();
                    let part = (q - q.floor()) * way;
                    let is_on_edge = part.max_element()
                        - part.to_array().into_iter().filter(|v| *v > 0.0).fold(1.0, f32::min)
                        < 1e-3;
                    if !(1e-3..0.499).contains(&along) || !is_on_edge {
                        continue;
                    }
                    // What `f32` tells of a place on the grid, at least.
                    let reach = epsilon.max(4e-6);
                    let step = grid.step() * way;
                    let (a, b) =
                        (vertex.at() - step.normalize() * reach, vertex.at() + step.normalize() * reach);
                    let sides = [value(&field, a) < iso, value(&field, b) < iso];
                    if sides[0] == sides[1] {
                        worst = worst.max((value(&field, vertex.at()) - iso).abs());
                    }
                }
                assert!(worst < 2e-6, "{name}, {:?}, {epsilon}: {worst}", options.method);
            }
        }
    }
}

#[test]
fn the_middle_and_what_is_refused() {
    let (torus, grid) = common::named("torus", 12);
    let source = Source::Field(&torus, grid);
    for options in options(0.0) {
        let mesh = meshes(&source, &Options { placement: Placement::Midpoint, ..options });
        if options.method == Method::MarchingCubes {
            for vertex in &mesh.vertices {
                let q = (grid.step().inverse() * (vertex.at() - grid.origin())) * 2.0;
                assert!((q - q.round()).abs().max_element() < 1e-4, "{q}");
            }
        }
        assert!(mesh.check().is_closed_manifold(), "{:?}: {}", options.method, mesh.check());
        for epsilon in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let options = Options { placement: Placement::Snapped { epsilon }, ..options };
            assert!(matches!(extract_on_cpu(&source, &options, &|_| {}), Err(ExtractError::Epsilon(_))));
        }
    }
    // A volume has nothing finer than its interpolant.
    let volume = common::small_brain();
    let source = Source::Volume(&volume);
    let snapped = Options { placement: Placement::Snapped { epsilon: 1e-4 }, ..Options::new(30.0) };
    assert!(bytes(&meshes(&source, &snapped)) == bytes(&meshes(&source, &Options::new(30.0))));
}
