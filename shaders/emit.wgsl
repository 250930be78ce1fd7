// emit: every crossed owned edge becomes one vertex, every cell's triangles their indices.
//
// Vertices lie in the order of their brick, plane, row, axis and place in the row; triangles in that
// of their brick and cell. A cell finds the vertices of the bricks beside it through the brick map
// and the prefix of the edge masks, so the mesh is welded across bricks. CPU twin: src/stage/emit/cpu.rs.
// Who makes which vertex and triangle, and how they get into the buffers: shaders/emit/serial.wgsl, shared.wgsl.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(8) var<storage, read> records: array<BrickRecord>;
// First vertex and triangle of each slot, within the slab.
@group(0) @binding(9) var<storage, read> offsets: array<vec2<u32>>;
@group(0) @binding(10) var<storage, read> table: array<vec2<u32>, 256>;
@group(0) @binding(13) var<storage, read_write> vertices: array<f32>;
@group(0) @binding(14) var<storage, read_write> indices: array<u32>;
@group(0) @binding(15) var<storage, read_write> header: MeshHeader;

// 2⁻⁹⁰: differences below it are taken of scaled numbers. Some drivers flush results below 2⁻¹²⁶ to zero.
const SMALL = 0x1p-90f;

// A small number times 2¹⁰⁰; 0 for those that some drivers take for 0 (below 2⁻¹²⁶).
fn scaled(v: f32) -> f32 {
    return select(v * 0x1p100f, 0.0, (bitcast<u32>(v) & 0x7f800000u) == 0u);
}

// Where between the edge's ends the value is iso; in the middle where the ends do not tell.
fn crossing(a: f32, b: f32) -> f32 {
    var t = (call.iso - a) / (b - a);
    if abs(b - a) < SMALL {
        // The ends straddle iso: where they lie this close together, all three are small.
        t = (scaled(call.iso) - scaled(a)) / (scaled(b) - scaled(a));
    }
    let sure = is_finite(bitcast<u32>(a)) && is_finite(bitcast<u32>(b)) && is_finite(bitcast<u32>(t));
    return select(0.5, clamp(t, 0.0, 1.0), sure);
}

struct Vertex {
    position: vec3<f32>,
    normal: vec3<f32>,
}

// The vertex on an edge of the brick: its owner's x, y, z and its axis.
fn make_vertex(slot: u32, origin: vec3<u32>, edge: vec4<u32>) -> Vertex {
    let axis = vec3<u32>(vec3<u32>(0u, 1u, 2u) == vec3<u32>(edge.w));
    let a = sample_bits(slot, origin, edge.xyz);
    let b = sample_bits(slot, origin, edge.xyz + axis);
    let t = crossing(bitcast<f32>(a), bitcast<f32>(b));
    let q = vec3<f32>(origin + edge.xyz) + vec3<f32>(axis) * t;
    let position = grid_position(q);
    let vector = outward_vector(origin, edge.xyz, axis, t, position);
    let known = has_direction(vector);
    var normal = unit(select(vec3<f32>(1.0), vector, known));
    if !known {
        // The normals stage looks at the neighbours.
        normal = bitcast<vec3<f32>>(mark(edge.w, !is_inside(a)));
        atomicStore(&work.singular, 1u);
    }
    return Vertex(position, normal);
}

// Writes a vertex into its place of the window.
fn write_vertex(place: u32, vertex: Vertex) {
    let out = 6u * place;
    vertices[out] = vertex.position.x;
    vertices[out + 1u] = vertex.position.y;
    vertices[out + 2u] = vertex.position.z;
    vertices[out + 3u] = vertex.normal.x;
    vertices[out + 4u] = vertex.normal.y;
    vertices[out + 5u] = vertex.normal.z;
}

// Number of the vertex on edge `edge` of the cell whose lowest corner is point `cell` of the brick.
fn vertex_on(edge: u32, cell: vec3<u32>, brick: u32, slot: u32) -> u32 {
    let axis = edge >> 2u;
    let one = edge & 1u;
    let two = (edge >> 1u) & 1u;
    let owner = cell + vec3<u32>(
        select(one, 0u, axis == 0u),
        select(select(two, 0u, axis == 1u), one, axis == 0u),
        select(two, 0u, axis == 2u),
    );
    return owned_vertex(owner, axis, brick, slot);
}

// The three vertices of triangle `t` of a cell of whose case the table has these words.
fn triangle_of(t: u32, words: vec2<u32>, cell: vec3<u32>, brick: u32, slot: u32) -> vec3<u32> {
    // Behind the count, four bits an edge.
    let shift = 4u + 12u * t;
    var edges = words.x >> min(shift, 31u);
    if shift >= 32u {
        edges = words.y >> (shift - 32u);
    } else if shift > 20u {
        edges |= words.y << (32u - shift);
    }
    let a = vertex_on(edges & 15u, cell, brick, slot);
    let b = vertex_on((edges >> 4u) & 15u, cell, brick, slot);
    let c = vertex_on((edges >> 8u) & 15u, cell, brick, slot);
    return select(vec3<u32>(a, b, c), vec3<u32>(a, c, b), params.mirrored == 1u);
}

// The triangles of a row's cells, as far as the window has room.
fn write_triangles(slot: u32, brick: u32, origin: vec3<u32>, row: u32) {
    let y = row % 8u;
    let z = row / 8u;
    let in_plane = (records[slot].triangles[row / 2u] >> (16u * (row & 1u))) & 0xffffu;
    var triangle = params.first_triangle + offsets[slot].y + (records[slot].planes[z] >> 16u) + in_plane;
    triangle -= params.triangle_window;
    let bits = cell_rows(slot, origin, y, z);
    for (var mixed = mixed_cells(bits, row_shape(origin, y, z)); mixed != 0u; mixed &= mixed - 1u) {
        let x = countTrailingZeros(mixed);
        let words = table_words(cell_case(bits, x));
        let count = words.x & 15u;
        for (var t = 0u; t < count; t++) {
            if triangle < call.triangle_capacity {
                let corners = triangle_of(t, words, vec3<u32>(x, y, z), brick, slot);
                indices[3u * triangle] = corners.x;
                indices[3u * triangle + 1u] = corners.y;
                indices[3u * triangle + 2u] = corners.z;
            }
            triangle++;
        }
    }
}

// The totals of the slab's own bricks, and the mesh header (`MeshHeader` in src/gpu/mesh.rs): draw
// arguments that draw nothing when a buffer is too short, and the sizes needed.
@compute @workgroup_size(1)
fn totals() {
    let total = offsets[work.own_active];
    work.vertices = total.x;
    work.triangles = total.y;
    for (var run = 0u; run < 4u; run++) {
        work.run_vertices[run] = offsets[work.run_slots[run]].x;
    }
    let vertices_short = total.x > call.vertex_capacity;
    let triangles_short = total.y > call.triangle_capacity;
    let bricks_short = work.needed_slots > work.slots;
    header = MeshHeader(
        select(3u * total.y, 0u, vertices_short || triangles_short || bricks_short),
        1u,
        0u,
        0,
        0u,
        total.x,
        total.y,
        select(work.own_active, work.needed_slots, bricks_short),
        select(0u, 1u, bricks_short) | select(0u, 2u, vertices_short) | select(0u, 4u, triangles_short),
        atomicLoad(&work.non_finite),
        atomicLoad(&work.runaway),
        0u,
    );
}
