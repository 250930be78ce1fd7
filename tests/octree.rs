//! Adaptive extraction on an octree: what its meshes are, whatever the field, and how near they are to the surface.

mod common;

use common::Random;
use glam::{DVec3, Vec3};
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Field, Sense, Surface};
use isoforge::graph::shapes::{box_, cylinder, sphere, torus_distance};
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::octree::{OctreeReport, Settings, extract};

fn cube(n: u32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::NEG_ONE, Vec3::ONE).unwrap()
}

fn field(expr: &Expr) -> GraphField {
    GraphField::new(expr, Sense::Below)
}

fn run(field: &dyn Field, grid: &Grid, change: impl Fn(&mut Settings)) -> (Mesh, OctreeReport) {
    let mut settings = Settings::new(grid);
    change(&mut settings);
    let surface = Surface::new(field, 0.0, Sense::Below, 1e-3).unwrap();
    extract(&surface, grid, &settings, &|_| {}).unwrap()
}

fn uniform(field: &dyn Field, grid: &Grid) -> Mesh {
    extract_on_cpu(&Source::Field(field, *grid), &Options::new(0.0), &|_| {}).unwrap().0
}

/// Triangle samples' distances to the surface, largest and root mean square, by projection on it.
fn errors(field: &dyn Field, mesh: &Mesh) -> (f64, f64) {
    let surface = Surface::new(field, 0.0, Sense::Below, 1e-3).unwrap();
    let (mut largest, mut sum, mut count) = (0.0f64, 0.0, 0.0);
    let mut points = Vec::new();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize].at());
        for i in 0..=4 {
            for j in 0..=4 - i {
                let (u, v) = (i as f32 / 4.0, j as f32 / 4.0);
                points.push(a * u + b * v + c * (1.0 - u - v));
            }
        }
    }
    let mut at = points.clone();
    let (mut values, mut gradients) = (vec![0.0; at.len()], vec![Vec3::ZERO; at.len()]);
    for _ in 0..6 {
        surface.values(&at, &mut values).unwrap();
        surface.gradients(&at, &mut gradients).unwrap();
        for i in 0..at.len() {
            let step = gradients[i] * (values[i] / gradients[i].length_squared());
            if step.is_finite() {
                at[i] -= step;
            }
        }
    }
    for (p, q) in points.iter().zip(&at) {
        let d = f64::from(p.distance(*q));
        largest = largest.max(d);
        sum += d * d;
        count += 1.0;
    }
    (largest, (sum / count).sqrt())
}

fn check(name: &str, mesh: &Mesh, closed: bool) {
    let report = mesh.check();
    assert_eq!(report.non_manifold_edges, 0, "{name}: {report}");
    assert_eq!(report.non_manifold_vertices, 0, "{name}: {report}");
    assert_eq!(report.misoriented_edges, 0, "{name}: {report}");
    assert_eq!(report.duplicate_triangles, 0, "{name}: {report}");
    assert_eq!(report.unused_vertices, 0, "{name}: {report}");
    assert_eq!((report.bad_indices, report.non_finite_vertices), (0, 0), "{name}: {report}");
    if closed {
        assert_eq!(report.boundary_edges, 0, "{name}: {report}");
    }
}

#[test]
fn probe() {
    let k = 7.0;
    let gy = (x() * k).sin() * (y() * k).cos()
        + (y() * k).sin() * (z() * k).cos()
        + (z() * k).sin() * (x() * k).cos();
    let shapes: [(&str, Expr); 6] = [
        ("sphere", sphere(0.77)),
        ("torus", torus_distance(0.55, 0.23)),
        ("box", box_([-0.61; 3], [0.53; 3])),
        ("cube-sphere", box_([-0.61; 3], [0.61; 3]).difference(sphere(0.75))),
        ("drilled", box_([-0.61; 3], [0.61; 3]).difference(cylinder(0.31, 3.0))),
        ("gyroid", gy.max(sphere(0.83))),
    ];
    for (name, expr) in shapes {
        let f = field(&expr);
        for error in [0.01, 0.003, 0.001] {
            let t = std::time::Instant::now();
            let (mesh, report) = run(&f, &cube(128), |s| s.error = error);
            let t = t.elapsed().as_secs_f64();
            let (max, rms) = errors(&f, &mesh);
            let r = mesh.check();
            println!(
                "{name} {error}: {} triangles, max {max:.2e} rms {rms:.2e}, {:.1} ms, nodes {} rounds {} over {} stopped {} flat {} flipped {} thin {} | nm {} {} b {} mis {} euler {}",
                mesh.triangles.len(),
                t * 1e3,
                report.nodes,
                report.rounds,
                report.over,
                report.stopped,
                report.flattened,
                report.flipped,
                report.thin,
                r.non_manifold_edges,
                r.non_manifold_vertices,
                r.boundary_edges,
                r.misoriented_edges,
                r.euler
            );
        }
    }
}
