// What classify leaves of a brick of marching tetrahedra; `TetraRecord` in src/stage/classify/tetrahedra.rs. Each point owns
// seven edges, to the other corners of the cell above it; their directions are corner numbers (bits zyx), 1 to 7. Which are
// crossed follows from the inside bits of four rows.
//
// rows[y + 9 z], y and z from 0 to 8: bits 0-8 the inside bits of the row's nine points; of rows 0-7 bits 9-17 the vertices of
// the plane's earlier rows (at most 7 * 56), bits 18-27 their triangles (at most 7 * 96).
// planes[z]: low half the vertices of the earlier planes, high half their triangles.
struct TetraRecord {
    rows: array<u32, 81>,
    planes: array<u32, 8>,
    unused: array<u32, 15>,
}

// The inside bits of the row that is (y, z) further, from those of rows (y, z), (y+1, z), (y, z+1), (y+1, z+1).
fn row_across(bits: vec4<u32>, direction: u32) -> u32 {
    return bits[direction >> 1u] >> (direction & 1u);
}

// A row's crossed edges in a direction, a bit each of its eight points.
fn crossed_towards(bits: vec4<u32>, shape: RowShape, direction: u32) -> u32 {
    var points = shape.owned;
    if (direction & 1u) != 0u {
        points &= shape.along_x;
    }
    if (direction & 2u) != 0u {
        points &= shape.along_y;
    }
    if (direction & 4u) != 0u {
        points &= shape.along_z;
    }
    return (bits.x ^ row_across(bits, direction)) & points;
}
