// What the samples of a row say that are there. Used by classify where an invocation takes whole rows.

// Inside bits of the nine points of row (y, z); in the upper half, which of them are NaN or infinite.
fn row_flags(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> u32 {
    let start = row_start(slot, origin, y, z);
    // Written out, so that the nine are asked for together.
    let a = vec3<u32>(row_bits(start, origin, 0u), row_bits(start, origin, 1u), row_bits(start, origin, 2u));
    let b = vec3<u32>(row_bits(start, origin, 3u), row_bits(start, origin, 4u), row_bits(start, origin, 5u));
    let c = vec3<u32>(row_bits(start, origin, 6u), row_bits(start, origin, 7u), row_bits(start, origin, 8u));
    return three_flags(a) | (three_flags(b) << 3u) | (three_flags(c) << 6u);
}
