//! Adaptive extraction on an octree: what its meshes are, whatever the field, and how near they are to the surface.

#[path = "octree/bloomenthal.rs"]
mod bloomenthal;
mod common;

use common::Random;
use glam::{Mat3, Vec3};
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::user::UserField;
use isoforge::field::{Closure, Field, NoForm, Sense, Surface};
use isoforge::graph::shapes::{box_, capsule, cylinder, sphere, torus_distance};
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::octree::{OctreeError, OctreeReport, Placement, Settings, extract};

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

fn gyroid_ball() -> Expr {
    let (a, b, c) = (x() * 6.0, y() * 6.0, z() * 6.0);
    (a.sin() * b.cos() + b.sin() * c.cos() + c.sin() * a.cos()).max(sphere(0.83))
}

fn two_holes() -> Expr {
    let hole = |at: f64| cylinder(0.15, 3.0).translate([at, 0.05, 0.0]);
    box_([-0.7, -0.4, -0.3], [0.7, 0.43, 0.2]).difference_of([hole(-0.33), hole(0.31)])
}

/// A tree of solids that stays inside of [−0.9, 0.9]³.
fn random_csg(random: &mut Random) -> Expr {
    let mut number = |low: f64, high: f64| low + (high - low) * f64::from(random.unit());
    let mut solid = || {
        let at = [number(-0.4, 0.4), number(-0.4, 0.4), number(-0.4, 0.4)];
        let size = number(0.12, 0.4);
        let kind = number(0.0, 4.0) as u32;
        let axis = [number(-1.0, 1.0), number(-1.0, 1.0), 1.5];
        let solid = match kind {
            0 => sphere(size),
            1 => box_([-0.6 * size; 3], [0.5 * size, 0.6 * size, 0.4 * size]),
            2 => cylinder(0.6 * size, size),
            _ => capsule([-0.3 * size, 0.0, 0.0], [0.4 * size, 0.1, 0.0], 0.4 * size),
        };
        solid.rotate(axis, number(0.0, 1.0)).unwrap().translate(at)
    };
    let solids: Vec<Expr> = (0..5).map(|_| solid()).collect();
    let mut whole = solids[0].clone();
    for solid in &solids[1..] {
        whole = match (random.unit() * 5.0) as u32 {
            0 | 1 => whole.union(solid.clone()),
            2 | 3 => whole.difference(solid.clone()),
            _ => whole.smooth_union(solid.clone(), 0.1),
        };
    }
    whole
}

/// A ball in a shell where each point has a sign of its own.
fn noisy_ball(seed: u64) -> impl Field {
    Closure::new(Sense::Below, move |p: Vec3| {
        let bits = p.to_array().map(|v| u64::from(v.to_bits()));
        let mut random = Random(seed ^ bits[0] << 40 ^ bits[1] << 20 ^ bits[2]);
        random.next();
        p.length() - 0.7 + 0.5 * (random.unit() - 0.5)
    })
}

/// Whatever the signs: no edge of one, three or four triangles, no vertex of two fans. Goes red
/// when polygons are wound by the other end's sign, and when the leaves that `measure` names are not split.
#[test]
fn random_solids_are_closed_and_manifold() {
    let mut random = Random(11);
    let (mut triangles, mut flipped) = (0, 0);
    for i in 0..40 {
        let f = field(&random_csg(&mut random));
        let grid = cube([16, 29, 48, 64][i % 4]);
        let (mesh, report) = run(&f, &grid, |s| s.error = [0.05, 0.01, 0.002][i % 3]);
        check(&format!("solid {i}"), &mesh, true);
        triangles += mesh.triangles.len();
        flipped += report.flipped;
    }
    assert!(triangles > 30_000 && flipped < triangles as u64 / 200, "{flipped} of {triangles}");
}

/// Signs without any sense: each face may be ambiguous, beside leaves of any size.
#[test]
fn noise_is_manifold() {
    for seed in 0..12u64 {
        let noise = noisy_ball(seed);
        let (mesh, _) = run(&noise, &cube(16), |s| {
            s.error = [0.02, 0.2, 0.6][seed as usize % 3];
            s.placement = [Placement::Quadric, Placement::Mean][seed as usize % 2];
        });
        assert!(mesh.triangles.len() > 500);
        check(&format!("noise {seed}"), &mesh, true);
    }
}

#[test]
fn resolved_shapes_have_the_uniform_mesh_s_topology() {
    for (name, expr, euler) in [
        ("sphere", sphere(0.77), 2),
        ("torus", torus_distance(0.55, 0.23), 0),
        ("two holes", two_holes(), -2),
        (
            "two balls",
            sphere(0.3).translate([0.4, 0.0, 0.1]).union(sphere(0.2).translate([-0.4, 0.0, 0.0])),
            4,
        ),
    ] {
        let f = field(&expr);
        let expected = uniform(&f, &cube(64)).check().euler;
        for error in [0.02, 0.005] {
            let (mesh, _) = run(&f, &cube(64), |s| s.error = error);
            check(name, &mesh, true);
            assert_eq!(mesh.check().euler, expected, "{name}");
        }
        assert_eq!(euler, expected, "{name}");
    }
}

