//! Elementary functions; the twin of `shaders/shared/functions.wgsl`, same bits.
//!
//! Made of `+ - * /`, `sqrt`, `floor`, selects and bit operations in the same order as the twin, since the
//! built-in ones differ between drivers and from Rust's. Without branches and tables, so that loops over
//! slices become vector code.
//!
//! NaN gives NaN, whatever the other operand. Denormal numbers count as zero, with their sign, and a result
//! that would be one is zero: drivers may flush them. Drivers reorder sums too (Mesa does, for example
//! `(a b + c d) + e` and `(a + b) + constant`): such are avoided or masked, since no algebra sees through bits. The errors named below were measured over all operands, except where
//! a function has two.

/// `sin(2π u)`, error at most 4e-7.
#[inline(always)]
pub fn sin_turns(u: f32) -> f32 {
    let f = u - (u + 0.5).floor();
    let folded = if f >= 0.0 { 0.5 } else { -0.5 } - f;
    let g = if f.abs() > 0.25 { folded } else { f };
    let s = g * g;
    g * (std::f32::consts::TAU + s * (C3 + s * (C5 + s * (C7 + s * (C9 + s * C11)))))
}

/// `cos(2π u)`, error at most 4e-7.
#[inline(always)]
pub fn cos_turns(u: f32) -> f32 {
    // Reduced first: adding a quarter to a large angle would round.
    sin_turns((u - (u + 0.5).floor()) + 0.25)
}

const C3: f32 = -41.341_7;
const C5: f32 = 81.605_21;
const C7: f32 = -76.703_67;
const C9: f32 = 41.999_99;
const C11: f32 = -14.337_024;

const SIGN: u32 = 0x8000_0000;
const LEAST_NORMAL: u32 = 0x0080_0000;
const ONE: u32 = 0x3f80_0000;
const INFINITY: u32 = 0x7f80_0000;

/// The bits without the sign.
#[inline(always)]
fn magnitude(x: f32) -> u32 {
    x.to_bits() & !SIGN
}

/// As `magnitude`, denormal numbers as zero.
#[inline(always)]
fn flushed_magnitude(x: f32) -> u32 {
    let bits = magnitude(x);
    if bits < LEAST_NORMAL { 0 } else { bits }
}

/// A denormal number as zero.
#[inline(always)]
fn flushed(x: f32) -> f32 {
    f32::from_bits((x.to_bits() & SIGN) | flushed_magnitude(x))
}

/// `value`, which has no sign of its own, with that of `x`.
#[inline(always)]
fn with_sign_of(value: f32, x: f32) -> f32 {
    f32::from_bits(value.to_bits() | (x.to_bits() & SIGN))
}

/// The upper 12 bits of a number: products of two such are exact, and so is what is left of the number.
#[inline(always)]
fn upper(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0xffff_f000)
}

/// A number without its last bit, which is how it gets past a driver's algebra.
#[inline(always)]
fn opaque(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & !1)
}

#[inline(always)]
fn clamp(x: f32, least: f32, most: f32) -> f32 {
    let x = if x < least { least } else { x };
    if x > most { most } else { x }
}

#[inline(always)]
fn nan_if(wrong: bool, value: f32) -> f32 {
    if wrong { f32::NAN } else { value }
}

#[inline(always)]
fn is_nan(x: f32) -> bool {
    magnitude(x) > INFINITY
}

/// 2^(high + low) for `high` from -126.9 to 128.4 and a small `low`.
#[inline(always)]
fn exp2_of_sum(high: f32, low: f32) -> f32 {
    // 1.5 · 2^23: the sum of it and a number has the nearest integer in its last bits.
    const ROUNDER: f32 = 12_582_912.0;
    let k = (high + ROUNDER).to_bits().wrapping_sub(ROUNDER.to_bits());
    let r = (high - (k as i32) as f32) + low;
    let q = r * (E2 + r * (E3 + r * (E4 + r * (E5 + r * E6))));
    let bits = (1.0 + r * (E1 + q)).to_bits().wrapping_add(k << 23);
    let bits = if bits as i32 >= INFINITY as i32 { INFINITY } else { bits };
    f32::from_bits(if (bits as i32) < LEAST_NORMAL as i32 { 0 } else { bits })
}

const E1: f32 = std::f32::consts::LN_2;
const E2: f32 = 0.240_226_48;
const E3: f32 = 0.055_503_6;
const E4: f32 = 0.009_618_506;
const E5: f32 = 0.001_339_080_6;
const E6: f32 = 0.000_153_264_63;

