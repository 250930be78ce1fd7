//! sample: the values of the bricks' points.

use crate::common;
use crate::inputs::check;
use isoforge::field::Sense;
use isoforge::field::{Field, PARAMETER_VECTORS};
use isoforge::gpu::Settings;
use isoforge::gpu::kernel::{Bindings, binding as b};
use isoforge::stage::classify::{BrickRecord, Classify};
use isoforge::stage::method::Method;
use isoforge::stage::params::{Params, Work};
use isoforge::stage::sample::{BRICK_BYTES, Sample};
use isoforge::stage::shaders::Samples;
use wgpu::BufferUsages as U;

/// Goes red when `grid_position` (`shaders/shared/grid.wgsl`) adds in another order, when
/// `shaders/sample.wgsl` swaps y and z, and when points past the grid's end are not repeated.
#[test]
fn as_the_twin() {
    check("sample", &["values"]);
}

/// Indirect dispatches go up to 65535 workgroups along x and then along y, so a large batch gets more
/// workgroups than slots. Those must leave the samples and the counts alone: the next batch's slots are
/// theirs to neither write nor count. Goes red when `batch_end` (`shaders/shared/grid.wgsl`) forgets the
/// batch.
#[test]
fn workgroups_beyond_the_batch_do_nothing() {
    let Some(gpu) = common::gpu() else { return };
    let (field, grid) = common::named("sphere", 15);
    let wgsl = field.wgsl().unwrap();
    let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
    let filled = |what, bytes: &[u8], usage| {
        let buffer = gpu.buffer(what, bytes.len() as u64, usage).unwrap();
        gpu.queue.write_buffer(&buffer, 0, bytes);
        buffer
    };
    // 8 bricks in batches of 2; the second batch, and 2 x 3 workgroups for it.
    let (slots, batch, first_slot) = (8u32, 2u32, 2u32);
    let params = Params { first_slot, ..Params::new(&grid, f32::MAX, Sense::Below) };
    let work =
        Work { active_bricks: slots, own_active: slots, batch_slots: batch, batches: 4, ..Work::default() };
    let params = Settings::new(gpu, &params.uniform(), &params.call());
    let work = filled("work", bytemuck::bytes_of(&work), storage);
    let active = filled("active", bytemuck::cast_slice(&[0u32, 1, 2, 3, 4, 5, 6, 7]), storage);
    let dispatches = filled("dispatches", bytemuck::cast_slice(&[2u32, 3, 1]), storage | U::INDIRECT);
    let parameters = filled("field", &[0; 16 * PARAMETER_VECTORS], U::UNIFORM | U::COPY_DST);
    // Room for all, so that a write too far shows.
    let poison = f32::NAN.to_ne_bytes().repeat(slots as usize * 729);
    let samples = filled("samples", &poison, storage);
    let records = filled("records", &[0xcd; 8 * size_of::<BrickRecord>()], storage);
    let counts = filled("counts", &[0xcd; 9 * 8], storage);
    let table = filled("table", &[0; 2048], storage);

    let mut bindings = Bindings::default();
    bindings.set_settings(&params).set(b::WORK, &work).set(b::ACTIVE, &active).set(b::FIELD, &parameters);
    bindings.set(b::SAMPLES, &samples).set(b::SOURCE, &samples);
    bindings.set(b::RECORDS, &records).set(b::COUNTS, &counts).set(b::TABLE, &table);
    let sample = Sample::new(gpu, &wgsl).unwrap();
    let classify = Classify::new(gpu, Samples::Field(&wgsl), Method::MarchingCubes).unwrap();
    gpu.guarded("batch", 0, || {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        sample.encode(gpu, &mut pass, &bindings, &dispatches, 0);
        classify.encode(gpu, &mut pass, &bindings, &dispatches, 0);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    })
    .unwrap();

    let samples: Vec<f32> = gpu.read(&samples, u64::from(slots) * BRICK_BYTES / 4).unwrap();
    let (own, rest) = samples.split_at(batch as usize * 729);
    assert!(own.iter().all(|v| v.is_finite()), "the batch's own samples are there");
    assert!(rest.iter().all(|v| v.is_nan()), "samples were written behind the batch");
    let counts: Vec<[u32; 2]> = gpu.read(&counts, 9).unwrap();
    let untouched = |slot: u32| counts[slot as usize] == [0xcdcd_cdcd; 2];
    assert!((0..9).all(|slot| untouched(slot) != (2..4).contains(&slot)), "{counts:x?}");
    let work: Work = gpu.read_one(&work).unwrap();
    assert_eq!(work.non_finite, 0, "samples of other batches were counted");
}
