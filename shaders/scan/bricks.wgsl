// What is scanned: the counts of the slab's active bricks, in place, the total behind the last; and beside them which of its own
// bricks make anything. Their slots are listed for emit, in order, so that it starts nothing for the others.
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;
// Behind room for all active bricks: these slots. Behind room for all of them: where those of each batch begin, and the end.
@group(0) @binding(6) var<storage, read_write> active_list: array<u32>;

fn item_count() -> u32 {
    return work.active_bricks;
}

fn item(i: u32) -> Sum {
    let own = counts[i];
    return Sum(own, u32(i < work.own_active && any(own != vec2<u32>(0u))));
}

fn put(i: u32, own: Sum, before: Sum) {
    counts[i] = before.xy;
    if own.z == 1u {
        active_list[work.slots + before.z] = i;
    }
    if i % work.batch_slots == 0u {
        active_list[2u * work.slots + i / work.batch_slots] = before.z;
    }
}

fn put_total(n: u32, total: Sum) {
    counts[n] = total.xy;
    // Batches behind the last brick have none.
    let begun = n / work.batch_slots + u32(n % work.batch_slots != 0u);
    for (var batch = begun; batch <= work.batches; batch++) {
        active_list[2u * work.slots + batch] = total.z;
    }
}
