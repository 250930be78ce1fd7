// emit where each invocation looks up and writes what it makes by itself: for software adapters, to which a barrier costs
// more than reading again. The other form: shared.wgsl.

// The edge of vertex `k` of a brick.
fn edge_of_vertex(slot: u32, origin: vec3<u32>, k: u32) -> OwnedEdge {
    var z = 0u;
    for (var i = 1u; i < 8u; i++) {
        z += u32((records[slot].planes[i] & 0xffffu) <= k);
    }
    let in_plane = k - (records[slot].planes[z] & 0xffffu);
    var y = 0u;
    for (var i = 1u; i < 8u; i++) {
        y += u32((records[slot].rows[8u * z + i] >> 24u) <= in_plane);
    }
    let row = records[slot].rows[8u * z + y];
    var edges = row & 0xffffffu;
    for (var skip = in_plane - (row >> 24u); skip > 0u; skip--) {
        edges &= edges - 1u;
    }
    let bit = countTrailingZeros(edges);
    return OwnedEdge(vec3<u32>(bit & 7u, y, z), along(bit >> 3u));
}

// Number of the vertex on the edge along `axis` of a point, 0 to 8 along each axis, of the brick or of those beside it.
fn owned_vertex(owner: vec3<u32>, axis: u32, brick: u32, slot: u32) -> u32 {
    // 1 where the owner lies in the next brick along an axis.
    let next = owner >> vec3<u32>(3u);
    let p = owner & vec3<u32>(7u);
    var there = slot;
    if any(next != vec3<u32>(0u)) {
        there = slot_of_brick(brick + next.x + params.slab_extent.x * (next.y + params.slab_extent.y * next.z));
    }
    let row = records[there].rows[p.y + 8u * p.z];
    let earlier = row & ((1u << (8u * axis + p.x)) - 1u);
    let before = (records[there].planes[p.z] & 0xffffu) + (row >> 24u) + countOneBits(earlier);
    return params.first_vertices[next.y + 2u * next.z] + offsets[there].x + before;
}

// Inside bits of the rows (y, z), (y+1, z), (y, z+1), (y+1, z+1).
fn cell_rows(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> vec4<u32> {
    return rows_at(slot, origin, y, z);
}

// One invocation a row.
@compute @workgroup_size(64)
fn emit_indices(
    @builtin(local_invocation_index) row: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    if slot >= batch_end(work.own_active) {
        return;
    }
    let brick = active_list[slot];
    let origin = brick_origin(brick);
    write_triangles(slot, brick, origin, row);
}
