//! Settings and meshes that make no sense are named, and nothing panics.

use crate::tools::*;
use glam::Vec3;
use isoforge::field::{Sense, Surface};
use isoforge::graph::shapes::*;
use isoforge::mesh::{Mesh, Vertex};
use isoforge::refine::{RefineError, Settings, refine};

#[test]
fn settings() {
    let ball = graph(&sphere(1.0));
    let s = start(&ball, 0.0, cube(8, 1.5));
    let error = |settings: Settings| refine(&s.surface, &s.mesh, &settings, &|_| {}).unwrap_err();
    for flatness in [-1.0, 1.5, f32::NAN, f32::INFINITY] {
        assert!(matches!(error(Settings { flatness, ..s.settings }), RefineError::Flatness(_)));
    }
    for epsilon in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(error(Settings { epsilon, ..s.settings }), RefineError::Epsilon(_)));
    }
    assert!(matches!(error(Settings { depth: 11, ..s.settings }), RefineError::Depth(11)));
    for border in [[Vec3::ZERO; 2], [Vec3::ZERO, Vec3::NAN], [Vec3::ONE, Vec3::ZERO]] {
        assert!(matches!(error(Settings { border: Some(border), ..s.settings }), RefineError::Border));
    }
    let few = Settings { most_triangles: s.mesh.triangles.len() as u64, flatness: 1.0, ..s.settings };
    assert!(matches!(error(few), RefineError::TooLarge { level: 1, .. }));
    let fewer = Settings { most_triangles: 3, ..s.settings };
    assert!(matches!(error(fewer), RefineError::TooLarge { level: 0, .. }));
    for iso in [f32::NAN, f32::INFINITY] {
        let nowhere = Surface::new(&ball, iso, Sense::Below, 1e-3).unwrap();
        let found = refine(&nowhere, &s.mesh, &s.settings, &|_| {});
        assert!(matches!(found, Err(RefineError::Iso(_))));
    }
    // The extremes that are allowed.
    for settings in [
        Settings { flatness: 1.0, depth: 2, ..s.settings },
        Settings { flatness: (-1.0f32).next_up(), ..s.settings },
        Settings { epsilon: f32::MIN_POSITIVE, ..s.settings },
        Settings { epsilon: f32::MAX, ..s.settings },
        Settings { depth: 0, ..s.settings },
    ] {
        refine(&s.surface, &s.mesh, &settings, &|_| {}).unwrap();
    }
}

#[test]
fn meshes() {
    let ball = graph(&sphere(1.0));
    let s = start(&ball, 0.0, cube(8, 1.5));
    let run = |mesh: &Mesh| refine(&s.surface, mesh, &s.settings, &|_| {});
    let mut bad = s.mesh.clone();
    bad.triangles[5][1] = 1 << 30;
    assert!(matches!(run(&bad), Err(RefineError::BadIndex { triangle: 5, .. })));
    let mut bad = s.mesh.clone();
    bad.vertices[7].position[2] = f32::NAN;
    assert!(matches!(run(&bad), Err(RefineError::NotFinite { vertex: 7 })));
    assert!(run(&Mesh::default()).unwrap().0.triangles.is_empty());

    // Without normals, with triangles that name a vertex twice, with vertices twice at one place, with none in use.
    let mut odd = s.mesh.clone();
    odd.vertices.iter_mut().for_each(|v| v.normal = [0.0; 3]);
    odd.triangles.push([3, 3, 4]);
    odd.vertices.push(odd.vertices[0]);
    odd.triangles[0][0] = odd.vertices.len() as u32 - 1;
    odd.vertices.push(Vertex { position: [9.0; 3], normal: [f32::NAN; 3] });
    let (mesh, report) = run(&odd).unwrap();
    assert_eq!((report.improper, mesh.check().non_finite_vertices), (1, 0));
    // Three triangles at an edge, and two that are the same.
    let mut odd = s.mesh.clone();
    odd.triangles.push(odd.triangles[0]);
    let (mesh, _) = run(&odd).unwrap();
    assert!(mesh.triangles.len() >= odd.triangles.len());
    // Far from any surface, and of a huge size: left where it is.
    let vertex = |p: [f32; 3]| Vertex { position: p, normal: [0.0, 0.0, 1.0] };
    let huge = Mesh {
        vertices: vec![vertex([3e38, 0.0, 0.0]), vertex([0.0, -3e38, 0.0]), vertex([-3e38, 0.0, 3e38])],
        triangles: vec![[0, 1, 2]],
    };
    assert!(run(&huge).unwrap().0.vertices.iter().all(|v| v.at().is_finite()));
}
