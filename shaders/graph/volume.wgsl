// A sampled volume; src/graph/volume/mod.rs is the twin. LEAF stands for the leaf's name; LEAF_FIRST, LEAF_NEAREST,
// LEAF_CONSTANT, LEAF_KIND and LEAF_GRADIENT_NEAREST are its constants. Marks of their own line part what all need,
// values, gradients and bounds.
//
// Data: points, origin, rows of the world-to-grid matrix, the border's value, where ranges and samples begin.

fn LEAF_word(at: u32) -> u32 {
    return field_data[LEAF_FIRST + at];
}

fn LEAF_number(at: u32) -> f32 {
    return bitcast<f32>(field_data[LEAF_FIRST + at]);
}

fn LEAF_points() -> vec3<u32> {
    return vec3<u32>(LEAF_word(0u), LEAF_word(1u), LEAF_word(2u));
}

fn LEAF_origin() -> vec3<f32> {
    return vec3<f32>(LEAF_number(3u), LEAF_number(4u), LEAF_number(5u));
}

fn LEAF_row(k: u32) -> vec3<f32> {
    return vec3<f32>(LEAF_number(6u + 3u * k), LEAF_number(7u + 3u * k), LEAF_number(8u + 3u * k));
}

fn LEAF_dot(row: vec3<f32>, d: vec3<f32>) -> f32 {
    return (row.x * d.x + row.y * d.y) + row.z * d.z;
}

// Grid coordinates.
fn LEAF_place(p: vec3<f32>) -> vec3<f32> {
    let d = p - LEAF_origin();
    return vec3<f32>(LEAF_dot(LEAF_row(0u), d), LEAF_dot(LEAF_row(1u), d), LEAF_dot(LEAF_row(2u), d));
}

fn LEAF_inside(q: vec3<f32>) -> vec3<bool> {
    return (q >= vec3<f32>(0.0)) & (q <= vec3<f32>(LEAF_points() - vec3<u32>(1u)));
}

fn LEAF_clamped(q: vec3<f32>) -> vec3<f32> {
    let last = vec3<f32>(LEAF_points() - vec3<u32>(1u));
    let above = select(vec3<f32>(0.0), q, q > vec3<f32>(0.0));
    return select(last, above, above < last);
}

fn LEAF_cell(q: vec3<f32>) -> vec3<u32> {
    return min(vec3<u32>(q), LEAF_points() - vec3<u32>(2u));
}

fn LEAF_nearest(q: vec3<f32>) -> vec3<u32> {
    return min(vec3<u32>(floor(q + vec3<f32>(0.5))), LEAF_points() - vec3<u32>(1u));
}

fn LEAF_sample(at: vec3<u32>) -> f32 {
    return LEAF_number(LEAF_word(17u) + at.x + LEAF_word(0u) * (at.y + LEAF_word(1u) * at.z));
}

fn LEAF_mix(a: f32, b: f32, t: f32) -> f32 {
    return a + (b - a) * t;
}

fn LEAF_along_x(i: vec3<u32>, t: f32) -> f32 {
    return LEAF_mix(LEAF_sample(i), LEAF_sample(i + vec3<u32>(1u, 0u, 0u)), t);
}

fn LEAF_along_y(i: vec3<u32>, f: vec3<f32>) -> f32 {
    return LEAF_mix(LEAF_along_x(i, f.x), LEAF_along_x(i + vec3<u32>(0u, 1u, 0u), f.x), f.y);
}

fn LEAF_value(p: vec3<f32>) -> f32 {
    let place = LEAF_place(p);
    if LEAF_CONSTANT && !all(LEAF_inside(place)) {
        return LEAF_number(15u);
    }
    let q = LEAF_clamped(place);
    if LEAF_NEAREST {
        return LEAF_sample(LEAF_nearest(q));
    }
    let i = LEAF_cell(q);
    let f = q - vec3<f32>(i);
    return LEAF_mix(LEAF_along_y(i, f), LEAF_along_y(i + vec3<u32>(0u, 0u, 1u), f), f.z);
}
//:
fn LEAF(p: vec3<f32>) -> f32 {
    return LEAF_value(p);
}
//:
fn LEAF_slope_x(i: vec3<u32>) -> f32 {
    return LEAF_sample(i + vec3<u32>(1u, 0u, 0u)) - LEAF_sample(i);
}

