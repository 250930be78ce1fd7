// start: what there is to know of the start mesh. CPU twins: `proper` and `start` in src/refine/mod.rs.

@group(0) @binding(13) var<storage, read> vertices: array<f32>;
@group(0) @binding(14) var<storage, read> indices: array<u32>;
@group(0) @binding(23) var<storage, read_write> kept_indices: array<u32>;
// The longest edge at each vertex: of positive floats the bits are in the same order.
@group(0) @binding(27) var<storage, read_write> longest: array<atomic<u32>>;
// Two words a triangle; the second 1 where it is kept, and the number of those before, once it is scanned.
@group(0) @binding(28) var<storage, read_write> splits: array<vec2<u32>>;

fn corners_of(triangle: u32) -> vec3<u32> {
    return vec3<u32>(indices[3u * triangle], indices[3u * triangle + 1u], indices[3u * triangle + 2u]);
}

fn is_proper(c: vec3<u32>) -> bool {
    return c.x != c.y && c.y != c.z && c.z != c.x;
}

@compute @workgroup_size(64)
fn inspect_vertices(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = item_of(id, groups);
    if v >= params.vertices {
        return;
    }
    let at = bitcast<vec3<u32>>(position(v));
    if !(is_finite(at.x) && is_finite(at.y) && is_finite(at.z)) {
        atomicMin(&work.not_finite, v);
    }
    if !has_direction(normal(v)) {
        atomicMin(&work.without_normal, v);
    }
}

@compute @workgroup_size(64)
fn inspect_triangles(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= params.triangles {
        return;
    }
    let corners = corners_of(triangle);
    if any(corners >= vec3<u32>(params.vertices)) {
        atomicMin(&work.bad_triangle, triangle);
    }
    let keep = is_proper(corners);
    splits[triangle] = vec2<u32>(0u, u32(keep));
    if !keep {
        atomicAdd(&work.improper, 1u);
    }
}

// The triangles without those that name a vertex twice.
@compute @workgroup_size(64)
fn keep_proper(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= params.triangles {
        return;
    }
    let corners = corners_of(triangle);
    if is_proper(corners) {
        let to = 3u * splits[triangle].y;
        kept_indices[to] = corners.x;
        kept_indices[to + 1u] = corners.y;
        kept_indices[to + 2u] = corners.z;
    }
}

fn stretch(a: u32, b: u32) {
    let edge = bitcast<u32>(long(position(b) - position(a)));
    // NaN, where an edge is beyond the range of floats, does not count.
    if edge <= 0x7f800000u {
        atomicMax(&longest[a], edge);
        atomicMax(&longest[b], edge);
    }
}

@compute @workgroup_size(64)
fn find_longest(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= params.triangles {
        return;
    }
    let corners = corners_of(triangle);
    stretch(corners.x, corners.y);
    stretch(corners.y, corners.z);
    stretch(corners.z, corners.x);
}
