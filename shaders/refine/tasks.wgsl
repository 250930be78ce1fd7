// tasks: which vertices are placed, from where, and what they are if no place is found.
// CPU twins: `Task` and `towards_crease` in src/refine/place.rs, `free` in src/refine/mod.rs.

@group(0) @binding(13) var<storage, read> vertices: array<f32>;
@group(0) @binding(14) var<storage, read> indices: array<u32>;
@group(0) @binding(25) var<storage, read> half_edges: array<u32>;
// The longest edge at each vertex of the start mesh.
@group(0) @binding(27) var<storage, read> lengths: array<f32>;
// Two words an item; the first the number of split edges before that edge.
@group(0) @binding(28) var<storage, read> splits: array<vec2<u32>>;
@group(0) @binding(29) var<storage, read_write> tasks: array<Task>;
@group(0) @binding(30) var<storage, read_write> fallbacks: array<f32>;

// How far a vertex may move, in parts of its edge or its longest edge.
const REACH = 0.5f;
// The cosine of the angle between the normals at an edge's ends from which on a crease is expected.
const CREASE = 0.7f;

// Bits of the axes across which both points lie on the same face of the border.
fn fixed_axes(p: vec3<f32>, q: vec3<f32>) -> u32 {
    if params.has_border == 0u {
        return 0u;
    }
    let on_low = (abs(p - params.low) <= params.near) & (abs(q - params.low) <= params.near);
    let on_high = (abs(p - params.high) <= params.near) & (abs(q - params.high) <= params.near);
    return dot(vec3<u32>(on_low | on_high), vec3<u32>(1u, 2u, 4u));
}

fn write(i: u32, task: Task, at: vec3<f32>, normal: vec3<f32>) {
    tasks[i] = task;
    fallbacks[6u * i] = at.x;
    fallbacks[6u * i + 1u] = at.y;
    fallbacks[6u * i + 2u] = at.z;
    fallbacks[6u * i + 3u] = normal.x;
    fallbacks[6u * i + 4u] = normal.y;
    fallbacks[6u * i + 5u] = normal.z;
}

// The vertices of the start mesh.
@compute @workgroup_size(64)
fn start_tasks(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = item_of(id, groups);
    if v >= params.tasks {
        return;
    }
    let p = position(v);
    write(v, Task(p, lengths[v] * REACH, vec3<f32>(0.0), fixed_axes(p, p)), p, direction_of(normal(v)));
}

// Towards the line where the tangent planes at the ends of an edge meet.
fn towards_crease(n: vec3<f32>, m: vec3<f32>, way: vec3<f32>, edge: f32) -> vec3<f32> {
    let cos = inner(n, m);
    if !(cos < CREASE && cos > -0.99f && edge > 0.0) {
        return vec3<f32>(0.0);
    }
    let half = way * 0.5;
    let to_a = -inner(n, half);
    let to_b = inner(m, half);
    let rest = 1.0 - cos * cos;
    let by_n = (to_a - cos * to_b) / rest;
    let by_m = (to_b - cos * to_a) / rest;
    let x = n * by_n + m * by_m;
    let direction = half / (edge * 0.5);
    let far_along = inner(x, direction);
    let off = x - direction * far_along;
    let most_along = edge * 0.3;
    let most_across = edge * REACH;
    var along = far_along;
    if along > most_along {
        along = most_along;
    } else if along < -most_along {
        along = -most_along;
    }
    let far = long(off);
    var across = off;
    if far > most_across {
        across = off * (most_across / far);
    }
    return direction * along + across;
}

// The midpoints of the edges that are split. The surface may bulge over an edge like an arc that meets the normals at
// its ends.
@compute @workgroup_size(64)
fn middle_tasks(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let e = item_of(id, groups);
    if e >= 3u * params.triangles || splits[e + 1u].x == splits[e].x {
        return;
    }
    let ends = ends_of(half_edges[e]);
    let p = position(ends.x);
    let q = position(ends.y);
    let n = normal(ends.x);
    let m = normal(ends.y);
    let middle = p * 0.5 + q * 0.5;
    let way = q - p;
    let edge = long(way);
    let sum = n + m;
    var direction = n;
    if has_direction(sum) {
        direction = direction_of(sum);
    }
    // cos and tan of a half and a quarter of the angle between the normals.
    var cos = long(sum) * 0.5;
    if !(cos < 1.0) {
        cos = 1.0;
    }
    let tan = sqrt((1.0 - cos) / (1.0 + cos));
    let guess = (edge * 0.625) * tan;
    let fixed = fixed_axes(p, q);
    let free = free_axes(fixed);
    let hint = (direction * select(params.epsilon, guess, guess > params.epsilon)) * free;
    let start = middle + towards_crease(n, m, way, edge) * free;
    write(splits[e].x, Task(start, edge * REACH, hint, fixed), middle, direction);
}
