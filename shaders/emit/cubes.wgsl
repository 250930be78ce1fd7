// emit of marching cubes and its topologically correct form: the vertices on edges, and the triangles of a cell, from shaders/cases/.
// Who makes the triangles of which cells: shaders/emit/rows.wgsl on GPUs, cells.wgsl on software adapters.

@group(0) @binding(8) var<storage, read> records: array<BrickRecord>;

fn along(axis: u32) -> vec3<u32> {
    return vec3<u32>(vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis));
}

// Number of the vertex at a corner of a triangle: on an edge of the cell whose lowest corner is point `cell` of the brick, or within
// the cell; `centre` is that of its first one there.
fn corner_vertex(corner: u32, cell: vec3<u32>, centre: u32) -> u32 {
    if HAS_UNDECIDED && corner >= 12u {
        return centre - (corner - 12u);
    }
    return owned_vertex(cell + lower_corner(corner), corner >> 2u);
}

// Writes the triangles of a cell from number `first` of the window on, as far as that has room. There is one at least.
fn write_cell(first: u32, entry: Entry, cell: vec3<u32>, centre: u32) {
    let count = triangle_count(entry);
    var t = 0u;
    // Asks at its end: where the condition comes first, lavapipe runs through all once more, for nothing.
    loop {
        if first + t < call.triangle_capacity {
            let corners = triangle_corners(entry, t);
            let a = corner_vertex(corners & 15u, cell, centre);
            let b = corner_vertex((corners >> 4u) & 15u, cell, centre);
            let c = corner_vertex((corners >> 8u) & 15u, cell, centre);
            let place = 3u * (first + t);
            indices[place] = a;
            indices[place + 1u] = select(b, c, params.mirrored == 1u);
            indices[place + 2u] = select(c, b, params.mirrored == 1u);
        }
        continuing {
            t++;
            break if t >= count;
        }
    }
}

// How many vertices lie within the cells of a row.
fn centres_of_row(slot: u32, row: u32) -> u32 {
    return (records[slot].triangles[row / 2u] >> (16u * (row & 1u) + 11u)) & 31u;
}

// Number of a row's first vertex within a cell: they are counted backwards from the brick's last vertex.
fn first_centre(slot: u32, row: u32) -> u32 {
    var before = 0u;
    for (var i = 0u; i < row; i++) {
        before += centres_of_row(slot, i);
    }
    return params.first_vertices.x + offsets[slot + 1u].x - 1u - before;
}

// How many vertices lie on edges that the brick owns: its first ones.
fn edge_vertices(slot: u32) -> u32 {
    let last = records[slot].rows[63];
    return (records[slot].planes[7] & 0xffffu) + (last >> 24u) + countOneBits(last & 0xffffffu);
}

// The lower end of an edge of a cell.
fn lower_corner(edge: u32) -> vec3<u32> {
    let axis = edge >> 2u;
    let one = edge & 1u;
    let two = (edge >> 1u) & 1u;
    return vec3<u32>(
        select(one, 0u, axis == 0u),
        select(select(two, 0u, axis == 1u), one, axis == 0u),
        select(two, 0u, axis == 2u),
    );
}

// The edge of each vertex: row in bits 5 and up, below it the bit of the row's word.
var<workgroup> brick_edges: array<u32, 1536>;

@compute @workgroup_size(LANES)
fn emit_vertices(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let slot = listed_slot(group, groups);
    let live = slot != NO_SLOT;
    if live {
        for (var row = lane; row < 64u; row += LANES) {
            let word = records[slot].rows[row];
            var place = (records[slot].planes[row / 8u] & 0xffffu) + (word >> 24u);
            for (var edges = word & 0xffffffu; edges != 0u; edges &= edges - 1u) {
                brick_edges[place] = (row << 5u) | countTrailingZeros(edges);
                place++;
            }
        }
    }
    workgroupBarrier();
    if !live {
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
        let edge = brick_edges[k];
        let owner = vec3<u32>(edge & 7u, (edge >> 5u) & 7u, edge >> 8u);
        write_vertex(place, make_vertex(slot, origin, owner, along((edge >> 3u) & 3u)));
    }
    report_runaway();
}
