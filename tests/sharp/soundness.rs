//! Closed, manifold, oriented, whatever the field; open only at the grid's border.

use crate::common::Random;
use crate::{cube, graph, sharp, uniform};
use glam::{Mat3, Vec3};
use isoforge::field::user::UserField;
use isoforge::field::{Closure, Field, NoForm, Sense, Surface};
use isoforge::graph::shapes::*;
use isoforge::graph::{Expr, x, y};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::sharp::{SharpError, extract};

/// Manifold and oriented, with the uniform mesh's Euler number; closed, too, where that is.
fn assert_sound(field: &dyn Field, grid: &Grid, name: &str) -> Mesh {
    let (mesh, report) = sharp(field, grid);
    let (check, other) = (mesh.check(), uniform(field, grid).check());
    let wrong = [
        check.non_manifold_edges,
        check.misoriented_edges,
        check.non_manifold_vertices,
        check.bad_indices,
        check.non_finite_vertices,
        check.unused_vertices,
        check.duplicate_triangles,
    ];
    assert_eq!(wrong, [0; 7], "{name}: {check} {report:?}");
    assert_eq!((check.euler, check.boundary_edges > 0), (other.euler, other.boundary_edges > 0), "{name}");
    assert!(mesh.vertices.iter().all(|v| (Vec3::from(v.normal).length() - 1.0).abs() < 1e-5), "{name}");
    mesh
}

/// Values that a lattice of `n`³ points has, and what is between.
fn random_lattice(seed: u64, n: i32, is_open: bool) -> impl Fn(Vec3) -> f32 + Send + Sync {
    move |p: Vec3| {
        let q = p.round().as_ivec3();
        let is_border = q.cmple(glam::IVec3::ZERO).any() || q.cmpge(glam::IVec3::splat(n)).any();
        if is_border && !is_open {
            return 1.0;
        }
        let mix = |n: i32, by: u64| (n as u64).wrapping_mul(by);
        Random(seed ^ mix(q.x, 73_856_093) ^ mix(q.y, 19_349_663) ^ mix(q.z, 83_492_791)).unit() - 0.5
    }
}

/// All 256 cases and every ambiguous face, inside the grid and at its border: two sheets that share a face twice, and
/// every kind of open end.
#[test]
fn random_samples() {
    for seed in 0..24 {
        let step = Vec3::new(if seed % 3 == 0 { -1.0 } else { 1.0 }, 1.0, 1.0);
        let n = [3 + seed as u32 % 9, 11, 9];
        let origin = if step.x < 0.0 { Vec3::X * n[0] as f32 } else { Vec3::ZERO };
        let grid = Grid::new(n, origin, Mat3::from_diagonal(step)).unwrap();
        for is_open in [false, true] {
            let values = random_lattice(seed, 9, is_open);
            let field = Closure::new(Sense::Below, values);
            let mesh = assert_sound(&field, &grid, &format!("{seed} {is_open}"));
            assert!(mesh.triangles.len() > 100);
        }
    }
}

fn random_solid(random: &mut Random, depth: u32) -> Expr {
    if depth == 0 {
        let mut within = |low: f32, high: f32| f64::from(low + (high - low) * random.unit());
        let (r, kind) = (within(0.15, 0.4), within(0.0, 3.0));
        let solid = match kind {
            k if k < 1.0 => sphere(r),
            k if k < 2.0 => box_([-r, -0.2, -0.3], [0.3, r, 0.2]),
            _ => cylinder(r, 0.8),
        };
        let solid = solid.rotate([within(-1.0, 1.0), 1.0, within(-1.0, 1.0)], within(0.0, 1.0)).unwrap();
        return solid.translate((within(-0.4, 0.4), within(-0.4, 0.4), within(-0.4, 0.4)));
    }
    let (a, b) = (random_solid(random, depth - 1), random_solid(random, depth - 1));
    match random.next() % 4 {
        0 => a.intersection(b),
        1 => a.difference(b),
        2 => a.smooth_union(b, 0.1),
        _ => a.union(b),
    }
}

/// Trees of solids; the uniform mesh loses volume at their edges.
#[test]
fn random_csg() {
    let mut random = Random(7);
    for i in 0..14 {
        let solid = random_solid(&mut random, 2);
        let field = graph(&solid);
        let mesh = assert_sound(&field, &cube(28, 1.5), &format!("solid {i}"));
        if !mesh.triangles.is_empty() {
            let check = mesh.check();
            let volume = uniform(&field, &cube(28, 1.5)).check().volume;
            assert!(
                check.is_closed_manifold() && (check.volume - volume).abs() < 0.25 * volume + 1e-3,
                "solid {i}: {check} {volume}"
            );
        }
    }
}