/// 2^x, relative error at most 1e-7; steps back by a last bit here and there.
#[inline(always)]
pub fn exp2(x: f32) -> f32 {
    nan_if(is_nan(x), exp2_of_sum(clamp(x, -126.75, 128.25), 0.0))
}

/// log2 e, its upper 12 bits, and the rest of it. The next number is as good for what is lost of an operand,
/// and another factor: Mesa may add `a c + (b c + d)` up to `(a + b) c + d`, which rounds otherwise.
const LOG2_E: f32 = std::f32::consts::LOG2_E;
const LOG2_E_UPPER: f32 = 1.442_382_8;
const LOG2_E_UPPER_NEXT: f32 = 1.442_382_9;
const LOG2_E_LOWER: f32 = 0.000_312_228_4;

/// e^x from -87.7 to 89.
#[inline(always)]
fn exp_within(x: f32) -> f32 {
    let high = upper(x);
    exp2_of_sum(high * LOG2_E_UPPER, opaque((x - high) * LOG2_E_UPPER_NEXT + x * LOG2_E_LOWER))
}

/// e^x, relative error at most 1.6e-7; steps back by a last bit here and there.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    nan_if(is_nan(x), exp_within(clamp(x, -87.7, 89.0)))
}

/// `e` and `f` of the normal number 2^e (1 + f), f from -0.293 to 0.415.
#[inline(always)]
fn exponent_and_fraction(bits: u32) -> (f32, f32) {
    const ROOT_OF_HALF: u32 = 0x3f35_04f3;
    let e = (bits.wrapping_sub(ROOT_OF_HALF) as i32) >> 23;
    (e as f32, f32::from_bits(bits.wrapping_sub((e as u32) << 23)) - 1.0)
}

/// (ln(1 + f) - f) `scaled` / f.
#[inline(always)]
fn ln_rest(f: f32, scaled: f32) -> f32 {
    let p = L5 + f * (L6 + f * (L7 + f * (L8 + f * (L9 + f * L10))));
    (scaled * f) * (f * (L3 + f * (L4 + f * p)) - 0.5)
}

const L3: f32 = 0.333_333_3;
const L4: f32 = -0.250_008_2;
const L5: f32 = 0.200_012_42;
const L6: f32 = -0.166_234_09;
const L7: f32 = 0.142_015_8;
const L8: f32 = -0.131_596_1;
const L9: f32 = 0.127_622_16;
const L10: f32 = -0.076_364_35;

/// log2(1 + f) in two parts, the first of them exact.
#[inline(always)]
fn log2_parts(f: f32) -> (f32, f32) {
    let high = upper(f);
    let low = ((f - high) * LOG2_E_UPPER_NEXT + f * LOG2_E_LOWER) + ln_rest(f, f * LOG2_E);
    (high * LOG2_E_UPPER, opaque(low))
}

/// `value` but for the operands of logarithms outside the normal numbers.
#[inline(always)]
fn logarithm_of(x: f32, value: f32) -> f32 {
    let bits = flushed_magnitude(x);
    let value = if bits == INFINITY { f32::INFINITY } else { value };
    let value = if bits == 0 { f32::NEG_INFINITY } else { value };
    nan_if((x.to_bits() >= SIGN && bits != 0) || is_nan(x), value)
}

/// log2 x, relative error at most 1.2e-7, monotone.
#[inline(always)]
pub fn log2(x: f32) -> f32 {
    let (e, f) = exponent_and_fraction(x.to_bits());
    let (high, low) = log2_parts(f);
    logarithm_of(x, e + (high + low))
}

/// ln x, relative error at most 1.1e-7, monotone.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    // 355/512, so that its product with an exponent is exact, and what ln 2 is more.
    const LN_2_UPPER: f32 = 0.693_359_4;
    const LN_2_LOWER: f32 = -0.000_212_194_44;
    let (e, f) = exponent_and_fraction(x.to_bits());
    logarithm_of(x, e * LN_2_UPPER + (f + opaque(ln_rest(f, f) + e * LN_2_LOWER)))
}

