// normals: vertices whose gradient had no direction, which emit marked, get the average of their neighbours'
// normals: of the other corners of their triangles, those that are not marked themselves.
//
// Sums are of whole numbers, which come out the same in any order. They are kept in the marks themselves:
// each word of a mark is MARK + 8 sum, and the lowest three bits of the first are the code of the edge.
// CPU twin: src/stage/normals/cpu.rs.

@group(0) @binding(13) var<storage, read_write> vertices: array<atomic<u32>>;
@group(0) @binding(14) var<storage, read> indices: array<u32>;
@group(0) @binding(15) var<storage, read> header: MeshHeader;
// A second window of the vertices, where the neighbours lie. Never written: but a buffer that is bound twice
// must be bound the same way.
@group(0) @binding(18) var<storage, read_write> neighbours: array<u32>;

// Normals are summed in these parts of 1. A vertex lies in at most 24 triangles (by mc33 six in each of four cells; by mc 14, by mt 12): a
// sum of 48 is below 2²⁴, a whole number as a float.
const PARTS = 262144.0;
// What rounding can make of 48 normals that cancel lies below.
const LEAST_SUM = 32.0;
const LANES = 64u;
// Items of an invocation. It first looks through all for marks, which few have: lavapipe executes what nobody takes, so that this
// waits for a loop over those alone.
const ITEMS = 32u;

// The first item of an invocation; the next ones follow each LANES further on.
fn first_item(lane: u32, group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return (group.y * groups.x + group.x) * LANES * ITEMS + lane;
}

fn arrange_for(place: u32, items: u32, wanted: bool) {
    write_dispatch(place, select(0u, items / (LANES * ITEMS) + 1u, wanted));
}

// Where the mesh is recorded without waiting: how many workgroups there are to run, none if nothing is marked.
@compute @workgroup_size(1)
fn arrange() {
    let marked = atomicLoad(&work.singular) != 0u;
    // Of a mesh that does not fit triangles are missing, but no mark is left in it either.
    arrange_for(3u * work.batches, header.triangles, marked && header.overflow == 0u);
    arrange_for(3u * work.batches + 1u, min(header.vertices, call.vertex_capacity), marked);
}

// The normal of a vertex in parts, times 8; nothing of one that is marked, or not in the window.
fn parts(number: u32) -> vec3<u32> {
    var words: vec3<u32>;
    if params.neighbour_capacity == 0u {
        // The same window.
        let place = number - params.vertex_window;
        if place >= call.vertex_capacity {
            return vec3<u32>(0u);
        }
        let at = 6u * place + 3u;
        words = vec3<u32>(atomicLoad(&vertices[at]), atomicLoad(&vertices[at + 1u]), atomicLoad(&vertices[at + 2u]));
    } else {
        let place = number - params.neighbour_window;
        if place >= params.neighbour_capacity {
            return vec3<u32>(0u);
        }
        let at = 6u * place + 3u;
        words = vec3<u32>(neighbours[at], neighbours[at + 1u], neighbours[at + 2u]);
    }
    if is_marked(words.x) {
        return vec3<u32>(0u);
    }
    return bitcast<vec3<u32>>(vec3<i32>(floor(bitcast<vec3<f32>>(words) * PARTS + 0.5))) * 8u;
}

// The corners of a triangle of the window.
fn corners_of(place: u32) -> vec3<u32> {
    return vec3<u32>(indices[3u * place], indices[3u * place + 1u], indices[3u * place + 2u]);
}

// Whether a vertex lies in the window and is marked.
fn has_mark(number: u32) -> bool {
    // Below the window this is a large number.
    let place = number - params.vertex_window;
    return place < call.vertex_capacity && is_marked(atomicLoad(&vertices[6u * place + 3u]));
}

@compute @workgroup_size(LANES)
fn add_neighbours(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let first = params.first_triangle - params.triangle_window + first_item(lane, group, groups);
    let end = min(call.triangle_capacity, header.triangles - params.triangle_window);
    var beside_marks = 0u;
    for (var i = 0u; i < ITEMS && first + LANES * i < end; i++) {
        let corners = corners_of(first + LANES * i);
        beside_marks |= u32(has_mark(corners.x) || has_mark(corners.y) || has_mark(corners.z)) << i;
    }
    for (; beside_marks != 0u; beside_marks &= beside_marks - 1u) {
        var corners = corners_of(first + LANES * countTrailingZeros(beside_marks));
        for (var i = 0u; i < 3u; i++) {
            if has_mark(corners.x) {
                let at = 6u * (corners.x - params.vertex_window) + 3u;
                let sum = parts(corners.y) + parts(corners.z);
                atomicAdd(&vertices[at], sum.x);
                atomicAdd(&vertices[at + 1u], sum.y);
                atomicAdd(&vertices[at + 2u], sum.z);
            }
            corners = corners.yzx;
        }
    }
}

@compute @workgroup_size(LANES)
fn average(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let first = first_item(lane, group, groups);
    let end = min(call.vertex_capacity, header.vertices - params.vertex_window);
    var marked = 0u;
    for (var i = 0u; i < ITEMS && first + LANES * i < end; i++) {
        marked |= u32(is_marked(atomicLoad(&vertices[6u * (first + LANES * i) + 3u]))) << i;
    }
    for (; marked != 0u; marked &= marked - 1u) {
        write_average(6u * (first + LANES * countTrailingZeros(marked)) + 3u);
    }
}

// Turns the mark that begins at a word, with what was added to it, into a normal.
fn write_average(at: u32) {
    let words = vec3<u32>(atomicLoad(&vertices[at]), atomicLoad(&vertices[at + 1u]), atomicLoad(&vertices[at + 2u]));
    let sum = vec3<f32>(bitcast<vec3<i32>>(words - MARK) >> vec3<u32>(3u));
    // Where the neighbours say nothing, the normal runs along the edge, out of the solid.
    let axis = vec3<f32>(vec3<u32>(0u, 1u, 2u) == vec3<u32>(words.x & 3u));
    let along = (params.step_x * axis.x + params.step_y * axis.y) + params.step_z * axis.z;
    let outwards = select(along, -along, (words.x & 4u) != 0u);
    let normal = unit(select(outwards, sum, largest(sum) >= LEAST_SUM));
    atomicStore(&vertices[at], bitcast<u32>(normal.x));
    atomicStore(&vertices[at + 1u], bitcast<u32>(normal.y));
    atomicStore(&vertices[at + 2u], bitcast<u32>(normal.z));
}
