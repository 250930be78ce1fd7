// emit where a workgroup first lists what its brick makes, so that then each invocation has as much to do, and
// writes side by side: for GPUs. The other form: serial.wgsl.

// How many vertices the brick makes; 0 beyond the last brick. All invocations read the same.
var<workgroup> brick_count: u32;
// The edge of each vertex: row in bits 5 and up, below it the bit of the row's word.
var<workgroup> brick_edges: array<u32, 1536>;
// What goes into the buffer next, as it will lie there.
var<workgroup> staged: array<f32, 6u * LANES>;

@compute @workgroup_size(LANES)
fn emit_vertices(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let live_slot = slot_of(group, groups);
    let live = live_slot < batch_end(work.own_active);
    let slot = select(params.first_slot, live_slot, live);
    if lane == 0u {
        brick_count = select(0u, offsets[slot + 1u].x - offsets[slot].x, live);
    }
    if live && lane < 64u {
        let word = records[slot].rows[lane];
        var place = (records[slot].planes[lane / 8u] & 0xffffu) + (word >> 24u);
        for (var edges = word & 0xffffffu; edges != 0u; edges &= edges - 1u) {
            brick_edges[place] = (lane << 5u) | countTrailingZeros(edges);
            place++;
        }
    }
    let count = workgroupUniformLoad(&brick_count);
    let origin = brick_origin(active_list[slot]);
    let first = params.first_vertices.x + offsets[slot].x - params.vertex_window;
    for (var done = 0u; done < count; done += LANES) {
        if done + lane < count {
            let edge = brick_edges[done + lane];
            let vertex = make_vertex(slot, origin, vec4<u32>(edge & 7u, (edge >> 5u) & 7u, edge >> 8u, (edge >> 3u) & 3u));
            staged[6u * lane] = vertex.position.x;
            staged[6u * lane + 1u] = vertex.position.y;
            staged[6u * lane + 2u] = vertex.position.z;
            staged[6u * lane + 3u] = vertex.normal.x;
            staged[6u * lane + 4u] = vertex.normal.y;
            staged[6u * lane + 5u] = vertex.normal.z;
        }
        workgroupBarrier();
        // Below the window this is a large number; what does not fit is left out.
        let place = first + done;
        let room = select(0u, params.vertex_capacity - place, place < params.vertex_capacity);
        let words = 6u * min(min(count - done, LANES), room);
        for (var i = lane; i < words; i += LANES) {
            vertices[6u * place + i] = staged[i];
        }
        workgroupBarrier();
    }
    report_runaway();
}

// Each row's crossed edges, and the number of its first vertex.
var<workgroup> own_edges: array<u32, 64>;
var<workgroup> own_first: array<u32, 64>;
// Each triangle: its row in bits 0 to 5, its cell's x from 6, its number in the cell from 9, the cell's case from 12.
var<workgroup> brick_triangles: array<u32, 2560>;

// Number of the vertex on the edge that is bit `bit` of row `row` of the brick.
fn own_vertex(row: u32, bit: u32, slot: u32) -> u32 {
    return own_first[row] + countOneBits(own_edges[row] & ((1u << bit) - 1u));
}

// One invocation a row, then one a triangle.
@compute @workgroup_size(64)
fn emit_indices(
    @builtin(local_invocation_index) row: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let live_slot = slot_of(group, groups);
    let live = live_slot < batch_end(work.own_active);
    let slot = select(params.first_slot, live_slot, live);
    let brick = active_list[slot];
    let origin = brick_origin(brick);
    let y = row % 8u;
    let z = row / 8u;
    load_rows(slot, origin, row, live);
    if live {
        let word = records[slot].rows[row];
        own_edges[row] = word & 0xffffffu;
        own_first[row] = params.first_vertices.x + offsets[slot].x + (records[slot].planes[z] & 0xffffu) + (word >> 24u);
        let in_plane = (records[slot].triangles[row / 2u] >> (16u * (row & 1u))) & 0xffffu;
        var place = (records[slot].planes[z] >> 16u) + in_plane;
        let bits = rows_at(slot, origin, y, z);
        for (var mixed = mixed_cells(bits, row_shape(origin, y, z)); mixed != 0u; mixed &= mixed - 1u) {
            let x = countTrailingZeros(mixed);
            let case_byte = cell_case(bits, x);
            let count = table_words(case_byte).x & 15u;
            for (var t = 0u; t < count; t++) {
                brick_triangles[place] = row | (x << 6u) | (t << 9u) | (case_byte << 12u);
                place++;
            }
        }
    }
    workgroupBarrier();
    if !live {
        return;
    }
    let count = offsets[slot + 1u].y - offsets[slot].y;
    let first = params.first_triangle + offsets[slot].y - params.triangle_window;
    for (var i = row; i < count; i += 64u) {
        let packed = brick_triangles[i];
        let cell = vec3<u32>((packed >> 6u) & 7u, packed & 7u, (packed >> 3u) & 7u);
        let corners = triangle_of((packed >> 9u) & 7u, packed >> 12u, cell, brick, slot);
        let triangle = first + i;
        if triangle < params.triangle_capacity {
            indices[3u * triangle] = corners.x;
            indices[3u * triangle + 1u] = corners.y;
            indices[3u * triangle + 2u] = corners.z;
        }
    }
}
