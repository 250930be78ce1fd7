// emit of the triangles of cubes, an invocation a row of cells: for GPUs. A workgroup brings together what it looks up of its brick.
// The other form: shaders/emit/cells.wgsl, with the same CPU twin.

// Of the rows y + 9 z (0 to 8) of the brick's cells, whichever brick owns them: the crossed edges, and the number of the first
// vertex. Behind these 81, what lies in the next bricks along x of the same rows.
var<workgroup> row_edges: array<u32, 162>;
var<workgroup> row_first: array<u32, 162>;

// Looks them up. Bricks that are not active have no crossed edges. Of bricks beyond the grid's end there is anything, and no
// cell asks for it.
fn load_edges(slot: u32, brick: u32, lane: u32) {
    for (var i = lane; i < 162u; i += 64u) {
        let row = i % 81u;
        let owner = vec3<u32>(8u * (i / 81u), row % 9u, row / 9u);
        // 1 where the owner lies in the next brick along an axis.
        let next = owner >> vec3<u32>(3u);
        let p = owner & vec3<u32>(7u);
        var there = slot;
        var is_there = true;
        if any(next != vec3<u32>(0u)) {
            let beside = brick + next.x + params.slab_extent.x * (next.y + params.slab_extent.y * next.z);
            is_there = is_active(beside);
            there = select(slot, slot_of_brick(beside), is_there);
        }
        let word = records[there].rows[p.y + 8u * p.z];
        row_edges[i] = select(0u, word & 0xffffffu, is_there);
        row_first[i] = params.first_vertices[next.y + 2u * next.z] + offsets[there].x
            + (records[there].planes[p.z] & 0xffffu) + (word >> 24u);
    }
}

// The inside bits of the rows (y, z), (y+1, z), (y, z+1), (y+1, z+1): they change where edges are crossed, so that one sample of
// a row is enough.
fn cell_rows(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> vec4<u32> {
    let row = y + 9u * z;
    let here = vec2<u32>(row_edges[row], row_edges[row + 81u]);
    let up = vec2<u32>(row_edges[row + 1u], row_edges[row + 82u]);
    var bits = (here.x & 0xffu) << 1u;
    bits ^= bits << 1u;
    bits ^= bits << 2u;
    bits ^= bits << 4u;
    bits ^= select(0u, 0x1ffu, is_inside(row_bits(row_start(slot, origin, y, z), origin, 0u)));
    let next_y = bits ^ crossed_along(here >> vec2<u32>(8u));
    return vec4<u32>(bits, next_y, bits ^ crossed_along(here >> vec2<u32>(16u)), next_y ^ crossed_along(up >> vec2<u32>(16u)))
        & vec4<u32>(0x1ffu);
}

// The crossed edges of a row's nine points along an axis, of which the last is another brick's.
fn crossed_along(edges: vec2<u32>) -> u32 {
    return (edges.x & 0xffu) | ((edges.y & 1u) << 8u);
}

// Number of the vertex on the edge along `axis` of a point, 0 to 8 along each axis, of the brick or of those beside it.
fn owned_vertex(owner: vec3<u32>, axis: u32) -> u32 {
    let row = owner.y + 9u * owner.z + 81u * (owner.x >> 3u);
    return row_first[row] + countOneBits(row_edges[row] & ((1u << (8u * axis + (owner.x & 7u))) - 1u));
}

// Keeps the entries of a row's undecided cells.
fn keep_undecided(slot: u32, origin: vec3<u32>, row: u32) {
    let y = row % 8u;
    let z = row / 8u;
    let bits = cell_rows(slot, origin, y, z);
    let mixed = mixed_cells(bits, row_shape(origin, y, z));
    for (var undecided = mixed & undecided_cells(bits); undecided != 0u; undecided &= undecided - 1u) {
        let cell = vec3<u32>(countTrailingZeros(undecided), y, z);
        keep_entry(8u * row + cell.x, undecided_entry(slot, origin, cell));
    }
}

// The triangles of a row's cells.
fn write_triangles(slot: u32, origin: vec3<u32>, row: u32) {
    let y = row % 8u;
    let z = row / 8u;
    let in_plane = (records[slot].triangles[row / 2u] >> (16u * (row & 1u))) & 0x7ffu;
    var triangle = params.first_triangle + offsets[slot].y + (records[slot].planes[z] >> 16u) + in_plane;
    triangle -= params.triangle_window;
    var centre = 0u;
    if HAS_UNDECIDED && centres_of_row(slot, row) > 0u {
        centre = first_centre(slot, row);
    }
    let bits = cell_rows(slot, origin, y, z);
    let undecided = undecided_cells(bits);
    for (var mixed = mixed_cells(bits, row_shape(origin, y, z)); mixed != 0u; mixed &= mixed - 1u) {
        let cell = vec3<u32>(countTrailingZeros(mixed), y, z);
        let entry = cell_entry(cell_case(bits, cell.x), 8u * row + cell.x, ((undecided >> cell.x) & 1u) == 1u);
        write_cell(triangle, entry, cell, centre);
        triangle += triangle_count(entry);
        centre -= centre_count(entry);
    }
}

@compute @workgroup_size(64)
fn emit_indices(
    @builtin(local_invocation_index) row: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let slot = listed_slot(group, groups);
    let live = slot != NO_SLOT;
    let brick = active_list[select(call.first_slot, slot, live)];
    if live {
        load_edges(slot, brick, row);
    }
    workgroupBarrier();
    if live {
        let origin = brick_origin(brick);
        if HAS_UNDECIDED {
            keep_undecided(slot, origin, row);
        }
        write_triangles(slot, origin, row);
    }
}