/// Goes red when polygons are wound by the other end's sign.
#[test]
fn no_triangle_of_a_smooth_surface_is_flipped() {
    let blend = sphere(0.4).smooth_union(box_([-0.7, -0.2, -0.2], [0.1, 0.3, 0.25]).round(0.1), 0.2);
    for (name, expr) in [("sphere", sphere(0.77)), ("torus", torus_distance(0.55, 0.23)), ("blend", blend)] {
        let f = field(&expr);
        let surface = Surface::new(&f, 0.0, Sense::Below, 1e-3).unwrap();
        for error in [0.01, 0.002] {
            let (mesh, report) = run(&f, &cube(64), |s| s.error = error);
            let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize].at());
            let middles: Vec<Vec3> =
                mesh.triangles.iter().map(|t| corners(t).iter().sum::<Vec3>() / 3.0).collect();
            let mut gradients = vec![Vec3::ZERO; middles.len()];
            surface.gradients(&middles, &mut gradients).unwrap();
            let flipped = mesh.triangles.iter().zip(&gradients).filter(|(t, g)| {
                let [a, b, c] = corners(t);
                (b - a).cross(c - a).dot(**g) < 0.0
            });
            assert_eq!((flipped.count(), report.flipped), (0, 0), "{name} {error}");
        }
    }
}

/// Was red while triangles with a crease between the samples were looked at at few points; goes red when
/// the leaves that `measure` names are not split.
#[test]
fn the_error_bound_holds_and_errors_fall_with_it() {
    for (name, expr) in [
        ("sphere", sphere(0.77)),
        ("torus", torus_distance(0.55, 0.23)),
        ("holes", two_holes()),
        ("gyroid", gyroid_ball()),
    ] {
        let f = field(&expr);
        let mut last = f64::INFINITY;
        for error in [0.02f32, 0.005, 0.00125] {
            let (mesh, report) = run(&f, &cube(128), |s| s.error = error);
            let (largest, rms) = errors(&f, &mesh);
            // Between the points that extraction looks at it may be a little more.
            let bound = if report.over == 0 { 1.25 * error } else { 1.25 * report.largest_error };
            assert!(largest <= f64::from(bound), "{name} {error}: {largest} {report:?}");
            // Where the smallest cells stop it, they are the error.
            assert!(report.over > 0 || rms < 0.8 * last, "{name} {error}: {rms} after {last}");
            assert!(
                report.over == 0 || (report.stopped > 0 && report.largest_error > error),
                "{name} {report:?}"
            );
            last = rms;
        }
    }
}

/// Goes red with `Placement::Mean`.
#[test]
fn fewer_triangles_than_the_uniform_mesh_at_equal_error() {
    for (name, expr, part) in [("torus", torus_distance(0.55, 0.23), 1.0), ("holes", two_holes(), 0.3)] {
        let f = field(&expr);
        let plain = uniform(&f, &cube(64));
        let (largest, _) = errors(&f, &plain);
        let (mesh, _) = run(&f, &cube(128), |s| s.error = largest as f32 * 0.95);
        assert!(errors(&f, &mesh).0 <= largest, "{name}");
        let ratio = mesh.triangles.len() as f64 / plain.triangles.len() as f64;
        assert!(ratio < part, "{name}: {ratio}");
    }
}

/// Goes red with `Placement::Mean`.
#[test]
fn a_turned_cube_keeps_its_edges_and_corners() {
    let f = field(&box_([-0.5; 3], [0.5; 3]).rotate([1.0, 2.0, 3.0], 0.1).unwrap());
    let (mesh, report) = run(&f, &cube(64), |s| s.error = 1e-3);
    check("cube", &mesh, true);
    let (largest, rms) = errors(&f, &mesh);
    // Corners whose tips lie two cells away from the leaf that sees their three faces are blunt.
    assert!(largest < 3e-3 && rms < 1e-4, "{largest} {rms} {report:?}");
    let report = (mesh.check(), report);
    assert!((report.0.volume - 1.0).abs() < 1e-4 && (report.0.area - 6.0).abs() < 1e-3, "{report:?}");
    assert!(mesh.triangles.len() < 4000, "{}", mesh.triangles.len());
}

#[test]
fn borders_are_open_and_reached() {
    let low = Vec3::new(-0.5, -0.71, -0.3);
    for cells in [[32, 32, 32], [37, 50, 23], [5, 64, 9]] {
        let grid = Grid::from_bounds(cells, low, Vec3::new(0.5, 0.6, 0.75)).unwrap();
        for (name, expr) in [("ball", sphere(0.62)), ("plane", z() - 0.1), ("gyroid", gyroid_ball())] {
            let f = field(&expr);
            let (mesh, _) = run(&f, &grid, |s| s.error = 0.01);
            check(name, &mesh, false);
            let (ours, theirs) = (mesh.check(), uniform(&f, &grid).check());
            assert!(ours.boundary_edges > 0, "{name}");
            let [a, b] = [&ours, &theirs].map(|r| r.bounds.unwrap());
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                assert!((a - b).abs() < 0.03, "{name} {cells:?}: {a} {b}");
            }
            assert!((ours.area - theirs.area).abs() < 0.05 * theirs.area, "{name} {cells:?} {ours} {theirs}");
            if name == "plane" {
                assert!((ours.area - 1.31).abs() < 1e-4, "{cells:?} {}", ours.area);
            }
        }
    }
}

