// What is scanned: as many pairs of counts as the slab has bricks, in place, the total behind the last.
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;

fn item_count() -> u32 {
    return params.slab_bricks;
}

fn item(i: u32) -> Sum {
    return Sum(counts[i], 0u);
}

fn put(i: u32, own: Sum, before: Sum) {
    counts[i] = before.xy;
}

fn put_total(n: u32, total: Sum) {
    counts[n] = total.xy;
}
