// Vertices on edges, each looked up by its number: emit of tetrahedra, which brings `edge_vertices`, how many a brick has, and
// `edge_of_vertex`.

// An edge of a brick: its owner, and the way to its other end, 0 or 1 along each axis.
struct OwnedEdge {
    owner: vec3<u32>,
    across: vec3<u32>,
}

@compute @workgroup_size(LANES)
fn emit_vertices(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    if slot >= batch_end(work.own_active) {
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
