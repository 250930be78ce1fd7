// marks: which edges are split: those that are not flat, and the longest of each triangle that has a split edge.
// CPU twins: `refine_once` in src/refine/mod.rs, `is_flat`, `longest` and `close` in src/refine/split.rs.

@group(0) @binding(13) var<storage, read> vertices: array<f32>;
@group(0) @binding(14) var<storage, read> indices: array<u32>;
@group(0) @binding(25) var<storage, read> half_edges: array<u32>;
@group(0) @binding(26) var<storage, read> edge_of: array<u32>;
@group(0) @binding(27) var<storage, read_write> lengths: array<f32>;
// Two words an item: 1 for an edge of that number that is split; the parts of the triangle of that number.
@group(0) @binding(28) var<storage, read_write> splits: array<atomic<u32>>;
@group(0) @binding(31) var<storage, read> states: array<u32>;

fn is_flat(a: u32, b: u32, edge: f32) -> bool {
    let n = normal(a);
    let m = normal(b);
    let along = position(b) - position(a);
    let least = (edge * 0.5) * params.least;
    return inner(n, m) >= params.flatness || abs(inner(n, along)) <= least || abs(inner(m, along)) <= least;
}

// Lengths of all edges, and marks of those that are not flat.
@compute @workgroup_size(64)
fn measure(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let e = item_of(id, groups);
    if e >= 3u * params.triangles {
        return;
    }
    var bent = false;
    var edge = 0.0;
    let h = half_edges[e];
    if edge_of[h] == e {
        let ends = ends_of(h);
        edge = long(position(ends.y) - position(ends.x));
        // Where no surface was found splitting finds none either, but goes on.
        let is_near = (states[ends.x] & states[ends.y] & PLACED) != 0u;
        bent = is_near && edge > 2.0 * params.epsilon && !is_flat(ends.x, ends.y, edge);
    }
    lengths[e] = edge;
    atomicStore(&splits[2u * e], u32(bent));
    atomicStore(&splits[2u * e + 1u], 0u);
    if bent {
        atomicAdd(&work.bent, 1u);
    }
}

fn edges_of(triangle: u32) -> vec3<u32> {
    return vec3<u32>(edge_of[3u * triangle], edge_of[3u * triangle + 1u], edge_of[3u * triangle + 2u]);
}

fn is_split(edge: u32) -> bool {
    return atomicLoad(&splits[2u * edge]) != 0u;
}

fn longer(a: u32, b: u32) -> u32 {
    let by = vec2<f32>(lengths[a], lengths[b]);
    return select(a, b, by.y > by.x || (by.y == by.x && b < a));
}

// A round. Marks are only ever set: so what is marked in the end is the same in any order.
@compute @workgroup_size(64)
fn close(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= params.triangles {
        return;
    }
    let edges = edges_of(triangle);
    if is_split(edges.x) || is_split(edges.y) || is_split(edges.z) {
        let longest = longer(longer(edges.x, edges.y), edges.z);
        if atomicExchange(&splits[2u * longest], 1u) == 0u {
            atomicStore(&work.changed, 1u);
        }
    }
}

@compute @workgroup_size(64)
fn count_parts(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= params.triangles {
        return;
    }
    let edges = edges_of(triangle);
    let parts = 1u + u32(is_split(edges.x)) + u32(is_split(edges.y)) + u32(is_split(edges.z));
    atomicStore(&splits[2u * triangle + 1u], parts);
}
