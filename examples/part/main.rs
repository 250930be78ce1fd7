//! What culling by intervals saves on a machined part: `cargo run --release --example part [-- CELLS]`.
//!
//! Extracts it on the CPU at 1024³ (or CELLS³) once culled, a few times over, and once with every point sampled.

use glam::Vec3;
use isoforge::extract::{Options, STAGES, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::graph::GraphField;
use isoforge::grid::Grid;
use std::time::Instant;

mod solid;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let cells = std::env::args().nth(1).map_or(Ok(1024), |a| a.parse())?;
    let field = GraphField::new(&solid::part()?, Sense::Below);
    let half = Vec3::splat(1.05 * solid::HALF[0]);
    let grid = Grid::from_bounds([cells; 3], -half, half)?;
    println!("{} operations, {cells}³ cells", field.operations());
    let mut best = [f64::INFINITY; 2];
    let mut sizes = [0; 2];
    for (all, runs) in [(0, 5), (1, 1)] {
        for _ in 0..runs {
            let since = Instant::now();
            let options = Options { cull: all == 0, ..Options::new(0.0) };
            let (mesh, report) = extract_on_cpu(&Source::Field(&field, grid), &options, &|_| {})?;
            best[all] = best[all].min(since.elapsed().as_secs_f64());
            sizes[all] = mesh.triangles.len();
            print!("{} of {} bricks", report.active_bricks, report.bricks);
            for (stage, seconds) in STAGES.iter().zip(report.seconds) {
                seconds.iter().for_each(|s| print!(", {stage} {s:.3} s"));
            }
            println!();
        }
    }
    assert_eq!(sizes[0], sizes[1]);
    let [culled, every] = best;
    println!(
        "{} triangles; culled {culled:.3} s, every point {every:.3} s: {:.1} x",
        sizes[0],
        every / culled
    );
    Ok(())
}
