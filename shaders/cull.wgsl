// cull: keeps the bricks that can hold surface.
//
// `range` builds a volume's table of lowest and highest sample a brick, once a volume (for a field it
// tells, of an empty mesh, what values there were). `cull` sets the bits of the bricks whose range straddles iso, and
// `keep_all` all of them; of a field with intervals, bounds.wgsl does. Then scan.wgsl counts the bits and lists the
// active bricks, in brick order, and `arrange` writes what follows from their number: the dispatch arguments.
// CPU twin: src/stage/cull/cpu.rs.

// Lowest and highest order key of a brick's samples. A brick with samples that are not finite beside
// finite ones has the widest range; a brick of none but such has an empty one.
@group(0) @binding(3) var<storage, read_write> ranges: array<vec2<u32>>;

// One brick an invocation: no barriers, which software adapters pay dearly for, and a GPU has enough
// bricks to stay busy while it waits for samples.
@compute @workgroup_size(64)
fn range(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = call.first_slot + id.y * groups.x * 64u + id.x;
    if index >= params.slab_bricks {
        return;
    }
    let origin = brick_origin(index);
    var low = 0xffffffffu;
    var high = 0u;
    var not_finite = 0u;
    var owned = 0u;
    // Points past the grid's end repeat the last one.
    for (var z = 0u; z < 9u; z++) {
        for (var y = 0u; y < 9u; y++) {
            let row = row_start(index, origin, y, z);
            let row_owned = y < 8u && z < 8u && origin.y + y < params.points.y && origin.z + z < params.points.z;
            for (var x = 0u; x < 9u; x++) {
                let bits = row_bits(row, origin, x);
                let key = order_key(bits);
                let finite = is_finite(bits);
                low = select(low, min(low, key), finite);
                high = select(high, max(high, key), finite);
                not_finite += u32(!finite);
                owned += u32(!finite && row_owned && x < 8u && origin.x + x < params.points.x);
            }
        }
    }
    if owned > 0u && index < params.own_bricks {
        atomicAdd(&work.non_finite, owned);
    }
    if not_finite > 0u && not_finite < 729u {
        low = 0u;
        high = 0xffffffffu;
    }
    ranges[index] = vec2<u32>(low, high);
}

// One word of the map an invocation.
@compute @workgroup_size(64)
fn cull(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let word = id.y * groups.x * 64u + id.x;
    if word >= map_words() {
        return;
    }
    let first = 32u * word;
    let count = min(params.slab_bricks - first, 32u);
    var bits = 0u;
    for (var i = 0u; i < count; i++) {
        let r = ranges[first + i];
        bits |= u32(straddles(r.x, r.y)) << i;
    }
    map[word] = vec2<u32>(bits, 0u);
}

@compute @workgroup_size(64)
fn keep_all(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let word = id.y * groups.x * 64u + id.x;
    if word < map_words() {
        let beyond = 32u - min(params.slab_bricks - 32u * word, 32u);
        map[word] = vec2<u32>(0xffffffffu >> beyond, 0u);
    }
}

// The bits are counted and the active bricks listed. Where there are more than slots, the slab counts as empty, and
// what it needs is told.
@compute @workgroup_size(1)
fn arrange() {
    let needed = slot_of_brick(params.slab_bricks);
    let fits = needed <= work.slots;
    work.needed_slots = needed;
    work.active_bricks = select(0u, needed, fits);
    work.own_active = select(0u, slot_of_brick(params.own_bricks), fits);
    let rows = params.slab_extent.x * vec4<u32>(0u, 1u, params.slab_extent.y, params.slab_extent.y + 1u);
    for (var run = 0u; run < 4u; run++) {
        work.run_slots[run] = select(0u, slot_of_brick(min(rows[run], params.slab_bricks)), fits);
    }
    for (var batch = 0u; batch < work.batches; batch++) {
        let first = batch * work.batch_slots;
        write_dispatch(3u * batch, slots_of_batch(first, work.active_bricks));
        write_dispatch(3u * batch + 1u, slots_of_batch(first, work.own_active));
    }
}

// The slots from `first` to `end`, at most a batch.
fn slots_of_batch(first: u32, end: u32) -> u32 {
    return min(end - min(first, end), work.batch_slots);
}
