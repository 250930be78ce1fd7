// emit of the triangles of cubes, an invocation a cell of a list: for software adapters, to which each look-up costs the same
// however few invocations make it. The other form: shaders/emit/rows.wgsl, with the same CPU twin.

// The brick and those beside it, next.x + 2 next.y + 4 next.z: the slot, or NO_SLOT if it is not active.
var<workgroup> near_slots: array<u32, 8>;
// The number of the first vertex of a plane z (0 to 8) of them, z + 9 (next.x + 2 next.y).
var<workgroup> plane_first: array<u32, 36>;
// Their rows as in records, y + 9 z (0 to 8) and 81 further on those next along x: crossed edges, and vertices of the plane's earlier rows.
var<workgroup> row_words: array<u32, 162>;

// The cells that have triangles, in no order: the cell x + 8 y + 64 z in 9 bits, its case in 8, whether it is undecided in one, and above
// them the triangles of the brick's earlier cells (at most 511 * 14).
var<workgroup> listed: atomic<u32>;
var<workgroup> cells: array<u32, 512>;
// Of the same, where there are undecided cells: the number of the first vertex within.
var<workgroup> cell_centres: array<u32, 512>;

// Looks up the brick numbered `i` of those near.
fn load_near(slot: u32, brick: u32, i: u32) {
    let next = vec3<u32>(i & 1u, (i >> 1u) & 1u, i >> 2u);
    let beside = brick + next.x + params.slab_extent.x * (next.y + params.slab_extent.y * next.z);
    // Of bricks beyond the grid's end there is anything, and no cell asks for it.
    near_slots[i] = select(select(NO_SLOT, slot_of_brick(beside), is_active(beside)), slot, i == 0u);
}

// Looks up the planes and rows. Bricks that are not active have no crossed edges.
fn load_rows(lane: u32) {
    for (var i = lane; i < 36u; i += 8u) {
        let z = i % 9u;
        let across = i / 9u;
        let there = near_slots[across + 4u * (z / 8u)];
        if there != NO_SLOT {
            plane_first[i] = params.first_vertices[across / 2u + 2u * (z / 8u)] + offsets[there].x
                + (records[there].planes[z % 8u] & 0xffffu);
        }
    }
    for (var row = lane; row < 81u; row += 8u) {
        let y = row % 9u;
        let z = row / 9u;
        let beside = 2u * (y / 8u) + 4u * (z / 8u);
        row_words[row] = near_row(beside, y % 8u + 8u * (z % 8u));
        row_words[row + 81u] = near_row(beside + 1u, y % 8u + 8u * (z % 8u));
    }
}

fn near_row(beside: u32, row: u32) -> u32 {
    let there = near_slots[beside];
    if there == NO_SLOT {
        return 0u;
    }
    return records[there].rows[row];
}

// Number of the vertex on the edge along `axis` of a point, 0 to 8 along each axis, of the brick or of those beside it.
fn owned_vertex(owner: vec3<u32>, axis: u32) -> u32 {
    let next = owner >> vec3<u32>(3u);
    let word = row_words[owner.y + 9u * owner.z + 81u * next.x];
    return plane_first[owner.z + 9u * (next.x + 2u * next.y)] + (word >> 24u)
        + countOneBits(word & ((1u << (8u * axis + (owner.x & 7u))) - 1u));
}

// On the way through the rows of cells of a plane: inside bits of the rows (y, z), (y+1, z), (y, z+1), (y+1, z+1), and the words of
// row (y+1, z). Bits change where edges are crossed, so that one sample of a plane is enough.
struct CellRows {
    bits: vec4<u32>,
    upper: vec2<u32>,
}

fn words_of_row(y: u32, z: u32) -> vec2<u32> {
    let row = y + 9u * z;
    return vec2<u32>(row_words[row], row_words[row + 81u]);
}

// The crossed edges of a row's nine points along an axis, of which the last is another brick's.
fn crossed_along(words: vec2<u32>) -> u32 {
    return (words.x & 0xffu) | ((words.y & 1u) << 8u);
}

