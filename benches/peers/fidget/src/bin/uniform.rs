//! The same expressions meshed at the same finest cell by isoforge's marching cubes (culled, memory used again) and by fidget's
//! octree mesher with its JIT, on the same threads (`RAYON_NUM_THREADS`), in turns: triangles a second, and the time to
//! the same surface error.
//!
//! For the latter the grid of isoforge is searched, a tenth at a time, whose RMS distance of triangle samples to the surface
//! (the same code for both) is not larger than fidget's.

use fidget_core::context::Tree;
use fidget_jit::JitShape;
use fidget_mesh::{Octree, Settings};
use glam::{DVec3, Vec3};
use isoforge::extract::{CpuExtractor, Options, Source};
use isoforge::field::Sense;
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use std::time::Instant;

/// Passes, in each of which both take their turn.
const PASSES: usize = 7;
/// Triangles of a mesh that its error is measured at.
const MEASURED: usize = 20_000;

struct Shape {
    name: &'static str,
    ours: Expr,
    theirs: Tree,
    exact: fn(DVec3) -> f64,
}

/// Where the part is drilled.
const HOLES: [[f32; 2]; 4] = [[-0.45, -0.45], [0.45, -0.45], [-0.45, 0.45], [0.45, 0.45]];

fn shapes() -> Vec<Shape> {
    let (p, q, r) = Tree::axes();
    let length = || (x().square() + y().square() + z().square()).sqrt();
    let their_length = || (p.clone().square() + q.clone().square() + r.clone().square()).sqrt();
    let (l, m, n) = (x() * 7.0, y() * 7.0, z() * 7.0);
    let (s, t, u) = (p.clone() * 7f32, q.clone() * 7f32, r.clone() * 7f32);
    let gyroid = l.sin() * m.cos() + m.sin() * n.cos() + n.sin() * l.cos();
    let their_gyroid = s.clone().sin() * t.clone().cos() + t.sin() * u.clone().cos() + u.sin() * s.cos();
    // A plate with a boss, a bore through both, and four holes.
    let plate = x().abs().max(y().abs()).max(z().abs() + 0.4) - 0.71;
    let radius = || (x().square() + y().square()).sqrt();
    let part = plate.min((radius() - 0.4).max((z() - 0.2).abs() - 0.4)).max(0.23 - radius());
    let hole = |[a, b]: [f32; 2]| 0.11 - ((x() - a).square() + (y() - b).square()).sqrt();
    let their_plate = p.clone().abs().max(q.clone().abs()).max(r.clone().abs() + 0.4f32) - 0.71f32;
    let their_radius = || (p.clone().square() + q.clone().square()).sqrt();
    let their_boss = (their_radius() - 0.4f32).max((r.clone() - 0.2f32).abs() - 0.4f32);
    let their_part = their_plate.min(their_boss).max(0.23f32 - their_radius());
    let their_hole =
        |[a, b]: [f32; 2]| 0.11f32 - ((p.clone() - a).square() + (q.clone() - b).square()).sqrt();
    vec![
        Shape { name: "sphere", ours: length() - 0.77, theirs: their_length() - 0.77f32, exact: |p| p.length() - 0.77 },
        Shape {
            name: "torus",
            ours: ((radius() - 0.55).square() + z().square()).sqrt() - 0.23,
            theirs: ((their_radius() - 0.55f32).square() + r.clone().square()).sqrt() - 0.23f32,
            exact: |p| (p.truncate().length() - 0.55).hypot(p.z) - 0.23,
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
        Shape {
            name: "part",
            ours: HOLES.into_iter().fold(part, |part, at| part.max(hole(at))),
            theirs: HOLES.into_iter().fold(their_part, |part, at| part.max(their_hole(at))),
            exact: |p| {
                let radius = p.truncate().length();
                let plate = p.x.abs().max(p.y.abs()).max(p.z.abs() + 0.4) - 0.71;
                let part = plate.min((radius - 0.4).max((p.z - 0.2).abs() - 0.4)).max(0.23 - radius);
                let hole = |[a, b]: [f32; 2]| 0.11 - (p.x - f64::from(a)).hypot(p.y - f64::from(b));
                HOLES.into_iter().fold(part, |part, at| part.max(hole(at)))
            },
        },
    ]
}

/// RMS distance of 15 points of each triangle, by Newton steps on the field itself, with a triangle's area as weight; of every
/// so many triangles.
fn rms(exact: fn(DVec3) -> f64, count: usize, triangle: impl Fn(usize) -> [DVec3; 3]) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for [a, b, c] in (0..count).step_by(count.div_ceil(MEASURED).max(1)).map(triangle) {
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
                sum += weight * at.distance_squared(p);
                area += weight;
            }
        }
    }
    (sum / area).sqrt()
}

