// A row of eight points of a brick: what lies inside the grid, which corners are inside the solid,
// and the cells' cases. Shared by classify and emit; the twin in
// src/stage/classify/cpu.rs does a plane of the brick at a time.

struct RowShape {
    // Bit x: the row's point x is a point of the grid.
    owned: u32,
    // Points that have a +x, +y, +z edge.
    along_x: u32,
    along_y: u32,
    along_z: u32,
    // Cells of the row.
    cells: u32,
}

fn low_bits(count: u32) -> u32 {
    return (1u << min(count, 8u)) - 1u;
}

fn row_shape(origin: vec3<u32>, y: u32, z: u32) -> RowShape {
    let p = params.points;
    let exists = origin.y + y < p.y && origin.z + z < p.z;
    let has_y = exists && origin.y + y + 1u < p.y;
    let has_z = exists && origin.z + z + 1u < p.z;
    let points = low_bits(p.x - origin.x);
    let cells = min(p.x - origin.x - 1u, 8u);
    return RowShape(
        select(0u, points, exists),
        select(0u, low_bits(cells), exists),
        select(0u, points, has_y),
        select(0u, points, has_z),
        select(0u, cells, has_y && has_z),
    );
}

// The row's crossed owned edges: +x in bits 0-7, +y in 8-15, +z in 16-23.
fn crossed_edges(bits: vec4<u32>, shape: RowShape) -> u32 {
    let x = (bits.x ^ (bits.x >> 1u)) & shape.along_x;
    let y = (bits.x ^ bits.y) & shape.along_y;
    let z = (bits.x ^ bits.z) & shape.along_z;
    return x | (y << 8u) | (z << 16u);
}

// Which cells of the row have corners on both sides.
fn mixed_cells(bits: vec4<u32>, shape: RowShape) -> u32 {
    let some = bits.x | bits.y | bits.z | bits.w;
    let every = bits.x & bits.y & bits.z & bits.w;
    return ((some | (some >> 1u)) & ~(every & (every >> 1u))) & ((1u << shape.cells) - 1u);
}

// Up to 64 cells, a bit each: eight rows of them, from the lowest bits on.
fn cells_of_row(cells: u32, row: u32) -> vec2<u32> {
    let word = cells << (8u * (row & 3u));
    return select(vec2<u32>(word, 0u), vec2<u32>(0u, word), row >= 4u);
}

fn first_cell(cells: vec2<u32>) -> u32 {
    return select(countTrailingZeros(cells.x), 32u + countTrailingZeros(cells.y), cells.x == 0u);
}

fn without_first(cells: vec2<u32>) -> vec2<u32> {
    return cells & select(vec2<u32>(cells.x - 1u, 0xffffffffu), vec2<u32>(0u, cells.y - 1u), cells.x == 0u);
}

fn cell_case(bits: vec4<u32>, x: u32) -> u32 {
    let pairs = (bits >> vec4<u32>(x)) & vec4<u32>(3u);
    return pairs.x | (pairs.y << 2u) | (pairs.z << 4u) | (pairs.w << 6u);
}
