// classify, an invocation a brick: for software adapters, to which the start of a workgroup and a barrier cost more than rows. The
// other form: shaders/classify.wgsl, with the same CPU twin.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(8) var<storage, read_write> records: array<BrickRecord>;
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;

// As many workgroups as bricks are started, of which seven of eight find nothing to do: that costs them next to nothing.
const BRICKS = 8u;

@compute @workgroup_size(BRICKS)
fn classify(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = call.first_slot + BRICKS * (group.y * groups.x + group.x) + lane;
    if slot >= batch_end(work.active_bricks) {
        return;
    }
    let origin = brick_origin(active_list[slot]);
    // Inside bits of the plane's rows below, which give way to those of this plane.
    var plane: array<u32, 9>;
    // Vertices on edges; triangles, and in the upper half vertices within cells. Those of the planes before, and of this one's rows.
    var before = vec2<u32>(0u);
    var odd = 0u;
    for (var z = 0u; z < 9u; z++) {
        var in_plane = vec2<u32>(0u);
        var row_below = 0u;
        var row_here = 0u;
        var even_row = 0u;
        for (var y = 0u; y < 9u; y++) {
            let flags = row_flags(slot, origin, y, z);
            if COUNTS_NON_FINITE && y < 8u && z < 8u {
                odd += countOneBits((flags >> 16u) & row_shape(origin, y, z).owned);
            }
            let next_below = plane[y];
            let next_here = flags & 0x1ffu;
            if y > 0u && z > 0u {
                let row = y - 1u + 8u * (z - 1u);
                let bits = vec4<u32>(row_below, next_below, row_here, next_here);
                let shape = row_shape(origin, y - 1u, z - 1u);
                let edges = crossed_edges(bits, shape);
                let own = row_counts(slot, origin, vec2<u32>(y - 1u, z - 1u), bits, shape);
                records[slot].rows[row] = edges | (in_plane.x << 24u);
                let of_row = (in_plane.y & 0x7ffu) | ((own >> 16u) << 11u);
                if (row & 1u) == 1u {
                    records[slot].triangles[row / 2u] = even_row | (of_row << 16u);
                }
                even_row = of_row;
                in_plane += vec2<u32>(countOneBits(edges), own);
            }
            row_below = next_below;
            row_here = next_here;
            plane[y] = next_here;
        }
        if z > 0u {
            records[slot].planes[z - 1u] = before.x | (before.y << 16u);
            before += in_plane;
        }
    }
    if COUNTS_NON_FINITE && odd > 0u && slot < work.own_active {
        atomicAdd(&work.non_finite, odd);
    }
    counts[slot] = vec2<u32>(before.x + (before.y >> 16u), before.y & 0xffffu);
}

// Triangles of a row's cells, and in the upper half vertices within them.
fn row_counts(slot: u32, origin: vec3<u32>, row: vec2<u32>, bits: vec4<u32>, shape: RowShape) -> u32 {
    var own = 0u;
    for (var mixed = mixed_cells(bits, shape); mixed != 0u; mixed &= mixed - 1u) {
        let x = countTrailingZeros(mixed);
        let entry = cell_entry(slot, origin, vec3<u32>(x, row), cell_case(bits, x));
        own += triangle_count(entry) | (centre_count(entry) << 16u);
    }
    return own;
}
