// Samples that are taken of the field here and now, and written down for emit: the sample stage within classify, so that
// no brick's samples are read once more.
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

const COUNTS_NON_FINITE = true;

// Takes and tests the brick's samples, each invocation every 64th, so that all have as much to do. Points past the grid's
// end repeat the last one; no stage looks at them. Called once a kernel, by all 64 invocations.
fn load_rows(slot: u32, origin: vec3<u32>, lane: u32, live: bool) {
    atomicStore(&brick_rows[lane], 0u);
    atomicStore(&brick_rows[min(lane + 64u, 80u)], 0u);
    workgroupBarrier();
    if live {
        for (var i = lane; i < 729u; i += 64u) {
            let point = min(origin + vec3<u32>(i % 9u, (i / 9u) % 9u, i / 81u), params.points - vec3<u32>(1u));
            let value = density(grid_position(vec3<f32>(point), vec3<f32>(0.0)));
            samples[(slot - call.first_slot) * 729u + i] = value;
            let flags = sample_flags(bitcast<u32>(value));
            if flags != 0u {
                atomicOr(&brick_rows[i / 9u], flags << (i % 9u));
            }
        }
    }
    workgroupBarrier();
}
