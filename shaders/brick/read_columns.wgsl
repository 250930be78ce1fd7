// Tests the brick's samples, which are there.

// Called once a kernel, by all invocations.
fn load_columns(slot: u32, origin: vec3<u32>, at: u32, live: bool) {
    if live && at < 81u {
        // Written out, so that the nine are asked for together.
        let low = vec3<u32>(column_bits(slot, origin, at, 0u), column_bits(slot, origin, at, 1u), column_bits(slot, origin, at, 2u));
        let middle = vec3<u32>(column_bits(slot, origin, at, 3u), column_bits(slot, origin, at, 4u), column_bits(slot, origin, at, 5u));
        let high = vec3<u32>(column_bits(slot, origin, at, 6u), column_bits(slot, origin, at, 7u), column_bits(slot, origin, at, 8u));
        brick_columns[at] = three_flags(low) | (three_flags(middle) << 3u) | (three_flags(high) << 6u);
    }
    workgroupBarrier();
}

// Bits of the sample at z of column x + 9 y.
fn column_bits(slot: u32, origin: vec3<u32>, column: u32, z: u32) -> u32 {
    return row_bits(row_start(slot, origin, column / 9u, z), origin, column % 9u);
}

fn keep_samples(slot: u32, at: u32) {}
