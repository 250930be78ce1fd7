//! Quotients and roots by `shaders/shared/nearest.wgsl`, which a real GPU's division only comes near to.

use super::{check_on, common};
use common::Random;
use isoforge::gpu::{Form, Gpu};

/// A device for which isoforge rounds quotients and roots itself.
fn gpu() -> Option<Gpu> {
    common::gpu().and_then(|gpu| gpu.with_form(Form::Shared))
}

/// As many units in the last place away as Vulkan lets a driver be.
fn off(value: f32, units: i32) -> f32 {
    f32::from_bits(value.to_bits().wrapping_add_signed(units))
}

/// Numbers whose last bits matter: any digits, few digits, and those beside a power of two, of exponents between -`reach` and it.
fn numbers(mut random: Random, reach: usize) -> impl FnMut() -> f32 {
    move || {
        let bits = random.next() as u32;
        let digits = match bits >> 30 {
            0 => bits & 0x7f_ffff,
            1 => (bits & 0xff) << 15,
            2 => bits & 3,
            _ => 0x7f_ffff - (bits & 3),
        };
        let exponent = 127 - reach + random.below(2 * reach + 1);
        f32::from_bits(((bits & 1) << 31) | ((exponent as u32) << 23) | digits)
    }
}

/// Goes red when quotients are corrected once alone, in the wrong direction, or not at the next power of two.
#[test]
fn quotients_are_the_nearest_whatever_the_driver_makes_of_them() {
    let Some(gpu) = gpu() else { return };
    let mut next = numbers(Random(31), 60);
    let operands: Vec<[f32; 4]> = (0..200_000)
        .map(|i| {
            let (a, b) = (next(), next());
            [a, b, off(a / b, i % 7 - 3), 0.0]
        })
        .collect();
    check_on(&gpu, "", "quotients", "iso_nearest_quotient(o.x, o.y, o.z)", &operands, |o| [o[0] / o[1]]);
}

/// Goes red when large divisors are left to the driver, which may give 0.
#[test]
fn quotients_by_large_divisors_are_the_nearest() {
    let Some(gpu) = gpu() else { return };
    let mut next = numbers(Random(33), 1);
    let operands: Vec<[f32; 4]> = (0..10_000)
        .map(|_| {
            let (a, b) = (next() * f32::exp2(120.0), next() * f32::exp2(126.0));
            let from_driver = if b.abs() < f32::exp2(126.0) { a / b } else { 0.0 };
            [a, b, from_driver, 0.0]
        })
        .collect();
    check_on(&gpu, "", "quotients", "iso_nearest_quotient(o.x, o.y, o.z)", &operands, |o| [o[0] / o[1]]);
}

/// Goes red as the quotients do.
#[test]
fn roots_are_the_nearest_whatever_the_driver_makes_of_them() {
    let Some(gpu) = gpu() else { return };
    let mut next = numbers(Random(32), 120);
    let operands: Vec<[f32; 4]> = (0..200_000)
        .map(|i| {
            let x = next().abs();
            // Units above a power of two are twice the floats below.
            let units = i % 15 - 7;
            let beside_a_power = x.sqrt().to_bits() & 0x7f_ffff < 16;
            [x, off(x.sqrt(), if beside_a_power { 2 * units } else { units }), 0.0, 0.0]
        })
        .collect();
    check_on(&gpu, "", "roots", "iso_nearest_root(o.x, o.y)", &operands, |o| [o[0].sqrt()]);
}

/// What has no nearest float to look for stays as the driver has it.
#[test]
fn what_is_not_normal_stays() {
    let Some(gpu) = gpu() else { return };
    let odd = [
        0.0,
        -0.0,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        1e-40,
        f32::MIN_POSITIVE,
        f32::MAX,
        1.0,
        -2.0,
    ];
    let operands: Vec<[f32; 4]> = odd.iter().flat_map(|&a| odd.map(|b| [a, b, a / b, a.sqrt()])).collect();
    check_on(&gpu, "", "quotients", "iso_nearest_quotient(o.x, o.y, o.z)", &operands, |o| [o[2]]);
    check_on(&gpu, "", "roots", "iso_nearest_root(o.x, o.w)", &operands, |o| [o[3]]);
}
