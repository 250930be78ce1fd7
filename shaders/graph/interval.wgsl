// Interval arithmetic on bounds of field values; src/graph/interval.rs is the twin and says what an
// interval promises. x is the lowest value, y the highest.

const UNBOUNDED = 3.40282347e38f;
const ALL = vec2<f32>(-UNBOUNDED, UNBOUNDED);
// 2⁻²¹ and 2⁻¹⁰⁰.
const STEP = 0x1p-21f;
const TINY = 0x1p-100f;

fn iv_bounded(a: vec2<f32>) -> bool {
    return a.x > -UNBOUNDED && a.y < UNBOUNDED;
}

fn iv_checked(a: vec2<f32>, known: bool) -> vec2<f32> {
    // By bits: drivers may take it that there is no NaN.
    let finite = is_finite(bitcast<u32>(a.x)) && is_finite(bitcast<u32>(a.y));
    return select(ALL, a, known && finite && iv_bounded(a) && a.x <= a.y);
}

fn iv_widened(a: vec2<f32>, by: f32) -> vec2<f32> {
    return vec2<f32>(
        select(a.x - abs(a.x) * by, 0.0, a.x > 0.0 && a.x < TINY),
        select(a.y + abs(a.y) * by, 0.0, a.y < 0.0 && a.y > -TINY),
    );
}

fn iv_rounded(a: vec2<f32>, known: bool) -> vec2<f32> {
    return iv_checked(iv_widened(a, STEP), known);
}

fn iv_grown(a: vec2<f32>, known: bool, relative: f32, absolute: f32) -> vec2<f32> {
    let w = iv_widened(a, relative);
    return iv_checked(vec2<f32>(w.x - absolute, w.y + absolute), known);
}

fn iv_point(v: f32) -> vec2<f32> {
    return iv_checked(vec2<f32>(v, v), true);
}

fn iv_hull(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return iv_checked(vec2<f32>(min(a.x, b.x), max(a.y, b.y)), iv_bounded(a) && iv_bounded(b));
}

fn iv_neg(a: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(-a.y, -a.x);
}

fn iv_add(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return iv_rounded(a + b, iv_bounded(a) && iv_bounded(b));
}

fn iv_sub(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return iv_rounded(vec2<f32>(a.x - b.y, a.y - b.x), iv_bounded(a) && iv_bounded(b));
}

fn iv_mul(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let p = a.x * b.x;
    let q = a.x * b.y;
    let r = a.y * b.x;
    let s = a.y * b.y;
    let ends = vec2<f32>(min(min(p, q), min(r, s)), max(max(p, q), max(r, s)));
    return iv_rounded(ends, iv_bounded(a) && iv_bounded(b));
}

fn iv_div(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let known = iv_bounded(a) && iv_bounded(b) && (b.x >= TINY || b.y <= -TINY);
    let by = select(vec2<f32>(1.0), b, known);
    let p = a.x / by.x;
    let q = a.x / by.y;
    let r = a.y / by.x;
    let s = a.y / by.y;
    return iv_rounded(vec2<f32>(min(min(p, q), min(r, s)), max(max(p, q), max(r, s))), known);
}

fn iv_abs(a: vec2<f32>) -> vec2<f32> {
    return iv_checked(vec2<f32>(max(max(a.x, -a.y), 0.0), max(-a.x, a.y)), iv_bounded(a));
}

fn iv_square(a: vec2<f32>) -> vec2<f32> {
    let m = iv_abs(a);
    return iv_rounded(m * m, iv_bounded(a));
}

fn iv_sqrt(a: vec2<f32>) -> vec2<f32> {
    return iv_rounded(sqrt(max(a, vec2<f32>(0.0))), iv_bounded(a) && a.x >= 0.0);
}

fn iv_floor(a: vec2<f32>) -> vec2<f32> {
    return iv_checked(floor(a), iv_bounded(a));
}

fn iv_sign(a: vec2<f32>) -> vec2<f32> {
    return iv_checked(sign(a), iv_bounded(a));
}

fn iv_min(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return iv_checked(min(a, b), iv_bounded(a) && iv_bounded(b));
}

fn iv_max(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return iv_checked(max(a, b), iv_bounded(a) && iv_bounded(b));
}

fn iv_less(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return iv_checked(vec2<f32>(f32(a.y < b.x), f32(a.x < b.y)), iv_bounded(a) && iv_bounded(b));
}

fn iv_less_equal(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return iv_checked(vec2<f32>(f32(a.y <= b.x), f32(a.x <= b.y)), iv_bounded(a) && iv_bounded(b));
}

fn iv_select(condition: vec2<f32>, a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let always = condition.x > 0.0 || condition.y < 0.0;
    let never = condition.x == 0.0 && condition.y == 0.0;
    let one = select(select(iv_hull(a, b), b, never), a, always);
    return select(ALL, one, iv_bounded(condition));
}

// Of a wave of length 1 with its top at `top`, given its values at the ends.
fn iv_wave(a: vec2<f32>, ends: vec2<f32>, top: f32) -> vec2<f32> {
    let margin = 1e-5f + 1e-6f * max(abs(a.x), abs(a.y));
    let at_top = ceil(a.x - margin - top) <= a.y + margin - top;
    let at_bottom = ceil(a.x - margin - (top + 0.5)) <= a.y + margin - (top + 0.5);
    let known = iv_bounded(a) && abs(a.x) < 65536.0 && abs(a.y) < 65536.0;
    let lo = select(min(ends.x, ends.y), -1.0, at_bottom);
    let hi = select(max(ends.x, ends.y), 1.0, at_top);
    return iv_grown(vec2<f32>(lo, hi), known, 0.0, 2e-6f + 4e-6f * max(abs(a.x), abs(a.y)));
}

fn iv_in_turns(a: vec2<f32>) -> vec2<f32> {
    return iv_checked(a * 0.15915494f, iv_bounded(a));
}

fn iv_pow(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let known = iv_bounded(a) && iv_bounded(b) && (a.x > 1e-30f || (a.x >= 0.0 && b.x > 0.0));
    // A loop, since drivers are slow at compiling a power four times.
    var ends = vec2<f32>(UNBOUNDED, -UNBOUNDED);
    for (var corner = 0u; corner < 4u; corner++) {
        let v = iso_pow(select(a.x, a.y, (corner & 1u) == 1u), select(b.x, b.y, corner > 1u));
        ends = vec2<f32>(min(ends.x, v), max(ends.y, v));
    }
    return iv_grown(ends, known, 1e-4f, 0.0);
}

fn iv_atan2(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let whole = b.x <= 0.0 && a.x <= 0.0 && a.y >= 0.0;
    let p = iso_atan2(a.x, b.x);
    let q = iso_atan2(a.x, b.y);
    let r = iso_atan2(a.y, b.x);
    let s = iso_atan2(a.y, b.y);
    let ends = vec2<f32>(min(min(p, q), min(r, s)), max(max(p, q), max(r, s)));
    let most = vec2<f32>(-3.15f, 3.15f);
    return iv_grown(select(ends, most, whole), iv_bounded(a) && iv_bounded(b), 1e-5f, 1e-6f);
}
