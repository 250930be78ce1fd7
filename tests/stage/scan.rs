//! scan: offsets, and the stage by itself at lengths around its runs and workgroups.

use crate::common::{self, Random};
use crate::inputs::check;
use isoforge::gpu::kernel::{Bindings, binding as b};
use isoforge::gpu::{Form, Gpu, Settings};
use isoforge::stage::params::{Params, Work};
use isoforge::stage::scan::cpu::scan;
use isoforge::stage::scan::{Scan, Scanned};
use wgpu::BufferUsages as U;

/// Goes red when `apply` (`shaders/scan.wgsl`) adds the item before it writes the sum, and when the total
/// behind the last item is missing.
#[test]
fn as_the_twin() {
    check("scan", &["offsets"]);
}

/// Scans `items` on the GPU, in buffers full of rubbish and dispatched for `dispatched` items.
fn on_gpu(gpu: &Gpu, stage: &Scan, items: &[[u32; 2]], dispatched: u32, over_bricks: bool) -> Vec<[u32; 2]> {
    let n = items.len() as u32;
    let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
    let filled = |what, bytes: &[u8], usage| {
        let buffer = gpu.buffer(what, bytes.len() as u64, usage).unwrap();
        gpu.queue.write_buffer(&buffer, 0, bytes);
        buffer
    };
    let (bricks, active) = if over_bricks { (n, 0xdead_beef) } else { (0xdead_beef, n) };
    let params = Params { slab_bricks: bricks, ..Params::default() };
    let work = Work { active_bricks: active, ..Work::default() };
    let params = Settings::new(gpu, &params.uniform(), &params.call());
    let work = filled("work", bytemuck::bytes_of(&work), storage);
    // Behind the items: room for the total, and two more that must stay as they are.
    let mut with_rubbish = items.to_vec();
    with_rubbish.extend([[0xcdcd_cdcd; 2]; 3]);
    let counts = filled("counts", bytemuck::cast_slice(&with_rubbish), storage);
    let partials = filled("partials", &vec![0xcd; 8 * dispatched.div_ceil(64).max(1) as usize], storage);
    let mut bindings = Bindings::default();
    bindings.set_settings(&params).set(b::WORK, &work).set(b::COUNTS, &counts).set(b::PARTIALS, &partials);
    gpu.guarded("scan", 0, || {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        stage.encode(gpu, &mut pass, &bindings, dispatched);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    })
    .unwrap();
    gpu.read(&counts, u64::from(n + 3)).unwrap()
}

/// Goes red when `scan_partials` leaves out the first chunk, which takes more bricks than the comparisons
/// have.
#[test]
fn by_itself_at_every_length() {
    let Some(gpu) = common::gpu() else { return };
    let forms = Form::ALL.into_iter().filter_map(|form| gpu.with_form(form));
    for (gpu, over_bricks) in forms.flat_map(|gpu| [(gpu.clone(), false), (gpu, true)]) {
        let gpu = &gpu;
        let scanned = if over_bricks { Scanned::AllCounts } else { Scanned::Counts };
        let stage = Scan::new(gpu, scanned).unwrap();
        for n in [0usize, 1, 2, 63, 64, 65, 127, 128, 129, 4095, 4096, 4097, 8191, 8193, 262_145, 300_001] {
            let mut random = Random(n as u64);
            let mut items: Vec<[u32; 2]> =
                (0..n).map(|_| [0, 0].map(|_| random.next() as u32 % 2561)).collect();
            if n == 8193 {
                // Sums that wrap: both sides agree on that too.
                items.iter_mut().for_each(|item| *item = item.map(|v| v.wrapping_mul(0x9e37_79b9)));
            }
            let mut twin = items.clone();
            twin.push([77; 2]);
            scan(&mut twin);
            twin.extend([[0xcdcd_cdcd; 2]; 2]);
            // Dispatched for more items than there are, as for the bricks of a slab of which few are active.
            for dispatched in [n as u32, 2 * n as u32 + 100] {
                let scanned = on_gpu(gpu, &stage, &items, dispatched, over_bricks);
                let first = scanned.iter().zip(&twin).position(|(a, b)| a != b);
                assert_eq!(first, None, "{n} items, dispatched for {dispatched}, over bricks: {over_bricks}");
            }
        }
    }
}
