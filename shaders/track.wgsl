// track: follows the surface from brick to brick, and leaves the bits in the brick map that cull would leave.
//
// Bricks wait in a queue, which nothing leaves: at the end it is the list of those reached. A round takes what was added
// since the one before (`advance`), samples it, and adds the bricks beside (`spread`). In which order a round adds
// is a matter of chance; what is reached is not, and from the map on bricks are in order.
// CPU twin: `spread` in src/track/cpu.rs.

// A brick's bit is set once it is reached.
@group(0) @binding(4) var<storage, read_write> map: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> active_list: array<u32>;

// Lies where the counts of the active bricks will.
@group(0) @binding(9) var<storage, read_write> queue: array<u32>;

// Sets the bit of a brick; whether it was set before.
fn reach(brick: u32) -> bool {
    let bit = 1u << (brick % 32u);
    return (atomicOr(&map[2u * (brick / 32u)], bit) & bit) != 0u;
}

// Marks the bricks that the queue holds at first.
@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let place = id.y * groups.x * 64u + id.x;
    if place < atomicLoad(&work.queued) {
        reach(queue[place]);
    }
}

// One workgroup: the next bricks of the queue, at most a batch, become the active list.
@compute @workgroup_size(64)
fn advance(@builtin(local_invocation_index) lane: u32) {
    let first = work.taken;
    // More than slots wait for ever: the host sees it, and starts again with more.
    let count = min(min(atomicLoad(&work.queued), work.slots) - first, work.batch_slots);
    for (var i = lane; i < count; i += 64u) {
        active_list[i] = queue[first + i];
    }
    // All have read where the round begins, from storage: that takes the barrier of storage.
    storageBarrier();
    if lane == 0u {
        work.taken = first + count;
        work.active_bricks = count;
        work.rounds += u32(count > 0u);
        write_dispatch(0u, count);
    }
}

// One workgroup a brick, one invocation each of the six bricks beside it: does the surface cross an edge between points
// of the plane that both share? Bricks with only a line in common are reached by way of these.
@compute @workgroup_size(8)
fn spread(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    if slot >= batch_end(work.active_bricks) || lane >= 6u {
        return;
    }
    let brick = active_list[slot];
    let origin = brick_origin(brick);
    let axis = vec3<u32>(0u, 1u, 2u) == vec3<u32>(lane / 2u);
    let up = (lane & 1u) == 1u;
    let way = vec3<i32>(select(vec3<i32>(0), vec3<i32>(select(-1, 1, up)), axis));
    let there = vec3<i32>(origin / 8u) + way;
    if any(there < vec3<i32>(0)) || any(there >= vec3<i32>(params.slab_extent)) {
        return;
    }
    let plane = vec3<u32>(select(0u, 8u, up));
    let low = select(vec3<u32>(0u), plane, axis);
    let high = select(min(params.points - 1u - origin, vec3<u32>(8u)), plane, axis);
    var some = false;
    var every = true;
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            let row = row_start(slot, origin, y, z);
            for (var x = low.x; x <= high.x; x++) {
                let inside = is_inside(row_bits(row, origin, x));
                some = some || inside;
                every = every && inside;
            }
        }
    }
    if !some || every {
        return;
    }
    let at = vec3<u32>(there);
    let beside = at.x + params.slab_extent.x * (at.y + params.slab_extent.y * at.z);
    if !reach(beside) {
        let place = atomicAdd(&work.queued, 1u);
        if place < work.slots {
            queue[place] = beside;
        }
    }
}