fn LEAF_slope_y(i: vec3<u32>, f: vec3<f32>) -> f32 {
    return LEAF_along_x(i + vec3<u32>(0u, 1u, 0u), f.x) - LEAF_along_x(i, f.x);
}

// The exact gradient, per step of the grid.
fn LEAF_exact(q: vec3<f32>) -> vec3<f32> {
    let i = LEAF_cell(q);
    let f = q - vec3<f32>(i);
    let y = vec3<u32>(0u, 1u, 0u);
    let z = vec3<u32>(0u, 0u, 1u);
    let low = LEAF_mix(LEAF_slope_x(i), LEAF_slope_x(i + y), f.y);
    let high = LEAF_mix(LEAF_slope_x(i + z), LEAF_slope_x(i + y + z), f.y);
    return vec3<f32>(
        LEAF_mix(low, high, f.z),
        LEAF_mix(LEAF_slope_y(i, f), LEAF_slope_y(i + z, f), f.z),
        LEAF_along_y(i + z, f) - LEAF_along_y(i, f),
    );
}

fn LEAF_lower(at: vec3<u32>, axis: vec3<u32>) -> vec3<u32> {
    return max(at, axis) - axis;
}

fn LEAF_upper(at: vec3<u32>, axis: vec3<u32>) -> vec3<u32> {
    return min(at + axis, LEAF_points() - vec3<u32>(1u));
}

fn LEAF_average(at: vec3<u32>, axis: vec3<u32>) -> f32 {
    let middle = LEAF_sample(at);
    return ((LEAF_sample(LEAF_lower(at, axis)) + LEAF_sample(LEAF_upper(at, axis))) + (middle + middle)) * 0.25;
}

fn LEAF_average_twice(at: vec3<u32>, axis: vec3<u32>, other: vec3<u32>) -> f32 {
    let middle = LEAF_average(at, other);
    let ends = LEAF_average(LEAF_lower(at, axis), other) + LEAF_average(LEAF_upper(at, axis), other);
    return (ends + (middle + middle)) * 0.25;
}

fn LEAF_smooth(at: vec3<u32>, axis: vec3<u32>) -> f32 {
    if LEAF_KIND == 1u {
        return LEAF_sample(at);
    }
    return LEAF_average_twice(at, axis.zxy, axis.yzx);
}

// Per step of the grid, along an axis, at a sample.
fn LEAF_difference(at: vec3<u32>, axis: vec3<u32>) -> f32 {
    let low = LEAF_lower(at, axis);
    let high = LEAF_upper(at, axis);
    let difference = LEAF_smooth(high, axis) - LEAF_smooth(low, axis);
    return select(difference, difference * 0.5, dot(high - low, axis) == 2u);
}

fn LEAF_difference_between(q: vec3<f32>, axis: vec3<u32>) -> f32 {
    if LEAF_GRADIENT_NEAREST {
        return LEAF_difference(LEAF_nearest(q), axis);
    }
    let i = LEAF_cell(q);
    let f = q - vec3<f32>(i);
    var along = array<f32, 4>();
    for (var k = 0u; k < 4u; k++) {
        let at = i + vec3<u32>(0u, k & 1u, k >> 1u);
        along[k] = LEAF_mix(LEAF_difference(at, axis), LEAF_difference(at + vec3<u32>(1u, 0u, 0u), axis), f.x);
    }
    return LEAF_mix(LEAF_mix(along[0], along[1], f.y), LEAF_mix(along[2], along[3], f.y), f.z);
}

