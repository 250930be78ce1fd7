// What is scanned: the counts of the slab's active bricks, in place, the total behind the last. Where `over_bricks`,
// as many as the slab has bricks.
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;

override over_bricks: bool;

fn item_count() -> u32 {
    return select(work.active_bricks, params.slab_bricks, over_bricks);
}

fn item(i: u32) -> vec2<u32> {
    return counts[i];
}

fn put(i: u32, before: vec2<u32>) {
    counts[i] = before;
}