fn timed(best: &mut f64, f: impl FnOnce()) {
    let since = Instant::now();
    f();
    *best = best.min(since.elapsed().as_secs_f64());
}

fn main() {
    let only = std::env::args().nth(1);
    println!(
        "| shape | depth | fidget: triangles, ms, RMS | isoforge: triangles, ms, RMS | triangles/s, isoforge ÷ fidget | equal RMS: cells, ms | time, isoforge ÷ fidget |"
    );
    println!("|---|---|---|---|---|---|---|");
    for shape in shapes() {
        if only.as_ref().is_some_and(|o| !shape.name.starts_with(o)) {
            continue;
        }
        let field = GraphField::new(&shape.ours, Sense::Below);
        let theirs = JitShape::from(shape.theirs).try_into().unwrap();
        let options = Options::new(0.0);
        for depth in 5..=8 {
            let settings = Settings { depth, ..Default::default() };
            let their_mesh = || Octree::build(&theirs, &settings).unwrap().walk_dual();
            let extract = |extractor: &mut CpuExtractor, cells: u32| {
                let grid = Grid::from_bounds([cells; 3], Vec3::NEG_ONE, Vec3::ONE).unwrap();
                extractor.extract(&Source::Field(&field, grid), &options, &|_| {}).unwrap();
            };
            let error = |extractor: &CpuExtractor| {
                let mesh = extractor.mesh();
                let corner = |v: u32| mesh.vertices[v as usize].at().as_dvec3();
                rms(shape.exact, mesh.triangles.len(), |i| mesh.triangles[i].map(corner))
            };

            let (mut same, mut equal) = (CpuExtractor::default(), CpuExtractor::default());
            extract(&mut same, 1 << depth);
            let our_error = error(&same);
            let mesh = their_mesh();
            let corner = |v: &usize| {
                let v = mesh.vertices[*v];
                DVec3::new(v.x.into(), v.y.into(), v.z.into())
            };
            let their_error = rms(shape.exact, mesh.triangles.len(), |i| {
                let t = mesh.triangles[i];
                [corner(&t[0]), corner(&t[1]), corner(&t[2])]
            });
            let mut sizes = (0..).map(|i| (8.0 * 1.1f64.powi(i)) as u32).take_while(|&cells| cells <= 1024);
            let coarse = sizes.find(|&cells| {
                extract(&mut equal, cells);
                error(&equal) <= their_error
            });

            let [mut our_time, mut their_time, mut equal_time] = [f64::INFINITY; 3];
            for _ in 0..PASSES {
                timed(&mut their_time, || drop(their_mesh()));
                timed(&mut our_time, || extract(&mut same, 1 << depth));
                if let Some(cells) = coarse {
                    timed(&mut equal_time, || extract(&mut equal, cells));
                }
            }
            let (our_count, their_count) = (same.mesh().triangles.len(), mesh.triangles.len());
            let rate = (our_count as f64 / our_time) / (their_count as f64 / their_time);
            println!(
                "| {} | {depth} | {their_count}, {:.2}, {their_error:.1e} | {our_count}, {:.2}, {our_error:.1e} | {rate:.2} | {}, {:.2} | {:.2} |",
                shape.name,
                their_time * 1e3,
                our_time * 1e3,
                coarse.map_or("none".into(), |n| n.to_string()),
                equal_time * 1e3,
                equal_time / their_time,
            );
        }
    }
}
