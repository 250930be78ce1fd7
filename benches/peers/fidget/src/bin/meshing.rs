//! Meshes of the same shapes by isoforge's octree and by fidget's mesher with its JIT, at equal measured error, on the same
//! threads (`RAYON_NUM_THREADS`): triangles and time.
//!
//! For each depth of fidget's octree, ε of isoforge's is searched such that the error (largest, then RMS distance of triangle
//! samples to the surface, the same code for both) is just not larger than fidget's.

use fidget_core::context::Tree;
use fidget_jit::JitShape;
use fidget_mesh::{Octree, Settings as Theirs};
use glam::{DVec3, Vec3};
use isoforge::field::{Sense, Surface};
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::octree::{Settings, extract};
use std::time::Instant;

struct Shape {
    name: &'static str,
    ours: Expr,
    theirs: Tree,
    exact: fn(DVec3) -> f64,
}

fn shapes() -> Vec<Shape> {
    let (a, b, c) = (x(), y(), z());
    let (p, q, r) = Tree::axes();
    let length = || (x().square() + y().square() + z().square()).sqrt();
    let their_length = || (p.clone().square() + q.clone().square() + r.clone().square()).sqrt();
    let cube = || x().abs().max(y().abs()).max(z().abs()) - 0.61;
    let their_cube = || p.clone().abs().max(q.clone().abs()).max(r.clone().abs()) - 0.61f32;
    let k = 7.0f32;
    let (s, t, u) = (p.clone() * k, q.clone() * k, r.clone() * k);
    let (l, m, n) = (a.clone() * 7.0, b.clone() * 7.0, c.clone() * 7.0);
    let gyroid = l.sin() * m.cos() + m.sin() * n.cos() + n.sin() * l.cos();
    let their_gyroid = s.clone().sin() * t.clone().cos() + t.sin() * u.clone().cos() + u.sin() * s.cos();
    let ring = |d: Expr, h: Expr| ((d - 0.55).square() + h.square()).sqrt() - 0.23;
    vec![
        Shape { name: "sphere", ours: length() - 0.77, theirs: their_length() - 0.77f32, exact: |p| p.length() - 0.77 },
        Shape {
            name: "torus",
            ours: ring((x().square() + y().square()).sqrt(), z()),
            theirs: (((p.clone().square() + q.clone().square()).sqrt() - 0.55f32).square() + r.clone().square()).sqrt()
                - 0.23f32,
            exact: |p| p.truncate().length().mul_add(1.0, -0.55).hypot(p.z) - 0.23,
        },
        Shape {
            name: "drilled block",
            ours: cube().max(0.31 - (x().square() + y().square()).sqrt()),
            theirs: their_cube().max(0.31f32 - (p.clone().square() + q.clone().square()).sqrt()),
            exact: |p| (p.abs().max_element() - 0.61).max(0.31 - p.truncate().length()),
        },
        Shape {
            name: "cube − sphere",
            ours: cube().max(0.75 - length()),
            theirs: their_cube().max(0.75f32 - their_length()),
            exact: |p| (p.abs().max_element() - 0.61).max(0.75 - p.length()),
        },
        Shape {
            name: "gyroid ball",
            ours: gyroid.max(length() - 0.83),
            theirs: their_gyroid.max(their_length() - 0.83f32),
            exact: |p| {
                let (s, c) = ((p * 7.0).map(f64::sin), (p * 7.0).map(f64::cos));
                (s.x * c.y + s.y * c.z + s.z * c.x).max(p.length() - 0.83)
            },
        },
    ]
}

