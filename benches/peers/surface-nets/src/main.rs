//! Times fast-surface-nets on one raw `f32` volume: `surface-nets-peer FILE NX NY NZ ISO [--repeats N]`.
//!
//! One thread; the buffer is used again, as its documentation advises, and the first run into it is not counted. Normals
//! are part of what it makes. One JSON object on standard output, as `examples/bench_volume.rs` writes it.

use fast_surface_nets::ndshape::RuntimeShape;
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, nx, ny, nz, iso, rest @ ..] = &arguments[..] else { return Err("FILE NX NY NZ ISO [--repeats N]".into()) };
    let repeats: usize = rest.get(1).map_or(Ok(3), |n| n.parse())?;
    let points: [u32; 3] = [nx.parse()?, ny.parse()?, nz.parse()?];
    let iso: f32 = iso.parse()?;
    // It looks for the sign.
    let mut values: Vec<f32> = bytemuck::pod_collect_to_vec(&std::fs::read(file)?);
    values.iter_mut().for_each(|v| *v -= iso);
    let shape = RuntimeShape::<u32, 3>::new(points);
    let mut buffer = SurfaceNetsBuffer::default();
    let mut seconds = Vec::new();
    for _ in 0..=repeats {
        let start = Instant::now();
        surface_nets(&values, &shape, [0; 3], points.map(|n| n - 1), &mut buffer);
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.remove(0);
    seconds.sort_by(f64::total_cmp);
    let (best, median) = (seconds[0], seconds[seconds.len() / 2]);
    println!("{}", serde_json::json!({ "best": best, "median": median, "triangles": buffer.indices.len() / 3 }));
    Ok(())
}
