// emit: every crossed owned edge becomes one vertex, every cell's triangles their indices. What all methods share.
//
// Vertices lie in the order of their brick, plane, row, direction and place in the row; triangles in that
// of their brick and cell. A cell finds the vertices of the bricks beside it through the brick map
// and the prefix of the edge masks, so the mesh is welded across bricks. CPU twin: src/stage/emit/cpu/.
// Which triangles there are: shaders/emit/cubes.wgsl, tetrahedra.wgsl. Who makes which triangle of cubes: shaders/emit/
// rows.wgsl, cells.wgsl. How many invocations a workgroup has, LANES and ROW_LANES, says the form.

// The active bricks, and behind them the slots of those that make anything, which scan has listed (shaders/scan/bricks.wgsl).
@group(0) @binding(6) var<storage, read> active_list: array<u32>;
// First vertex and triangle of each slot, within the slab.
@group(0) @binding(9) var<storage, read> offsets: array<vec2<u32>>;
@group(0) @binding(13) var<storage, read_write> vertices: array<f32>;
@group(0) @binding(14) var<storage, read_write> indices: array<u32>;
@group(0) @binding(15) var<storage, read_write> header: MeshHeader;

const NO_SLOT = 0xffffffffu;

// The listed slots of a batch: where they begin among them, and the end.
fn listed_slots(batch: u32) -> vec2<u32> {
    let begin = 2u * work.slots + batch;
    return vec2<u32>(active_list[begin], active_list[begin + 1u]);
}

// The slot that a workgroup works on, if there is one for it.
fn listed_slot(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    let listed = listed_slots(call.first_slot / work.batch_slots);
    let place = listed.x + group.y * groups.x + group.x;
    return select(NO_SLOT, active_list[work.slots + min(place, work.slots)], place < listed.y);
}

// 2⁻⁹⁰: differences below it are taken of scaled numbers. Some drivers flush results below 2⁻¹²⁶ to zero.
const SMALL = 0x1p-90f;

// A small number times 2¹⁰⁰; 0 for those that some drivers take for 0 (below 2⁻¹²⁶).
fn scaled(v: f32) -> f32 {
    return select(v * 0x1p100f, 0.0, (bitcast<u32>(v) & 0x7f800000u) == 0u);
}

// 2¹⁰⁰, of either sign: the sample of a point beyond a closed border (src/extract/cap.rs).
const FAR = 0x1p100f;

fn is_beyond(a: f32, b: f32) -> bool {
    return abs(a) == FAR || abs(b) == FAR;
}

// Where between the edge's ends the value is iso; in the middle where the ends do not tell; at the other end if one lies beyond a
// closed border.
fn crossing(a: f32, b: f32) -> f32 {
    if is_beyond(a, b) {
        return select(0.0, 1.0, abs(a) == FAR);
    }
    var t = (call.iso - a) / (b - a);
    if abs(b - a) < SMALL {
        // The ends straddle iso: where they lie this close together, all three are small.
        t = (scaled(call.iso) - scaled(a)) / (scaled(b) - scaled(a));
    }
    if !is_finite(bitcast<u32>(b - a)) {
        // Both are large, and of either sign.
        t = (0.5 * call.iso - 0.5 * a) / (0.5 * b - 0.5 * a);
    }
    let sure = is_finite(bitcast<u32>(a)) && is_finite(bitcast<u32>(b)) && is_finite(bitcast<u32>(t));
    return select(0.5, clamp(t, 0.0, 1.0), sure);
}

struct Vertex {
    position: vec3<f32>,
    normal: vec3<f32>,
}

// The vertex on an edge of the brick: from its owner to the corner `across` from it, 0 or 1 along each axis.
fn make_vertex(slot: u32, origin: vec3<u32>, owner: vec3<u32>, across: vec3<u32>) -> Vertex {
    let a = sample_bits(slot, origin, owner);
    let b = sample_bits(slot, origin, owner + across);
    let t = fraction(origin + owner, across, a, b);
    let position = grid_position(vec3<f32>(origin + owner), vec3<f32>(across) * t);
    let vector = outward_vector(origin, owner, across, t, position);
    let known = has_direction(vector);
    var normal = unit(select(vec3<f32>(1.0), vector, known));
    if !known {
        // The normals stage looks at the neighbours.
        normal = bitcast<vec3<f32>>(mark(select(select(2u, 1u, across.y == 1u), 0u, across.x == 1u), !is_inside(a)));
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

// The totals of the slab's own bricks, the arguments of the dispatches over those of each batch that make anything, and the mesh header
// (`MeshHeader` in src/gpu/mesh.rs): draw arguments that draw nothing when a buffer is too short, and the sizes needed.
@compute @workgroup_size(1)
fn totals() {
    take_settings();
    let total = offsets[work.own_active];
    work.vertices = total.x;
    work.triangles = total.y;
    for (var run = 0u; run < 4u; run++) {
        work.run_vertices[run] = offsets[work.run_slots[run]].x;
    }
    for (var batch = 0u; batch < work.batches; batch++) {
        let listed = listed_slots(batch);
        write_dispatch(3u * batch + 2u, listed.y - listed.x);
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
