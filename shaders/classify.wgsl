// classify: each brick's crossed owned edges as bit masks, and how many vertices and triangles its
// rows make. One workgroup a brick; one invocation a column of nine points, then one a row of eight.
// CPU twin: src/stage/classify/cpu.rs. The other form: shaders/classify/serial.wgsl.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(8) var<storage, read_write> records: array<BrickRecord>;
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;

// Before each row: vertices on edges; triangles, and in the upper half vertices within cells.
var<workgroup> before_rows: array<vec2<u32>, 64>;
// The same of the whole brick.
var<workgroup> of_brick: vec2<u32>;

@compute @workgroup_size(GROUP)
fn classify(
    lane: Lane,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let at = lane_of(lane);
    let slot = slot_of(group, groups);
    // All meet at the barriers, also those beyond the last brick.
    let live = slot < batch_end(work.active_bricks);
    let origin = brick_origin(active_list[select(call.first_slot, slot, live)]);
    load_columns(slot, origin, at, live);
    turn_columns(at);
    // From here on the first 64 have a row each.
    let row = at;
    let y = row % 8u;
    let z = row / 8u;
    var edges = 0u;
    var own = vec2<u32>(0u);
    if live && row < 64u {
        let shape = row_shape(origin, y, z);
        let bits = rows_at(y, z);
        edges = crossed_edges(bits, shape);
        own.x = countOneBits(edges);
        let mixed = mixed_cells(bits, shape);
        let undecided = mixed & undecided_cells(bits);
        for (var cells = mixed & ~undecided; cells != 0u; cells &= cells - 1u) {
            own.y += triangle_count(decided_entry(cell_case(bits, countTrailingZeros(cells))));
        }
        if HAS_UNDECIDED {
            for (var cells = undecided; cells != 0u; cells &= cells - 1u) {
                let entry = undecided_entry(slot, origin, vec3<u32>(countTrailingZeros(cells), y, z));
                own.y += triangle_count(entry) | (centre_count(entry) << 16u);
            }
        }
        if COUNTS_NON_FINITE && slot < work.own_active {
            let odd = not_finite_at(y, z, shape.owned);
            if odd > 0u {
                atomicAdd(&work.non_finite, odd);
            }
        }
    }
    let before = group_before(lane, own);
    if row < 64u {
        before_rows[row] = before;
        note_centres(row, own.y >> 16u);
    }
    if row == 63u {
        of_brick = before + own;
    }
    workgroupBarrier();
    if !live {
        return;
    }
    if any(of_brick != vec2<u32>(0u)) {
        keep_samples(slot, at);
    }
    if row >= 64u {
        return;
    }
    let in_plane = before - before_rows[row & 56u];
    records[slot].rows[row] = edges | (in_plane.x << 24u);
    if (row & 1u) == 0u {
        let centres = centres_noted(row) | (centres_noted(row + 1u) << 16u);
        records[slot].triangles[row / 2u] = (in_plane.y & 0xffffu) | ((in_plane.y + own.y) << 16u) | (centres << 11u);
    }
    if y == 0u {
        records[slot].planes[z] = before.x | (before.y << 16u);
    }
    if row == 63u {
        counts[slot] = vec2<u32>(of_brick.x + (of_brick.y >> 16u), of_brick.y & 0xffffu);
    }
}
