// Samples that the sample stage wrote: 9³ a slot of the batch, x fastest.
@group(0) @binding(2) var<storage, read> source: array<u32>;

const COUNTS_NON_FINITE = true;

fn sample_bits(slot: u32, origin: vec3<u32>, local: vec3<u32>) -> u32 {
    return source[(slot - params.first_slot) * 729u + local.x + 9u * (local.y + 9u * local.z)];
}
