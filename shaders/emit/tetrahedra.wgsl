// emit of marching tetrahedra. CPU twins: src/stage/emit/cpu/tetrahedra.rs, edges.rs, crossings.rs.

@group(0) @binding(8) var<storage, read> records: array<TetraRecord>;
@group(0) @binding(10) var<storage, read> table: array<u32>;

// Inside bits of the rows (y, z), (y+1, z), (y, z+1), (y+1, z+1).
fn kept_rows(slot: u32, y: u32, z: u32) -> vec4<u32> {
    let at = y + 9u * z;
    return vec4<u32>(
        records[slot].rows[at],
        records[slot].rows[at + 1u],
        records[slot].rows[at + 9u],
        records[slot].rows[at + 10u],
    ) & vec4<u32>(0x1ffu);
}

fn vertices_before(slot: u32, y: u32, z: u32) -> u32 {
    return (records[slot].planes[z] & 0xffffu) + ((records[slot].rows[y + 9u * z] >> 9u) & 0x1ffu);
}

fn corner_offset(corner: u32) -> vec3<u32> {
    return vec3<u32>(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
}

fn edge_vertices(slot: u32) -> u32 {
    return offsets[slot + 1u].x - offsets[slot].x;
}

// An edge of a brick: its owner, and the way to its other end, 0 or 1 along each axis.
struct OwnedEdge {
    owner: vec3<u32>,
    across: vec3<u32>,
}

// The edge of vertex `k` of a brick.
fn edge_of_vertex(slot: u32, origin: vec3<u32>, k: u32) -> OwnedEdge {
    var z = 0u;
    for (var i = 1u; i < 8u; i++) {
        z += u32((records[slot].planes[i] & 0xffffu) <= k);
    }
    let in_plane = k - (records[slot].planes[z] & 0xffffu);
    var y = 0u;
    for (var i = 1u; i < 8u; i++) {
        y += u32(((records[slot].rows[i + 9u * z] >> 9u) & 0x1ffu) <= in_plane);
    }
    var skip = k - vertices_before(slot, y, z);
    let bits = kept_rows(slot, y, z);
    let shape = row_shape(origin, y, z);
    var direction = 1u;
    var edges = crossed_towards(bits, shape, direction);
    while direction < 7u && skip >= countOneBits(edges) {
        skip -= countOneBits(edges);
        direction++;
        edges = crossed_towards(bits, shape, direction);
    }
    for (; skip > 0u; skip--) {
        edges &= edges - 1u;
    }
    return OwnedEdge(vec3<u32>(countTrailingZeros(edges), y, z), corner_offset(direction));
}

@compute @workgroup_size(LANES)
fn emit_vertices(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let slot = listed_slot(group, groups);
    if slot == NO_SLOT {
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
        let edge = edge_of_vertex(slot, origin, k);
        write_vertex(place, make_vertex(slot, origin, edge.owner, edge.across));
    }
    report_runaway();
}

// Number of the vertex on an edge of a cell: its lower corner in the low three bits, and above them the direction.
fn vertex_on(edge: u32, origin: vec3<u32>, cell: vec3<u32>, brick: u32, slot: u32) -> u32 {
    let direction = (edge >> 3u) & 7u;
    let owner = cell + corner_offset(edge & 7u);
    // 1 where the owner lies in the next brick along an axis.
    let next = owner >> vec3<u32>(3u);
    let p = owner & vec3<u32>(7u);
    var there = slot;
    if any(next != vec3<u32>(0u)) {
        there = slot_of_brick(brick + next.x + params.slab_extent.x * (next.y + params.slab_extent.y * next.z));
    }
    let bits = kept_rows(there, p.y, p.z);
    let shape = row_shape(origin + 8u * next, p.y, p.z);
    var before = vertices_before(there, p.y, p.z);
    for (var d = 1u; d < direction; d++) {
        before += countOneBits(crossed_towards(bits, shape, d));
    }
    before += countOneBits(crossed_towards(bits, shape, direction) & ((1u << p.x) - 1u));
    return params.first_vertices[next.y + 2u * next.z] + offsets[there].x + before;
}

@compute @workgroup_size(ROW_LANES)
fn emit_indices(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let slot = listed_slot(group, groups);
    if slot == NO_SLOT {
        return;
    }
    let brick = active_list[slot];
    for (var row = lane; row < 64u; row += ROW_LANES) {
        write_triangles(slot, brick, brick_origin(brick), row);
    }
}

// The triangles of a row's cells, as far as the window has room.
fn write_triangles(slot: u32, brick: u32, origin: vec3<u32>, row: u32) {
    let y = row % 8u;
    let z = row / 8u;
    let in_plane = (records[slot].rows[y + 9u * z] >> 18u) & 0x3ffu;
    var triangle = params.first_triangle + offsets[slot].y + (records[slot].planes[z] >> 16u) + in_plane;
    triangle -= params.triangle_window;
    let bits = kept_rows(slot, y, z);
    for (var mixed = mixed_cells(bits, row_shape(origin, y, z)); mixed != 0u; mixed &= mixed - 1u) {
        let cell = vec3<u32>(countTrailingZeros(mixed), y, z);
        let entry = TETRA_TABLE + TETRA_WORDS * cell_case(bits, cell.x);
        let count = table[entry];
        for (var t = 0u; t < count; t++) {
            if triangle < call.triangle_capacity {
                let edges = table[entry + 1u + t];
                let a = vertex_on(edges & 63u, origin, cell, brick, slot);
                let b = vertex_on((edges >> 6u) & 63u, origin, cell, brick, slot);
                let c = vertex_on((edges >> 12u) & 63u, origin, cell, brick, slot);
                let corners = select(vec3<u32>(a, b, c), vec3<u32>(a, c, b), params.mirrored == 1u);
                indices[3u * triangle] = corners.x;
                indices[3u * triangle + 1u] = corners.y;
                indices[3u * triangle + 2u] = corners.z;
            }
            triangle++;
        }
    }
}
