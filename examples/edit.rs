//! A slider over a parameter of a scene, full extraction against incremental:
//! `cargo run --release --example edit [-- SCENE PARAMETER FROM TO STEPS CELLS]`.
//!
//! Without arguments: `examples/scenes/part.toml bore 0.40 0.45 10`, with the scene's own cells. CELLS is how many there
//! are along the longest side.

use isoforge::extract::{Incremental, Options, Source, extract_on_cpu};
use isoforge::grid::Grid;
use isoforge::scene::{OpenOptions, Scene};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

/// Milliseconds since then.
fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arg = |i: usize, default: &'static str| args.get(i).map_or(default, String::as_str);
    let scene = Scene::open(Path::new(arg(0, "examples/scenes/part.toml")), &OpenOptions::default())?;
    let parameter = arg(1, "bore");
    let [from, to] = [arg(2, "0.40").parse::<f64>()?, arg(3, "0.45").parse()?];
    let steps: u32 = arg(4, "10").parse()?;
    let [low, high] = scene.bounds.ok_or("the scene names no bounds")?;
    let mut cells = scene.cells.unwrap_or([100; 3]);
    if let Some(longest) = args.get(5) {
        let (longest, side) = (longest.parse::<f32>()?, high - low);
        cells = (side / side.max_element() * longest).round().max(glam::Vec3::ONE).as_uvec3().to_array();
    }
    let grid = Grid::from_bounds(cells, low, high)?;
    let options = Options::new(scene.iso.unwrap_or(0.0));

    let mut field = scene.field();
    let mut incremental = Incremental::new(grid);
    incremental.update(&field, &options)?;
    println!(
        "{parameter:>10} | full ms | incremental ms | ratio | dirty bricks | kept | triangles | same bytes"
    );
    let mut sums = [0.0; 2];
    for step in 0..=steps {
        let value = from + (to - from) * f64::from(step) / f64::from(steps.max(1));
        field.set(parameter, value)?;
        let since = Instant::now();
        let (mesh, _) = extract_on_cpu(&Source::Field(&field, grid), &options, &|_| {})?;
        let full = ms(since);
        let since = Instant::now();
        let update = incremental.update(&field, &options)?;
        let partial = ms(since);
        sums = [sums[0] + full, sums[1] + partial];
        println!(
            "{value:10.4} | {full:7.2} | {partial:14.2} | {:5.2} | {:12} | {:4} | {:9} | {}",
            partial / full,
            update.dirty_bricks,
            update.kept_bricks,
            update.triangles,
            *incremental.mesh() == mesh
        );
    }
    println!("all: {:.1} ms full, {:.1} ms incremental, {:.2} times", sums[0], sums[1], sums[1] / sums[0]);
    Ok(())
}
