// classify: each brick's crossed owned edges as bit masks, and how many vertices and triangles its
// rows make. One workgroup a brick, one invocation a row of eight points.
// CPU twin: src/stage/classify/cpu.rs.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(8) var<storage, read_write> records: array<BrickRecord>;
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;
@group(0) @binding(10) var<uniform> table: array<vec4<u32>, 128>;

// Vertices (low half) and triangles (high half) of each row.
var<workgroup> row_counts: array<u32, 64>;

@compute @workgroup_size(8, 8)
fn classify(
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) row: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    let live = slot < batch_end(work.active_bricks);
    var edges = 0u;
    var row_triangles = 0u;
    if live {
        let origin = brick_origin(active_list[slot]);
        let shape = row_shape(origin, local.x, local.y);
        let bits = inside_rows(slot, origin, local.x, local.y);
        edges = crossed_edges(bits, shape);
        for (var mixed = mixed_cells(bits, shape); mixed != 0u; mixed &= mixed - 1u) {
            row_triangles += table_words(cell_case(bits, countTrailingZeros(mixed))).x & 15u;
        }
        if COUNTS_NON_FINITE && slot < work.own_active {
            let odd = countOneBits(not_finite_row(slot, origin, local.x, local.y) & shape.owned);
            if odd > 0u {
                atomicAdd(&work.non_finite, odd);
            }
        }
    }
    row_counts[row] = countOneBits(edges) | (row_triangles << 16u);
    workgroupBarrier();
    if !live {
        return;
    }
    // Each invocation sums the rows before it in its plane, the first of a plane also the planes
    // before: no more barriers.
    var before = 0u;
    for (var r = row & 56u; r < row; r++) {
        before += row_counts[r];
    }
    records[slot].rows[row] = edges | (before << 24u);
    if (row & 1u) == 0u {
        records[slot].triangles[row / 2u] = (before >> 16u) | ((before + row_counts[row]) & 0xffff0000u);
    }
    if local.x == 0u {
        var planes = 0u;
        for (var r = 0u; r < row; r++) {
            planes += row_counts[r];
        }
        records[slot].planes[local.y] = planes;
    }
    if row == 63u {
        var total = 0u;
        for (var r = 0u; r < 64u; r++) {
            total += row_counts[r];
        }
        counts[slot] = vec2<u32>(total & 0xffffu, total >> 16u);
    }
}

// Which owned points of the row are NaN or infinite.
fn not_finite_row(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> u32 {
    let row = row_start(slot, origin, y, z);
    var odd = 0u;
    for (var x = 0u; x < 8u; x++) {
        odd |= u32(!is_finite(row_bits(row, origin, x))) << x;
    }
    return odd;
}
