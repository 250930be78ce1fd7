// What emit looks up of a brick's crossed edges, brought together by its workgroup; the other form: serial_edges.wgsl.

// The edge of each vertex: row in bits 5 and up, below it the bit of the row's word.
var<workgroup> brick_edges: array<u32, 1536>;

// Lists the edges in the order of their vertices. Called once a kernel, by all invocations, 64 at least.
fn load_edges(slot: u32, lane: u32, live: bool) {
    if live && lane < 64u {
        let word = records[slot].rows[lane];
        var place = (records[slot].planes[lane / 8u] & 0xffffu) + (word >> 24u);
        for (var edges = word & 0xffffffu; edges != 0u; edges &= edges - 1u) {
            brick_edges[place] = (lane << 5u) | countTrailingZeros(edges);
            place++;
        }
    }
    workgroupBarrier();
}

// The edge of vertex `k` of a brick: its owner's x, y, z and its axis.
fn edge_of_vertex(slot: u32, k: u32) -> vec4<u32> {
    let edge = brick_edges[k];
    return vec4<u32>(edge & 7u, (edge >> 5u) & 7u, edge >> 8u, (edge >> 3u) & 3u);
}

// Each row's crossed edges, and the number of its first vertex.
var<workgroup> own_edges: array<u32, 64>;
var<workgroup> own_first: array<u32, 64>;

// Called once a kernel, by all 64 invocations, before a barrier.
fn load_own_vertices(slot: u32, lane: u32, live: bool) {
    if live {
        let word = records[slot].rows[lane];
        own_edges[lane] = word & 0xffffffu;
        own_first[lane] = params.first_vertices.x + offsets[slot].x
            + (records[slot].planes[lane / 8u] & 0xffffu) + (word >> 24u);
    }
}

// Number of the vertex on the edge that is bit `bit` of row `row` of the brick.
fn own_vertex(row: u32, bit: u32, slot: u32) -> u32 {
    return own_first[row] + countOneBits(own_edges[row] & ((1u << bit) - 1u));
}
