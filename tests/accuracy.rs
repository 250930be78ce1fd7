//! The measured error of meshes whose error is known.

use glam::{Vec3, vec3};
use isoforge::accuracy::measure;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Closure, Field, Sense, Surface};
use isoforge::graph::shapes::{box_, sphere};
use isoforge::graph::{Expr, GraphField, z};
use isoforge::grid::Grid;
use isoforge::mesh::{Mesh, Vertex};
use std::collections::HashSet;
use std::sync::Mutex;
use std::time::Instant;

fn field(expr: &Expr) -> GraphField {
    GraphField::new(expr, Sense::Below)
}

fn surface(field: &dyn Field) -> Surface<'_> {
    Surface::new(field, 0.0, Sense::Below, 1e-3).unwrap()
}

fn mesh(points: &[Vec3], normal: impl Fn(Vec3) -> Vec3, triangles: &[[u32; 3]]) -> Mesh {
    let vertices =
        points.iter().map(|p| Vertex { position: p.to_array(), normal: normal(*p).to_array() }).collect();
    Mesh { vertices, triangles: triangles.to_vec() }
}

/// Goes red when samples are not spread by area, or distances not squared.
#[test]
fn triangles_above_a_plane() {
    let plane = field(&(z() * 3.0));
    // Heights 0, 0 and 0.6: the mean square over a triangle is 0.36 / 6. A second one of half the area at 0.1.
    let points = [
        vec3(0.0, 0.0, 0.0),
        vec3(1.0, 0.0, 0.0),
        vec3(0.0, 1.0, 0.6),
        vec3(0.0, 0.0, 0.1),
        vec3(1.0, 0.0, 0.1),
        vec3(0.0, 1.0, 0.1),
    ];
    let mesh = mesh(&points, |_| vec3(0.0, 0.6, 0.8), &[[0, 1, 2], [3, 4, 5]]);
    let found = measure(&surface(&plane), &mesh, 20_000).unwrap();
    let tilted = (1.0f64 + 0.36).sqrt();
    let rms = ((0.06 * tilted + 0.01) / (tilted + 1.0)).sqrt();
    assert!((found.distance_rms / rms - 1.0).abs() < 2e-3, "{found:?} {rms}");
    assert!((0.57..0.6001).contains(&found.distance_max), "{found:?}");
    let angle = 0.8f64.acos().to_degrees();
    assert!((found.normal_rms - angle).abs() < 1e-3 && (found.normal_max - angle).abs() < 1e-3, "{found:?}");
    assert_eq!((found.samples, found.lost), (20_000, 0));
}

#[test]
fn an_octahedron_in_a_ball() {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
    let faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    let mesh = mesh(&axes, |p| p, &faces);
    // A distance, and a field whose gradient is 0 in the middle and far from 1 elsewhere.
    let squares = sphere(1.0).square() * sphere(1.0) + sphere(1.0);
    for expr in [sphere(1.0), squares] {
        let found = measure(&surface(&field(&expr)), &mesh, 50_000).unwrap();
        assert!((found.distance_max - (1.0 - 1.0 / 3.0f64.sqrt())).abs() < 1e-3, "{found:?}");
        assert!(found.lost == 0 && found.normal_max < 1e-2, "{found:?}");
    }
}

/// A chamfered box: the middle of the chamfer is nearer to the faces than to the edge. Goes red when samples do not slide
/// along the surface.
#[test]
fn beside_an_edge() {
    let cube = box_([-1.0; 3], [1.0; 3]);
    // From outside: 0.1 beyond the edge along the diagonal, the nearest point is on the edge.
    let out = 1.0 + 0.1 / 2.0f32.sqrt();
    let strip = [vec3(out, out, -0.01), vec3(out, out, 0.01), vec3(out, out + 1e-4, 0.0)];
    let above = mesh(&strip, |_| vec3(0.7, 0.7, 0.0), &[[0, 1, 2]]);
    let found = measure(&surface(&field(&cube)), &above, 200).unwrap();
    assert!((found.distance_max - 0.1).abs() < 1e-3 && found.lost == 0, "{found:?}");
    // From inside a product of half spaces, whose gradient points to the edge and not to the nearest face.
    let product = -((Expr::from(1.0) - isoforge::graph::x()) * (Expr::from(1.0) - isoforge::graph::y()));
    let strip = [vec3(0.9, 0.8, -0.01), vec3(0.9, 0.8, 0.01), vec3(0.9, 0.8001, 0.0)];
    let below = mesh(&strip, |_| Vec3::X, &[[0, 1, 2]]);
    let found = measure(&surface(&field(&product)), &below, 200).unwrap();
    assert!((found.distance_max - 0.1).abs() < 2e-3 && found.lost == 0, "{found:?}");
}

/// Twice the cells, a quarter of the error.
#[test]
fn extraction_is_of_second_order() {
    let ball = field(&sphere(0.8));
    let of = |cells: u32| {
        let grid = Grid::from_bounds([cells; 3], Vec3::splat(-1.0), Vec3::splat(1.0)).unwrap();
        let (mesh, _) = extract_on_cpu(&Source::Field(&ball, grid), &Options::new(0.0), &|_| {}).unwrap();
        measure(&surface(&ball), &mesh, 100_000).unwrap()
    };
    let (coarse, fine) = (of(16), of(32));
    let order = (coarse.distance_rms / fine.distance_rms).log2();
    assert!((1.8..2.2).contains(&order), "{order}");
    assert!(fine.distance_max < 0.4 * coarse.distance_max, "{coarse:?} {fine:?}");
}

#[test]
fn few_triangles_keep_all_cores_busy() {
    let threads = Mutex::new(HashSet::new());
    let plane = Closure::new(Sense::Below, |p: Vec3| {
        let Some(thread) = rayon::current_thread_index() else { return p.z };
        // Each waits for the other at its first value.
        let is_new = threads.lock().unwrap().insert(thread);
        let since = Instant::now();
        while is_new && threads.lock().unwrap().len() < 2 && since.elapsed().as_secs() < 20 {
            std::thread::yield_now();
        }
        p.z
    });
    let few = mesh(&[Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE], |_| Vec3::X, &[[0, 1, 2], [1, 2, 3]]);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    // Outside of the pool: a surface asks for a value, too.
    let plane = surface(&plane);
    pool.install(|| measure(&plane, &few, 2_000)).unwrap();
    assert_eq!(threads.into_inner().unwrap().len(), 2);
}

#[test]
fn nothing_to_measure() {
    let ball = field(&sphere(0.8));
    assert_eq!(measure(&surface(&ball), &Mesh::default(), 100).unwrap().samples, 0);
    let flat = mesh(&[Vec3::ZERO; 3], |_| Vec3::X, &[[0, 1, 2]]);
    assert_eq!(measure(&surface(&ball), &flat, 100).unwrap().samples, 0);
    // No surface anywhere: every sample is lost, none counts.
    let nowhere = field(&(z() * 0.0 + 1.0));
    let one = mesh(&[Vec3::X, Vec3::Y, Vec3::Z], |_| Vec3::X, &[[0, 1, 2]]);
    let found = measure(&surface(&nowhere), &one, 100).unwrap();
    assert_eq!((found.lost, found.distance_max), (100, 0.0));
}
