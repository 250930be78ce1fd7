// Tests the brick's samples, which are there, an invocation a row: nothing is computed for a sample but its test. The other
// way: read_samples.wgsl.
//
// Called once a kernel, by all 64 invocations.
fn load_rows(slot: u32, origin: vec3<u32>, lane: u32, live: bool) {
    if live {
        for (var row = lane; row < 81u; row += 64u) {
            atomicStore(&brick_rows[row], row_flags(slot, origin, row % 9u, row / 9u));
        }
    }
    workgroupBarrier();
}
