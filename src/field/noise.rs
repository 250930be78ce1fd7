//! Gradient noise; the twin of `shaders/shared/noise.wgsl`, same bits, by the rules of [`super::functions`].
//!
//! Perlin's: at each point of the integer lattice a gradient along one of the twelve directions from the
//! centre of a cube to its edges, chosen by a hash; in between the eight gradients of a cell, each a linear
//! function, mixed by quintic weights. Twice differentiable, zero at the lattice points.

/// Noise lies within ± this: the mix has no value above 1.0364 before `SCALE`, whichever the gradients.
pub const NOISE_BOUND: f32 = 1.0;

/// The length of its gradient is at most this, and so is its change per unit: 3.75 before `SCALE`, in the
/// centre of a cell, and the rest for what is only proven.
pub const NOISE_SLOPE: f32 = 3.7;

/// Brings the mix within ± 1.
const SCALE: f32 = 0.96;

/// Noise is zero from this coordinate on: there is no fraction left of it.
const FAR: u32 = 0x4a80_0000;
const SIGN: u32 = 0x8000_0000;
const ONE: u32 = 0x3f80_0000;

/// A value and its derivatives along x, y and z.
type Jet = [f32; 4];

/// A bijection in which each bit of a number changes each bit of the result every other time (lowbias32).
#[inline(always)]
fn mixed(mut h: u32) -> u32 {
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// What lies between a coordinate and its cell: the coordinate's number on the lattice, what is over, the weight
/// of the cell's far side, and the slope of the weight.
#[inline(always)]
fn placed(x: f32) -> (u32, f32, f32, f32) {
    // A driver may take a denormal number for zero, which lies in another cell if it is negative.
    let x = if x.to_bits() & !SIGN < 0x0080_0000 { 0.0 } else { x };
    let cell = x.floor();
    let t = x - cell;
    // 1.5 · 2^23: the sum has the whole number in its last bits.
    let number = (cell + 12_582_912.0).to_bits();
    (number, t, (t * t * t) * (t * (t * 6.0 - 15.0) + 10.0), (t * t) * (t * (t * 30.0 - 60.0) + 30.0))
}

/// The linear function of the lattice point with the hash `h` at `x`, `y`, `z` from it.
#[inline(always)]
fn corner(h: u32, x: f32, y: f32, z: f32) -> Jet {
    const THIRD: i32 = 715_827_882;
    let h = mixed(h);
    // The axis that the gradient is perpendicular to: x, y or z, as `h` is low, middle or high.
    let (low, high) = ((h as i32) < -THIRD, (h as i32) > THIRD);
    let (first_sign, second_sign) = (h << 31, (h << 30) & SIGN);
    let first = f32::from_bits(if low { y } else { x }.to_bits() ^ first_sign);
    let second = f32::from_bits(if high { y } else { z }.to_bits() ^ second_sign);
    let (along_first, along_second) = (f32::from_bits(ONE | first_sign), f32::from_bits(ONE | second_sign));
    let along_y = if high { along_second } else { 0.0 };
    [
        first + second,
        if low { 0.0 } else { along_first },
        if low { along_first } else { along_y },
        if high { 0.0 } else { along_second },
    ]
}

/// The mix of `a` and `b` by a weight that depends on one coordinate.
#[inline(always)]
fn mix<const AXIS: usize>(a: Jet, b: Jet, weight: f32, slope: f32) -> Jet {
    let mut r = [0, 1, 2, 3].map(|k| a[k] + weight * (b[k] - a[k]));
    r[1 + AXIS] += slope * (b[0] - a[0]);
    r
}

/// Noise at a point, from -1 to 1, error at most 3e-6; zero where a coordinate is 2^22 or more, NaN where one is
/// NaN.
#[inline(always)]
pub fn noise(p: [f32; 3], seed: u32) -> f32 {
    noise_gradient(p, seed)[0]
}

/// Noise at a point, the same bits, and its derivatives along x, y and z, error at most 1e-5.
#[inline(always)]
pub fn noise_gradient([x, y, z]: [f32; 3], seed: u32) -> [f32; 4] {
    const PRIMES: [u32; 3] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d];
    let magnitudes = [x, y, z].map(|c| c.to_bits() & !SIGN);
    let ((i, x0, u, du), (j, y0, v, dv), (k, z0, w, dw)) = (placed(x), placed(y), placed(z));
    let (x1, y1, z1) = (x0 - 1.0, y0 - 1.0, z0 - 1.0);
    let [i0, j0, k0] = [i.wrapping_mul(PRIMES[0]), j.wrapping_mul(PRIMES[1]), k.wrapping_mul(PRIMES[2])];
    let [i1, j1, k1] = [i0.wrapping_add(PRIMES[0]), j0.wrapping_add(PRIMES[1]), k0.wrapping_add(PRIMES[2])];
    // Mixed by itself, else seeds beside each other would have lattices beside each other.
    let seed = mixed(seed ^ 0x5bd1_e995);
    let edge = |jk: u32, y: f32, z: f32| {
        mix::<0>(corner(seed ^ jk ^ i0, x0, y, z), corner(seed ^ jk ^ i1, x1, y, z), u, du)
    };
    let near = mix::<1>(edge(j0 ^ k0, y0, z0), edge(j1 ^ k0, y1, z0), v, dv);
    let far = mix::<1>(edge(j0 ^ k1, y0, z1), edge(j1 ^ k1, y1, z1), v, dv);
    let jet = mix::<2>(near, far, w, dw);
    let outside = magnitudes.iter().fold(false, |o, &m| o | (m >= FAR));
    let is_nan = magnitudes.iter().fold(false, |o, &m| o | (m > 0x7f80_0000));
    jet.map(|value| {
        let value = value * SCALE;
        // 2^-60: what denormal numbers on the way there change.
        let value = if outside || value.to_bits() & !SIGN < 0x2180_0000 { 0.0 } else { value };
        if is_nan { f32::NAN } else { value }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::SQRT_2;

    /// The directions, as `corner` numbers them: zero axis, then signs.
    fn direction(h: u32) -> [f64; 3] {
        let sign = |bit: u32| if bit == 0 { 1.0 } else { -1.0 };
        let (first, second) = (sign(h & 1), sign(h >> 1 & 1));
        match h as i32 {
            i32::MIN..-715_827_882 => [0.0, first, second],
            -715_827_882..=715_827_882 => [first, 0.0, second],
            _ => [first, second, 0.0],
        }
    }

    /// The hash of a lattice point.
    fn hash(cell: [i32; 3], seed: u32) -> u32 {
        let primes = [2_654_435_761u32, 2_246_822_519, 3_266_489_917];
        let part = |k: usize| (0x4b40_0000 + cell[k]) as u32 as u64 * u64::from(primes[k]);
        mixed(mixed(seed ^ 0x5bd1_e995) ^ (part(0) ^ part(1) ^ part(2)) as u32)
    }

    /// The noise by its definition: eight gradients, weighted.
    fn by_definition(p: [f64; 3], seed: u32) -> f64 {
        let cell = p.map(f64::floor);
        let corner = |i: usize| {
            let far = [0, 1, 2].map(|k| i >> k & 1);
            let gradient = direction(hash([0, 1, 2].map(|k| cell[k] as i32 + far[k] as i32), seed));
            let term = |k: usize| gradient[k] * (p[k] - cell[k] - far[k] as f64);
            let side = |k: usize| if far[k] == 1 { p[k] - cell[k] } else { 1.0 - (p[k] - cell[k]) };
            (0..3).map(term).sum::<f64>() * (0..3).map(|k| weight(side(k))[0]).product::<f64>()
        };
        f64::from(SCALE) * (0..8).map(corner).sum::<f64>()
    }

    /// Points spread over cells near the origin and farther ones, and seeds.
    fn points() -> impl Iterator<Item = ([f32; 3], u32)> {
        let part = |i: u32, k: u32, scale: f32| (mixed(3 * i + k) >> 8) as f32 / 8_388_608.0 * scale - scale;
        (0..60_000).map(move |i| {
            let scale = [1.0, 7.0, 300.0][i as usize % 3];
            ([0, 1, 2].map(|k| part(i, k, scale)), i / 5)
        })
    }

    #[test]
    fn value_and_gradient_by_the_definition() {
        let (mut value_error, mut gradient_error) = (0f64, 0f64);
        for (p, seed) in points() {
            let [value, gradient @ ..] = noise_gradient(p, seed);
            assert_eq!(value.to_bits(), noise(p, seed).to_bits());
            let exact = p.map(f64::from);
            value_error = value_error.max((f64::from(value) - by_definition(exact, seed)).abs());
            for k in 0..3 {
                let beside = |h: f64| {
                    let mut p = exact;
                    p[k] += h;
                    by_definition(p, seed)
                };
                let difference = (beside(1e-5) - beside(-1e-5)) / 2e-5;
                gradient_error = gradient_error.max((f64::from(gradient[k]) - difference).abs());
            }
            let length = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
            assert!(value.abs() <= NOISE_BOUND && length <= NOISE_SLOPE, "{value}, {gradient:?} at {p:?}");
        }
        println!("errors: {value_error:.1e}, {gradient_error:.1e}");
        assert!(value_error < 3e-6, "{value_error}");
        assert!(gradient_error < 1e-5, "{gradient_error}");
    }

    #[test]
    fn outside_and_on_the_lattice() {
        for p in [[3.0, -2.0, 7.0], [0.0; 3], [-0.0; 3], [-1e-40, 0.0, 1e-40]] {
            assert_eq!(noise(p, 5).to_bits(), 0, "{p:?}");
        }
        for z in 0..9 {
            assert_eq!(noise([1e-30, 0.0, z as f32], 5).to_bits(), 0, "{z}");
        }
        for far in [4_194_304.0, -4_194_304.0, 1e30, f32::INFINITY] {
            assert_eq!(noise_gradient([0.3, far, 0.2], 5), [0.0; 4]);
            assert!(noise([far, f32::NAN, 0.2], 5).is_nan());
        }
        assert_ne!(noise([4_194_303.5, -4_194_303.5, 0.25], 5), 0.0);
    }

    /// Goes red without the second product of `mixed`.
    #[test]
    fn directions_are_even_and_independent() {
        const N: u32 = 24 * 24 * 24;
        let number = |h: u32| (h as i32 >= -715_827_882) as usize + (h as i32 > 715_827_882) as usize;
        let kind = |h: u32| 4 * number(h) + (h & 3) as usize;
        let cells = || (0..N as i32).map(|i| [i % 24 - 12, i / 24 % 24 - 12, i / 576 - 12]);
        for seed in [0, 1, 2, u32::MAX] {
            // Against the neighbour along each axis, the diagonal one, and the same cell of the next seed.
            let others = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 1, 1, 0], [0, 0, 0, 1]];
            for [x, y, z, s] in others {
                let mut pairs = [0.0f64; 144];
                for c in cells() {
                    let other = hash([c[0] + x, c[1] + y, c[2] + z], seed.wrapping_add_signed(s));
                    pairs[12 * kind(hash(c, seed)) + kind(other)] += 1.0;
                }
                let expected = f64::from(N) / 144.0;
                let chi = pairs.iter().map(|n| (n - expected).powi(2) / expected).sum::<f64>();
                // 143 degrees of freedom: 225 is five deviations.
                assert!(chi < 225.0, "chi² {chi:.0}: seed {seed} against {:?}", [x, y, z, s]);
            }
        }
    }

    /// From least to most.
    type Interval = [f64; 2];

    fn sum(a: Interval, b: Interval) -> Interval {
        [a[0] + b[0], a[1] + b[1]]
    }

    fn product(a: Interval, b: Interval) -> Interval {
        let p = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
        [p.into_iter().fold(f64::INFINITY, f64::min), p.into_iter().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// The weight of a cell's far side and its slope.
    fn weight(t: f64) -> [f64; 2] {
        [t.powi(3) * (t * (t * 6.0 - 15.0) + 10.0), 30.0 * (t * (1.0 - t)).powi(2)]
    }

    /// Weight, slope and distance of one side of a cell while the place along an axis is within `t`.
    fn side([low, high]: Interval, far: bool) -> [Interval; 3] {
        let ([w0, s0], [w1, s1]) = (weight(low), weight(high));
        let most = if low < 0.5 && high > 0.5 { 1.875 } else { s0.max(s1) };
        let least = s0.min(s1);
        if far {
            [[w0, w1], [least, most], [low - 1.0, high - 1.0]]
        } else {
            [[1.0 - w1, 1.0 - w0], [-most, -least], [low, high]]
        }
    }

    /// The most that one of the twelve gradients makes of a vector.
    fn most_of(v: [Interval; 3]) -> f64 {
        let a = v.map(|i| i[0].abs().max(i[1].abs()));
        a[0] + a[1] + a[2] - a[0].min(a[1]).min(a[2])
    }

    /// No more than the mix has anywhere in a box within a cell, whichever the gradients of the corners are;
    /// and no more than the component of its gradient along `u`, given one.
    fn most_in(cell: [Interval; 3], u: Option<[f64; 3]>) -> f64 {
        let sides = cell.map(|t| [side(t, false), side(t, true)]);
        let corner = |i: usize| {
            let [x, y, z] = [0, 1, 2].map(|k| sides[k][i >> k & 1]);
            let w = product(product(x[0], y[0]), z[0]);
            let d = [x[2], y[2], z[2]];
            let Some(u) = u else { return w[1] * most_of(d) };
            let slopes = [
                product(x[1], product(y[0], z[0])),
                product(y[1], product(x[0], z[0])),
                product(z[1], product(x[0], y[0])),
            ];
            let along = |k: usize, i: Interval| product([u[k]; 2], i);
            let slope = sum(sum(along(0, slopes[0]), along(1, slopes[1])), along(2, slopes[2]));
            most_of([0, 1, 2].map(|k| sum(along(k, w), product(slope, d[k]))))
        };
        (0..8).map(corner).sum()
    }

    /// Cuts a box until each part of it is proven for each of `all`; returns how many parts that took.
    fn prove<T: Copy>(cell: [Interval; 3], all: &[T], proven: &impl Fn([Interval; 3], T) -> bool) -> usize {
        let left: Vec<T> = all.iter().copied().filter(|&item| !proven(cell, item)).collect();
        if left.is_empty() {
            return 1;
        }
        assert!(cell[0][1] - cell[0][0] > 1e-4, "not below the bound in {cell:?}");
        let half = |k: usize, upper: usize| {
            let middle = 0.5 * (cell[k][0] + cell[k][1]);
            if upper == 0 { [cell[k][0], middle] } else { [middle, cell[k][1]] }
        };
        (0..8).map(|i| prove([0, 1, 2].map(|k| half(k, i >> k & 1)), &left, proven)).sum()
    }

    /// A cell is the same from each of its corners.
    const OCTANT: [Interval; 3] = [[0.0, 0.5]; 3];

    /// What rounding may add, and more.
    const ROUNDING: f64 = 1e-5;

    #[test]
    fn no_value_is_above_the_bound() {
        let bound = f64::from(NOISE_BOUND) / f64::from(SCALE) - ROUNDING;
        let parts = prove(OCTANT, &[()], &|cell, ()| most_in(cell, None) < bound);
        println!("{parts} parts");
    }

    #[test]
    fn no_gradient_is_longer_than_the_bound() {
        // What bounds the components along the corners of a patch of directions bounds those within, but for
        // the cosine of the angle from the middle of the patch to its corners.
        const N: i32 = 12;
        let step = 2.0 / f64::from(N);
        let cosine = (0.5 * SQRT_2 * step).atan().cos();
        let bound = (f64::from(NOISE_SLOPE) / f64::from(SCALE) - ROUNDING) * cosine;
        let mut directions = Vec::new();
        for axis in 0..3 {
            for (i, j) in (0..=N).flat_map(|i| (0..=N).map(move |j| (i, j))) {
                let mut u = [1.0, f64::from(i) * step - 1.0, f64::from(j) * step - 1.0];
                let length = u.iter().map(|c| c * c).sum::<f64>().sqrt();
                u.rotate_right(axis);
                directions.push(u.map(|c| c / length));
            }
        }
        let parts = prove(OCTANT, &directions, &|cell, u| most_in(cell, Some(u)) < bound);
        println!("{parts} parts");
    }
}
