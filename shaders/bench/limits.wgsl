// What an adapter can do at most: `copy` moves bytes, `multiply` does arithmetic. For src/bench/roofline.rs.

@group(0) @binding(2) var<storage, read> source: array<vec4<u32>>;
@group(0) @binding(12) var<storage, read_write> samples: array<vec4<u32>>;

@compute @workgroup_size(256)
fn copy(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let all = groups.x * groups.y * 256u;
    for (var i = id.y * groups.x * 256u + id.x; i < arrayLength(&samples); i += all) {
        samples[i] = source[i];
    }
}

const STEPS = 1024u;

// Four chains of multiplications and additions, 64 operations a step; others run beside.
@compute @workgroup_size(256)
fn multiply(@builtin(global_invocation_id) id: vec3<u32>) {
    let factor = vec4<f32>(0.999 + 1e-6 * f32(id.x & 15u));
    var a = vec4<f32>(f32(id.x)) * 1e-3;
    var b = a + 1.0;
    for (var i = 0u; i < STEPS; i++) {
        a = a * factor + b;
        b = b * factor + a;
        a = a * factor + b;
        b = b * factor + a;
        a = a * factor + b;
        b = b * factor + a;
        a = a * factor + b;
        b = b * factor + a;
    }
    // Never so: but the compiler does not know it.
    if a.x + a.y + a.z + a.w == 12345.678 {
        samples[0] = bitcast<vec4<u32>>(a + b);
    }
}