/// Largest and RMS distance of 15 points of each triangle, by Newton steps on the field itself; with a triangle's area as
/// weight in the mean.
fn errors(exact: fn(DVec3) -> f64, triangles: impl Iterator<Item = [DVec3; 3]>) -> [f64; 2] {
    let (mut largest, mut sum, mut area) = (0.0f64, 0.0, 0.0);
    for [a, b, c] in triangles {
        let weight = (b - a).cross(c - a).length();
        for i in 0..=4 {
            for j in 0..=4 - i {
                let (u, v) = (f64::from(i) / 4.0, f64::from(j) / 4.0);
                let p = a * u + b * v + c * (1.0 - u - v);
                let mut at = p;
                for _ in 0..8 {
                    let slope = |axis: DVec3| (exact(at + axis * 1e-6) - exact(at - axis * 1e-6)) / 2e-6;
                    let g = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
                    let step = g * (exact(at) / g.length_squared());
                    if step.is_finite() {
                        at -= step;
                    }
                }
                let d = at.distance(p);
                largest = largest.max(d);
                sum += weight * d * d;
                area += weight;
            }
        }
    }
    [largest, (sum / area).sqrt()]
}

/// The best times of both, which take turns: what else the machine does meets both alike.
fn best(rounds: usize, theirs: impl Fn(), ours: impl Fn()) -> [f64; 2] {
    let mut best = [f64::INFINITY; 2];
    for _ in 0..rounds {
        for (best, f) in best.iter_mut().zip([&theirs as &dyn Fn(), &ours]) {
            let since = Instant::now();
            f();
            *best = best.min(since.elapsed().as_secs_f64());
        }
    }
    best
}

fn main() {
    let only = std::env::args().nth(1);
    println!(
        "| shape | depth | fidget: triangles, ms, largest, RMS | equal | isoforge: triangles, ms, largest, RMS | triangles | time |"
    );
    for shape in shapes() {
        if only.as_ref().is_some_and(|o| !shape.name.starts_with(o)) {
            continue;
        }
        let field = GraphField::new(&shape.ours, Sense::Below);
        let surface = Surface::new(&field, 0.0, Sense::Below, 1e-3).unwrap();
        let theirs = JitShape::from(shape.theirs).try_into().unwrap();
        for depth in 4..=7 {
            let settings = Theirs { depth, ..Default::default() };
            let fidget = || Octree::build(&theirs, &settings).unwrap().walk_dual();
            let mesh = fidget();
            let corners = |v: &usize| {
                let v = mesh.vertices[*v];
                DVec3::new(v.x.into(), v.y.into(), v.z.into())
            };
            let at = |t: &[usize]| [corners(&t[0]), corners(&t[1]), corners(&t[2])];
            let their_error = errors(shape.exact, mesh.triangles.iter().map(|t| at(t.as_slice())));
            let their_count = mesh.triangles.len();
            for (which, name) in ["largest", "RMS"].into_iter().enumerate() {
                let grid = Grid::from_bounds([1 << (depth + 1); 3], Vec3::NEG_ONE, Vec3::ONE).unwrap();
                let make = |error: f64| {
                    let settings = Settings { error: error as f32, ..Settings::new(&grid) };
                    extract(&surface, &grid, &settings, &|_| {}).unwrap().0
                };
                let measure = |error: f64| {
                    let mesh = make(error);
                    let at = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize].at().as_dvec3());
                    (errors(shape.exact, mesh.triangles.iter().map(at)), mesh.triangles.len())
                };
                // The largest ε of a series that is good enough.
                let goal = their_error[which];
                let mut tried = (0..30).map(|i| {
                    let error = goal * 2.0 * 0.86f64.powi(i) * [1.0, 4.0][which];
                    (error, measure(error))
                });
                let Some((error, (ours, count))) = tried.find(|(_, (e, _))| e[which] <= goal * 1.0001 + 1e-7) else {
                    println!(
                        "| {} | {depth} | {their_count} {their_error:.2?} | {name} | not reached | | |",
                        shape.name
                    );
                    continue;
                };
                let [their_time, time] = best(7, || drop(fidget()), || drop(make(error)));
                println!(
                    "| {} | {depth} | {their_count} {:.1} {:.1e} {:.1e} | {name} | {count} {:.1} {:.1e} {:.1e} | {:.2} | {:.2} |",
                    shape.name,
                    their_time * 1e3,
                    their_error[0],
                    their_error[1],
                    time * 1e3,
                    ours[0],
                    ours[1],
                    count as f64 / their_count as f64,
                    time / their_time
                );
            }
        }
    }
}
