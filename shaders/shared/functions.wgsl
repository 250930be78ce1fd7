// Elementary functions of + - * /, sqrt, floor, selects and bit operations alone, so that every driver and the
// CPU give the same bits; the built-in ones differ by up to 2e-4 between drivers. CPU twin, with the same
// operations in the same order, and where the errors are named: src/field/functions.rs.

// sin(2π u), error at most 4e-7.
fn sin_turns(u: f32) -> f32 {
    let f = u - floor(u + 0.5);
    // Fold to a quarter turn either side of zero.
    let folded = select(-0.5, 0.5, f >= 0.0) - f;
    let g = select(f, folded, abs(f) > 0.25);
    let s = g * g;
    return g * (6.2831853 + s * (-41.341702 + s * (81.605209 + s * (-76.703668 + s * (41.99999 + s * -14.337024)))));
}

// cos(2π u), error at most 4e-7.
fn cos_turns(u: f32) -> f32 {
    // Reduced first: adding a quarter to a large angle would round.
    return sin_turns((u - floor(u + 0.5)) + 0.25);
}

const ISO_SIGN = 0x80000000u;
const ISO_LEAST_NORMAL = 0x00800000u;
const ISO_ONE = 0x3f800000u;
const ISO_INFINITY = 0x7f800000u;

fn iso_magnitude(x: f32) -> u32 {
    return bitcast<u32>(x) & 0x7fffffffu;
}

fn iso_flushed_magnitude(x: f32) -> u32 {
    let bits = iso_magnitude(x);
    return select(bits, 0u, bits < ISO_LEAST_NORMAL);
}

fn iso_flushed(x: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(x) & ISO_SIGN) | iso_flushed_magnitude(x));
}

fn iso_with_sign_of(value: f32, x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(value) | (bitcast<u32>(x) & ISO_SIGN));
}

fn iso_upper(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) & 0xfffff000u);
}

fn iso_opaque(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) & 0xfffffffeu);
}

fn iso_clamp(x: f32, least: f32, most: f32) -> f32 {
    let above = select(x, least, x < least);
    return select(above, most, above > most);
}

// Infinities and NaN are selected as bits: WGSL has no literals of them, and a compiler may take a float
// operation to make none.
fn iso_nan_if(wrong: bool, value: f32) -> f32 {
    return bitcast<f32>(select(bitcast<u32>(value), 0x7fc00000u, wrong));
}

fn iso_infinity_if(infinite: bool, value: f32) -> f32 {
    return bitcast<f32>(select(bitcast<u32>(value), ISO_INFINITY, infinite));
}

fn iso_is_nan(x: f32) -> bool {
    return iso_magnitude(x) > ISO_INFINITY;
}

fn iso_exp2_of_sum(high: f32, low: f32) -> f32 {
    let k = bitcast<u32>(high + 12582912.0) - 0x4b400000u;
    let r = (high - f32(bitcast<i32>(k))) + low;
    let q = r * (0.24022648 + r * (0.0555036 + r * (0.009618506 + r * (0.0013390806 + r * 0.00015326463))));
    let raw = bitcast<u32>(1.0 + r * (0.6931472 + q)) + (k << 23u);
    let bits = select(raw, ISO_INFINITY, bitcast<i32>(raw) >= bitcast<i32>(ISO_INFINITY));
    return bitcast<f32>(select(bits, 0u, bitcast<i32>(bits) < bitcast<i32>(ISO_LEAST_NORMAL)));
}

fn iso_exp2(x: f32) -> f32 {
    return iso_nan_if(iso_is_nan(x), iso_exp2_of_sum(iso_clamp(x, -126.75, 128.25), 0.0));
}

fn iso_exp_within(x: f32) -> f32 {
    let high = iso_upper(x);
    return iso_exp2_of_sum(high * 1.4423828, iso_opaque((x - high) * 1.4423829 + x * 0.0003122284));
}

fn iso_exp(x: f32) -> f32 {
    return iso_nan_if(iso_is_nan(x), iso_exp_within(iso_clamp(x, -87.7, 89.0)));
}

// Exponent and fraction.
fn iso_exponent_and_fraction(bits: u32) -> vec2<f32> {
    let e = bitcast<i32>(bits - 0x3f3504f3u) >> 23u;
    return vec2<f32>(f32(e), bitcast<f32>(bits - (bitcast<u32>(e) << 23u)) - 1.0);
}

