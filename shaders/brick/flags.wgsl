// What the bits of samples say. Used by classify.

// To be shifted by the sample's place: inside; and in the upper half NaN or infinite, if that is asked.
fn sample_flags(bits: u32) -> u32 {
    return u32(is_inside(bits)) | (u32(COUNTS_NON_FINITE && !is_finite(bits)) << 16u);
}

fn three_flags(bits: vec3<u32>) -> u32 {
    return sample_flags(bits.x) | (sample_flags(bits.y) << 1u) | (sample_flags(bits.z) << 2u);
}
