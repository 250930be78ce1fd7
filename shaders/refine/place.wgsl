// place: vertices go onto the surface, with their normals. One invocation takes a vertex all the way.
// CPU twins: `place` in src/refine/place.rs, `holds` in src/refine/mod.rs, `search` in src/field/project.rs, `signed` in src/field/surface.rs.

@group(0) @binding(13) var<storage, read_write> vertices: array<f32>;
@group(0) @binding(29) var<storage, read> tasks: array<Task>;
@group(0) @binding(30) var<storage, read> fallbacks: array<f32>;
@group(0) @binding(31) var<storage, read_write> states: array<u32>;

// Below 0 inside; what is not finite is outside, and nothing is beyond the range of floats.
fn signed(sample: f32) -> f32 {
    if !is_finite(bitcast<u32>(sample)) {
        return MOST;
    }
    let value = params.sign * (sample - params.iso);
    let bits = bitcast<u32>(value);
    return select(select(MOST, -MOST, (bits >> 31u) == 1u), value, is_finite(bits));
}

@compute @workgroup_size(64)
fn place(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = item_of(id, groups);
    if i >= params.tasks {
        return;
    }
    var s = begin(tasks[i]);
    var gradient = vec3<f32>(0.0);
    // The field is called from one place: compilers take long for what it becomes.
    loop {
        let running = s.phase < CONVERGED;
        if !running || s.phase == NEWTON {
            let slope = density_gradient(select(s.at, s.low, running)) * params.slope;
            if !running {
                gradient = slope;
                break;
            }
            aim(&s, slope);
        }
        take(&s, signed(density(s.at)));
    }
    report_runaway();
    // lavapipe ends an invocation's loops in silence after 65,535 iterations of all of them: then this one, too.
    var turns = 0u;
    loop {
        turns += 1u;
        if turns >= params.twice {
            break;
        }
    }
    if turns < params.twice {
        atomicStore(&work.cut_short, 1u);
    }

    let fallback = vec3<f32>(fallbacks[6u * i], fallbacks[6u * i + 1u], fallbacks[6u * i + 2u]);
    let expected = vec3<f32>(fallbacks[6u * i + 3u], fallbacks[6u * i + 4u], fallbacks[6u * i + 5u]);
    let is_singular = !has_direction(gradient);
    let converged = s.phase == CONVERGED;
    var normal = expected;
    if !is_singular {
        normal = direction_of(gradient);
    }
    // Its normal points away from the expected one: it has reached another sheet of the surface; or it has left the box of the border.
    let is_inside = all(s.at >= params.low - params.near) && all(s.at <= params.high + params.near);
    let has_left = params.has_border == 1u && !is_inside;
    let is_astray = converged && (inner(normal, expected) < 0.0 || has_left);
    if is_singular {
        atomicAdd(&work.singular, 1u);
    }
    if !converged {
        atomicAdd(&work.not_converged, 1u);
    }
    if is_astray {
        atomicAdd(&work.astray, 1u);
    }
    let placed = converged && !is_astray;
    let at = select(fallback, s.at, placed);
    normal = select(expected, normal, placed);
    let v = params.first + i;
    vertices[6u * v] = at.x;
    vertices[6u * v + 1u] = at.y;
    vertices[6u * v + 2u] = at.z;
    vertices[6u * v + 3u] = normal.x;
    vertices[6u * v + 4u] = normal.y;
    vertices[6u * v + 5u] = normal.z;
    // All count as moved: `find_bad` looks at the triangles of those.
    states[v] = MOVED | select(0u, PLACED, placed);
}
