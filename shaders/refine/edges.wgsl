// edges: the edges of a triangle list, each once, in an order that follows from the mesh alone.
//
// Half-edges (3 times the triangle's number, and k) are sorted into a list for each lower vertex, and the lists, which
// are short, by the upper one. An edge's number is the place of its first half-edge in all the lists: so numbers have
// gaps where the CPU's have none, and the same order. CPU twin: src/refine/edges.rs.

@group(0) @binding(14) var<storage, read> indices: array<u32>;
// Of each vertex: where its list begins, once counts are scanned, and how many half-edges are in it by now.
@group(0) @binding(24) var<storage, read_write> fans: array<atomic<u32>>;
@group(0) @binding(25) var<storage, read_write> half_edges: array<u32>;
// The edge of each half-edge.
@group(0) @binding(26) var<storage, read_write> edge_of: array<u32>;

// The longest list that is sorted.
override longest_fan: u32;

@compute @workgroup_size(64)
fn count_fans(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let h = item_of(id, groups);
    if h < 3u * params.triangles {
        atomicAdd(&fans[2u * ends_of(h).x], 1u);
    }
}

// Into the lists, in an order of chance until they are sorted.
@compute @workgroup_size(64)
fn fill_fans(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let h = item_of(id, groups);
    if h < 3u * params.triangles {
        let lower = ends_of(h).x;
        half_edges[atomicLoad(&fans[2u * lower]) + atomicAdd(&fans[2u * lower + 1u], 1u)] = h;
    }
}

// One invocation a vertex.
@compute @workgroup_size(64)
fn sort_fans(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = item_of(id, groups);
    if v >= params.vertices {
        return;
    }
    let first = atomicLoad(&fans[2u * v]);
    let end = atomicLoad(&fans[2u * v + 2u]);
    if end - first > longest_fan {
        atomicStore(&work.crowded, 1u);
        return;
    }
    for (var i = first + 1u; i < end; i++) {
        let h = half_edges[i];
        let upper = ends_of(h).y;
        var to = i;
        while to > first {
            let before = half_edges[to - 1u];
            // Those of one edge may stand in any order.
            if ends_of(before).y <= upper {
                break;
            }
            half_edges[to] = before;
            to--;
        }
        half_edges[to] = h;
    }
    var edge = first;
    var last = NONE;
    for (var i = first; i < end; i++) {
        let h = half_edges[i];
        let upper = ends_of(h).y;
        if upper != last {
            edge = i;
            last = upper;
        }
        edge_of[h] = edge;
    }
}
