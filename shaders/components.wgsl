// components: keeps the components of a mesh that hold a given vertex.
//
// Labels of vertices sink to the lowest vertex of their component (Shiloach & Vishkin 1982: hooking and pointer
// jumping), whatever the order of the invocations; then what is kept moves together in its order.
// CPU twin: src/track/components.rs.

struct Labelled {
    // Not 0 if two corners of a triangle had different labels.
    changed: atomic<u32>,
    kept: atomic<u32>,
    dropped: atomic<u32>,
    // How many edges there are in `edges`.
    starts: u32,
    // Vertices and triangles that are kept.
    vertices: u32,
    triangles: u32,
}

@group(0) @binding(8) var<storage, read> records: array<BrickRecord>;
@group(0) @binding(9) var<storage, read> offsets: array<vec2<u32>>;
@group(0) @binding(13) var<storage, read> vertices: array<u32>;
@group(0) @binding(14) var<storage, read> indices: array<u32>;
@group(0) @binding(15) var<storage, read> header: MeshHeader;
@group(0) @binding(19) var<storage, read_write> labels: array<atomic<u32>>;
@group(0) @binding(20) var<storage, read_write> labelled: Labelled;
// Points of the grid, and the axis of the edge from there.
@group(0) @binding(21) var<storage, read> edges: array<vec4<u32>>;
@group(0) @binding(22) var<storage, read_write> kept_vertices: array<u32>;
@group(0) @binding(23) var<storage, read_write> kept_indices: array<u32>;
@group(0) @binding(32) var<storage, read_write> marks: array<vec2<u32>>;

// In the label of a component's lowest vertex: the component is kept. No mesh has so many vertices.
const KEPT = 0x80000000u;

fn item_of(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * 64u + id.x;
}

@compute @workgroup_size(64)
fn label(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = item_of(id, groups);
    if v < header.vertices {
        atomicStore(&labels[v], v);
    }
}

@compute @workgroup_size(64)
fn hook(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= header.triangles {
        return;
    }
    let corners = vec3<u32>(indices[3u * triangle], indices[3u * triangle + 1u], indices[3u * triangle + 2u]);
    let a = atomicLoad(&labels[corners.x]);
    let b = atomicLoad(&labels[corners.y]);
    let c = atomicLoad(&labels[corners.z]);
    if a == b && b == c {
        return;
    }
    let lowest = min(a, min(b, c));
    atomicMin(&labels[a], lowest);
    atomicMin(&labels[b], lowest);
    atomicMin(&labels[c], lowest);
    atomicMin(&labels[corners.x], lowest);
    atomicMin(&labels[corners.y], lowest);
    atomicMin(&labels[corners.z], lowest);
    atomicStore(&labelled.changed, 1u);
}

@compute @workgroup_size(64)
fn jump(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = item_of(id, groups);
    if v < header.vertices {
        atomicMin(&labels[v], atomicLoad(&labels[atomicLoad(&labels[v])]));
    }
}

// Each edge's vertex marks its component. Labels are final: each is that of the component's lowest vertex.
@compute @workgroup_size(64)
fn keep(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let place = item_of(id, groups);
    if place >= labelled.starts {
        return;
    }
    let edge = edges[place];
    let b = edge.xyz / 8u;
    let p = edge.xyz % 8u;
    let brick = b.x + params.slab_extent.x * (b.y + params.slab_extent.y * b.z);
    if !is_active(brick) {
        return;
    }
    let slot = slot_of_brick(brick);
    let row = records[slot].rows[p.y + 8u * p.z];
    let bit = 1u << (8u * edge.w + p.x);
    if (row & bit) == 0u {
        return;
    }
    let before = (records[slot].planes[p.z] & 0xffffu) + (row >> 24u) + countOneBits(row & (bit - 1u));
    let lowest = atomicLoad(&labels[offsets[slot].x + before]) & ~KEPT;
    atomicOr(&labels[lowest], KEPT);
}

fn is_kept(v: u32) -> bool {
    return (atomicLoad(&labels[atomicLoad(&labels[v]) & ~KEPT]) & KEPT) != 0u;
}

// 1 for each vertex, and each triangle, that is kept.
@compute @workgroup_size(64)
fn mark(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = item_of(id, groups);
    if i >= params.slab_bricks {
        return;
    }
    var kept = vec2<bool>(false);
    if i < header.vertices {
        kept.x = is_kept(i);
        if (atomicLoad(&labels[i]) & ~KEPT) == i {
            if kept.x {
                atomicAdd(&labelled.kept, 1u);
            } else {
                atomicAdd(&labelled.dropped, 1u);
            }
        }
    }
    if i < header.triangles {
        kept.y = is_kept(indices[3u * i]);
    }
    marks[i] = vec2<u32>(kept);
}

// `marks` now holds the exclusive prefix sums.
@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = item_of(id, groups);
    if i >= params.slab_bricks {
        return;
    }
    let to = marks[i];
    let next = marks[i + 1u];
    if next.x > to.x {
        for (var k = 0u; k < 6u; k++) {
            kept_vertices[6u * to.x + k] = vertices[6u * i + k];
        }
    }
    if next.y > to.y {
        for (var k = 0u; k < 3u; k++) {
            kept_indices[3u * to.y + k] = marks[indices[3u * i + k]].x;
        }
    }
}
