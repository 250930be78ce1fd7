// A sum of components of finite support; src/graph/blobs/ is the twin and says how they are stored. LEAF
// stands for the leaf's name; LEAF_FIRST, LEAF_KERNEL, LEAF_FALLOFF, LEAF_TURNED and LEAF_WORDS are its constants. Marks of their own line
// part what all need, values, gradients and bounds.
//
// Data: how many grids, where the components begin, the slack; of each grid ten words (origin, cells a unit, dims,
// reach, where its cells and its peaks begin); cells and peaks; five words a component, of turned ellipsoids 13 (centre,
// three rows, weight). Places count from LEAF_FIRST.

fn LEAF_word(at: u32) -> u32 {
    return field_data[LEAF_FIRST + at];
}

fn LEAF_number(at: u32) -> f32 {
    return bitcast<f32>(field_data[LEAF_FIRST + at]);
}

fn LEAF_rest(q: f32) -> f32 {
    return select(0.0, 1.0 - q, q < 1.0);
}

// The kernel at q = r²/b².
fn LEAF_kernel(q: f32) -> f32 {
    switch LEAF_KERNEL {
        case 0u: {
            let u = LEAF_rest(q);
            return (u * u) * (0.5555556 + 0.44444445 * u);
        }
        // A constant times a product is written as a product with the constant: drivers do it in that order.
        case 1u: {
            let u = LEAF_rest(sqrt(q));
            return select((1.5 * u) * u, 1.0 - 3.0 * q, q < 0.11111111);
        }
        case 2u: {
            return select(0.0, iso_exp2(-LEAF_FALLOFF * select(1.0, q, q < 1.0)), q < 1.0);
        }
        default: {
            return select(0.0, 1.0 / select(q, 0x1p-20f, q < 0x1p-20f), q < 1.0);
        }
    }
}

// A distance in the axes of a turned component.
fn LEAF_turned(at: u32, d: vec3<f32>) -> vec3<f32> {
    var e = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        let row = at + 3u + 3u * k;
        e[k] = (LEAF_number(row) * d.x + LEAF_number(row + 1u) * d.y) + LEAF_number(row + 2u) * d.z;
    }
    return e;
}

fn LEAF_q(at: u32, d: vec3<f32>) -> f32 {
    if LEAF_TURNED {
        let e = LEAF_turned(at, d);
        return (e.x * e.x + e.y * e.y) + e.z * e.z;
    }
    return ((d.x * d.x + d.y * d.y) + d.z * d.z) * LEAF_number(at + 3u);
}

// First and last cell along an axis that a box reaches; last below first where there is none.
fn LEAF_span(grid: u32, axis: u32, low: f32, high: f32) -> vec2<f32> {
    let origin = LEAF_number(grid + axis);
    let inverse = LEAF_number(grid + 3u);
    let reach = LEAF_number(grid + 7u);
    let first = floor((low - origin) * inverse - reach);
    let end = floor((high - origin) * inverse + reach);
    let last = f32(LEAF_word(grid + 4u + axis) - 1u);
    return vec2<f32>(select(0.0, first, first > 0.0), select(last, end, end < last));
}
//:
fn LEAF(p: vec3<f32>) -> f32 {
    var sum = 0.0;
    let components = LEAF_word(1u);
    for (var g = 0u; g < LEAF_word(0u); g++) {
        let grid = 3u + 10u * g;
        let x = LEAF_span(grid, 0u, p.x, p.x);
        let y = LEAF_span(grid, 1u, p.y, p.y);
        let z = LEAF_span(grid, 2u, p.z, p.z);
        if !(x.x <= x.y && y.x <= y.y && z.x <= z.y) {
            continue;
        }
        let nx = LEAF_word(grid + 4u);
        let ny = LEAF_word(grid + 5u);
        for (var cz = u32(z.x); cz <= u32(z.y); cz++) {
            for (var cy = u32(y.x); cy <= u32(y.y); cy++) {
                let row = LEAF_word(grid + 8u) + nx * (cy + ny * cz);
                let end = LEAF_word(row + u32(x.y) + 1u);
                for (var i = LEAF_word(row + u32(x.x)); i < end; i++) {
                    let at = components + LEAF_WORDS * i;
                    let d = p - vec3<f32>(LEAF_number(at), LEAF_number(at + 1u), LEAF_number(at + 2u));
                    sum += LEAF_number(at + LEAF_WORDS - 1u) * LEAF_kernel(LEAF_q(at, d));
                }
            }
        }
    }
    return sum;
}
//:
// The derivative of the kernel by q, below 1.
fn LEAF_slope(q: f32) -> f32 {
    switch LEAF_KERNEL {
        case 0u: {
            let u = LEAF_rest(q);
            return -u * (1.1111112 + 1.3333334 * u);
        }
        case 1u: {
            let t = sqrt(q);
            return select((-1.5 * LEAF_rest(t)) / t, -3.0, q < 0.11111111);
        }
        case 2u: {
            return -(LEAF_FALLOFF * 0.6931472) * LEAF_kernel(q);
        }
        default: {
            let value = 1.0 / q;
            return select(0.0, -value * value, q >= 0x1p-20f);
        }
    }
}

