// The brick map: which bricks of the slab are active, a bit each, 32 a word, and how many are before the word.
// So the slot of an active brick is one load and a population count, and the map takes a quarter of a byte a brick,
// however few are active. Behind the last word: the total. `BrickMap` in src/stage/cull/map.rs.

// Words that the map has for the slab's bricks.
fn map_words() -> u32 {
    return (params.slab_bricks + 31u) / 32u;
}

// The active bricks before `brick`, which may be one past the last: the slot of a brick that is active.
fn slot_of_brick(brick: u32) -> u32 {
    let word = map[brick / 32u];
    return word.y + countOneBits(word.x & ((1u << (brick % 32u)) - 1u));
}

// Whether a brick is active.
fn is_active(brick: u32) -> bool {
    return ((map[brick / 32u].x >> (brick % 32u)) & 1u) == 1u;
}
