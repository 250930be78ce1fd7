// What is scanned: the bits of the brick map's words. The sum before a word is written beside its bits, and the bricks
// of its bits are listed: the active list, in brick order, as far as there are slots.
@group(0) @binding(4) var<storage, read_write> map: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> active_list: array<u32>;

fn item_count() -> u32 {
    return map_words();
}

fn item(i: u32) -> Sum {
    return Sum(countOneBits(map[i].x), 0u, 0u);
}

fn put(i: u32, own: Sum, before: Sum) {
    let bits = map[i].x;
    map[i] = vec2<u32>(bits, before.x);
    var slot = before.x;
    for (var left = bits; left != 0u && slot < work.slots; left &= left - 1u) {
        active_list[slot] = 32u * i + countTrailingZeros(left);
        slot++;
    }
}

fn put_total(n: u32, total: Sum) {
    map[n] = vec2<u32>(0u, total.x);
}
