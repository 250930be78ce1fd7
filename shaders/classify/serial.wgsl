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
    take_settings();
    let slot = call.first_slot + BRICKS * (group.y * groups.x + group.x) + lane;
    if slot >= batch_end(work.active_bricks) {
        return;
    }
    let origin = brick_origin(active_list[slot]);
    // Inside bits of the plane's rows below, which give way to those of this plane.
    var plane: array<u32, 9>;
    // Vertices on edges; triangles, and in the upper half vertices within cells. Those of the planes before, and of this one's rows.
    // Triangles of undecided cells come at the end of each plane.
    var before = vec2<u32>(0u);
    var odd = 0u;
    for (var z = 0u; z < 9u; z++) {
        var in_plane = vec2<u32>(0u);
        var row_below = 0u;
        var row_here = 0u;
        var even_row = 0u;
        var undecided = vec2<u32>(0u);
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
                let mixed = mixed_cells(bits, shape);
                let left = mixed & undecided_cells(bits);
                undecided |= cells_of_row(left, y - 1u);
                records[slot].rows[row] = edges | (in_plane.x << 24u);
                if (row & 1u) == 1u {
                    records[slot].triangles[row / 2u] = even_row | (in_plane.y << 16u);
                }
                even_row = in_plane.y;
                in_plane += vec2<u32>(countOneBits(edges), decided_triangles(bits, mixed & ~left));
            }
            row_below = next_below;
            row_here = next_here;
            plane[y] = next_here;
        }
        if z > 0u {
            if HAS_UNDECIDED {
                in_plane.y += add_undecided(slot, origin, z - 1u, undecided);
            }
            records[slot].planes[z - 1u] = before.x | (before.y << 16u);
            before += in_plane;
        }
    }
    if COUNTS_NON_FINITE && odd > 0u && slot < work.own_active {
        atomicAdd(&work.non_finite, odd);
    }
    counts[slot] = vec2<u32>(before.x + (before.y >> 16u), before.y & 0xffffu);
}

// Triangles of some cells of a row.
fn decided_triangles(bits: vec4<u32>, some: u32) -> u32 {
    var own = 0u;
    for (var cells = some; cells != 0u; cells &= cells - 1u) {
        own += triangle_count(decided_entry(cell_case(bits, countTrailingZeros(cells))));
    }
    return own;
}

// Adds a plane's undecided cells to what is written of its rows. Their triangles, and in the upper half vertices within them.
fn add_undecided(slot: u32, origin: vec3<u32>, z: u32, undecided: vec2<u32>) -> u32 {
    var all = 0u;
    for (var cells = undecided; any(cells != vec2<u32>(0u)); cells = without_first(cells)) {
        let number = first_cell(cells);
        let y = number / 8u;
        let entry = undecided_entry(slot, origin, vec3<u32>(number & 7u, y, z));
        let count = triangle_count(entry);
        let centres = centre_count(entry);
        records[slot].triangles[4u * z + y / 2u] += centres << (11u + 16u * (y & 1u));
        for (var later = y + 1u; later < 8u; later++) {
            records[slot].triangles[4u * z + later / 2u] += count << (16u * (later & 1u));
        }
        all += count | (centres << 16u);
    }
    return all;
}
