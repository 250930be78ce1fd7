//! What the trilinear interpolant of a cell's corners does where the corners alone do not say; the twin of
//! `shaders/shared/trilinear.wgsl`.
//!
//! Theory: the asymptotic decider (Nielson & Hamann 1991) on faces. Within the cell, Chernyaev's look (1995) at the slices
//! across one axis: corners A, B, C, D around a slice are linear in its height, and where A and C lie on one side of iso and
//! B and D on the other, the sign of A C − B D says which pair is joined in that slice. A pair that no border of
//! such a run of slices joins is joined within it (a tunnel) if that quadratic has both of its roots there.
//! Practice: signs are those of the inside test, magnitudes |sample − iso|; all products are compared exactly, in whole
//! numbers, so that every driver decides the same and both cells of a face do. A sample equal to iso is outside by the
//! least number there is; one that is not finite, by the largest. The interpolant meant is that of the differences as `f32` has them; what
//! of a cell's differences is less than 2⁻²⁹ of the largest does not count for tunnels (for faces it does).

use super::inside::Inside;
use super::samples::Samples;
use crate::table::mc33::{Entry, FACE_CORNERS, MC33, Tunnel};

/// The magnitude of what is less.
const LEAST: u32 = 0x0080_0000;
/// The magnitude of what is more.
const MOST: u32 = 0x7f7f_ffff;

/// The corners of a cell: which are inside, and how far from iso, as bits of a normal float above 0.
#[derive(Debug, Clone, Copy)]
pub struct Corners {
    case: u8,
    magnitudes: [u32; 8],
}

impl Corners {
    /// Of a cell with these samples.
    pub fn new(iso: f32, inside: Inside, samples: [f32; 8]) -> Self {
        let case = (0..8).fold(0, |case, k| case | u8::from(inside.test(samples[k])) << k);
        Self { case, magnitudes: samples.map(|sample| magnitude(iso, sample)) }
    }

    /// Of the cell whose lowest corner is point (x, y, z) of a brick.
    pub fn of_cell(iso: f32, inside: Inside, samples: &Samples<'_>, cell: [usize; 3]) -> Self {
        Self::new(iso, inside, samples.of_cell(cell))
    }

    /// The entry of the table, if the cell's is a case that the corners do not decide.
    pub fn undecided(&self) -> Option<Entry<'static>> {
        (!MC33.is_decided(self.case)).then(|| self.entry())
    }

    /// The entry of the table for a cell of a case that the corners do not decide.
    pub fn entry(&self) -> Entry<'static> {
        MC33.entry(self.case, |face| self.joins_inside(face), |faces| self.tunnel(faces))
    }

    /// Whether a corner is inside.
    pub fn is_inside(&self, corner: u8) -> bool {
        self.case >> corner & 1 == 1
    }

    /// Whether the inside corners of an ambiguous face are joined on it.
    pub fn joins_inside(&self, face: usize) -> bool {
        let [a, b, c, d] = FACE_CORNERS[face];
        let product =
            |a: u8, b: u8| product(self.magnitudes[usize::from(a)], self.magnitudes[usize::from(b)]);
        let (first, second) = (product(a, c), product(b, d));
        if self.is_inside(a) { first > second } else { second > first }
    }

    /// Whether there is a tunnel, where `faces` says of each ambiguous face whether its inside corners are joined.
    pub fn tunnel(&self, faces: u32) -> Tunnel {
        let fixed = self.fixed();
        // The lines along z: their ends, below and above.
        let lines = FACE_CORNERS[4].map(|corner| [corner, corner + 4]);
        let ends = lines.map(|line| line.map(|corner| fixed[usize::from(corner)]));
        let polar = |i: usize, j: usize| ends[0][i] * ends[2][j] - ends[1][i] * ends[3][j];
        // A C - B D at the height t / (1 + t), times (1 + t)²: low + middle t + high t².
        let (low, middle, high) = (polar(0, 0), polar(0, 1) + polar(1, 0), polar(1, 1));
        let real = i128::from(middle).pow(2) > 4 * i128::from(low) * i128::from(high);
        for pattern in 0..2 {
            // The run of slices where A and C are inside (or outside: the other pattern) and B and D are not, as fractions:
            // heights at which the last line comes to its side, and the first leaves it.
            let (mut begin, mut end) = ([0, 1], [1, 0]);
            let (mut begin_line, mut end_line) = (None, None);
            let mut exists = true;
            for i in 0..4 {
                let [below, above] = lines[i].map(|corner| self.is_inside(corner) == (i % 2 == pattern));
                let at = ends[i].map(i64::abs);
                exists &= below | above;
                if !below && at[0] * begin[1] > begin[0] * at[1] {
                    (begin, begin_line) = (at, Some(i));
                }
                if !above && at[0] * end[1] < end[0] * at[1] {
                    (end, end_line) = (at, Some(i));
                }
            }
            if !exists || begin[0] * end[1] >= end[0] * begin[1] {
                continue;
            }
            // Whether A and C are joined at the border: by a face's decision, or since B or D is just iso.
            let joined = |line: Option<usize>, face: u32| match line {
                Some(i) => i % 2 == 1,
                None => (faces >> face & 1 == 1) == (pattern == 0),
            };
            let first = joined(begin_line, 4);
            if first != joined(end_line, 5) || !real {
                continue;
            }
            let slope = |at: [i64; 2]| {
                let slope = i128::from(middle) * i128::from(at[1]) + 2 * i128::from(high) * i128::from(at[0]);
                slope.signum() * if first { 1 } else { -1 }
            };
            if slope(begin) < 0 && slope(end) > 0 {
                // The other pair is joined in between.
                return if first == (pattern == 0) { Tunnel::Outside } else { Tunnel::Inside };
            }
        }
        Tunnel::None
    }

    /// The corners as whole numbers below 2³⁰, of one scale; outside corners below 0.
    fn fixed(&self) -> [i64; 8] {
        let most = self.magnitudes.into_iter().fold(0, u32::max) >> 23;
        let mut fixed = [0; 8];
        for (k, number) in fixed.iter_mut().enumerate() {
            let bits = self.magnitudes[k];
            let size = ((mantissa(bits) << 6) >> (most - (bits >> 23)).min(31)).max(1);
            *number = if self.is_inside(k as u8) { i64::from(size) } else { -i64::from(size) };
        }
        fixed
    }
}

fn magnitude(iso: f32, sample: f32) -> u32 {
    let bits = (sample - iso).abs().to_bits();
    if !sample.is_finite() { MOST } else { bits.clamp(LEAST, MOST) }
}

fn mantissa(bits: u32) -> u32 {
    bits & 0x007f_ffff | 0x0080_0000
}

/// The exact product of two magnitudes, in a form that orders as it does: exponent, and 48 bits.
fn product(a: u32, b: u32) -> (u32, u64) {
    let exponent = (a >> 23) + (b >> 23);
    let digits = u64::from(mantissa(a)) * u64::from(mantissa(b));
    if digits >> 47 == 1 { (exponent + 1, digits) } else { (exponent, digits << 1) }
}
