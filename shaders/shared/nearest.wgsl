// Quotients and roots rounded to the nearest float, from what a driver makes of them, for src/gpu/exact.rs. What is off is told by what is
// left: of a quotient n - q d, of a root x - s², in whole numbers; these are small, so that their lowest 32 bits are enough. Where a number is zero,
// denormal, infinite or NaN, it stays as the driver has it.

// Units in the last place that a driver may be off: 2.5 of quotients; 7 of roots, which are 1 by an inverse root that is off by 2 itself.
const ISO_MOST_OFF = 8u;

fn iso_exponent_of(bits: u32) -> u32 {
    return (bits >> 23u) & 0xffu;
}

fn iso_digits_of(bits: u32) -> u32 {
    return (bits & 0x7fffffu) | 0x800000u;
}

// Neither zero nor denormal, infinite or NaN.
fn iso_is_normal(exponent: u32) -> bool {
    return exponent - 1u < 254u;
}

// Also beside the number, as far as a driver may be off.
fn iso_is_well_normal(exponent: u32) -> bool {
    return exponent - 2u < 252u;
}

// 1 for a power of two: the float below is half as far away as that above.
fn iso_closer_below(bits: u32) -> u32 {
    return u32((bits & 0x7fffffu) == 0u);
}

fn iso_nearest_quotient(a: f32, b: f32, from_driver: f32) -> f32 {
    let n = bitcast<u32>(a);
    let d = bitcast<u32>(b);
    var q = bitcast<u32>(from_driver);
    if iso_exponent_of(d) > 252u {
        // By divisors from 2¹²⁶ on a driver may give anything.
        q = bitcast<u32>((a * 0.25) / (b * 0.25));
    }
    if iso_is_normal(iso_exponent_of(n)) && iso_is_normal(iso_exponent_of(d)) && iso_is_well_normal(iso_exponent_of(q)) {
        for (var i = 0u; i < ISO_MOST_OFF; i++) {
            let shift = iso_exponent_of(n) + 150u - iso_exponent_of(d) - iso_exponent_of(q);
            // Twice what is left, beside the divisor: no quotient of floats lies in the middle of two.
            let left = bitcast<i32>(((iso_digits_of(n) << shift) - iso_digits_of(q) * iso_digits_of(d)) << 1u);
            let unit = bitcast<i32>(iso_digits_of(d));
            if left > -(unit >> iso_closer_below(q)) && left < unit {
                break;
            }
            q += select(0xffffffffu, 1u, left > 0);
        }
    }
    return bitcast<f32>(q);
}

fn iso_nearest_root(x: f32, from_driver: f32) -> f32 {
    let n = bitcast<u32>(x);
    var s = bitcast<u32>(from_driver);
    if iso_is_normal(n >> 23u) && iso_is_normal(s >> 23u) {
        for (var i = 0u; i < ISO_MOST_OFF; i++) {
            let digits = iso_digits_of(s);
            let left = bitcast<i32>((iso_digits_of(n) << (iso_exponent_of(n) + 150u - 2u * iso_exponent_of(s))) - digits * digits);
            // (s + 1/2)² is s² + s + 1/4.
            if left > -(bitcast<i32>(digits) >> iso_closer_below(s)) && left <= bitcast<i32>(digits) {
                break;
            }
            s += select(0xffffffffu, 1u, left > 0);
        }
    }
    return bitcast<f32>(s);
}