fn iso_ln_rest(f: f32, scaled: f32) -> f32 {
    let p = 0.20001242 + f * (-0.16623409 + f * (0.1420158 + f * (-0.1315961 + f * (0.12762216 + f * -0.07636435))));
    return (scaled * f) * (f * (0.3333333 + f * (-0.2500082 + f * p)) - 0.5);
}

fn iso_log2_parts(f: f32) -> vec2<f32> {
    let high = iso_upper(f);
    let low = ((f - high) * 1.4423829 + f * 0.0003122284) + iso_ln_rest(f, f * 1.442695);
    return vec2<f32>(high * 1.4423828, iso_opaque(low));
}

fn iso_logarithm_of(x: f32, value: f32) -> f32 {
    let bits = iso_flushed_magnitude(x);
    let most = select(bitcast<u32>(value), ISO_INFINITY, bits == ISO_INFINITY);
    let least = select(most, ISO_INFINITY | ISO_SIGN, bits == 0u);
    return iso_nan_if((bitcast<u32>(x) >= ISO_SIGN && bits != 0u) || iso_is_nan(x), bitcast<f32>(least));
}

fn iso_log2(x: f32) -> f32 {
    let parts = iso_exponent_and_fraction(bitcast<u32>(x));
    let sum = iso_log2_parts(parts.y);
    return iso_logarithm_of(x, parts.x + (sum.x + sum.y));
}

fn iso_ln(x: f32) -> f32 {
    let parts = iso_exponent_and_fraction(bitcast<u32>(x));
    let e = parts.x;
    let f = parts.y;
    return iso_logarithm_of(x, e * 0.6933594 + (f + iso_opaque(iso_ln_rest(f, f) + e * -0.00021219444)));
}

fn iso_pow(x: f32, exponent: f32) -> f32 {
    let base = iso_flushed_magnitude(x);
    let parts = iso_exponent_and_fraction(base);
    let sum = iso_log2_parts(parts.y);
    let t = iso_upper((parts.x + sum.x) + sum.y);
    let t_rest = ((parts.x - t) + sum.x) + sum.y;
    let y = iso_flushed(exponent);
    let within = iso_clamp(y, -4294967296.0, 4294967296.0);
    let y_upper = iso_upper(within);
    let high = y_upper * t;
    let low = iso_opaque((within - y_upper) * t + within * t_rest);
    let bounded = iso_clamp(high, -126.75, 128.25);
    var power = iso_exp2_of_sum(bounded, select(0.0, low, bounded == high));

    let positive = y > 0.0;
    power = bitcast<f32>(select(bitcast<u32>(power), select(ISO_INFINITY, 0u, positive), base == 0u));
    power = bitcast<f32>(select(bitcast<u32>(power), select(0u, ISO_INFINITY, positive), base == ISO_INFINITY));
    power = select(power, 1.0, y == 0.0);
    let half = within * 0.5;
    let integer = floor(within) == within;
    let even = floor(half) == half;
    let negative = bitcast<u32>(x) >= ISO_SIGN && base != 0u;
    power = bitcast<f32>(bitcast<u32>(power) ^ select(0u, ISO_SIGN, negative && !even));
    return iso_nan_if((negative && !integer) || iso_is_nan(x) || iso_is_nan(exponent), power);
}

fn iso_turns_of(x: f32) -> f32 {
    let high = iso_upper(x);
    let turns = high * 0.15911865;
    return (turns - floor(turns + 0.5)) + iso_opaque((x - high) * 0.15911867 + x * 0.00003629075);
}

fn iso_or_small(x: f32, value: f32) -> f32 {
    let with_small = select(value, iso_flushed(x), iso_magnitude(x) < 0x39800000u);
    return iso_nan_if(iso_magnitude(x) >= ISO_INFINITY, with_small);
}

fn iso_sin(x: f32) -> f32 {
    return iso_or_small(x, sin_turns(iso_turns_of(x)));
}

fn iso_cos(x: f32) -> f32 {
    return iso_nan_if(iso_magnitude(x) >= ISO_INFINITY, cos_turns(iso_turns_of(abs(x))));
}

fn iso_tan(x: f32) -> f32 {
    let turns = iso_turns_of(abs(x));
    let sine = sin_turns(turns);
    let cosine = cos_turns(turns);
    let pole = cosine == 0.0;
    let value = sine / select(cosine, 1.0, pole);
    let infinite = iso_with_sign_of(iso_infinity_if(pole, 0.0), sine);
    let bits = select(bitcast<u32>(value), bitcast<u32>(infinite), pole);
    return iso_or_small(x, bitcast<f32>(bits ^ (bitcast<u32>(x) & ISO_SIGN)));
}

