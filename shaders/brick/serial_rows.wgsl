// What classify and emit look up of a brick, each invocation for itself: for software adapters, to which a barrier costs more
// than reading a sample again. The other form: shared_rows.wgsl.

fn load_rows(slot: u32, origin: vec3<u32>, lane: u32, live: bool) {}

// Inside bits of the rows (y, z), (y+1, z), (y, z+1), (y+1, z+1).
fn rows_at(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> vec4<u32> {
    return vec4<u32>(
        inside_row(slot, origin, y, z),
        inside_row(slot, origin, y + 1u, z),
        inside_row(slot, origin, y, z + 1u),
        inside_row(slot, origin, y + 1u, z + 1u),
    );
}

// Inside bits of nine points.
fn inside_row(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> u32 {
    let row = row_start(slot, origin, y, z);
    var bits = 0u;
    for (var x = 0u; x < 9u; x++) {
        bits |= u32(is_inside(row_bits(row, origin, x))) << x;
    }
    return bits;
}

// How many of the row's points that the brick owns are NaN or infinite.
fn not_finite_at(slot: u32, origin: vec3<u32>, y: u32, z: u32, owned: u32) -> u32 {
    let row = row_start(slot, origin, y, z);
    var odd = 0u;
    for (var x = 0u; x < 8u; x++) {
        odd |= u32(!is_finite(row_bits(row, origin, x))) << x;
    }
    return countOneBits(odd & owned);
}