// Before the first row.
fn before_rows(slot: u32, origin: vec3<u32>, z: u32) -> CellRows {
    let words = words_of_row(0u, z);
    var bits = (words.x & 0xffu) << 1u;
    bits ^= bits << 1u;
    bits ^= bits << 2u;
    bits ^= bits << 4u;
    bits ^= bits << 8u;
    bits ^= select(0u, 0x1ffu, is_inside(sample_bits(slot, origin, vec3<u32>(0u, 0u, z))));
    bits &= 0x1ffu;
    return CellRows(vec4<u32>(0u, bits, 0u, bits ^ crossed_along(words >> vec2<u32>(16u))), words);
}

fn next_rows(before: CellRows, y: u32, z: u32) -> CellRows {
    let here = before.bits.y;
    let above = before.bits.w;
    let upper = words_of_row(y + 1u, z);
    let next = here ^ crossed_along(before.upper >> vec2<u32>(8u));
    return CellRows(vec4<u32>(here, next, above, next ^ crossed_along(upper >> vec2<u32>(16u))), upper);
}

// Keeps the entries of a plane's undecided cells.
fn keep_undecided(slot: u32, origin: vec3<u32>, z: u32) {
    var undecided = vec2<u32>(0u);
    var rows = before_rows(slot, origin, z);
    for (var y = 0u; y < 8u; y++) {
        rows = next_rows(rows, y, z);
        undecided |= cells_of_row(mixed_cells(rows.bits, row_shape(origin, y, z)) & undecided_cells(rows.bits), y);
    }
    for (; any(undecided != vec2<u32>(0u)); undecided = without_first(undecided)) {
        let i = first_cell(undecided);
        keep_entry(64u * z + i, undecided_entry(slot, origin, vec3<u32>(i & 7u, i / 8u, z)));
    }
}

// Lists a plane's cells.
fn list_cells(slot: u32, origin: vec3<u32>, z: u32) {
    var triangles = records[slot].planes[z] >> 16u;
    var centre = 0u;
    if HAS_UNDECIDED {
        // Counting takes a turn of a loop a row, which most bricks need not take.
        let has_centres = offsets[slot + 1u].x - offsets[slot].x > edge_vertices(slot);
        centre = first_centre(slot, select(0u, 8u * z, has_centres));
    }
    var rows = before_rows(slot, origin, z);
    for (var y = 0u; y < 8u; y++) {
        rows = next_rows(rows, y, z);
        let undecided = undecided_cells(rows.bits);
        var mixed = mixed_cells(rows.bits, row_shape(origin, y, z));
        var place = atomicAdd(&listed, countOneBits(mixed));
        for (; mixed != 0u; mixed &= mixed - 1u) {
            let x = countTrailingZeros(mixed);
            let cell = x + 8u * y + 64u * z;
            let case_byte = cell_case(rows.bits, x);
            let is_undecided = (undecided >> x) & 1u;
            let entry = cell_entry(case_byte, cell, is_undecided == 1u);
            cells[place] = cell | (case_byte << 9u) | (is_undecided << 17u) | (triangles << 18u);
            if HAS_UNDECIDED {
                cell_centres[place] = centre;
                centre -= centre_count(entry);
            }
            triangles += triangle_count(entry);
            place++;
        }
    }
}

@compute @workgroup_size(8)
fn emit_indices(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let slot = listed_slot(group, groups);
    let live = slot != NO_SLOT;
    let brick = active_list[select(call.first_slot, slot, live)];
    let origin = brick_origin(brick);
    if live {
        load_near(slot, brick, lane);
        if lane == 0u {
            atomicStore(&listed, 0u);
        }
    }
    workgroupBarrier();
    if live {
        load_rows(lane);
    }
    workgroupBarrier();
    if live {
        if HAS_UNDECIDED {
            keep_undecided(slot, origin, lane);
        }
        list_cells(slot, origin, lane);
    }
    workgroupBarrier();
    if live {
        write_cells(params.first_triangle + offsets[slot].y - params.triangle_window, lane);
    }
}

// The triangles of the cells listed; `first` is that of the brick.
fn write_cells(first: u32, lane: u32) {
    let count = atomicLoad(&listed);
    for (var i = lane; i < count; i += 8u) {
        let word = cells[i];
        let number = word & 0x1ffu;
        let entry = cell_entry((word >> 9u) & 0xffu, number, ((word >> 17u) & 1u) == 1u);
        var centre = 0u;
        if HAS_UNDECIDED {
            centre = cell_centres[i];
        }
        write_cell(first + (word >> 18u), entry, vec3<u32>(number & 7u, (number / 8u) & 7u, number / 64u), centre);
    }
}
