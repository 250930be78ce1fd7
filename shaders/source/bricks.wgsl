// Samples that the sample stage wrote: 9³ a slot of the batch, x fastest.
@group(0) @binding(2) var<storage, read> source: array<u32>;

const COUNTS_NON_FINITE = true;

fn sample_bits(slot: u32, origin: vec3<u32>, local: vec3<u32>) -> u32 {
    return source[(slot - call.first_slot) * 729u + local.x + 9u * (local.y + 9u * local.z)];
}

// Where row (y, z) of a brick begins.
fn row_start(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> u32 {
    return (slot - call.first_slot) * 729u + 9u * (y + 9u * z);
}

// Bits of the sample at x (0-8) of that row.
fn row_bits(row: u32, origin: vec3<u32>, x: u32) -> u32 {
    return source[row + x];
}
