//! Bloomenthal's octree: the same of its meshes, whose leaves' polygons meet on shared segments.

use super::*;
use isoforge::octree::polygonize;

fn run(field: &dyn Field, grid: &Grid, change: impl Fn(&mut Settings)) -> (Mesh, OctreeReport) {
    let mut settings = Settings::new(grid);
    change(&mut settings);
    let surface = Surface::new(field, 0.0, Sense::Below, 1e-3).unwrap();
    polygonize(&surface, grid, &settings, &|_| {}).unwrap()
}

/// Of 2 to 8 balls, cut by one more.
fn random_balls(random: &mut Random) -> Expr {
    let mut ball = |most: f64| {
        let mut number = |low: f64, high: f64| low + (high - low) * f64::from(random.unit());
        let at = [number(-0.4, 0.4), number(-0.4, 0.4), number(-0.4, 0.4)];
        sphere(number(0.08, most)).translate(at)
    };
    let mut whole = ball(0.45);
    for _ in 0..(ball(1.0), 6).1 {
        whole = whole.union(ball(0.3));
    }
    whole.difference(ball(0.4))
}

/// Leaves of many sizes beside each other, without any balance. Goes red (boundary edges) when a large leaf's loops leave
/// out the crossings that only its smaller neighbours have.
#[test]
fn random_solids_are_closed_and_manifold() {
    let mut random = Random(23);
    let (mut triangles, mut flipped) = (0, 0);
    for i in 0..40 {
        let solid = if i % 2 == 0 { random_csg(&mut random) } else { random_balls(&mut random) };
        let grid = cube([16, 29, 48, 64][i % 4]);
        let (mesh, report) = run(&field(&solid), &grid, |s| {
            s.error = [0.05, 0.01, 0.002][i % 3];
            s.coarsest = [0, 8, 16][i / 3 % 3];
        });
        check(&format!("solid {i}"), &mesh, true);
        assert!(mesh.check().volume > 0.0, "solid {i}");
        triangles += mesh.triangles.len();
        flipped += report.flipped;
    }
    assert!(triangles > 30_000 && flipped < triangles as u64 / 200, "{flipped} of {triangles}");
}

/// Every face may be ambiguous, beside leaves of any size. Goes red when diagonals join crossings that two leaves
/// share (`is_free`).
#[test]
fn noise_is_manifold() {
    for seed in 0..12u64 {
        let (mesh, _) = run(&noisy_ball(seed), &cube([16, 24][seed as usize % 2]), |s| {
            s.error = [0.02, 0.2, 0.6][seed as usize % 3];
            s.coarsest = [0, 2, 4][seed as usize / 3 % 3];
            s.budget = if seed < 6 { 1 << 20 } else { 2000 };
        });
        assert!(mesh.triangles.len() > 200, "{seed}: {}", mesh.triangles.len());
        check(&format!("noise {seed}"), &mesh, true);
    }
}

/// Goes red when a leaf is kept whose middle has another sign than all its corners (`agrees`).
#[test]
fn resolved_shapes_have_the_uniform_mesh_s_topology() {
    let balls = sphere(0.3).translate([0.4, 0.0, 0.1]).union(sphere(0.2).translate([-0.4, 0.0, 0.0]));
    for (name, expr, euler) in [
        ("sphere", sphere(0.77), 2),
        ("torus", torus_distance(0.55, 0.23), 0),
        ("two holes", two_holes(), -2),
        ("two balls", balls, 4),
    ] {
        let f = field(&expr);
        assert_eq!(uniform(&f, &cube(64)).check().euler, euler, "{name}");
        for error in [0.02, 0.005] {
            let (mesh, _) = run(&f, &cube(64), |s| s.error = error);
            check(name, &mesh, true);
            assert_eq!(mesh.check().euler, euler, "{name}");
        }
    }
}

#[test]
fn the_error_bound_holds_and_errors_fall_with_it() {
    for (name, expr) in
        [("sphere", sphere(0.77)), ("torus", torus_distance(0.55, 0.23)), ("holes", two_holes())]
    {
        let f = field(&expr);
        let mut last = f64::INFINITY;
        for error in [0.02f32, 0.005, 0.00125] {
            let (mesh, report) = run(&f, &cube(128), |s| s.error = error);
            let (largest, rms) = errors(&f, &mesh);
            eprintln!("{name} {error}: {largest:.2e} {rms:.2e} {} {report:?}", mesh.triangles.len());
            let bound = if report.over == 0 { 1.25 * error } else { 1.25 * report.largest_error };
            assert!(largest <= f64::from(bound), "{name} {error}: {largest} {report:?}");
            assert!(report.over > 0 || rms < 0.8 * last, "{name} {error}: {rms} after {last}");
            last = rms;
        }
    }
}

#[test]
fn fewer_triangles_than_the_uniform_mesh_at_equal_error() {
    let blend = sphere(0.4).smooth_union(box_([-0.7, -0.2, -0.2], [0.1, 0.3, 0.25]).round(0.1), 0.2);
    for (name, expr) in [
        ("sphere", sphere(0.77)),
        ("torus", torus_distance(0.55, 0.23)),
        ("blend", blend),
        ("holes", two_holes()),
    ] {
        let f = field(&expr);
        let plain = uniform(&f, &cube(64));
        let (largest, rms) = errors(&f, &plain);
        for (n, part) in [(64, 0.95), (128, 0.95)] {
            let (mesh, report) = run(&f, &cube(n), |s| s.error = largest as f32 * part);
            let ours = errors(&f, &mesh);
            eprintln!(
                "{name}: uniform {} {largest:.2e} {rms:.2e}; {n} {} {:.2e} {:.2e} {report:?}",
                plain.triangles.len(),
                mesh.triangles.len(),
                ours.0,
                ours.1
            );
        }
    }
}
