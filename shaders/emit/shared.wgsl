// emit where a workgroup brings together what it looks up of its brick: for GPUs. The other form: serial.wgsl.

// The edge of each vertex: row in bits 5 and up, below it the bit of the row's word.
var<workgroup> brick_edges: array<u32, 1536>;

@compute @workgroup_size(LANES)
fn emit_vertices(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    let live = slot < batch_end(work.own_active);
    if live && lane < 64u {
        let word = records[slot].rows[lane];
        var place = (records[slot].planes[lane / 8u] & 0xffffu) + (word >> 24u);
        for (var edges = word & 0xffffffu; edges != 0u; edges &= edges - 1u) {
            brick_edges[place] = (lane << 5u) | countTrailingZeros(edges);
            place++;
        }
    }
    workgroupBarrier();
    if !live {
        return;
    }
    let origin = brick_origin(active_list[slot]);
    let first = offsets[slot].x;
    let count = edge_vertices(slot);
    for (var k = lane; k < count; k += LANES) {
        let place = params.first_vertices.x + first + k - params.vertex_window;
        if place >= call.vertex_capacity {
            break;
        }
        let edge = brick_edges[k];
        let owner = vec3<u32>(edge & 7u, (edge >> 5u) & 7u, edge >> 8u);
        write_vertex(place, make_vertex(slot, origin, owner, along((edge >> 3u) & 3u)));
    }
    report_runaway();
}

// Each row's crossed edges, and the number of its first vertex.
var<workgroup> own_edges: array<u32, 64>;
var<workgroup> own_first: array<u32, 64>;

// Number of the vertex on the edge that is bit `bit` of row `row` of the brick.
fn own_vertex(row: u32, bit: u32, slot: u32) -> u32 {
    return own_first[row] + countOneBits(own_edges[row] & ((1u << bit) - 1u));
}

// One invocation a row.
@compute @workgroup_size(64)
fn emit_indices(
    @builtin(local_invocation_index) row: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let live_slot = slot_of(group, groups);
    let live = live_slot < batch_end(work.own_active);
    let slot = select(call.first_slot, live_slot, live);
    let brick = active_list[slot];
    let origin = brick_origin(brick);
    if live {
        let word = records[slot].rows[row];
        own_edges[row] = word & 0xffffffu;
        own_first[row] = params.first_vertices.x + offsets[slot].x + (records[slot].planes[row / 8u] & 0xffffu) + (word >> 24u);
    }
    load_rows(slot, origin, row, live);
    if !live {
        return;
    }
    write_triangles(slot, brick, origin, row);
}
