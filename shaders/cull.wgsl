// cull: keeps the bricks that can hold surface.
//
// `range` builds a volume's table of lowest and highest sample a brick, once a volume (for a field it
// tells, of an empty mesh, what values there were); a field's table is made of intervals by bounds.wgsl.
// `cull` marks the bricks whose range straddles iso, or all of them for a field without bounds; `compact` turns
// the scanned marks into the list of active bricks, in brick order, and the dispatch arguments.
// CPU twin: src/stage/cull/cpu.rs.

// Lowest and highest order key of a brick's samples. A brick with samples that are not finite beside
// finite ones has the widest range; a brick of none but such has an empty one.
@group(0) @binding(3) var<storage, read_write> ranges: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> marks: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> slots: array<u32>;
@group(0) @binding(6) var<storage, read_write> active_list: array<u32>;
@group(0) @binding(7) var<storage, read_write> dispatches: array<u32>;

const NO_SLOT = 0xffffffffu;
const MAX_GROUPS = 65535u;

// One brick an invocation: no barriers, which software adapters pay dearly for, and a GPU has enough
// bricks to stay busy while it waits for samples.
@compute @workgroup_size(64)
fn range(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = params.first_slot + id.y * groups.x * 64u + id.x;
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

@compute @workgroup_size(64)
fn cull(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = id.y * groups.x * 64u + id.x;
    if index < params.slab_bricks {
        let r = ranges[index];
        marks[index] = vec2<u32>(u32(straddles(r.x, r.y)), 0u);
    }
}

@compute @workgroup_size(64)
fn keep_all(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = id.y * groups.x * 64u + id.x;
    if index < params.slab_bricks {
        marks[index] = vec2<u32>(1u, 0u);
    }
}

// `marks` now holds the exclusive prefix sums, with the total behind the last brick.
@compute @workgroup_size(64)
fn compact(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = id.y * groups.x * 64u + id.x;
    if index < params.slab_bricks {
        let slot = marks[index].x;
        let kept = marks[index + 1u].x > slot;
        slots[index] = select(NO_SLOT, slot, kept);
        if kept {
            active_list[slot] = index;
        }
    }
    if index == 0u {
        work.active_bricks = marks[params.slab_bricks].x;
        work.own_active = marks[params.own_bricks].x;
        let rows = params.slab_extent.x * vec4<u32>(0u, 1u, params.slab_extent.y, params.slab_extent.y + 1u);
        for (var run = 0u; run < 4u; run++) {
            work.run_slots[run] = marks[min(rows[run], params.slab_bricks)].x;
        }
        for (var batch = 0u; batch < work.batches; batch++) {
            let first = batch * work.batch_slots;
            write_dispatch(2u * batch, first, work.active_bricks);
            write_dispatch(2u * batch + 1u, first, work.own_active);
        }
    }
}

// Arguments for one workgroup a slot from `first` to `end`, at most a batch.
fn write_dispatch(place: u32, first: u32, end: u32) {
    let count = min(end - min(first, end), work.batch_slots);
    let x = min(count, MAX_GROUPS);
    dispatches[3u * place] = x;
    dispatches[3u * place + 1u] = select(0u, (count + MAX_GROUPS - 1u) / MAX_GROUPS, count > 0u);
    dispatches[3u * place + 2u] = 1u;
}
