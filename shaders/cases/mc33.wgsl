// The triangles of a cell by topologically correct marching cubes (src/table/mc33.rs): the marching cubes table where the
// corners decide, else what the trilinear interpolant says. CPU twin: src/stage/trilinear.rs.
@group(0) @binding(10) var<storage, read> table: array<u32>;

const HAS_CENTRES = true;
// Two words a case (src/table/mc33.rs); in place of the number of triangles, that the corners do not decide.
const CASES = 512u;
const UNDECIDED = 15u;
// Behind them.
const ROWS = 1024u;

// What the tables have for a cell, to be asked by the functions below: where it begins, and its first word.
struct Entry {
    at: u32,
    head: u32,
}

fn cell_entry(slot: u32, origin: vec3<u32>, cell: vec3<u32>, case_byte: u32) -> Entry {
    let of_case = CASES + 2u * case_byte;
    let head = table[of_case];
    if (head & 15u) == UNDECIDED {
        return undecided_entry(slot, origin, cell, case_byte, table[of_case + 1u]);
    }
    return Entry(of_case, head);
}

fn undecided_entry(slot: u32, origin: vec3<u32>, cell: vec3<u32>, case_byte: u32, word: u32) -> Entry {
    var magnitudes: array<u32, 8>;
    for (var k = 0u; k < 8u; k++) {
        magnitudes[k] = magnitude(sample_bits(slot, origin, cell + vec3<u32>(k & 1u, (k >> 1u) & 1u, k >> 2u)));
    }
    var number = 0u;
    var faces = 0u;
    for (var face = 0u; face < 6u; face++) {
        if ((word >> face) & 1u) == 1u {
            let joined = u32(joins_inside(case_byte, magnitudes, face));
            number = 2u * number + joined;
            faces |= joined << face;
        }
    }
    let row = (word >> 6u) + 3u * number;
    var entry = table[row];
    if (table[row + 1u] | table[row + 2u]) != 0u {
        let joined = table[row + tunnel(case_byte, magnitudes, faces)];
        // Rounding may say what cannot be.
        entry = select(joined, entry, joined == 0u);
    }
    return Entry(entry, table[entry]);
}

fn triangle_count(entry: Entry) -> u32 {
    return entry.head & 15u;
}

// Vertices within the cell.
fn centre_count(entry: Entry) -> u32 {
    return select((entry.head >> 4u) & 3u, 0u, entry.at < ROWS);
}

// The edges whose vertices lie around a centre, a bit each.
fn around_centre(entry: Entry, i: u32) -> u32 {
    return (entry.head >> (8u + 12u * i)) & 0xfffu;
}

// The corners of triangle `t`, four bits each: edges, and from 12 on centres.
fn triangle_corners(entry: Entry, t: u32) -> u32 {
    if entry.at >= ROWS {
        return table[entry.at + 1u + t / 2u] >> (12u * (t & 1u));
    }
    let shift = 4u + 12u * t;
    var corners = entry.head >> min(shift, 31u);
    if shift >= 32u {
        corners = table[entry.at + 1u] >> (shift - 32u);
    } else if shift > 20u {
        corners |= table[entry.at + 1u] << (32u - shift);
    }
    return corners;
}

// Of classify: the vertices within the cells of each row.
var<workgroup> row_centres: array<u32, 64>;

fn note_centres(row: u32, count: u32) {
    row_centres[row] = count;
}

fn centres_noted(row: u32) -> u32 {
    return row_centres[row];
}
