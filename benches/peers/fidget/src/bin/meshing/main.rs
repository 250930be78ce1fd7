//! Meshes of the same shapes by isoforge's octree and by fidget's mesher with its JIT, at equal measured error, on the same
//! threads (`RAYON_NUM_THREADS`): triangles and time.
//!
//! For each depth of fidget's octree, the coarsest setting of isoforge's is searched whose error (largest, then RMS, of both
//! directions, the same code for both) is not larger than fidget's: grids from fidget's finest cells on to twice as many an
//! axis, on each of them ε down by 14 % a step. With `--one-sided` the error that counts is that of the mesh's points alone,
//! which does not see what a mesh lacks. Another argument is the beginning of the name of the only shape to measure.

mod error;

use error::{Parts, Samples};
use fidget_core::context::Tree;
use fidget_jit::JitShape;
use fidget_mesh::{Octree, Settings as Theirs};
use glam::{DVec3, Vec3};
use isoforge::extract::{CpuExtractor, Options, Source};
use isoforge::field::{Sense, Surface};
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::mesh::{Mesh, Vertex};
use isoforge::octree::{Settings, extract};
use std::time::Instant;

struct Shape {
    name: &'static str,
    ours: Expr,
    theirs: Tree,
    parts: Parts,
}

fn one(part: f64) -> [f64; 4] {
    [part, f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY]
}

/// The cube without what `part` is positive in.
fn cut(p: DVec3, part: f64) -> [f64; 4] {
    let [x, y, z] = (p.abs() - 0.61).to_array();
    [x, y, z, part]
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
        Shape {
            name: "sphere",
            ours: length() - 0.77,
            theirs: their_length() - 0.77f32,
            parts: |p| one(p.length() - 0.77),
        },
        Shape {
            name: "torus",
            ours: ring((x().square() + y().square()).sqrt(), z()),
            theirs: (((p.clone().square() + q.clone().square()).sqrt() - 0.55f32).square()
                + r.clone().square())
            .sqrt()
                - 0.23f32,
            parts: |p| one((p.truncate().length() - 0.55).hypot(p.z) - 0.23),
        },
        Shape {
            name: "drilled block",
            ours: cube().max(0.31 - (x().square() + y().square()).sqrt()),
            theirs: their_cube().max(0.31f32 - (p.clone().square() + q.clone().square()).sqrt()),
            parts: |p| cut(p, 0.31 - p.truncate().length()),
        },
        Shape {
            name: "cube − sphere",
            ours: cube().max(0.75 - length()),
            theirs: their_cube().max(0.75f32 - their_length()),
            parts: |p| cut(p, 0.75 - p.length()),
        },
        Shape {
            name: "gyroid ball",
            ours: gyroid.max(length() - 0.83),
            theirs: their_gyroid.max(their_length() - 0.83f32),
            parts: |p| {
                let (s, c) = ((p * 7.0).map(f64::sin), (p * 7.0).map(f64::cos));
                let steepest = 7.0 * 6f64.sqrt();
                let gyroid = (s.x * c.y + s.y * c.z + s.z * c.x) / steepest;
                [gyroid, p.length() - 0.83, f64::NEG_INFINITY, f64::NEG_INFINITY]
            },
        },
    ]
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

/// Cells an axis of the mesh that points of the surface are taken from: half of those of fidget's deepest octree in size.
const FINE: u32 = 256;
/// Passes, in each of which both take their turn.
const PASSES: usize = 15;

fn grid(cells: u32) -> Grid {
    Grid::from_bounds([cells; 3], Vec3::NEG_ONE, Vec3::ONE).unwrap()
}

/// Triangles, ms, errors of both directions, of the mesh's points alone, pieces and Euler number.
fn told(mesh: &Mesh, time: f64, [both, one]: [error::Errors; 2]) -> String {
    let report = mesh.check();
    format!(
        "{}, {:.1}, {:.1e} {:.1e}, {:.1e} {:.1e}, {} {}",
        mesh.triangles.len(),
        time * 1e3,
        both[0],
        both[1],
        one[0],
        one[1],
        report.components,
        report.euler
    )
}

fn main() {
    let (flags, names): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|a| a.starts_with("--"));
    let one_sided = flags.iter().any(|f| f == "--one-sided");
    let columns =
        "triangles, ms, largest and RMS of both directions, from the mesh alone, pieces and Euler number";
    println!(
        "| shape | depth | fidget: {columns} | equal | isoforge: cells, ε, {columns} | triangles | time |"
    );
    println!("|---|---|---|---|---|---|---|");
    for shape in shapes() {
        if names.first().is_some_and(|o| !shape.name.starts_with(o)) {
            continue;
        }
        let field = GraphField::new(&shape.ours, Sense::Below);
        let surface = Surface::new(&field, 0.0, Sense::Below, 1e-3).unwrap();
        let theirs = JitShape::from(shape.theirs).try_into().unwrap();
        let mut fine = CpuExtractor::default();
        fine.extract(&Source::Field(&field, grid(FINE)), &Options::new(0.0), &|_| {}).unwrap();
        let samples = Samples::new(shape.parts, fine.mesh(), 2.0 / f64::from(FINE));
        let [points, sharp] = samples.count();
        eprintln!("{}: {points} points of the surface, {sharp} of them on creases", shape.name);
        for depth in 4..=7 {
            let settings = Theirs { depth, ..Default::default() };
            let fidget = || Octree::build(&theirs, &settings).unwrap().walk_dual();
            let mesh = fidget();
            let their_mesh = Mesh {
                vertices: mesh
                    .vertices
                    .iter()
                    .map(|v| Vertex { position: [v.x, v.y, v.z], normal: [0.0; 3] })
                    .collect(),
                triangles: mesh.triangles.iter().map(|t| [t.x, t.y, t.z].map(|v| v as u32)).collect(),
            };
            let their_errors = samples.errors(&their_mesh);
            for (which, name) in ["largest", "RMS"].into_iter().enumerate() {
                let make = |cells: u32, error: f64| {
                    let grid = grid(cells);
                    let settings = Settings { error: error as f32, ..Settings::new(&grid) };
                    extract(&surface, &grid, &settings, &|_| {}).unwrap().0
                };
                // The first of the series that is good enough: the coarsest grid, of those the largest ε.
                let goal = their_errors[usize::from(one_sided)][which];
                let series = (4..=8).flat_map(|quarters| {
                    let largest = goal * [2.0, 8.0][which];
                    (0..30).map(move |i| ((1 << depth) / 4 * quarters, largest * 0.86f64.powi(i)))
                });
                let mut tried = series.map(|(cells, error)| {
                    let mesh = make(cells, error);
                    let errors = samples.errors(&mesh);
                    (cells, error, mesh, errors)
                });
                let found = tried.find(|(.., e)| e[usize::from(one_sided)][which] <= goal * 1.0001 + 1e-7);
                let Some((cells, error, our_mesh, our_errors)) = found else {
                    let theirs = told(&their_mesh, f64::NAN, their_errors);
                    println!("| {} | {depth} | {theirs} | {name} | not reached | | |", shape.name);
                    continue;
                };
                let [their_time, our_time] = best(PASSES, || drop(fidget()), || drop(make(cells, error)));
                println!(
                    "| {} | {depth} | {} | {name} | {cells}³, {error:.1e}, {} | {:.2} | {:.2} |",
                    shape.name,
                    told(&their_mesh, their_time, their_errors),
                    told(&our_mesh, our_time, our_errors),
                    our_mesh.triangles.len() as f64 / their_mesh.triangles.len() as f64,
                    our_time / their_time
                );
            }
        }
    }
}
