// cut: triangles whose edges are split become their parts; vertices that turn one over are taken back before.
// CPU twins: `cut` and what it calls in src/refine/split.rs, `take_back` in src/refine/mod.rs.

@group(0) @binding(13) var<storage, read_write> vertices: array<f32>;
@group(0) @binding(14) var<storage, read> indices: array<u32>;
@group(0) @binding(23) var<storage, read_write> kept_indices: array<u32>;
@group(0) @binding(26) var<storage, read> edge_of: array<u32>;
// Split edges before that edge, parts of the triangles before that triangle.
@group(0) @binding(28) var<storage, read> splits: array<vec2<u32>>;
@group(0) @binding(30) var<storage, read> fallbacks: array<f32>;
@group(0) @binding(31) var<storage, read_write> states: array<atomic<u32>>;

fn corners_of(triangle: u32) -> vec3<u32> {
    return vec3<u32>(indices[3u * triangle], indices[3u * triangle + 1u], indices[3u * triangle + 2u]);
}

fn middle(h: u32) -> u32 {
    let edge = edge_of[h];
    return select(NONE, params.vertices + splits[edge].x, splits[edge + 1u].x > splits[edge].x);
}

fn middles_of(triangle: u32) -> vec3<u32> {
    return vec3<u32>(middle(3u * triangle), middle(3u * triangle + 1u), middle(3u * triangle + 2u));
}

fn fallback_of(task: u32) -> vec3<f32> {
    return vec3<f32>(fallbacks[6u * task], fallbacks[6u * task + 1u], fallbacks[6u * task + 2u]);
}

// The normal of a triangle, twice its area long.
fn area_of(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    let u = b - a;
    let v = c - a;
    return u.yzx * v.zxy - u.zxy * v.yzx;
}

fn area(t: vec3<u32>) -> vec3<f32> {
    return area_of(position(t.x), position(t.y), position(t.z));
}

fn faces_outwards(t: vec3<u32>, whole: vec3<f32>) -> bool {
    let own = area(t);
    let normals = (normal(t.x) + normal(t.y)) + normal(t.z);
    return inner(own, normals) > 0.0 || inner(own, whole) > 0.0;
}

fn side(a: u32, b: u32) -> f32 {
    return long(position(b) - position(a));
}

// The corner that the longest side lies opposite to; of equal sides, the one opposite to the first.
fn opposite_longest(t: vec3<u32>) -> u32 {
    let sides = vec3<f32>(side(t.y, t.z), side(t.z, t.x), side(t.x, t.y));
    let first = u32(sides.y > sides.x);
    return select(first, 2u, sides.z > select(sides.x, sides.y, first == 1u));
}

// Whether the quadrilateral is cut along the diagonal from its first corner.
fn is_cut_from_first(q: vec4<u32>, whole: vec3<f32>) -> bool {
    let by_first = faces_outwards(q.xyz, whole) && faces_outwards(q.xzw, whole);
    let by_second = faces_outwards(q.xyw, whole) && faces_outwards(q.yzw, whole);
    if side(q.x, q.z) <= side(q.y, q.w) {
        return by_first || !by_second;
    }
    return !(by_second || !by_first);
}

struct Parts {
    triangles: array<vec3<u32>, 4>,
    count: u32,
}

fn turned(v: vec3<u32>, turn: u32) -> vec3<u32> {
    return select(select(v, v.yzx, turn == 1u), v.zxy, turn == 2u);
}

