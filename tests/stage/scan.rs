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

/// Slots of a batch, where the items are bricks.
const BATCH: u32 = 100;

/// Own bricks, of which those that make anything are listed: the others are the halo's.
fn own_of(n: u32) -> u32 {
    n - n / 5
}

/// Scans `items` on the GPU, in buffers full of rubbish and dispatched for `dispatched` items: the sums, and the list for emit.
fn on_gpu(
    gpu: &Gpu,
    stage: &Scan,
    items: &[[u32; 2]],
    dispatched: u32,
    scanned: Scanned,
) -> (Vec<[u32; 2]>, Vec<u32>) {
    let n = items.len() as u32;
    let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
    let filled = |what, bytes: &[u8], usage| {
        let buffer = gpu.buffer(what, bytes.len() as u64, usage).unwrap();
        gpu.queue.write_buffer(&buffer, 0, bytes);
        buffer
    };
    let is_bricks = scanned == Scanned::Bricks;
    let (bricks, active) = if is_bricks { (0xdead_beef, n) } else { (n, 0xdead_beef) };
    let params = Params { slab_bricks: bricks, ..Params::default() };
    // Room for a batch and a half more than there are.
    let slots = (n / BATCH + 2) * BATCH - BATCH / 2;
    let batches = slots.div_ceil(BATCH);
    let own_active = own_of(n);
    let work =
        Work { active_bricks: active, own_active, batch_slots: BATCH, batches, slots, ..Work::default() };
    let params = Settings::new(gpu, &params.uniform(), &params.call());
    let work = filled("work", bytemuck::bytes_of(&work), storage);
    // Behind the items: room for the total, and two more that must stay as they are.
    let mut with_rubbish = items.to_vec();
    with_rubbish.extend([[0xcdcd_cdcd; 2]; 3]);
    let counts = filled("counts", bytemuck::cast_slice(&with_rubbish), storage);
    let partials = filled("partials", &vec![0xcd; Scan::partial_bytes(dispatched.into()) as usize], storage);
    let list_words = u64::from(2 * slots + batches + 3);
    let list = filled("list", &vec![0xcd; 4 * list_words as usize], storage);
    let mut bindings = Bindings::default();
    bindings.set_settings(&params).set(b::WORK, &work).set(b::COUNTS, &counts).set(b::PARTIALS, &partials);
    bindings.set(b::ACTIVE, &list);
    gpu.guarded("scan", 0, || {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        stage.encode(gpu, &mut pass, &bindings, dispatched);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    })
    .unwrap();
    (gpu.read(&counts, u64::from(n + 3)).unwrap(), gpu.read(&list, list_words).unwrap())
}

/// What the list should be: rubbish where active bricks lie, the slots of own bricks that make anything, rubbish up to the last
/// slot, where each batch begins, and rubbish.
fn list_of(items: &[[u32; 2]]) -> Vec<u32> {
    let n = items.len() as u32;
    let slots = (n / BATCH + 2) * BATCH - BATCH / 2;
    let own = items.iter().take(own_of(n) as usize).enumerate();
    let listed: Vec<u32> = own.filter(|(_, item)| **item != [0, 0]).map(|(slot, _)| slot as u32).collect();
    let mut list = vec![0xcdcd_cdcd; slots as usize];
    list.extend(&listed);
    list.resize(2 * slots as usize, 0xcdcd_cdcd);
    let begins = |batch: u32| listed.partition_point(|&slot| slot < batch * BATCH) as u32;
    list.extend((0..=slots.div_ceil(BATCH)).map(begins));
    list.extend([0xcdcd_cdcd; 2]);
    list
}

/// Goes red when `scan_partials` leaves out the first chunk, which takes more bricks than the comparisons
/// have; when `item` of `shaders/scan/bricks.wgsl` lists the halo's bricks, too; and when `put_total` there says nothing of the batches behind
/// the last brick.
#[test]
fn by_itself_at_every_length() {
    let Some(gpu) = common::gpu() else { return };
    let forms = Form::ALL.into_iter().filter_map(|form| gpu.with_form(form));
    for (gpu, scanned) in forms.flat_map(|gpu| [(gpu.clone(), Scanned::Bricks), (gpu, Scanned::Counts)]) {
        let gpu = &gpu;
        let stage = Scan::new(gpu, scanned).unwrap();
        for n in
            [0usize, 1, 2, 63, 64, 65, 99, 100, 101, 128, 255, 256, 257, 4096, 4097, 8193, 262_145, 300_001]
        {
            let mut random = Random(n as u64);
            let mut items: Vec<[u32; 2]> =
                (0..n).map(|_| [0, 0].map(|_| random.next() as u32 % 2561)).collect();
            // Bricks that make nothing, or no vertices of their own.
            items.iter_mut().filter(|item| item[0] % 3 == 0).for_each(|item| *item = [0, item[1] % 2]);
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
                let (sums, list) = on_gpu(gpu, &stage, &items, dispatched, scanned);
                let what = format!("{n} items, dispatched for {dispatched}, {scanned:?}");
                assert_eq!(sums.iter().zip(&twin).position(|(a, b)| a != b), None, "{what}");
                if scanned == Scanned::Bricks {
                    let expected = list_of(&items);
                    assert_eq!(list.len(), expected.len(), "{what}");
                    let first = list.iter().zip(&expected).position(|(a, b)| a != b);
                    assert_eq!(first, None, "{what}: the list");
                }
            }
        }
    }
}