/// Goes red when `mirrored` is not heeded.
#[test]
fn sheared_and_mirrored_grids() {
    for sign in [1.0, -1.0] {
        let step =
            Mat3::from_cols(Vec3::new(sign, 0.1, 0.0), Vec3::new(0.2, 1.0, 0.1), Vec3::new(0.0, -0.3, 0.9))
                * (2.2 / 48.0);
        let grid = Grid::new([48; 3], -(step * Vec3::splat(24.0)), step).unwrap();
        let (mesh, _) = run(&field(&two_holes()), &grid, |s| s.error = 0.005);
        check("sheared", &mesh, true);
        let report = mesh.check();
        assert!(report.volume > 0.0 && report.genus == Some(2), "{sign} {report}");
    }
}

/// Goes red when the budget is not looked at.
#[test]
fn a_budget_that_runs_out_gives_a_valid_mesh() {
    let f = field(&gyroid_ball());
    for budget in [1, 500, 5000] {
        let (mesh, report) = run(&f, &cube(128), |s| {
            s.budget = budget;
            s.error = 1e-3;
        });
        check("budget", &mesh, true);
        assert!(report.nodes <= budget.max(9) && report.unsplit > 0 && report.unsplit_size > 1, "{report:?}");
    }
}

#[test]
fn fields_without_surface_and_bad_settings() {
    let nan = Closure::new(Sense::Below, |_| f32::NAN);
    let half_nan = Closure::new(Sense::Below, |p: Vec3| if p.x > 0.1 { f32::NAN } else { p.length() - 0.7 });
    for f in [&field(&Expr::from(1.0)) as &dyn Field, &field(&Expr::from(-1.0)), &nan] {
        let (mesh, report) = run(f, &cube(16), |_| {});
        assert_eq!((mesh.triangles.len(), mesh.vertices.len(), report.over), (0, 0, 0));
    }
    let (mesh, _) = run(&half_nan, &cube(32), |_| {});
    check("half NaN", &mesh, true);
    assert!(mesh.triangles.len() > 100);

    let f = field(&sphere(0.5));
    let surface = Surface::new(&f, 0.0, Sense::Below, 1e-3).unwrap();
    let grid = cube(16);
    for error in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let settings = Settings { error, ..Settings::new(&grid) };
        assert!(matches!(extract(&surface, &grid, &settings, &|_| {}), Err(OctreeError::Error(_))));
    }
    let settings = Settings { budget: 0, ..Settings::new(&grid) };
    assert_eq!(extract(&surface, &grid, &settings, &|_| {}), Err(OctreeError::Budget));
    for iso in [f32::NAN, f32::INFINITY] {
        let surface = Surface::new(&f, iso, Sense::Below, 1e-3).unwrap();
        let found = extract(&surface, &grid, &Settings::new(&grid), &|_| {});
        assert!(matches!(found, Err(OctreeError::Iso(_))));
    }
    let loops =
        "fn density(p: vec3<f32>) -> f32 { var s = 0.0; while s < p.x { s += 0.1; } return s - 0.5; }";
    let black = UserField::new(loops, "black", Sense::Below).unwrap();
    assert!(matches!(Surface::new(&black, 0.0, Sense::Below, 1e-3), Err(NoForm::Cpu)));
}

/// A plate thinner than a cell between two layers of points: nothing is meshed, but it is told.
#[test]
fn thin_features_are_counted() {
    let plate = |half: f64| (z() - 0.03).abs().max(x().abs().max(y().abs()) - 0.5) - half;
    let (mesh, report) = run(&field(&plate(0.004)), &cube(32), |_| {});
    assert!(mesh.triangles.is_empty() && report.thin > 200, "{report:?}");
    assert_eq!(run(&field(&sphere(0.6)), &cube(32), |_| {}).1.thin, 0);
}

#[test]
fn the_same_bytes_on_one_thread_and_on_many() {
    let f = field(&random_csg(&mut Random(5)));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&f, &cube(64), |s| s.error = 0.001))
    };
    let [one, four] = [on(1), on(4)];
    assert!(one.0.vertices.len() > 500 && one.1 == four.1, "{:?} {:?}", one.1, four.1);
    assert!(one.0 == four.0, "the meshes differ");
}

/// Normals are the field's gradients, and unit vectors.
#[test]
fn normals_are_exact() {
    let (mesh, _) = run(&field(&sphere(0.77)), &cube(64), |_| {});
    for v in &mesh.vertices {
        assert!(Vec3::from(v.normal).distance(v.at().normalize()) < 1e-5);
    }
}
