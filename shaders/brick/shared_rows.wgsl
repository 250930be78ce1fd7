// What classify and emit look up of a brick, brought together by its workgroup: for GPUs, where 64 invocations read side
// by side. The other form: serial_rows.wgsl.

// The samples come by `test_samples`: of read_samples.wgsl, or of shaders/source/evaluate.wgsl.

// Inside bits of the nine points of row y + 9 z; in the upper half, which of them are NaN or infinite.
var<workgroup> brick_rows: array<atomic<u32>, 81>;

// Tests the brick's samples. Called once a kernel, by all 64 invocations.
fn load_rows(slot: u32, origin: vec3<u32>, lane: u32, live: bool) {
    atomicStore(&brick_rows[lane], 0u);
    atomicStore(&brick_rows[min(lane + 64u, 80u)], 0u);
    workgroupBarrier();
    if live {
        test_samples(slot, origin, lane);
    }
    workgroupBarrier();
}

// Notes what the bits of the brick's sample number `i` say.
fn note_sample(i: u32, bits: u32) {
    let found = u32(is_inside(bits)) | (u32(!is_finite(bits)) << 16u);
    if found != 0u {
        atomicOr(&brick_rows[i / 9u], found << (i % 9u));
    }
}

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
