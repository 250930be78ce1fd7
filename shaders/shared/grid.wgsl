// Grid and brick indexing; the twins are `Params::grid_position` and `Params::brick_origin` (src/stage/params.rs).

// World position of what lies `within` a cell, in grid steps from a point of it. The margin goes off first, so that it changes no bit of
// the position.
fn grid_position(point: vec3<f32>, within: vec3<f32>) -> vec3<f32> {
    return domain_position((point - params.margin) + within);
}

// World position of what lies that many grid steps in the domain.
fn domain_position(p: vec3<f32>) -> vec3<f32> {
    return params.origin + ((params.step_x * p.x + params.step_y * p.y) + params.step_z * p.z);
}

// Lowest point of a brick of the slab.
fn brick_origin(brick: u32) -> vec3<u32> {
    let b = params.slab_extent;
    return (params.slab_first + vec3<u32>(brick % b.x, (brick / b.x) % b.y, brick / (b.x * b.y))) * 8u;
}

// Behind the last slot of this batch, of `all`. A dispatch in two dimensions has workgroups
// beyond it, which must leave the next batch alone.
fn batch_end(all: u32) -> u32 {
    return min(all, call.first_slot + work.batch_slots);
}

// Which slot a workgroup works on: slots go along x, then y, since a dimension holds 65535 groups.
fn slot_of(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return call.first_slot + group.y * groups.x + group.x;
}