fn LEAF_gradient(p: vec3<f32>) -> vec4<f32> {
    let place = LEAF_place(p);
    let inside = LEAF_inside(place);
    let value = LEAF_value(p);
    if LEAF_CONSTANT && !all(inside) {
        return vec4<f32>(value, 0.0, 0.0, 0.0);
    }
    let q = LEAF_clamped(place);
    var slopes = vec3<f32>(0.0);
    if LEAF_KIND == 0u {
        slopes = LEAF_exact(q);
    } else {
        slopes = vec3<f32>(
            LEAF_difference_between(q, vec3<u32>(1u, 0u, 0u)),
            LEAF_difference_between(q, vec3<u32>(0u, 1u, 0u)),
            LEAF_difference_between(q, vec3<u32>(0u, 0u, 1u)),
        );
    }
    slopes = select(vec3<f32>(0.0), slopes, inside);
    return vec4<f32>(value, (LEAF_row(0u) * slopes.x + LEAF_row(1u) * slopes.y) + LEAF_row(2u) * slopes.z);
}
//:
const LEAF_LARGEST = 1e38f;

fn LEAF_blocks(shift: u32) -> vec3<u32> {
    return ((LEAF_points() - vec3<u32>(2u)) >> vec3<u32>(shift)) + vec3<u32>(1u);
}

fn LEAF_bounds(first: vec3<u32>, last: vec3<u32>) -> vec2<f32> {
    var shift = 2u;
    var at = LEAF_word(16u);
    var blocks = LEAF_blocks(shift);
    while any((last >> vec3<u32>(shift)) - (first >> vec3<u32>(shift)) > vec3<u32>(3u)) {
        at += 2u * blocks.x * blocks.y * blocks.z;
        shift += 1u;
        blocks = LEAF_blocks(shift);
    }
    let low = first >> vec3<u32>(shift);
    let high = last >> vec3<u32>(shift);
    var bounds = vec2<f32>(UNBOUNDED, -UNBOUNDED);
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            for (var x = low.x; x <= high.x; x++) {
                let place = at + 2u * (x + blocks.x * (y + blocks.y * z));
                bounds = vec2<f32>(min(bounds.x, LEAF_number(place)), max(bounds.y, LEAF_number(place + 1u)));
            }
        }
    }
    let most = max(-bounds.x, bounds.y);
    let by = abs(most) * 0x1p-20f;
    return select(vec2<f32>(bounds.x - by, bounds.y + by), ALL, most > LEAF_LARGEST);
}

fn LEAF_iv_row(k: u32, x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {
    let row = LEAF_row(k);
    return iv_add(iv_add(iv_mul(iv_point(row.x), x), iv_mul(iv_point(row.y), y)), iv_mul(iv_point(row.z), z));
}

fn LEAF_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {
    let origin = LEAF_origin();
    let dx = iv_sub(x, iv_point(origin.x));
    let dy = iv_sub(y, iv_point(origin.y));
    let dz = iv_sub(z, iv_point(origin.z));
    let a = LEAF_iv_row(0u, dx, dy, dz);
    let b = LEAF_iv_row(1u, dx, dy, dz);
    let c = LEAF_iv_row(2u, dx, dy, dz);
    if !(iv_bounded(a) && iv_bounded(b) && iv_bounded(c)) {
        return ALL;
    }
    let low = vec3<f32>(a.x, b.x, c.x);
    let high = vec3<f32>(a.y, b.y, c.y);
    let zero = vec3<f32>(0.0);
    let last = vec3<f32>(LEAF_points() - vec3<u32>(1u));
    if LEAF_CONSTANT && (any(high < zero) || any(low > last)) {
        return iv_point(LEAF_number(15u));
    }
    let bounds = LEAF_bounds(LEAF_cell(clamp(low, zero, last)), LEAF_cell(clamp(high, zero, last)));
    if LEAF_CONSTANT && (any(low < zero) || any(high > last)) {
        return iv_hull(iv_point(LEAF_number(15u)), bounds);
    }
    return bounds;
}
