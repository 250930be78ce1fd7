// What classify looks up of a brick, brought together by its workgroup: for GPUs. The other form: shaders/classify/serial.wgsl.
//
// An invocation has what the samples of a column along z say, one of nine after the other, so that neighbours along x read side by side, no
// two write the same word, and what the field takes of x and y alone stays in registers. `load_columns` tests the samples and `keep_samples`
// writes them down: those of read_columns.wgsl, or of shaders/source/evaluate.wgsl.

// Inside bits of the nine points of column x + 9 y; in the upper half, which of them are NaN or infinite.
var<workgroup> brick_columns: array<u32, 81>;
// The same of row y + 9 z.
var<workgroup> brick_rows: array<u32, 81>;

// Turns columns into rows. Called once a kernel, by all invocations.
fn turn_columns(at: u32) {
    if at < 81u {
        let first = 9u * (at % 9u);
        let z = at / 9u;
        var flags = 0u;
        for (var x = 0u; x < 9u; x++) {
            flags |= ((brick_columns[first + x] >> z) & 0x10001u) << x;
        }
        brick_rows[at] = flags;
    }
    workgroupBarrier();
}

// Inside bits of the rows (y, z), (y+1, z), (y, z+1), (y+1, z+1).
fn rows_at(y: u32, z: u32) -> vec4<u32> {
    let row = y + 9u * z;
    return vec4<u32>(brick_rows[row], brick_rows[row + 1u], brick_rows[row + 9u], brick_rows[row + 10u]) & vec4<u32>(0x1ffu);
}

// How many of the row's points that the brick owns are NaN or infinite.
fn not_finite_at(y: u32, z: u32, owned: u32) -> u32 {
    return countOneBits((brick_rows[y + 9u * z] >> 16u) & owned);
}