/// A cube that the grid cuts off ends in the grid's border, all of it.
#[test]
fn open_borders_are_reached() {
    let field = graph(&box_([-0.55, -3.0, -3.0], [0.45, 3.0, 0.3]));
    let grid = Grid::from_bounds([13, 9, 10], Vec3::NEG_ONE, Vec3::ONE).unwrap();
    let mesh = assert_sound(&field, &grid, "cut off");
    let (low, high) = mesh.bounds().unwrap();
    assert_eq!((low.y, high.y, low.z), (-1.0, 1.0, -1.0));
    let area = mesh.check().area;
    assert!((area - (2.0 * 1.3 * 2.0 + 1.0 * 2.0)).abs() < 1e-5, "{area}");
    // A plane through a grid of one cell.
    let plane = graph(&(x() + y() * 0.5));
    assert_sound(&plane, &cube(1, 1.0), "one cell");
}

#[test]
fn grids_that_lean_and_mirrored_ones() {
    let field = graph(&box_([-0.5; 3], [0.5; 3]));
    for turn in [1.0, -1.0] {
        let lean =
            Mat3::from_cols(Vec3::X * turn * 0.1, Vec3::new(0.02, 0.07, 0.0), Vec3::new(0.0, 0.03, 0.13));
        let grid = Grid::new([26, 40, 20], lean * Vec3::new(-13.0, -20.0, -10.0), lean).unwrap();
        let mesh = assert_sound(&field, &grid, "leaning");
        let check = mesh.check();
        assert!(check.is_closed_manifold() && (check.volume - 1.0).abs() < 1e-5, "{check}");
    }
}

/// NaN, infinities, no gradient, a jump: a mesh without NaN, and what was odd is counted.
#[test]
fn odd_fields() {
    let grid = cube(12, 1.0);
    let holes = Closure::new(Sense::Below, |p: Vec3| if p.x > 0.3 { f32::NAN } else { p.length() - 0.7 });
    assert_sound(&holes, &grid, "NaN");
    assert!(sharp(&holes, &grid).1.non_finite > 0);
    let jump = Closure::new(Sense::Above, |p: Vec3| if p.length() < 0.61 { 1.0 } else { -1.0 });
    assert_sound(&jump, &grid, "jump");
    assert!(sharp(&jump, &grid).1.singular > 0);
    let flat = Closure::new(Sense::Below, |p: Vec3| (p.length() - 0.7).powi(3).clamp(-1e-30, 1e-30));
    assert_sound(&flat, &grid, "flat");
    for value in [1.0, -1.0, f32::NAN, 0.0] {
        let constant = Closure::new(Sense::Below, move |_| value);
        assert_eq!(sharp(&constant, &grid).0, Mesh::default(), "{value}");
    }
}

/// Pores and necks of a molecule, where sheets meet twice. Goes red when polygons there are cut by a diagonal between the two
/// sheets.
#[test]
fn a_molecule() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/molecule.toml");
    let scene = isoforge::scene::Scene::open(&path, &Default::default()).expect("a scene");
    let (field, [low, high]) = (scene.field(), scene.bounds.expect("bounds"));
    for cells in [30, 40, 50] {
        let grid = Grid::from_bounds([cells; 3], low, high).expect("a grid");
        assert_sound(&field, &grid, "molecule");
    }
}

#[test]
fn what_is_refused() {
    let endless =
        "fn density(p: vec3<f32>) -> f32 { var s = p.x; while (s < 1.0) { s += abs(p.y) + 0.1; } return s; }";
    let field = UserField::new(endless, "endless", Sense::Below).unwrap();
    assert!(matches!(Surface::new(&field, 0.0, Sense::Below, 1e-3), Err(NoForm::Cpu)));
    let ball = graph(&sphere(0.5));
    let surface = Surface::new(&ball, f32::NAN, Sense::Below, 1e-3).unwrap();
    assert!(matches!(extract(&surface, &cube(4, 1.0), u64::MAX, &|_| {}), Err(SharpError::Iso(_))));
}

#[test]
fn same_bytes_on_any_threads() {
    let field = graph(&random_solid(&mut Random(3), 2));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sharp(&field, &cube(40, 1.5)))
    };
    let (one, two) = (on(1), on(2));
    assert!(one == two && !one.0.triangles.is_empty());
}
