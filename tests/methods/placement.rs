//! Where vertices lie on their edges.

use crate::{bytes, common, on_cpu, on_gpu, options};
use glam::{Mat3, Vec3};
use isoforge::extract::{ExtractError, Extractor, Method, Options, Placement, Source, extract_on_cpu};
use isoforge::field::{Field, Points, Sense};
use isoforge::gpu::Form;
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use std::collections::BTreeSet;

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

/// Noise with features of about `cells` cells, and a grid that is stretched and turned.
fn noise(seed: u32, cells: f64) -> (GraphField, Grid) {
    let step = Mat3::from_rotation_z(0.5) * Mat3::from_diagonal(Vec3::new(0.9, 1.0, -1.1));
    let at = [x() / cells + 0.137, y() / cells + 0.271, z() / cells + 0.113];
    let field = GraphField::new(&Expr::noise(seed).at(at), Sense::Below);
    (field, Grid::new([30; 3], Vec3::ZERO, step).unwrap())
}

/// The vertices within cells, by the grid coordinates.
fn within_cells(mesh: &Mesh, grid: &Grid) -> Vec<usize> {
    let to_steps = grid.step().inverse();
    let is_within = |&v: &usize| {
        let q = to_steps * (mesh.vertices[v].at() - grid.origin());
        (q - q.round()).abs().min_element() > 1e-3
    };
    (0..mesh.vertices.len()).filter(is_within).collect()
}

/// The vertices that triangles join with one.
fn around(mesh: &Mesh, v: usize) -> BTreeSet<usize> {
    let all = mesh.triangles.iter().map(|t| t.map(|v| v as usize)).filter(|t| t.contains(&v));
    all.flatten().filter(|&other| other != v).collect()
}

/// Vertices within cells are the mean of those around them where these are not searched for. Where they are, the field crosses
/// iso within ε of each, in the same cell: on the line along the gradient through the mean, or where there is no crossing on it,
/// between the mean and the nearest corner of the other side.
///
/// Goes red when `line_of` (src/stage/emit/cpu/snap.rs) goes along the steps' rows in place of columns, when `snap_within` there
/// stays where it finds nothing or `nearest` takes corners of either side, and when `unsnapped` (src/stage/emit/cpu/crossings.rs)
/// leaves the middle out; when either shader differs.
#[test]
fn vertices_within_cells() {
    let epsilon = 1e-3;
    let (mut all, mut to_corners) = (0, 0);
    for seed in 0..6 {
        let (field, grid) = noise(seed, 2.2);
        let source = Source::Field(&field, grid);
        let options = Options { method: Method::Mc33, ..Options::new(0.0) };
        let with = |placement| meshes(&source, &Options { placement, ..options });
        let (plain, midpoint) = (with(Placement::Linear), with(Placement::Midpoint));
        let centres = within_cells(&plain, &grid);
        for mesh in [&plain, &midpoint] {
            for &v in &centres {
                let others = around(mesh, v).into_iter().filter(|v| !centres.contains(v));
                let others: Vec<Vec3> = others.map(|v| mesh.vertices[v].at()).collect();
                let mean = others.iter().sum::<Vec3>() / others.len() as f32;
                assert!(others.len() >= 3 && mean.distance(mesh.vertices[v].at()) < 1e-4, "{seed}, {v}");
            }
        }
        let snapped = with(Placement::Snapped { epsilon });
        assert_eq!(snapped.triangles, plain.triangles);
        for &v in &centres {
            let [from, to] = [&plain, &snapped].map(|mesh| mesh.vertices[v].at());
            let q = [from, to].map(|p| grid.step().inverse() * (p - grid.origin()));
            assert_eq!(q[0].floor(), q[1].floor(), "{seed}, {v}: it leaves the cell");
            all += 1;
            let way = to - from;
            let (far, way, normal) = (way.length(), way.normalize(), Vec3::from(plain.vertices[v].normal));
            if far > 1e-2 && way.dot(normal).abs() < 0.999 {
                let is_in = value(&field, from) < 0.0;
                let corners =
                    (0..8).map(|k| q[0].floor() + Vec3::from([0, 1, 2].map(|a| (k >> a & 1) as f32)));
                let at = |corner: Vec3| grid.origin() + grid.step() * corner;
                let others: Vec<Vec3> =
                    corners.filter(|&corner| (value(&field, at(corner)) < 0.0) != is_in).collect();
                let least = others.iter().map(|c| c.distance(q[0])).fold(f32::INFINITY, f32::min);
                let is_towards = |&c: &Vec3| way.dot((at(c) - from).normalize()) > 0.999;
                let reached = others.into_iter().find(is_towards);
                let reached = reached.unwrap_or_else(|| panic!("{seed}, {v}: {way}, not along {normal}"));
                assert!(
                    reached.distance(q[0]) < least + 1e-4,
                    "{seed}, {v}: {reached} is not the nearest corner"
                );
                to_corners += 1;
            }
            let sides = [-epsilon, epsilon].map(|t| value(&field, to + way * t) < 0.0);
            assert_ne!(sides[0], sides[1], "{seed}, {v}: no crossing at {to}");
        }
    }
    assert!(all > 300 && to_corners > 30 && to_corners * 3 < all, "{to_corners} of {all} go to corners");
}

/// As many triangles meet as before, every form of the kernels gives the same bytes, and closed meshes stay closed.
#[test]
fn forms_agree_and_meshes_stay_closed() {
    let (field, grid) = noise(9, 1.6);
    let capped = isoforge::extract::Capped::new(&Source::Field(&field, grid), &Options::new(0.0)).unwrap();
    for placement in [Placement::Midpoint, Placement::Snapped { epsilon: 1e-5 }] {
        let options = Options { method: Method::Mc33, placement, ..Options::new(0.0) };
        let mesh = meshes(&capped.source(), &options);
        let report = mesh.check();
        assert!(report.is_closed_manifold() && report.misoriented_edges == 0, "{placement:?}: {report}");
        let Some(default) = common::extractor() else { continue };
        for form in Form::ALL.into_iter().filter_map(|form| default.gpu().with_form(form)) {
            let other = on_gpu(&Extractor::new(form).unwrap(), &capped.source(), &options);
            assert_eq!(mesh.triangles, other.triangles, "{placement:?}");
            assert!(!default.gpu().is_software() || bytes(&mesh) == bytes(&other), "{placement:?}");
        }
    }
}
