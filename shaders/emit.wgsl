// emit: every crossed owned edge becomes one vertex, every cell's triangles their indices.
//
// Vertices lie in the order of their brick, plane, row, axis and place in the row; triangles in that
// of their brick and cell. A cell finds the vertices of the bricks beside it through the brick map
// and the prefix of the edge masks, so the mesh is welded across bricks. CPU twin: src/stage/emit/cpu.rs.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(8) var<storage, read> records: array<BrickRecord>;
// First vertex and triangle of each slot, within the slab.
@group(0) @binding(9) var<storage, read> offsets: array<vec2<u32>>;
@group(0) @binding(10) var<uniform> table: array<vec4<u32>, 128>;
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
    var t = (params.iso - a) / (b - a);
    if abs(b - a) < SMALL {
        // The ends straddle iso: where they lie this close together, all three are small.
        t = (scaled(params.iso) - scaled(a)) / (scaled(b) - scaled(a));
    }
    let sure = is_finite(bitcast<u32>(a)) && is_finite(bitcast<u32>(b)) && is_finite(bitcast<u32>(t));
    return select(0.5, clamp(t, 0.0, 1.0), sure);
}

@compute @workgroup_size(LANES)
fn emit_vertices(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    let live = slot < batch_end(work.own_active);
    load_edges(slot, lane, live);
    if !live {
        return;
    }
    let origin = brick_origin(active_list[slot]);
    let first = offsets[slot].x;
    let count = offsets[slot + 1u].x - first;
    for (var k = lane; k < count; k += LANES) {
        let place = params.first_vertices.x + first + k - params.vertex_window;
        if place >= params.vertex_capacity {
            break;
        }
        let edge = edge_of_vertex(slot, k);
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
        let out = 6u * place;
        vertices[out] = position.x;
        vertices[out + 1u] = position.y;
        vertices[out + 2u] = position.z;
        vertices[out + 3u] = normal.x;
        vertices[out + 4u] = normal.y;
        vertices[out + 5u] = normal.z;
    }
    report_runaway();
}

// Number of the vertex on edge `edge` of the cell whose lowest corner is point `cell` of the brick.
fn vertex_on(edge: u32, cell: vec3<u32>, brick: u32, own_slot: u32) -> u32 {
    let axis = edge >> 2u;
    let one = edge & 1u;
    let two = (edge >> 1u) & 1u;
    let owner = cell + vec3<u32>(
        select(one, 0u, axis == 0u),
        select(select(two, 0u, axis == 1u), one, axis == 0u),
        select(two, 0u, axis == 2u),
    );
    // 1 where the owner lies in the next brick along an axis.
    let next = owner >> vec3<u32>(3u);
    let p = owner & vec3<u32>(7u);
    let bit = 8u * axis + p.x;
    if all(next == vec3<u32>(0u)) {
        return own_vertex(p.y + 8u * p.z, bit, own_slot);
    }
    let slot = slot_of_brick(brick + next.x + params.slab_extent.x * (next.y + params.slab_extent.y * next.z));
    let row = records[slot].rows[p.y + 8u * p.z];
    let earlier = row & ((1u << bit) - 1u);
    let before = (records[slot].planes[p.z] & 0xffffu) + (row >> 24u) + countOneBits(earlier);
    return params.first_vertices[next.y + 2u * next.z] + offsets[slot].x + before;
}

@compute @workgroup_size(64)
fn emit_indices(
    @builtin(local_invocation_index) row: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    let live = slot < batch_end(work.own_active);
    let brick = active_list[select(params.first_slot, slot, live)];
    let origin = brick_origin(brick);
    load_own_vertices(slot, row, live);
    load_rows(slot, origin, row, live);
    if !live {
        return;
    }
    let y = row % 8u;
    let z = row / 8u;
    let in_plane = (records[slot].triangles[row / 2u] >> (16u * (row & 1u))) & 0xffffu;
    var triangle = params.first_triangle + offsets[slot].y + (records[slot].planes[z] >> 16u) + in_plane;
    triangle -= params.triangle_window;
    let shape = row_shape(origin, y, z);
    let bits = rows_at(slot, origin, y, z);
    for (var mixed = mixed_cells(bits, shape); mixed != 0u; mixed &= mixed - 1u) {
        let x = countTrailingZeros(mixed);
        var words = table_words(cell_case(bits, x));
        for (var left = words.x & 15u; left > 0u; left--) {
            // Drop what was used: the count first, then each triangle's three edges.
            words.x = (words.x >> 4u) | (words.y << 28u);
            words.y >>= 4u;
            let cell = vec3<u32>(x, y, z);
            let a = vertex_on(words.x & 15u, cell, brick, slot);
            let b = vertex_on((words.x >> 4u) & 15u, cell, brick, slot);
            let c = vertex_on((words.x >> 8u) & 15u, cell, brick, slot);
            words.x = (words.x >> 8u) | (words.y << 24u);
            words.y >>= 8u;
            if triangle < params.triangle_capacity {
                indices[3u * triangle] = a;
                indices[3u * triangle + 1u] = select(b, c, params.mirrored == 1u);
                indices[3u * triangle + 2u] = select(c, b, params.mirrored == 1u);
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
    let vertices_short = total.x > params.vertex_capacity;
    let triangles_short = total.y > params.triangle_capacity;
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
