// Vertices where the field itself crosses iso, within `call.epsilon`: the secant's place and the middle of what is left by
// turns, each with a look `near` further on, which closes the bracket once the place is good. CPU twin: src/stage/emit/cpu/snap.rs.

const MOST_STEPS = 32u;
// 2⁻²²: less does not show beside a whole number.
const LEAST_NEAR = 0x1p-22f;

fn on_edge(owner: vec3<f32>, across: vec3<f32>, t: f32) -> f32 {
    return density(grid_position(owner, across * t));
}

fn fraction(owner: vec3<u32>, across: vec3<u32>, a: u32, b: u32) -> f32 {
    if is_beyond(bitcast<f32>(a), bitcast<f32>(b)) {
        // Where a border is closed there is nothing to look for.
        return crossing(bitcast<f32>(a), bitcast<f32>(b));
    }
    let q = vec3<f32>(owner);
    let way = vec3<f32>(across);
    let step = (params.step_x * way.x + params.step_y * way.y) + params.step_z * way.z;
    // No longer than the edge is long.
    let near = max(0.5 * call.epsilon / ((abs(step.x) + abs(step.y)) + abs(step.z)), LEAST_NEAR);
    let inside_low = is_inside(a);
    var low = 0.0;
    var high = 1.0;
    var at_low = bitcast<f32>(a);
    var at_high = bitcast<f32>(b);
    for (var i = 0u; i < MOST_STEPS && high - low > 2.0 * near; i++) {
        let part = select(crossing(at_low, at_high), 0.5, (i & 1u) == 1u);
        let t = low + (high - low) * part;
        let v = on_edge(q, way, t);
        var look = 0.0;
        if is_inside(bitcast<u32>(v)) == inside_low {
            low = t;
            at_low = v;
            look = min(t + near, high);
        } else {
            high = t;
            at_high = v;
            look = max(t - near, low);
        }
        let w = on_edge(q, way, look);
        if is_inside(bitcast<u32>(w)) == inside_low {
            low = look;
            at_low = w;
        } else {
            high = look;
            at_high = w;
        }
    }
    return low + (high - low) * crossing(at_low, at_high);
}
