// What classify looks up of a brick, brought together by its workgroup: for GPUs. The other form: shaders/classify/serial.wgsl.
// `load_rows`, which does it, is that of read_rows.wgsl, read_samples.wgsl, or shaders/source/evaluate.wgsl.

// Inside bits of the nine points of row y + 9 z; in the upper half, which of them are NaN or infinite.
var<workgroup> brick_rows: array<atomic<u32>, 81>;

// Inside bits of the rows (y, z), (y+1, z), (y, z+1), (y+1, z+1).
fn rows_at(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> vec4<u32> {
    let row = y + 9u * z;
    return vec4<u32>(
        atomicLoad(&brick_rows[row]),
        atomicLoad(&brick_rows[row + 1u]),
        atomicLoad(&brick_rows[row + 9u]),
        atomicLoad(&brick_rows[row + 10u]),
    ) & vec4<u32>(0x1ffu);
}

// How many of the row's points that the brick owns are NaN or infinite.
fn not_finite_at(slot: u32, origin: vec3<u32>, y: u32, z: u32, owned: u32) -> u32 {
    return countOneBits((atomicLoad(&brick_rows[y + 9u * z]) >> 16u) & owned);
}
