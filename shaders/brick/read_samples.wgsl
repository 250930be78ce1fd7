// The brick's samples, each invocation every 64th: all are asked for before the first is looked at, so that the memory
// brings them side by side (in a loop each would wait for the one before).
fn test_samples(slot: u32, origin: vec3<u32>, lane: u32) {
    let a = read_four(slot, origin, lane);
    let b = read_four(slot, origin, lane + 256u);
    // The last ones again behind the end: noting a sample twice changes nothing.
    let c = read_four(slot, origin, lane + 512u);
    note_four(lane, a);
    note_four(lane + 256u, b);
    note_four(lane + 512u, c);
}

fn read_four(slot: u32, origin: vec3<u32>, i: u32) -> vec4<u32> {
    return vec4<u32>(
        take_sample(slot, origin, i),
        take_sample(slot, origin, i + 64u),
        take_sample(slot, origin, i + 128u),
        take_sample(slot, origin, min(i + 192u, 728u)),
    );
}

fn note_four(i: u32, bits: vec4<u32>) {
    note_sample(i, bits.x);
    note_sample(i + 64u, bits.y);
    note_sample(i + 128u, bits.z);
    note_sample(min(i + 192u, 728u), bits.w);
}