fn iso_turned(angle: f32, half_turns: f32) -> f32 {
    return half_turns * 3.1415927 + (angle + half_turns * -8.742278e-8);
}

struct IsoAsinPart { angle: f32, above: bool }

fn iso_asin_part(bits: u32) -> IsoAsinPart {
    let a = bitcast<f32>(select(bits, ISO_ONE, bits > ISO_ONE));
    let above = a > 0.5;
    let z = select(a * a, (1.0 - a) * 0.5, above);
    let s = select(a, sqrt(z), above);
    let p = 0.16666752 + z * (0.074953094 + z * (0.04546915 + z * (0.024184778 + z * 0.042158306)));
    return IsoAsinPart(s + (s * z) * p, above);
}

fn iso_asin(x: f32) -> f32 {
    let bits = iso_flushed_magnitude(x);
    let part = iso_asin_part(bits);
    let angle = select(part.angle, -2.0 * part.angle, part.above);
    return iso_nan_if(bits > ISO_ONE, iso_with_sign_of(iso_turned(angle, select(0.0, 0.5, part.above)), x));
}

fn iso_acos(x: f32) -> f32 {
    let bits = iso_flushed_magnitude(x);
    let part = iso_asin_part(bits);
    let negative = bitcast<u32>(x) >= ISO_SIGN;
    let unsigned = select(part.angle, -2.0 * part.angle, part.above);
    let angle = select(-unsigned, unsigned, negative);
    let half_turns = select(0.5, select(0.0, 1.0, negative), part.above);
    return iso_nan_if(bits > ISO_ONE, iso_turned(angle, half_turns));
}

// Angle, and how many times π more.
fn iso_atan_of_ratio(y: f32, x: f32) -> vec2<f32> {
    let low = y <= 0.41421357 * x;
    let middle = y <= 2.4142137 * x;
    let over = select(select(-x, y, low), y - x, middle && !low);
    let under = select(select(y, x, low), y + x, middle && !low);
    let half_turns = select(select(0.5, 0.25, middle), 0.0, low);
    let w = iso_flushed(over / under);
    let z = w * w;
    let p = -0.33333316 + z * (0.19998528 + z * (-0.14244388 + z * (0.1059912 + z * -0.06089863)));
    return vec2<f32>(w + (w * z) * p, half_turns);
}

fn iso_atan(x: f32) -> f32 {
    let bits = iso_flushed_magnitude(x);
    let a = bitcast<f32>(select(bits, 0x70000000u, bits > 0x70000000u));
    let parts = iso_atan_of_ratio(a, 1.0);
    return iso_nan_if(iso_is_nan(x), iso_with_sign_of(iso_turned(parts.x, parts.y), x));
}

fn iso_atan2(y: f32, x: f32) -> f32 {
    let y_bits = iso_flushed_magnitude(y);
    let x_bits = iso_flushed_magnitude(x);
    let most = max(y_bits, x_bits);
    let infinite = most == ISO_INFINITY;
    let a_bits = select(y_bits, select(0u, ISO_ONE, y_bits == ISO_INFINITY), infinite);
    let b_bits = select(x_bits, select(0u, ISO_ONE, x_bits == ISO_INFINITY), infinite);
    let scale = select(select(1.0, 5.421011e-20, most >= 0x5f800000u), 18446744073709551616.0, most < 0x1f800000u);
    let a = iso_flushed(bitcast<f32>(a_bits) * scale);
    let b = iso_flushed(bitcast<f32>(b_bits) * scale);
    let parts = iso_atan_of_ratio(a, select(b, 1.0, most == 0u));
    let left = bitcast<u32>(x) >= ISO_SIGN;
    let angle = iso_turned(select(parts.x, -parts.x, left), select(parts.y, 1.0 - parts.y, left));
    return iso_nan_if(iso_is_nan(x) || iso_is_nan(y), iso_with_sign_of(angle, y));
}

fn iso_tanh(x: f32) -> f32 {
    let a = bitcast<f32>(iso_flushed_magnitude(x));
    let z = a * a;
    let p = -0.333333 + z * (0.13331936 + z * (-0.053784717 + z * (0.020798625 + z * -0.0058979667)));
    let far = 1.0 - 2.0 / (iso_exp_within(2.0 * select(a, 10.0, a > 10.0)) + 1.0);
    return iso_nan_if(iso_is_nan(x), iso_with_sign_of(select(far, a + (a * z) * p, a < 0.6), x));
}