// The gradient of q, times a number.
fn LEAF_along(at: u32, d: vec3<f32>, slope: f32) -> vec3<f32> {
    if LEAF_TURNED {
        let e = LEAF_turned(at, d);
        var sum = vec3<f32>(0.0);
        for (var k = 0u; k < 3u; k++) {
            let column = at + 3u + k;
            sum[k] = (LEAF_number(column) * e.x + LEAF_number(column + 3u) * e.y) + LEAF_number(column + 6u) * e.z;
        }
        return (slope + slope) * sum;
    }
    let inverse_square = LEAF_number(at + 3u);
    return (slope * (inverse_square + inverse_square)) * d;
}

fn LEAF_gradient(p: vec3<f32>) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    let components = LEAF_word(1u);
    for (var g = 0u; g < LEAF_word(0u); g++) {
        let grid = 3u + 10u * g;
        let x = LEAF_span(grid, 0u, p.x, p.x);
        let y = LEAF_span(grid, 1u, p.y, p.y);
        let z = LEAF_span(grid, 2u, p.z, p.z);
        if !(x.x <= x.y && y.x <= y.y && z.x <= z.y) {
            continue;
        }
        let nx = LEAF_word(grid + 4u);
        let ny = LEAF_word(grid + 5u);
        for (var cz = u32(z.x); cz <= u32(z.y); cz++) {
            for (var cy = u32(y.x); cy <= u32(y.y); cy++) {
                let row = LEAF_word(grid + 8u) + nx * (cy + ny * cz);
                let end = LEAF_word(row + u32(x.y) + 1u);
                for (var i = LEAF_word(row + u32(x.x)); i < end; i++) {
                    let at = components + LEAF_WORDS * i;
                    let d = p - vec3<f32>(LEAF_number(at), LEAF_number(at + 1u), LEAF_number(at + 2u));
                    let weight = LEAF_number(at + LEAF_WORDS - 1u);
                    let q = LEAF_q(at, d);
                    if q < 1.0 {
                        sum += vec4<f32>(weight * LEAF_kernel(q), LEAF_along(at, d, weight * LEAF_slope(q)));
                    }
                }
            }
        }
    }
    return sum;
}
//:
const LEAF_FEW_CELLS = 512u;

// Nearest and farthest distance along an axis.
fn LEAF_away(low: f32, high: f32, at: f32) -> vec2<f32> {
    let below = low - at;
    let above = at - high;
    let near = select(above, below, below > above);
    let one = high - at;
    let other = at - low;
    return vec2<f32>(select(0.0, near, near > 0.0), select(other, one, one > other));
}

// The least and the largest q over a box. A little less and a little more, since drivers may contract.
fn LEAF_range(at: u32, low: vec3<f32>, high: vec3<f32>) -> vec2<f32> {
    let centre = vec3<f32>(LEAF_number(at), LEAF_number(at + 1u), LEAF_number(at + 2u));
    if LEAF_TURNED {
        var q = vec2<f32>(0.0);
        for (var k = 0u; k < 3u; k++) {
            let first = at + 3u + 3u * k;
            let row = vec3<f32>(LEAF_number(first), LEAF_number(first + 1u), LEAF_number(first + 2u));
            let a = row * (low - centre);
            let b = row * (high - centre);
            let sizes = max(abs(a), abs(b));
            let off = ((sizes.x + sizes.y) + sizes.z) * 0x1p-20f;
            let lows = min(a, b);
            let highs = max(a, b);
            let lo = ((lows.x + lows.y) + lows.z) - off;
            let hi = ((highs.x + highs.y) + highs.z) + off;
            let least = select(select(0.0, hi * hi, hi < 0.0), lo * lo, lo > 0.0);
            q += vec2<f32>(least, max(lo * lo, hi * hi));
        }
        return vec2<f32>(q.x * (1.0 - 0x1p-20f), q.y * (1.0 + 0x1p-20f));
    }
    let dx = LEAF_away(low.x, high.x, centre.x);
    let dy = LEAF_away(low.y, high.y, centre.y);
    let dz = LEAF_away(low.z, high.z, centre.z);
    let squares = (dx * dx + dy * dy) + dz * dz;
    return (squares * vec2<f32>(1.0 - 0x1p-20f, 1.0 + 0x1p-20f)) * LEAF_number(at + 3u);
}

