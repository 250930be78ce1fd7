//! A field's WGSL, run by itself over lists of points and boxes.

use isoforge::field::{Field, PARAMETER_VECTORS};
use isoforge::gpu::Gpu;
use isoforge::gpu::kernel::{Bindings, Kernel, binding as b};
use wgpu::BufferUsages as U;

const INTERVAL: &str = include_str!("../../shaders/graph/interval.wgsl");
const DERIVATIVE: &str = include_str!("../../shaders/graph/derivative.wgsl");
const FUNCTIONS: &str = include_str!("../../shaders/shared/functions.wgsl");
const NOISE: &str = include_str!("../../shaders/shared/noise.wgsl");
const IS_FINITE: &str = "fn is_finite(bits: u32) -> bool { return (bits & 0x7f800000u) != 0x7f800000u; }\n";

/// Runs `body` for each item of `input` (so many floats each), which writes so many floats to `out` at `o`.
fn run(gpu: &Gpu, field: &dyn Field, text: &str, body: &str, input: &[f32], sizes: [usize; 2]) -> Vec<f32> {
    let wgsl = field.wgsl().unwrap();
    let count = input.len() / sizes[0];
    let source = format!(
        "{IS_FINITE}{FUNCTIONS}{NOISE}{DERIVATIVE}{text}
        struct Params {{
    nothing: u32,
}}
        @group(0) @binding(0) var<uniform> params: Params;
        @group(0) @binding(16) var<uniform> field_parameters: array<vec4<f32>, {PARAMETER_VECTORS}>;
        @group(0) @binding(17) var<storage, read> field_data: array<u32>;
        @group(0) @binding(2) var<storage, read> source: array<f32>;
        @group(0) @binding(12) var<storage, read_write> out: array<f32>;
        @compute @workgroup_size(64)
        fn run(@builtin(global_invocation_id) id: vec3<u32>) {{
            let n = id.x;
            if n >= {count}u {{ return; }}
            let i = n * {}u;
            let o = n * {}u;
            {body}
        }}",
        sizes[0], sizes[1]
    );
    let kernel = Kernel::new(gpu, &source, "run", &[]).unwrap();
    let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
    let buffer = |bytes: &[u8], least: usize, usage| {
        let buffer = gpu.buffer("test", bytes.len().max(least) as u64, usage).unwrap();
        gpu.queue.write_buffer(&buffer, 0, bytes);
        buffer
    };
    let parameters =
        buffer(bytemuck::cast_slice(&wgsl.parameters), 16 * PARAMETER_VECTORS, U::UNIFORM | U::COPY_DST);
    let data = buffer(bytemuck::cast_slice(&wgsl.data), 16, storage);
    let source = buffer(bytemuck::cast_slice(input), 16, storage);
    let out = buffer(&[], 4 * count * sizes[1], storage);
    let params = buffer(&[], 16, U::UNIFORM | U::COPY_DST);
    let mut bindings = Bindings::default();
    bindings
        .set(b::PARAMS, &params)
        .set(b::FIELD, &parameters)
        .set(b::FIELD_DATA, &data)
        .set(b::SOURCE, &source)
        .set(b::SAMPLES, &out);
    gpu.guarded("test", 0, || {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        kernel.dispatch(gpu, &mut pass, &bindings, count.div_ceil(64) as u32);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    })
    .unwrap();
    gpu.read(&out, (count * sizes[1]) as u64).unwrap()
}

pub fn values(gpu: &Gpu, field: &dyn Field, points: &[[f32; 3]]) -> Vec<f32> {
    let text = field.wgsl().unwrap().value;
    let body = "out[o] = density(vec3<f32>(source[i], source[i + 1u], source[i + 2u]));";
    run(gpu, field, &text, body, points.as_flattened(), [3, 1])
}

/// By planes; the text must be there.
pub fn values_by_planes(gpu: &Gpu, field: &dyn Field, points: &[[f32; 3]]) -> Vec<f32> {
    let text = field.wgsl().unwrap().planes.unwrap().text;
    // What the first part takes has no z, what the second takes z alone.
    let body = "let p = vec3<f32>(source[i], source[i + 1u], source[i + 2u]);
        out[o] = density_in_plane(density_plane(vec3<f32>(p.xy, 1e30)), density_level(vec3<f32>(1e30, 1e30, p.z)));";
    run(gpu, field, &text, body, points.as_flattened(), [3, 1])
}

pub fn gradients(gpu: &Gpu, field: &dyn Field, points: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let text = field.wgsl().unwrap().gradient.unwrap();
    let body = "let g = density_gradient(vec3<f32>(source[i], source[i + 1u], source[i + 2u]));
        out[o] = g.x; out[o + 1u] = g.y; out[o + 2u] = g.z;";
    let flat = run(gpu, field, &text, body, points.as_flattened(), [3, 3]);
    flat.as_chunks().0.to_vec()
}

/// Bounds over boxes: lowest and highest x, y, z.
pub fn intervals(gpu: &Gpu, field: &dyn Field, boxes: &[[f32; 6]]) -> Vec<[f32; 2]> {
    let text = format!("{INTERVAL}{}", field.wgsl().unwrap().interval.unwrap());
    let body = "let r = density_interval(vec2<f32>(source[i], source[i + 1u]),
        vec2<f32>(source[i + 2u], source[i + 3u]), vec2<f32>(source[i + 4u], source[i + 5u]));
        out[o] = r.x; out[o + 1u] = r.y;";
    run(gpu, field, &text, body, boxes.as_flattened(), [6, 2]).as_chunks().0.to_vec()
}
