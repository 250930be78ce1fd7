//! Every named field shows something as `isoforge extract NAME` does.

use crate::common;
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::named;

/// Surfaces without an end in their box; the others end in its faces alone.
const CLOSED: [&str; 10] = [
    "sphere",
    "octahedron",
    "cube",
    "torus",
    "quadric",
    "ellipsoid",
    "steiner",
    "boy",
    "superellipsoid",
    "supertorus",
];

/// Goes red when a box is too small for its surface, and when a closed one is inside out.
#[test]
fn of_every_named_field() {
    for definition in named::ALL {
        let name = definition.name;
        let (field, grid) = common::named(name, 64);
        let options = Options::new(definition.iso);
        let (mesh, _) = extract_on_cpu(&Source::Field(&field, grid), &options, &|_| {}).unwrap();
        let report = mesh.check();
        assert!(report.triangles > 1000, "{name}: {report}");
        assert_eq!((report.misoriented_edges, report.non_manifold_edges), (0, 0), "{name}: {report}");
        assert_eq!(CLOSED.contains(&name), report.boundary_edges == 0, "{name}: {report}");
        if report.boundary_edges == 0 {
            assert!(report.volume > 0.0, "{name}: {report}");
        }
        let (low, high) = mesh.bounds().unwrap();
        let half = definition.half_edge;
        let size = (high - low).max_element() / (2.0 * half);
        assert!((0.5..=1.0 + 1e-6).contains(&size), "{name} fills {size} of its box");
        // Open edges lie in the box's faces.
        let mut uses = std::collections::HashMap::new();
        for [a, b, c] in &mesh.triangles {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                *uses.entry([*a.min(b), *a.max(b)]).or_insert(0) += 1;
            }
        }
        for (edge, _) in uses.iter().filter(|(_, n)| **n == 1) {
            let in_face = edge.map(|v| mesh.vertices[v as usize].at().abs().max_element() > half * 0.99999);
            assert_eq!(in_face, [true; 2], "{name}");
        }
        assert!(mesh.vertices.iter().all(|v| (Vec3::from(v.normal).length() - 1.0).abs() < 1e-5), "{name}");
        let whole = Options { cull: false, ..options };
        let (uncut, _) = extract_on_cpu(&Source::Field(&field, grid), &whole, &|_| {}).unwrap();
        assert!(uncut == mesh, "{name}: culling changes it");
    }
}
