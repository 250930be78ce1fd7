// classify for marching tetrahedra: each brick's inside bits, and how many vertices and triangles its rows make. One workgroup
// a brick. CPU twin: src/stage/classify/tetrahedra.rs.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(8) var<storage, read_write> records: array<TetraRecord>;
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;
@group(0) @binding(10) var<storage, read> table: array<u32>;

// Inside bits of the nine points of row y + 9 z.
var<workgroup> inside_rows: array<u32, 81>;
// Vertices and triangles before each row.
var<workgroup> before_rows: array<vec2<u32>, 64>;

// Inside bits of a row; none past the grid's end.
fn read_row(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> u32 {
    if origin.y + y >= params.points.y || origin.z + z >= params.points.z {
        return 0u;
    }
    let row = row_start(slot, origin, y, z);
    let count = min(params.points.x - origin.x, 9u);
    var bits = 0u;
    var odd = 0u;
    for (var x = 0u; x < count; x++) {
        let sample = row_bits(row, origin, x);
        bits |= u32(is_inside(sample)) << x;
        odd |= u32(!is_finite(sample)) << x;
    }
    if COUNTS_NON_FINITE && (odd & 0xffu) != 0u && y < 8u && z < 8u && slot < work.own_active {
        atomicAdd(&work.non_finite, countOneBits(odd & 0xffu));
    }
    return bits;
}

@compute @workgroup_size(64)
fn classify(
    lane: Lane,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let row = lane_of(lane);
    let y = row % 8u;
    let z = row / 8u;
    let slot = slot_of(group, groups);
    // All meet at the barriers, also those beyond the last brick.
    let live = slot < batch_end(work.active_bricks);
    let origin = brick_origin(active_list[select(call.first_slot, slot, live)]);
    if live {
        for (var i = row; i < 81u; i += 64u) {
            inside_rows[i] = read_row(slot, origin, i % 9u, i / 9u);
        }
    }
    workgroupBarrier();
    var own = vec2<u32>(0u);
    let at = y + 9u * z;
    if live {
        let bits = vec4<u32>(inside_rows[at], inside_rows[at + 1u], inside_rows[at + 9u], inside_rows[at + 10u]);
        let shape = row_shape(origin, y, z);
        for (var direction = 1u; direction < 8u; direction++) {
            own.x += countOneBits(crossed_towards(bits, shape, direction));
        }
        for (var mixed = mixed_cells(bits, shape); mixed != 0u; mixed &= mixed - 1u) {
            own.y += table[TETRA_TABLE + TETRA_WORDS * cell_case(bits, countTrailingZeros(mixed))];
        }
    }
    let before = group_before(lane, own);
    before_rows[row] = before;
    workgroupBarrier();
    if !live {
        return;
    }
    let in_plane = before - before_rows[row & 56u];
    records[slot].rows[at] = inside_rows[at] | (in_plane.x << 9u) | (in_plane.y << 18u);
    if y == 7u {
        records[slot].rows[at + 1u] = inside_rows[at + 1u];
    }
    if z == 7u {
        records[slot].rows[at + 9u] = inside_rows[at + 9u];
    }
    if row == 63u {
        records[slot].rows[80] = inside_rows[80];
        counts[slot] = before + own;
    }
    if y == 0u {
        records[slot].planes[z] = before.x | (before.y << 16u);
    }
    if row < 15u {
        records[slot].unused[row] = 0u;
    }
}