fn parts_of(corners: vec3<u32>, middles: vec3<u32>, whole: vec3<f32>) -> Parts {
    let split = middles != vec3<u32>(NONE);
    let count = 1u + u32(split.x) + u32(split.y) + u32(split.z);
    // Turned so that an only midpoint, or an only edge without one, is the first.
    var turn = 0u;
    if count == 2u {
        turn = select(select(2u, 1u, split.y), 0u, split.x);
    } else if count == 3u {
        turn = select(select(2u, 1u, !split.y), 0u, !split.x);
    } else if count == 4u {
        turn = opposite_longest(corners);
    }
    let c = turned(corners, turn);
    let m = turned(middles, turn);
    var parts: Parts;
    parts.count = count;
    parts.triangles[0] = c;
    if count == 2u {
        parts.triangles[0] = vec3<u32>(c.x, m.x, c.z);
        parts.triangles[1] = vec3<u32>(m.x, c.y, c.z);
    } else if count >= 3u {
        // The quadrilateral that is left, from the first corner.
        let q = vec4<u32>(c.x, select(m.x, c.y, count == 3u), m.y, m.z);
        if is_cut_from_first(q, whole) {
            parts.triangles[0] = q.xyz;
            parts.triangles[1] = q.xzw;
        } else {
            parts.triangles[0] = q.xyw;
            parts.triangles[1] = q.yzw;
        }
        let last = vec3<u32>(m.y, c.z, m.z);
        if count == 3u {
            parts.triangles[2] = last;
        } else {
            parts.triangles[2] = vec3<u32>(m.x, c.y, m.y);
            parts.triangles[3] = last;
        }
    }
    return parts;
}

fn has_moved(vertex: u32) -> bool {
    return vertex != NONE && (atomicLoad(&states[vertex]) & MOVED) != 0u;
}

// Of each triangle that would be turned over, the midpoint that went farthest: what the others have gained may stay.
@compute @workgroup_size(64)
fn find_bad(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= params.triangles {
        return;
    }
    let middles = middles_of(triangle);
    if !(has_moved(middles.x) || has_moved(middles.y) || has_moved(middles.z)) {
        return;
    }
    let corners = corners_of(triangle);
    let whole = area(corners);
    if all(whole == vec3<f32>(0.0)) {
        return;
    }
    var parts = parts_of(corners, middles, whole);
    var good = true;
    for (var k = 0u; k < parts.count; k++) {
        good = good && faces_outwards(parts.triangles[k], whole);
    }
    if good {
        return;
    }
    var all_middles = middles;
    var most = 0.0;
    var farthest = NONE;
    for (var k = 0u; k < 3u; k++) {
        let m = all_middles[k];
        if m != NONE {
            let far = long(position(m) - fallback_of(m - params.vertices));
            if far > most {
                most = far;
                farthest = m;
            }
        }
    }
    if farthest != NONE {
        atomicOr(&states[farthest], BAD);
    }
}

// The same for the triangles of the start mesh, with all their corners.
@compute @workgroup_size(64)
fn find_bad_start(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= params.triangles {
        return;
    }
    let t = corners_of(triangle);
    if !(has_moved(t.x) || has_moved(t.y) || has_moved(t.z)) {
        return;
    }
    let before = area_of(fallback_of(t.x), fallback_of(t.y), fallback_of(t.z));
    if any(before != vec3<f32>(0.0)) && !faces_outwards(t, before) {
        atomicOr(&states[t.x], BAD);
        atomicOr(&states[t.y], BAD);
        atomicOr(&states[t.z], BAD);
    }
}

// Takes what was found back to its fallback.
@compute @workgroup_size(64)
fn take_back(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = item_of(id, groups);
    if i >= params.tasks {
        return;
    }
    let v = params.first + i;
    let state = atomicLoad(&states[v]);
    if (state & (BAD | PLACED)) != (BAD | PLACED) {
        atomicStore(&states[v], state & PLACED);
        return;
    }
    for (var k = 0u; k < 6u; k++) {
        vertices[6u * v + k] = fallbacks[6u * i + k];
    }
    atomicStore(&states[v], MOVED);
    atomicStore(&work.changed, 1u);
    atomicAdd(&work.taken_back, 1u);
}

@compute @workgroup_size(64)
fn cut(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let triangle = item_of(id, groups);
    if triangle >= params.triangles {
        return;
    }
    let corners = corners_of(triangle);
    var parts = parts_of(corners, middles_of(triangle), area(corners));
    let first = 3u * splits[triangle].y;
    for (var k = 0u; k < parts.count; k++) {
        kept_indices[first + 3u * k] = parts.triangles[k].x;
        kept_indices[first + 3u * k + 1u] = parts.triangles[k].y;
        kept_indices[first + 3u * k + 2u] = parts.triangles[k].z;
    }
}
