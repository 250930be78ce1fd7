// emit of marching cubes and its topologically correct form: the triangles of cells, from shaders/cases/, and the numbers of
// the vertices that they have on edges.

@group(0) @binding(8) var<storage, read> records: array<BrickRecord>;

fn along(axis: u32) -> vec3<u32> {
    return vec3<u32>(vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis));
}

// Number of the vertex on edge `edge` of the cell whose lowest corner is point `cell` of the brick.
fn vertex_on(edge: u32, cell: vec3<u32>, brick: u32, slot: u32) -> u32 {
    return owned_vertex(cell + lower_corner(edge), edge >> 2u, brick, slot);
}

// Number of the vertex at a corner of a triangle; `centre` is that of the cell's first one within.
fn corner_vertex(corner: u32, cell: vec3<u32>, brick: u32, slot: u32, centre: u32) -> u32 {
    if HAS_UNDECIDED && corner >= 12u {
        return centre - (corner - 12u);
    }
    return vertex_on(corner, cell, brick, slot);
}

// The three vertices of triangle `t` of a cell.
fn triangle_of(t: u32, entry: Entry, cell: vec3<u32>, brick: u32, slot: u32, centre: u32) -> vec3<u32> {
    let corners = triangle_corners(entry, t);
    let a = corner_vertex(corners & 15u, cell, brick, slot, centre);
    let b = corner_vertex((corners >> 4u) & 15u, cell, brick, slot, centre);
    let c = corner_vertex((corners >> 8u) & 15u, cell, brick, slot, centre);
    return select(vec3<u32>(a, b, c), vec3<u32>(a, c, b), params.mirrored == 1u);
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

// Keeps the entries of the undecided cells in the rows of an invocation, at most eight.
fn keep_undecided(slot: u32, origin: vec3<u32>, lane: u32) {
    var undecided = vec2<u32>(0u);
    for (var row = lane; row < 64u; row += ROW_LANES) {
        let y = row % 8u;
        let z = row / 8u;
        let bits = cell_rows(slot, origin, y, z);
        let left = mixed_cells(bits, row_shape(origin, y, z)) & undecided_cells(bits);
        undecided |= cells_of_row(left, row / ROW_LANES);
    }
    for (; any(undecided != vec2<u32>(0u)); undecided = without_first(undecided)) {
        let i = first_cell(undecided);
        let row = lane + ROW_LANES * (i / 8u);
        let cell = vec3<u32>(i & 7u, row % 8u, row / 8u);
        keep_entry(8u * row + cell.x, undecided_entry(slot, origin, cell));
    }
}

// The triangles of a row's cells, as far as the window has room.
fn write_triangles(slot: u32, brick: u32, origin: vec3<u32>, row: u32) {
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
    var mixed = mixed_cells(bits, row_shape(origin, y, z));
    if mixed == 0u {
        return;
    }
    // Loops that ask at their end: where the condition comes first, lavapipe runs through all once more, for nothing.
    loop {
        let cell = vec3<u32>(countTrailingZeros(mixed), y, z);
        let entry = cell_entry(cell_case(bits, cell.x), 8u * row + cell.x, ((undecided >> cell.x) & 1u) == 1u);
        let count = triangle_count(entry);
        var t = 0u;
        loop {
            if triangle < call.triangle_capacity {
                let corners = triangle_of(t, entry, cell, brick, slot, centre);
                indices[3u * triangle] = corners.x;
                indices[3u * triangle + 1u] = corners.y;
                indices[3u * triangle + 2u] = corners.z;
            }
            triangle++;
            continuing {
                t++;
                break if t >= count;
            }
        }
        centre -= centre_count(entry);
        continuing {
            mixed &= mixed - 1u;
            break if mixed == 0u;
        }
    }
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