/// x^y, relative error at most 6e-6 where the result is near the ends of its range, 2e-7 for moderate ones.
/// Zero has no sign here: 0^y is 0, 1 or +∞. A negative x has a power only if y is an integer, -∞ too.
#[inline(always)]
pub fn pow(x: f32, y: f32) -> f32 {
    let base = flushed_magnitude(x);
    let (e, f) = exponent_and_fraction(base);
    let (high, low) = log2_parts(f);
    let t = upper((e + high) + low);
    let t_rest = ((e - t) + high) + low;
    // A larger y makes 0, 1 or ∞ of every x, just as this one.
    let y = flushed(y);
    let within = clamp(y, -4_294_967_296.0, 4_294_967_296.0);
    let y_upper = upper(within);
    let high = y_upper * t;
    let low = opaque((within - y_upper) * t + within * t_rest);
    let bounded = clamp(high, -126.75, 128.25);
    let power = exp2_of_sum(bounded, if bounded == high { low } else { 0.0 });

    let (up, down) = if y > 0.0 { (f32::INFINITY, 0.0) } else { (0.0, f32::INFINITY) };
    let power = if base == 0 { down } else { power };
    let power = if base == INFINITY { up } else { power };
    let power = if y == 0.0 { 1.0 } else { power };
    let half = within * 0.5;
    let (integer, even) = (within.floor() == within, half.floor() == half);
    let negative = x.to_bits() >= SIGN && base != 0;
    let power = if negative && !even { -power } else { power };
    nan_if((negative && !integer) || is_nan(x) || is_nan(y), power)
}

/// The angle `x` in turns, give or take whole ones.
#[inline(always)]
fn turns_of(x: f32) -> f32 {
    // The upper 12 bits of 1 / 2π, the number after that, and the rest; see [`LOG2_E`].
    const UPPER: f32 = 0.159_118_65;
    const UPPER_NEXT: f32 = 0.159_118_67;
    const LOWER: f32 = 0.000_036_290_75;
    let high = upper(x);
    let turns = high * UPPER;
    (turns - (turns + 0.5).floor()) + opaque((x - high) * UPPER_NEXT + x * LOWER)
}

/// `value`, but x itself where the sine and the tangent of it are.
#[inline(always)]
fn or_small(x: f32, value: f32) -> f32 {
    const SMALL: u32 = 0x3980_0000;
    let value = if magnitude(x) < SMALL { flushed(x) } else { value };
    nan_if(magnitude(x) >= INFINITY, value)
}

/// The sine of an angle in radians.
#[inline(always)]
pub fn sin(x: f32) -> f32 {
    or_small(x, sin_turns(turns_of(x)))
}

/// The cosine of an angle in radians.
#[inline(always)]
pub fn cos(x: f32) -> f32 {
    nan_if(magnitude(x) >= INFINITY, cos_turns(turns_of(x.abs())))
}

/// The tangent of an angle in radians.
#[inline(always)]
pub fn tan(x: f32) -> f32 {
    let turns = turns_of(x.abs());
    let (sine, cosine) = (sin_turns(turns), cos_turns(turns));
    let pole = cosine == 0.0;
    let value = sine / if pole { 1.0 } else { cosine };
    let value = if pole { with_sign_of(f32::INFINITY, sine) } else { value };
    or_small(x, f32::from_bits(value.to_bits() ^ (x.to_bits() & SIGN)))
}

/// π in two parts.
const PI: f32 = std::f32::consts::PI;
const PI_REST: f32 = -8.742_278e-8;

/// `angle` and `half_turns` π.
#[inline(always)]
fn turned(angle: f32, half_turns: f32) -> f32 {
    half_turns * PI + (angle + half_turns * PI_REST)
}

/// For |x| up to a half its arc sine, for those above the arc sine of √((1 - |x|) / 2); and whether above.
#[inline(always)]
fn asin_part(bits: u32) -> (f32, bool) {
    let a = f32::from_bits(if bits > ONE { ONE } else { bits });
    let above = a > 0.5;
    let z = if above { (1.0 - a) * 0.5 } else { a * a };
    let s = if above { z.sqrt() } else { a };
    (s + (s * z) * (S3 + z * (S5 + z * (S7 + z * (S9 + z * S11)))), above)
}

const S3: f32 = 0.166_667_52;
const S5: f32 = 0.074_953_094;
const S7: f32 = 0.045_469_15;
const S9: f32 = 0.024_184_778;
const S11: f32 = 0.042_158_306;

/// The arc sine, in radians, relative error at most 2.8e-7, monotone.
#[inline(always)]
pub fn asin(x: f32) -> f32 {
    let bits = flushed_magnitude(x);
    let (part, above) = asin_part(bits);
    let (angle, half_turns) = if above { (-2.0 * part, 0.5) } else { (part, 0.0) };
    nan_if(bits > ONE, with_sign_of(turned(angle, half_turns), x))
}

