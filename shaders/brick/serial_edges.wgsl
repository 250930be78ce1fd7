// What emit looks up of a brick's crossed edges, each invocation for itself; the other form: shared_edges.wgsl.

fn load_edges(slot: u32, lane: u32, live: bool) {}

// The edge of vertex `k` of a brick: its owner's x, y, z and its axis.
fn edge_of_vertex(slot: u32, k: u32) -> vec4<u32> {
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
    return vec4<u32>(bit & 7u, y, z, bit >> 3u);
}

fn load_own_vertices(slot: u32, lane: u32, live: bool) {}

// Number of the vertex on the edge that is bit `bit` of row `row` of the brick.
fn own_vertex(row: u32, bit: u32, slot: u32) -> u32 {
    let word = records[slot].rows[row];
    let before = (records[slot].planes[row / 8u] & 0xffffu) + (word >> 24u) + countOneBits(word & ((1u << bit) - 1u));
    return params.first_vertices.x + offsets[slot].x + before;
}
