// The triangles of a cell by topologically correct marching cubes (src/table/mc33.rs): the marching cubes table where the
// corners decide, else what the trilinear interpolant says. CPU twin: src/stage/trilinear.rs.
@group(0) @binding(10) var<storage, read> table: array<u32>;

// Vertices within cells have but these.
const HAS_UNDECIDED = true;
// Two words a case (src/table/mc33.rs).
const CASES = 512u;
// Behind them.
const ROWS = 1024u;

// What the tables have for a cell, to be asked by the functions below: where it begins, and its first word.
struct Entry {
    at: u32,
    head: u32,
}

fn entry_at(at: u32) -> Entry {
    return Entry(at, table[at]);
}

// Which cells of a row (shaders/shared/row.wgsl) their corners do not decide: those with a face whose diagonal corners alone are on
// one side, and those in which each corner is on the side of the opposite one.
fn undecided_cells(bits: vec4<u32>) -> u32 {
    let next = bits >> vec4<u32>(1u);
    // The faces between cells of the row, of which a cell has that bit and the next; and the other four, a pair of rows each.
    let across_x = ~(bits.x ^ bits.w) & ~(bits.y ^ bits.z) & (bits.x ^ bits.y);
    let low = bits.xyxz;
    let high = bits.zwyw;
    let faces = ~(low ^ (high >> vec4<u32>(1u))) & ~((low >> vec4<u32>(1u)) ^ high) & (low ^ high);
    let opposite = ~(bits ^ next.wzyx);
    let symmetric = opposite.x & opposite.y & opposite.z & opposite.w;
    return across_x | (across_x >> 1u) | faces.x | faces.y | faces.z | faces.w | symmetric;
}

fn decided_entry(case_byte: u32) -> Entry {
    return entry_at(CASES + 2u * case_byte);
}

// Of a cell that its corners do not decide. Lavapipe executes this also where nobody asks, so that callers ask in loops over all
// undecided cells that they have: few loops, each over many.
fn undecided_entry(slot: u32, origin: vec3<u32>, cell: vec3<u32>) -> Entry {
    var magnitudes: array<u32, 8>;
    var case_byte = 0u;
    for (var k = 0u; k < 8u; k++) {
        let bits = sample_bits(slot, origin, cell + vec3<u32>(k & 1u, (k >> 1u) & 1u, k >> 2u));
        magnitudes[k] = magnitude(bits);
        case_byte |= u32(is_inside(bits)) << k;
    }
    let word = table[CASES + 2u * case_byte + 1u];
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
    return entry_at(entry);
}

// Of emit's triangles: where the entries of the brick's undecided cells begin.
var<workgroup> kept_entries: array<u32, 512>;

fn keep_entry(number: u32, entry: Entry) {
    kept_entries[number] = entry.at;
}

// The entry of a cell; if it is undecided, that was kept for it.
fn cell_entry(case_byte: u32, number: u32, undecided: bool) -> Entry {
    return entry_at(select(CASES + 2u * case_byte, kept_entries[number], undecided));
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
