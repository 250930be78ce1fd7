//! Measures 1,000,000 soft objects: `cargo run --release --example blobs [-- COUNT CELLS]`.
//!
//! Prints what building the field takes, each stage of the extraction on the CPU, and what writing and reading the
//! mesh's buffers once takes: that is what the rest is held against.

use glam::Vec3;
use isoforge::extract::{Options, STAGES, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::graph::GraphField;
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use std::time::Instant;

/// A number from 0 to 1 (splitmix64).
fn random(seed: &mut u64) -> f32 {
    *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*seed ^ (*seed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
}

/// Everywhere in the unit cube.
fn spray(count: usize) -> Vec<Component> {
    let (mut seed, radius) = (1, 1.0 / (count as f32).cbrt());
    let mut one = |_| Component { position: [0; 3].map(|_| random(&mut seed)), radius, weight: 1.0 };
    (0..count).map(&mut one).collect()
}

/// The lower half of the unit cube, filled with particles that overlap, its top in waves.
fn fluid(count: usize) -> Vec<Component> {
    let (mut seed, distance) = (2, (0.5 / count as f32).cbrt());
    let mut one = |_| {
        let [x, y, z] = [0; 3].map(|_| random(&mut seed));
        let top = 0.5 + 0.05 * ((x * 20.0).sin() + (y * 15.0).cos());
        Component { position: [x, y, z * top], radius: 2.0 * distance, weight: 1.0 }
    };
    (0..count).map(&mut one).collect()
}

fn copy_of(mesh: &Mesh) -> (f64, u64) {
    let since = Instant::now();
    let copy = mesh.clone();
    let sum = copy.triangles.iter().flatten().map(|&i| u64::from(i)).sum::<u64>()
        + copy.vertices.iter().map(|v| u64::from(v.position[0].to_bits())).sum::<u64>();
    (since.elapsed().as_secs_f64(), sum)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1).map(|a| a.parse::<u32>());
    let count = args.next().transpose()?.unwrap_or(1_000_000) as usize;
    let cells = args.next().transpose()?.unwrap_or(256);
    for (name, components) in [("spray", spray(count)), ("fluid", fluid(count))] {
        for _ in 0..2 {
            let components = components.clone();
            let since = Instant::now();
            let blobs = Blobs::new(Kernel::SoftObject, components)?;
            let binning = since.elapsed().as_secs_f64();
            let field = GraphField::new(&blobs.expr(), Sense::Above);
            let grid = Grid::from_bounds([cells; 3], Vec3::splat(-0.03), Vec3::splat(1.03))?;
            let since = Instant::now();
            let (mesh, report) = extract_on_cpu(&Source::Field(&field, grid), &Options::new(0.5), &|_| {})?;
            let extraction = since.elapsed().as_secs_f64();
            let (copy, check) = copy_of(&mesh);
            println!(
                "{name}: {count} components, {cells}³: binning {binning:.3} s, extraction {extraction:.3} s, \
                 {} triangles, mesh buffers {copy:.3} s, {:.2} x of the two ({} of {} bricks; {check:x})",
                report.triangles,
                extraction / (binning + copy),
                report.active_bricks,
                report.bricks,
            );
            let seconds = STAGES.iter().zip(report.seconds);
            for (stage, seconds) in seconds.filter_map(|(stage, s)| Some((stage, s?))) {
                println!("  {stage} {seconds:.3} s");
            }
        }
    }
    Ok(())
}
