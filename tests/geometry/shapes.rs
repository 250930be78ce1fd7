//! Area, volume, genus and normals of shapes that are known.

use crate::{common, meshes, on_cpu};
use glam::{DVec3, Mat3, Vec3};
use isoforge::extract::{Options, Source};
use isoforge::field::named::Named;
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Area and volume of the sphere of radius 1, and of the torus with R² = 1/2 and r² = 1/8.
const KNOWN: [(&str, f64, f64, i64); 2] = [
    ("sphere", 4.0 * PI, 4.0 * PI / 3.0, 2),
    ("torus", PI * PI, PI * PI / 8.0 * std::f64::consts::SQRT_2, 0),
];

/// A grid that no symmetry of the shape fits to.
fn uneven(n: u32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::new(-1.33, -1.41, -1.37), Vec3::new(1.45, 1.36, 1.43)).unwrap()
}

fn close(a: f64, b: f64, part: f64) -> bool {
    (a - b).abs() <= part * b.abs()
}

#[test]
fn area_and_volume_converge_at_second_order() {
    for (name, area, volume, euler) in KNOWN {
        let field = Named::new(name).unwrap();
        let options = Options::new(field.definition().iso);
        let mut logs = Vec::new();
        for n in [16u32, 32, 64, 128] {
            let report = on_cpu(&Source::Field(&field, uneven(n)), &options).check();
            assert!(report.is_closed_manifold() && !report.has_defects(), "{name} {n}: {report}");
            assert_eq!(report.euler, euler, "{name} {n}");
            assert!(report.volume > 0.0, "{name} {n}: outwards");
            let errors = [(report.area - area).abs() / area, (report.volume - volume).abs() / volume];
            logs.push((f64::from(n).ln(), errors.map(f64::ln)));
        }
        for (i, what) in ["area", "volume"].iter().enumerate() {
            let order = -slope(logs.iter().map(|(n, errors)| (*n, errors[i])));
            println!("{name}: {what} of order {order:.3}");
            assert!(order > 1.8, "{name}: {what} is of order {order}: {logs:?}");
        }
    }
}

/// Of the line nearest to the points.
fn slope(points: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
    let n = points.clone().count() as f64;
    let mean = points.clone().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let (mut over, mut under) = (0.0, 0.0);
    for (x, y) in points {
        over += (x - mean.0) * (y - mean.1);
        under += (x - mean.0).powi(2);
    }
    over / under
}

#[test]
fn both_backends_enclose_the_shapes() {
    for (name, area, volume, euler) in KNOWN {
        let field = Named::new(name).unwrap();
        let options = Options::new(field.definition().iso);
        for mesh in meshes(&Source::Field(&field, uneven(48)), &options) {
            let report = mesh.check();
            assert!(report.is_closed_manifold() && !report.has_defects(), "{name}: {report}");
            assert!(report.euler == euler && report.components == 1, "{name}: {report}");
            assert!(close(report.area, area, 0.01) && close(report.volume, volume, 0.02), "{name}: {report}");
        }
    }
}

/// A shape on grids with the same box: turned, sheared, mirrored along one axis, two and three.
#[test]
fn any_grid_gives_the_same_solid_wound_outwards() {
    let n = 40.0;
    let turned = Mat3::from_rotation_z(0.5) * Mat3::from_rotation_y(0.3);
    let sheared = Mat3::from_cols(Vec3::X, Vec3::new(0.4, 1.0, 0.0), Vec3::new(-0.2, 0.3, 1.0));
    let mirrors = [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, -1.0), -Vec3::ONE];
    for (name, area, volume, euler) in KNOWN {
        let field = Named::new(name).unwrap();
        let options = Options::new(field.definition().iso);
        for shape in [Mat3::IDENTITY, turned, sheared] {
            for mirror in mirrors {
                let step = shape * Mat3::from_diagonal(mirror) * (3.4 / n);
                let grid = Grid::new([40; 3], -(step * Vec3::splat(n / 2.0 + 0.13)), step).unwrap();
                let found = meshes(&Source::Field(&field, grid), &options);
                assert_eq!(grid.is_mirrored(), mirror.element_product() < 0.0);
                for mesh in found {
                    let report = mesh.check();
                    assert!(
                        report.is_closed_manifold() && report.euler == euler,
                        "{name} {mirror}: {report}"
                    );
                    assert!(close(report.area, area, 0.02), "{name} {mirror}: {report}");
                    assert!(close(report.volume, volume, 0.04), "{name} {mirror}: {report}");
                    normals_agree(&mesh, name);
                }
            }
        }
    }
}

/// Each vertex normal is of unit length and lies near the mean of the triangles around it.
fn normals_agree(mesh: &Mesh, name: &str) {
    let mut around = vec![DVec3::ZERO; mesh.vertices.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize].at().as_dvec3());
        let doubled = (b - a).cross(c - a);
        triangle.iter().for_each(|v| around[*v as usize] += doubled);
    }
    let mut worst = 1.0f64;
    for (vertex, around) in mesh.vertices.iter().zip(around) {
        let normal = Vec3::from(vertex.normal).as_dvec3();
        assert!((normal.length() - 1.0).abs() < 1e-6, "{name}: {vertex:?}");
        if around.length() > 1e-9 {
            worst = worst.min(normal.dot(around.normalize()));
        }
    }
    assert!(worst > 0.9, "{name}: a normal is off by {} degrees", worst.acos().to_degrees());
}

#[test]
fn normals_agree_with_the_triangles() {
    for name in ["sphere", "torus", "gyroid"] {
        let (field, _) = common::named(name, 64);
        let field_grid = uneven(64);
        let options = Options::new(field.definition().iso);
        // The same samples as a volume: normals from differences.
        let source = Source::Field(&field, field_grid);
        let values = |p: Vec3| {
            use isoforge::field::{Field, Points};
            let mut out = [0.0];
            field.values(Points { x: &[p.x], y: &[p.y], z: &[p.z] }, &mut out).unwrap();
            out[0]
        };
        let volume = common::sampled(field_grid, values);
        let inside_below = Options { sense: Some(isoforge::field::Sense::Below), ..options };
        for mesh in meshes(&source, &options) {
            normals_agree(&mesh, name);
        }
        let from_samples = meshes(&Source::Volume(&volume), &inside_below);
        for mesh in from_samples {
            normals_agree(&mesh, name);
        }
    }
}

/// The gyroid goes on beyond any box: its only open edges lie in the box's faces.
#[test]
fn a_gyroid_ends_at_the_box_alone() {
    let (field, grid) = common::named("gyroid", 37);
    let half = field.definition().half_edge;
    for mesh in meshes(&Source::Field(&field, grid), &Options::new(0.15)) {
        let report = mesh.check();
        assert!(report.boundary_edges > 0 && report.non_manifold_edges == 0 && report.misoriented_edges == 0);
        let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
        for [a, b, c] in &mesh.triangles {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                *uses.entry([*a.min(b), *a.max(b)]).or_default() += 1;
            }
        }
        let open: Vec<_> = uses.into_iter().filter(|(_, n)| *n == 1).map(|(edge, _)| edge).collect();
        assert_eq!(open.len(), report.boundary_edges);
        for edge in open {
            let [a, b] = edge.map(|v| mesh.vertices[v as usize].at());
            let in_face =
                |axis: usize| (a[axis].abs() - half).abs() < 1e-5 && (a[axis] - b[axis]).abs() < 1e-5;
            assert!((0..3).any(in_face), "{a} to {b}");
        }
    }
}
