// What the trilinear interpolant of a cell's corners does where the corners alone do not say: which diagonal corners its
// faces join, and whether there is a tunnel through its middle. CPU twin: src/stage/trilinear.rs, which says how.
//
// WGSL has numbers of 32 bits: larger ones are vectors of words, the lowest first.

// The magnitude of what is less, and of what is more.
const LEAST = 0x00800000u;
const MOST = 0x7f7fffffu;

// The corners of each face, around it; four bits each.
const FACE_CORNERS = array<u32, 6>(0x4620u, 0x5731u, 0x4510u, 0x6732u, 0x2310u, 0x6754u);

// How far a sample is from iso, as bits of a normal float above 0.
fn magnitude(bits: u32) -> u32 {
    let size = bitcast<u32>(bitcast<f32>(bits) - call.iso) & 0x7fffffffu;
    return select(MOST, clamp(size, LEAST, MOST), is_finite(bits));
}

fn mantissa(bits: u32) -> u32 {
    return (bits & 0x7fffffu) | 0x800000u;
}

fn product(a: u32, b: u32) -> vec2<u32> {
    let a0 = a & 0xffffu;
    let a1 = a >> 16u;
    let b0 = b & 0xffffu;
    let b1 = b >> 16u;
    let low = a0 * b0;
    let middle = a1 * b0 + (low >> 16u);
    let rest = a0 * b1 + (middle & 0xffffu);
    return vec2<u32>((low & 0xffffu) | (rest << 16u), a1 * b1 + (middle >> 16u) + (rest >> 16u));
}

fn sum(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = a.x + b.x;
    return vec2<u32>(low, a.y + b.y + u32(low < a.x));
}

fn difference(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    return vec2<u32>(a.x - b.x, a.y - b.y - u32(a.x < b.x));
}

fn less(a: vec2<u32>, b: vec2<u32>) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

// 128 bits.
fn large_product(a: vec2<u32>, b: vec2<u32>) -> vec4<u32> {
    let low = product(a.x, b.x);
    let one = product(a.x, b.y);
    let two = product(a.y, b.x);
    let high = product(a.y, b.y);
    let second = sum(sum(vec2<u32>(low.y, 0u), vec2<u32>(one.x, 0u)), vec2<u32>(two.x, 0u));
    let third = sum(sum(vec2<u32>(one.y, 0u), vec2<u32>(two.y, 0u)), sum(vec2<u32>(high.x, 0u), vec2<u32>(second.y, 0u)));
    return vec4<u32>(low.x, second.x, third.x, high.y + third.y);
}

fn less_large(a: vec4<u32>, b: vec4<u32>) -> bool {
    return less(a.zw, b.zw) || (all(a.zw == b.zw) && less(a.xy, b.xy));
}

// A product of magnitudes, in a form that orders as it does: exponent, and 48 bits of digits.
fn ordered_product(a: u32, b: u32) -> vec3<u32> {
    let digits = product(mantissa(a), mantissa(b));
    let exponent = (a >> 23u) + (b >> 23u);
    if (digits.y >> 15u) == 1u {
        return vec3<u32>(digits, exponent + 1u);
    }
    return vec3<u32>(digits.x << 1u, (digits.y << 1u) | (digits.x >> 31u), exponent);
}

fn less_ordered(a: vec3<u32>, b: vec3<u32>) -> bool {
    return a.z < b.z || (a.z == b.z && less(a.xy, b.xy));
}

fn face_corner(face: u32, i: u32) -> u32 {
    return (FACE_CORNERS[face] >> (4u * i)) & 7u;
}

// Whether the inside corners of an ambiguous face are joined on it.
fn joins_inside(case_byte: u32, magnitudes: array<u32, 8>, face: u32) -> bool {
    var m = magnitudes;
    let first = ordered_product(m[face_corner(face, 0u)], m[face_corner(face, 2u)]);
    let second = ordered_product(m[face_corner(face, 1u)], m[face_corner(face, 3u)]);
    if ((case_byte >> face_corner(face, 0u)) & 1u) == 1u {
        return less_ordered(second, first);
    }
    return less_ordered(first, second);
}

// A whole number with its sign.
struct Whole {
    size: vec2<u32>,
    negative: bool,
}

fn settled(positive: vec2<u32>, negative: vec2<u32>) -> Whole {
    if less(positive, negative) {
        return Whole(difference(negative, positive), true);
    }
    return Whole(difference(positive, negative), false);
}