fn LEAF_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {
    if !(iv_bounded(x) && iv_bounded(y) && iv_bounded(z)) {
        return ALL;
    }
    var bounds = vec2<f32>(0.0);
    var magnitude = 0.0;
    var count = 0u;
    var coarse = 0.0;
    let components = LEAF_word(1u);
    for (var g = 0u; g < LEAF_word(0u); g++) {
        let grid = 3u + 10u * g;
        let a = LEAF_span(grid, 0u, x.x, x.y);
        let b = LEAF_span(grid, 1u, y.x, y.y);
        let c = LEAF_span(grid, 2u, z.x, z.y);
        if !(a.x <= a.y && b.x <= b.y && c.x <= c.y) {
            continue;
        }
        var first = vec3<u32>(u32(a.x), u32(b.x), u32(c.x));
        var last = vec3<u32>(u32(a.y), u32(b.y), u32(c.y));
        let dims = vec3<u32>(LEAF_word(grid + 4u), LEAF_word(grid + 5u), LEAF_word(grid + 6u));
        let n = min(last - first + vec3<u32>(1u), vec3<u32>(LEAF_FEW_CELLS + 1u));
        if n.x * n.y > LEAF_FEW_CELLS || n.x * n.y * n.z > LEAF_FEW_CELLS {
            var level = 1u;
            var at = LEAF_word(grid + 9u);
            var boxes = ((dims - vec3<u32>(1u)) >> vec3<u32>(level)) + vec3<u32>(1u);
            while any((last >> vec3<u32>(level)) - (first >> vec3<u32>(level)) > vec3<u32>(3u)) {
                at += 2u * boxes.x * boxes.y * boxes.z;
                level += 1u;
                boxes = ((dims - vec3<u32>(1u)) >> vec3<u32>(level)) + vec3<u32>(1u);
            }
            first = first >> vec3<u32>(level);
            last = last >> vec3<u32>(level);
            for (var bz = first.z; bz <= last.z; bz++) {
                for (var by = first.y; by <= last.y; by++) {
                    for (var bx = first.x; bx <= last.x; bx++) {
                        let place = at + 2u * (bx + boxes.x * (by + boxes.y * bz));
                        let peaks = vec2<f32>(LEAF_number(place), LEAF_number(place + 1u));
                        bounds += peaks;
                        coarse += peaks.y - peaks.x;
                    }
                }
            }
            continue;
        }
        for (var cz = first.z; cz <= last.z; cz++) {
            for (var cy = first.y; cy <= last.y; cy++) {
                let row = LEAF_word(grid + 8u) + dims.x * (cy + dims.y * cz);
                let end = LEAF_word(row + last.x + 1u);
                for (var i = LEAF_word(row + first.x); i < end; i++) {
                    let at = components + LEAF_WORDS * i;
                    let q = LEAF_range(at, vec3<f32>(x.x, y.x, z.x), vec3<f32>(x.y, y.y, z.y));
                    if q.x < 1.0 {
                        let weight = LEAF_number(at + LEAF_WORDS - 1u);
                        let near = weight * LEAF_kernel(q.x);
                        let far = weight * LEAF_kernel(q.y);
                        bounds += vec2<f32>(select(far, near, near < far), select(near, far, near < far));
                        magnitude += abs(near);
                        count += 1u;
                    }
                }
            }
        }
    }
    let by = magnitude * (f32(count) * 0x1p-22f + 0x1p-17f) + coarse * LEAF_number(2u);
    return iv_checked(vec2<f32>(bounds.x - by, bounds.y + by), true);
}
