// The triangles of a cell by the marching cubes table (src/table/mod.rs): two packed words a case. It lies in a storage buffer, since
// invocations look up different cases, which uniform memory serves one after another.
@group(0) @binding(10) var<storage, read> table: array<vec2<u32>, 256>;

const HAS_UNDECIDED = false;

// What the table has for a cell, to be asked by the functions below.
struct Entry {
    words: vec2<u32>,
}

// Which cells of a row their corners do not decide: none.
fn undecided_cells(bits: vec4<u32>) -> u32 {
    return 0u;
}

fn decided_entry(case_byte: u32) -> Entry {
    return Entry(table[case_byte]);
}

fn undecided_entry(slot: u32, origin: vec3<u32>, cell: vec3<u32>) -> Entry {
    return decided_entry(0u);
}

fn keep_entry(number: u32, entry: Entry) {}

fn cell_entry(case_byte: u32, number: u32, undecided: bool) -> Entry {
    return decided_entry(case_byte);
}

fn triangle_count(entry: Entry) -> u32 {
    return entry.words.x & 15u;
}

// Vertices within the cell: none.
fn centre_count(entry: Entry) -> u32 {
    return 0u;
}

// The corners of triangle `t`, four bits each: edges.
fn triangle_corners(entry: Entry, t: u32) -> u32 {
    let words = entry.words;
    // Behind the count, four bits an edge.
    let shift = 4u + 12u * t;
    var corners = words.x >> min(shift, 31u);
    if shift >= 32u {
        corners = words.y >> (shift - 32u);
    } else if shift > 20u {
        corners |= words.y << (32u - shift);
    }
    return corners;
}

fn note_centres(row: u32, count: u32) {}

fn centres_noted(row: u32) -> u32 {
    return 0u;
}