// A C - B D of one end of the lines A and B, and of one end of C and D, added to a sum: what is above 0, and what is below.
fn add_polar(total: vec4<u32>, a: vec4<u32>, a_inside: u32, b: vec4<u32>, b_inside: u32) -> vec4<u32> {
    var positive = total.xy;
    var negative = total.zw;
    let differ = a_inside ^ (b_inside >> 2u);
    let first = product(a.x, b.z);
    if (differ & 1u) == 0u {
        positive = sum(positive, first);
    } else {
        negative = sum(negative, first);
    }
    let second = product(a.y, b.w);
    if (differ & 2u) == 0u {
        negative = sum(negative, second);
    } else {
        positive = sum(positive, second);
    }
    return vec4<u32>(positive, negative);
}

// The sign of middle * d + 2 * high * n.
fn slope(middle: Whole, high: Whole, n: u32, d: u32) -> i32 {
    let first = large_product(middle.size, vec2<u32>(d, 0u));
    let second = large_product(sum(high.size, high.size), vec2<u32>(n, 0u));
    let one = select(1, -1, middle.negative);
    let two = select(1, -1, high.negative);
    if less_large(first, second) {
        return two;
    }
    if less_large(second, first) {
        return one;
    }
    return select(0, one, one == two && any(first != vec4<u32>(0u)));
}

// The corner as a whole number below 2³⁰, at the scale of the largest exponent.
fn fixed_point(bits: u32, most: u32) -> u32 {
    return max((mantissa(bits) << 6u) >> min(most - (bits >> 23u), 31u), 1u);
}

// Which corners a tunnel joins, where `faces` says of each ambiguous face whether its inside corners are joined: 0 for no
// tunnel, 1 for inside corners, 2 for outside ones.
fn tunnel(case_byte: u32, magnitudes: array<u32, 8>, faces: u32) -> u32 {
    var m = magnitudes;
    var most = 0u;
    for (var k = 0u; k < 8u; k++) {
        most = max(most, m[k] >> 23u);
    }
    // The ends of the lines A, B, C, D along z.
    let below = vec4<u32>(fixed_point(m[0], most), fixed_point(m[1], most), fixed_point(m[3], most), fixed_point(m[2], most));
    let above = vec4<u32>(fixed_point(m[4], most), fixed_point(m[5], most), fixed_point(m[7], most), fixed_point(m[6], most));
    let around = (case_byte & 0x33u) | ((case_byte & 0x44u) << 1u) | ((case_byte & 0x88u) >> 1u);
    let inside_below = around & 15u;
    let inside_above = around >> 4u;
    let none = vec4<u32>(0u);
    let at_low = add_polar(none, below, inside_below, below, inside_below);
    let between = add_polar(none, below, inside_below, above, inside_above);
    let at_middle = add_polar(between, above, inside_above, below, inside_below);
    let at_high = add_polar(none, above, inside_above, above, inside_above);
    let low = settled(at_low.xy, at_low.zw);
    let middle = settled(at_middle.xy, at_middle.zw);
    let high = settled(at_high.xy, at_high.zw);
    let square = large_product(middle.size, middle.size);
    let other = large_product(sum(low.size, low.size), sum(high.size, high.size));
    let is_real = select(less_large(other, square), any(square != none) || any(other != none), low.negative != high.negative);
    if !is_real {
        return 0u;
    }
    for (var pattern = 0u; pattern < 2u; pattern++) {
        var begin = vec2<u32>(0u, 1u);
        var end = vec2<u32>(1u, 0u);
        var begin_line = 4u;
        var end_line = 4u;
        var exists = true;
        for (var i = 0u; i < 4u; i++) {
            let wanted = u32((i & 1u) == pattern);
            let is_below = ((inside_below >> i) & 1u) == wanted;
            let is_above = ((inside_above >> i) & 1u) == wanted;
            let at = vec2<u32>(below[i], above[i]);
            exists = exists && (is_below || is_above);
            if !is_below && less(product(begin.x, at.y), product(at.x, begin.y)) {
                begin = at;
                begin_line = i;
            }
            if !is_above && less(product(at.x, end.y), product(end.x, at.y)) {
                end = at;
                end_line = i;
            }
        }
        if !exists || !less(product(begin.x, end.y), product(end.x, begin.y)) {
            continue;
        }
        let first = select((begin_line & 1u) == 1u, (((faces >> 4u) & 1u) == 1u) == (pattern == 0u), begin_line == 4u);
        let last = select((end_line & 1u) == 1u, (((faces >> 5u) & 1u) == 1u) == (pattern == 0u), end_line == 4u);
        if first != last {
            continue;
        }
        let falling = select(1, -1, first);
        if slope(middle, high, begin.x, begin.y) == falling && slope(middle, high, end.x, end.y) == -falling {
            return select(1u, 2u, first == (pattern == 0u));
        }
    }
    return 0u;
}
