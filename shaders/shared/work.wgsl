// What the GPU counts of a slab while it works; `Work` in src/stage/params.rs.
struct Work {
    // Active bricks with the halo, and the slab's own; 0 where there are more than slots.
    active_bricks: u32,
    own_active: u32,
    // Vertices and triangles of the slab's own bricks.
    vertices: u32,
    triangles: u32,
    // NaN and infinite samples at the points of own bricks.
    non_finite: atomic<u32>,
    // Not 0 once a loop of the user's WGSL was stopped.
    runaway: atomic<u32>,
    // Slots that one batch of samples holds, and how many batches the argument buffer has room for.
    batch_slots: u32,
    batches: u32,
    // Of the box's first brick, and those one row up, one layer up, and both: the slot where they or the
    // next active brick lie, and the vertices before it.
    run_slots: vec4<u32>,
    run_vertices: vec4<u32>,
    // Not 0 once emit has marked a vertex whose gradient has no direction.
    singular: atomic<u32>,
    // Of the tracker: bricks in its queue, those that were taken from it, and in how many rounds.
    queued: atomic<u32>,
    taken: u32,
    rounds: u32,
    // Active bricks that there is room for, and that there are.
    slots: u32,
    needed_slots: u32,
    // Boxes of bricks that may hold surface, by the length of their lists: large ones and small ones.
    large_boxes: atomic<u32>,
    small_boxes: atomic<u32>,
}

@group(0) @binding(1) var<storage, read_write> work: Work;
