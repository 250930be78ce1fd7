//! The functions that fields are made of: a GPU gives the bits of their twins.

mod common;
#[path = "functions/elementary.rs"]
mod elementary;
#[path = "functions/exact.rs"]
mod exact;
#[path = "functions/noise.rs"]
mod noise;

use bytemuck::Pod;
use isoforge::gpu::kernel::{Bindings, Kernel, binding as b};
use isoforge::gpu::{Form, Gpu};
use wgpu::BufferUsages as U;

/// Asserts that `expression` over each `o` of `operands` is what `twin` gives, after `library`, bit for bit, where the adapter
/// rounds quotients and roots and where isoforge does. One NaN is as good as another.
fn check<const N: usize>(
    library: &str,
    name: &str,
    expression: &str,
    operands: &[[f32; 4]],
    twin: impl Fn(&[f32; 4]) -> [f32; N],
) where
    [f32; N]: Pod,
{
    let Some(gpu) = common::gpu() else { return };
    for gpu in [gpu.clone(), gpu.with_form(Form::Shared).expect("every adapter has it")] {
        check_on(&gpu, library, name, expression, operands, &twin);
    }
}

fn check_on<const N: usize>(
    gpu: &Gpu,
    library: &str,
    name: &str,
    expression: &str,
    operands: &[[f32; 4]],
    twin: impl Fn(&[f32; 4]) -> [f32; N],
) where
    [f32; N]: Pod,
{
    let ty = if N == 1 { "f32".to_string() } else { format!("vec{N}<f32>") };
    let source = format!(
        "{library}
        struct Params {{
    nothing: u32,
}}
        @group(0) @binding(0) var<uniform> params: Params;
        @group(0) @binding({}) var<storage, read> operands: array<vec4<f32>>;
        @group(0) @binding({}) var<storage, read_write> results: array<{ty}>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            if id.x < arrayLength(&operands) {{
                let o = operands[id.x];
                results[id.x] = {expression};
            }}
        }}",
        b::SOURCE,
        b::SAMPLES
    );
    let kernel = Kernel::new(gpu, &source, "main", &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
    let bytes = size_of_val(operands) as u64;
    let from = gpu.buffer("operands", bytes, U::STORAGE | U::COPY_DST).unwrap();
    let into = gpu.buffer("results", bytes / 4 * N as u64, U::STORAGE | U::COPY_SRC).unwrap();
    gpu.write(&from, bytemuck::cast_slice(operands)).unwrap();
    let params = gpu.buffer("params", 16, U::UNIFORM | U::COPY_DST).unwrap();
    gpu.write(&params, &[0; 16]).unwrap();
    let mut bindings = Bindings::default();
    bindings.set(b::PARAMS, &params).set(b::SOURCE, &from).set(b::SAMPLES, &into);
    gpu.guarded(name, 0, || {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        kernel.dispatch(gpu, &mut pass, &bindings, operands.len().div_ceil(64) as u32);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    })
    .unwrap();
    let results: Vec<[f32; N]> = gpu.read(&into, operands.len() as u64).unwrap();

    let same = |a: f32, b: f32| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
    let differs = |(o, r): &(&[f32; 4], &[f32; N])| !twin(o).iter().zip(*r).all(|(&b, &a)| same(a, b));
    let mut wrong = operands.iter().zip(&results).filter(differs);
    if let Some((o, r)) = wrong.next() {
        let more = wrong.count();
        panic!("{name} of {o:?}: {r:?} on the GPU, {:?} by the twin, and {more} more", twin(o));
    }
}
