// Quotients and roots rounded to the nearest float, from what a driver makes of them, for src/gpu/exact.rs. What is off is told by what is
// left: of a quotient n - q d, of a root x - s², in whole numbers; these are small, so that their lowest 32 bits are enough. Where a number is zero,
// denormal, infinite or NaN, it stays as the driver has it.

// Floats that a driver may be off: by 2.5 units in the last place of quotients; of roots, which are 1 by an inverse root that is off by 2
// itself, 7. Below a power of two a unit is two floats.
const ISO_MOST_OFF = 16u;

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

// What is left of a quotient, twice, in units of the divisor's digits: none lies in the middle of two floats.
fn iso_left_of_quotient(n: u32, d: u32, q: u32) -> i32 {
    let shift = iso_exponent_of(n) + 150u - iso_exponent_of(d) - iso_exponent_of(q);
    return bitcast<i32>(((iso_digits_of(n) << shift) - iso_digits_of(q) * iso_digits_of(d)) << 1u);
}

// What is left of a root, in units of its digits: (s + 1/2)² is s² + s + 1/4.
fn iso_left_of_root(n: u32, s: u32) -> i32 {
    let digits = iso_digits_of(s);
    return bitcast<i32>((iso_digits_of(n) << (iso_exponent_of(n) + 150u - 2u * iso_exponent_of(s))) - digits * digits);
}

// From `here`, of which so much is left, towards the nearest float: 1, 0, or -1.
fn iso_step(left: i32, digits: u32, here: u32) -> u32 {
    let unit = bitcast<i32>(digits);
    return u32(left > unit) - u32(left <= -(unit >> iso_closer_below(here)));
}

// Whether one step may not be enough, as it may not be at a power of two or just above. Drivers are seldom further off, and where no
// invocation is, none waits for the loops below.
fn iso_is_far(left: i32, digits: u32, here: u32) -> bool {
    return abs(left) > bitcast<i32>(3u * digits - 3u) || (here & 0x7fffffu) <= 1u;
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
        let digits = iso_digits_of(d);
        let left = iso_left_of_quotient(n, d, q);
        let is_far = iso_is_far(left, digits, q);
        var step = iso_step(left, digits, q);
        q += step;
        for (var i = 1u; i < ISO_MOST_OFF && is_far && step != 0u; i++) {
            step = iso_step(iso_left_of_quotient(n, d, q), digits, q);
            q += step;
        }
    }
    return bitcast<f32>(q);
}

fn iso_nearest_root(x: f32, from_driver: f32) -> f32 {
    let n = bitcast<u32>(x);
    var s = bitcast<u32>(from_driver);
    if iso_is_normal(n >> 23u) && iso_is_normal(s >> 23u) {
        let left = iso_left_of_root(n, s);
        let is_far = iso_is_far(left, iso_digits_of(s), s);
        var step = iso_step(left, iso_digits_of(s), s);
        s += step;
        for (var i = 1u; i < ISO_MOST_OFF && is_far && step != 0u; i++) {
            step = iso_step(iso_left_of_root(n, s), iso_digits_of(s), s);
            s += step;
        }
    }
    return bitcast<f32>(s);
}
