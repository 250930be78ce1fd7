// Tests the brick's samples, which are there, an invocation every 64th, so that neighbours read side by side: for GPUs with
// subgroup operations, which have arithmetic to spare for the samples' places. The other way: read_rows.wgsl.
//
// Called once a kernel, by all 64 invocations.
fn load_rows(slot: u32, origin: vec3<u32>, lane: u32, live: bool) {
    atomicStore(&brick_rows[lane], 0u);
    atomicStore(&brick_rows[min(lane + 64u, 80u)], 0u);
    workgroupBarrier();
    if live {
        // All are asked for before the first is looked at, so that the memory brings them together.
        let a = read_four(slot, origin, lane);
        let b = read_four(slot, origin, lane + 256u);
        let c = read_four(slot, origin, lane + 512u);
        note_four(lane, a);
        note_four(lane + 256u, b);
        note_four(lane + 512u, c);
    }
    workgroupBarrier();
}

// Bits of the brick's sample number `i`; behind the last, of the last.
fn numbered_sample(slot: u32, origin: vec3<u32>, i: u32) -> u32 {
    let k = min(i, 728u);
    return row_bits(row_start(slot, origin, (k / 9u) % 9u, k / 81u), origin, k % 9u);
}

fn read_four(slot: u32, origin: vec3<u32>, i: u32) -> vec4<u32> {
    return vec4<u32>(
        numbered_sample(slot, origin, i),
        numbered_sample(slot, origin, i + 64u),
        numbered_sample(slot, origin, i + 128u),
        numbered_sample(slot, origin, i + 192u),
    );
}

fn note_four(i: u32, bits: vec4<u32>) {
    note_sample(i, bits.x);
    note_sample(i + 64u, bits.y);
    note_sample(i + 128u, bits.z);
    note_sample(i + 192u, bits.w);
}

fn note_sample(i: u32, bits: u32) {
    let flags = sample_flags(bits);
    if flags != 0u && i < 729u {
        atomicOr(&brick_rows[i / 9u], flags << (i % 9u));
    }
}
