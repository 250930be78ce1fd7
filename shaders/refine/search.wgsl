// The way of one point to the surface; CPU twin, with the why: `Search` in src/field/project.rs.

const START = 0u;
const HINT = 1u;
const NEWTON = 2u;
const LINE = 3u;
const BRACKET = 4u;
const CONVERGED = 5u;
const FAILED = 6u;

const HINTS = 2u;
const STEPS = 6u;
// Steps to both sides along the line, each length twice.
const PLACES = 8u;
const NARROWINGS = 64u;
const NUDGE = 0.45f;
const LEAST_PART = 0x1p-100f;
const RESOLUTION = 0x1p-21f;
const MOST = 0x1.fffffep+127f;

struct Search {
    start: vec3<f32>,
    start_value: f32,
    hint: vec3<f32>,
    radius: f32,
    free: vec3<f32>,
    step: f32,
    line: vec3<f32>,
    epsilon: f32,
    low: vec3<f32>,
    low_value: f32,
    high: vec3<f32>,
    high_value: f32,
    at: vec3<f32>,
    phase: u32,
    round: u32,
}

fn begin(task: Task) -> Search {
    var s: Search;
    s.start = task.start;
    s.hint = task.hint;
    s.radius = task.radius;
    s.free = free_axes(task.fixed);
    let step = task.radius * 0.5;
    s.step = select(step, params.longest, params.longest < step);
    let least = largest(task.start) * RESOLUTION;
    s.epsilon = select(least, params.epsilon, params.epsilon > least);
    s.low = task.start;
    s.high = task.start;
    s.at = task.start;
    let bits = bitcast<vec3<u32>>(task.start);
    s.phase = select(FAILED, START, is_finite(bits.x) && is_finite(bits.y) && is_finite(bits.z));
    return s;
}

// A length, with the sign of the way along the gradient to the surface from a point with this value.
fn outwards(value: f32, far: f32) -> f32 {
    return select(-far, far, value < 0.0);
}

// The point, or the place in its direction where the ball ends.
fn within(s: ptr<function, Search>, p: vec3<f32>) -> vec3<f32> {
    let offset = p - (*s).start;
    let far = long(offset);
    if far > (*s).radius {
        return (*s).start + offset * ((*s).radius / far);
    }
    return p;
}

fn enter(s: ptr<function, Search>, phase: u32) {
    (*s).phase = phase;
    (*s).round = 0u;
}

fn give_up(s: ptr<function, Search>) {
    (*s).at = (*s).start;
    (*s).phase = FAILED;
}

// A Newton step along the `slope` at `low`.
fn aim(s: ptr<function, Search>, slope: vec3<f32>) {
    let gradient = slope * (*s).free;
    if !has_direction(gradient) {
        search_line(s);
        return;
    }
    let direction = direction_of(gradient);
    if all((*s).line == vec3<f32>(0.0)) {
        (*s).line = direction;
    }
    let newton = (abs((*s).low_value) / long(gradient)) * 1.0625 + (*s).epsilon * 0.5;
    let step = select((*s).step, newton, newton < (*s).step);
    (*s).at = within(s, (*s).low + direction * outwards((*s).low_value, step));
}

fn search_line(s: ptr<function, Search>) {
    if all((*s).line == vec3<f32>(0.0)) {
        (*s).line = (*s).free * 0.57735026f;
    }
    (*s).low = (*s).start;
    (*s).low_value = (*s).start_value;
    enter(s, LINE);
    aim_line(s);
}

fn aim_line(s: ptr<function, Search>) {
    // 0.125, -0.125, 0.25 ... of the radius.
    let part = 0.125 * f32(1u << ((*s).round >> 1u));
    let along = select(part, -part, ((*s).round & 1u) == 1u) * (*s).radius;
    (*s).at = (*s).start + (*s).line * outwards((*s).start_value, along);
}

fn aim_hint(s: ptr<function, Search>) {
    let far = outwards((*s).start_value, select(3.0, 1.0, (*s).round == 0u));
    (*s).at = within(s, (*s).start + (*s).hint * far);
}

// Takes the signed value at `at`, and asks for the next.
fn take(s: ptr<function, Search>, value: f32) {
    if value == 0.0 {
        (*s).phase = CONVERGED;
        return;
    }
    if (*s).phase == START {
        (*s).low_value = value;
        (*s).start_value = value;
        if !((*s).radius > 0.0 && (*s).radius <= MOST) {
            give_up(s);
        } else if all((*s).hint == vec3<f32>(0.0)) {
            enter(s, NEWTON);
        } else {
            enter(s, HINT);
            aim_hint(s);
        }
        return;
    }
    let is_across = (value < 0.0) != ((*s).low_value < 0.0);
    (*s).round += 1u;
    if (*s).phase == BRACKET || is_across {
        if is_across {
            (*s).high = (*s).at;
            (*s).high_value = value;
        } else {
            (*s).low = (*s).at;
            (*s).low_value = value;
        }
        if (*s).phase != BRACKET {
            enter(s, BRACKET);
        }
        narrow(s);
    } else if (*s).phase == HINT {
        if (*s).round < HINTS {
            aim_hint(s);
        } else {
            enter(s, NEWTON);
        }
    } else if (*s).phase == NEWTON {
        if (*s).round < STEPS {
            (*s).low = (*s).at;
            (*s).low_value = value;
        } else {
            search_line(s);
        }
    } else if (*s).round < PLACES {
        aim_line(s);
    } else {
        give_up(s);
    }
}

// Ends the search in a bracket that is short enough, or asks for a value in it.
fn narrow(s: ptr<function, Search>) {
    let along = (*s).high - (*s).low;
    let far = long(along);
    let secant = (*s).low_value / ((*s).low_value - (*s).high_value);
    var t = select(0.5, secant, secant >= LEAST_PART && secant < 1.0);
    if far <= (*s).epsilon {
        (*s).at = (*s).low + along * t;
        (*s).phase = CONVERGED;
        return;
    }
    if (*s).round == NARROWINGS {
        give_up(s);
        return;
    }
    let nudge = ((*s).epsilon * NUDGE) / far;
    t += select(-nudge, nudge, t < 0.5);
    if (*s).round >= 4u && ((*s).round & 1u) == 0u {
        t = 0.5;
    }
    (*s).at = (*s).low + along * t;
}
