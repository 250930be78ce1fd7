// Tests the brick's samples, which are there, an invocation a row: nothing is computed for a sample but its test. The other
// way: read_samples.wgsl.
//
// Called once a kernel, by all 64 invocations.
fn load_rows(slot: u32, origin: vec3<u32>, lane: u32, live: bool) {
    if live {
        for (var row = lane; row < 81u; row += 64u) {
            let start = row_start(slot, origin, row % 9u, row / 9u);
            // Written out, so that the nine are asked for together.
            let a = vec3<u32>(row_bits(start, origin, 0u), row_bits(start, origin, 1u), row_bits(start, origin, 2u));
            let b = vec3<u32>(row_bits(start, origin, 3u), row_bits(start, origin, 4u), row_bits(start, origin, 5u));
            let c = vec3<u32>(row_bits(start, origin, 6u), row_bits(start, origin, 7u), row_bits(start, origin, 8u));
            let flags = three_flags(a) | (three_flags(b) << 3u) | (three_flags(c) << 6u);
            atomicStore(&brick_rows[row], flags);
        }
    }
    workgroupBarrier();
}

fn three_flags(bits: vec3<u32>) -> u32 {
    return sample_flags(bits.x) | (sample_flags(bits.y) << 1u) | (sample_flags(bits.z) << 2u);
}