/// The arc cosine, in radians, relative error at most 1.3e-7, monotone.
#[inline(always)]
pub fn acos(x: f32) -> f32 {
    let bits = flushed_magnitude(x);
    let (part, above) = asin_part(bits);
    let negative = x.to_bits() >= SIGN;
    let angle = if above { -2.0 * part } else { part };
    let angle = if negative { angle } else { -angle };
    let far = if negative { 1.0 } else { 0.0 };
    nan_if(bits > ONE, turned(angle, if above { far } else { 0.5 }))
}

/// The arc tangent of y / x, neither of them negative, nor both zero: an angle from -π/8 to π/8, and how many
/// times π more.
#[inline(always)]
fn atan_of_ratio(y: f32, x: f32) -> (f32, f32) {
    // tan(π/8) and tan(3π/8): between them the angle from π/4, above them that from π/2.
    let (low, middle) = (y <= 0.414_213_57 * x, y <= 2.414_213_7 * x);
    let over = if low { y } else { -x };
    let over = if middle && !low { y - x } else { over };
    let under = if low { x } else { y };
    let under = if middle && !low { y + x } else { under };
    let half_turns = if middle { 0.25 } else { 0.5 };
    let half_turns = if low { 0.0 } else { half_turns };
    let w = flushed(over / under);
    let z = w * w;
    (w + (w * z) * (T3 + z * (T5 + z * (T7 + z * (T9 + z * T11)))), half_turns)
}

const T3: f32 = -0.333_333_16;
const T5: f32 = 0.199_985_28;
const T7: f32 = -0.142_443_88;
const T9: f32 = 0.105_991_2;
const T11: f32 = -0.060_898_63;

/// The arc tangent, in radians, relative error at most 1.7e-7, monotone.
#[inline(always)]
pub fn atan(x: f32) -> f32 {
    // A larger x has the same arc tangent, and none of its reciprocals are denormal.
    const LARGE: u32 = 0x7000_0000;
    let bits = flushed_magnitude(x);
    let a = f32::from_bits(if bits > LARGE { LARGE } else { bits });
    let (angle, half_turns) = atan_of_ratio(a, 1.0);
    nan_if(is_nan(x), with_sign_of(turned(angle, half_turns), x))
}

/// The angle of the point (x, y), in radians from -π to π, relative error at most 1.7e-7; 0 or ±π at the origin,
/// by the signs of its zeros.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (mut a, mut b) = (flushed_magnitude(y), flushed_magnitude(x));
    let most = if a > b { a } else { b };
    if most == INFINITY {
        a = if a == INFINITY { ONE } else { 0 };
        b = if b == INFINITY { ONE } else { 0 };
    }
    // Away from both ends of the exponents, where sums and products would leave them: by 2^±64.
    const LARGE: u32 = 0x5f80_0000;
    const SMALL: u32 = 0x1f80_0000;
    let scale = if most >= LARGE { 5.421_011e-20 } else { 1.0 };
    let scale = if most < SMALL { 18_446_744_073_709_551_616.0 } else { scale };
    let (a, b) = (f32::from_bits(a) * scale, f32::from_bits(b) * scale);
    let (a, b) = (f32::from_bits(flushed_magnitude(a)), f32::from_bits(flushed_magnitude(b)));
    let (right, half_turns) = atan_of_ratio(a, if most == 0 { 1.0 } else { b });
    let left = x.to_bits() >= SIGN;
    let (angle, half_turns) = if left { (-right, 1.0 - half_turns) } else { (right, half_turns) };
    nan_if(is_nan(x) || is_nan(y), with_sign_of(turned(angle, half_turns), y))
}

/// The hyperbolic tangent, relative error at most 1.6e-7, monotone.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let a = f32::from_bits(flushed_magnitude(x));
    let z = a * a;
    let near = a + (a * z) * (H3 + z * (H5 + z * (H7 + z * (H9 + z * H11))));
    let far = 1.0 - 2.0 / (exp_within(2.0 * if a > 10.0 { 10.0 } else { a }) + 1.0);
    nan_if(is_nan(x), with_sign_of(if a < 0.6 { near } else { far }, x))
}

const H3: f32 = -0.333_333;
const H5: f32 = 0.133_319_36;
const H7: f32 = -0.053_784_717;
const H9: f32 = 0.020_798_625;
const H11: f32 = -0.005_897_966_7;

#[cfg(test)]
mod tests;
