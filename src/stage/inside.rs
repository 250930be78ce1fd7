//! The one inside test and its tie rule; the twin of `shaders/shared/inside.wgsl`.
//!
//! A sample is inside when it is finite and strictly on the inner side of iso. A sample equal to iso
//! is outside, and so are NaN and both infinities.

use crate::field::Sense;
use crate::volume::Sample;
use wide::f32x8;

/// A number that orders as the float with these bits does; −0 is +0.
#[inline(always)]
pub fn order_key(bits: u32) -> u32 {
    let b = if bits == 0x8000_0000 { 0 } else { bits };
    if b >> 31 == 1 { !b } else { b | 0x8000_0000 }
}

/// The float whose [`order_key`] is `key`.
pub fn from_order_key(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 { key & 0x7fff_ffff } else { !key })
}

/// The inside test for one iso value: a closed interval of floats, which NaN is never in.
#[derive(Debug, Clone, Copy)]
pub struct Inside {
    low: f32,
    high: f32,
}

impl Inside {
    /// The test for `iso`.
    pub fn new(iso: f32, sense: Sense) -> Self {
        match sense {
            Sense::Below => Self { low: f32::MIN, high: iso.next_down() },
            Sense::Above => Self { low: iso.next_up(), high: f32::MAX },
        }
    }

    /// Whether a sample is inside.
    #[inline(always)]
    pub fn test(self, value: f32) -> bool {
        self.low <= value && value <= self.high
    }

    /// Bit `i` tells whether `row[i]` is inside; at most 16 samples.
    #[inline(always)]
    pub fn row<T: Sample>(self, row: &[T]) -> u32 {
        let Some((eight, rest)) = row.split_first_chunk() else { return self.each(row) };
        self.eight(eight) | self.each(rest) << 8
    }

    #[inline(always)]
    fn eight<T: Sample>(self, samples: &[T; 8]) -> u32 {
        let mut values = [0.0; 8];
        for i in 0..8 {
            values[i] = samples[i].to_f32();
        }
        let values = f32x8::new(values);
        (values.simd_ge(f32x8::splat(self.low)) & values.simd_le(f32x8::splat(self.high))).to_bitmask()
    }

    #[inline(always)]
    fn each<T: Sample>(self, row: &[T]) -> u32 {
        row.iter().enumerate().fold(0, |bits, (i, sample)| bits | u32::from(self.test(sample.to_f32())) << i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shader's form of the test.
    fn by_ranks(bits: u32, iso: f32, sense: Sense) -> bool {
        let rank = |bits: u32| {
            let turned = if sense == Sense::Above { bits ^ 0x8000_0000 } else { bits };
            if turned >> 31 == 1 { 0xff7f_ffffu32.wrapping_sub(turned) } else { 0x7f7f_ffff + turned }
        };
        let key = order_key(iso.to_bits()) ^ if sense == Sense::Above { u32::MAX } else { 0 };
        assert_eq!(key - 0x80_0000 - (key >> 31), rank(iso.to_bits()), "{iso}");
        rank(bits) < rank(iso.to_bits())
    }

    #[test]
    fn interval_and_ranks_agree() {
        let tiny = f32::from_bits(1);
        let mut values = vec![0.0, -0.0, tiny, -tiny, 1.0, -1.0, f32::MIN_POSITIVE, f32::MAX, f32::MIN];
        values.extend([f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN, f32::from_bits(0x7f80_0001)]);
        values.extend((0..2000u32).map(|i| f32::from_bits(i.wrapping_mul(0x9e37_79b9))));
        for &iso in values.iter().filter(|v| v.is_finite()).take(200) {
            for sense in [Sense::Below, Sense::Above] {
                let inside = Inside::new(iso, sense);
                for &v in &values {
                    assert_eq!(
                        inside.test(v),
                        by_ranks(v.to_bits(), iso, sense),
                        "{v} against {iso}, {sense:?}"
                    );
                }
                assert!(!inside.test(iso), "a tie is outside");
                for row in values.windows(9) {
                    let bits = (0..9).filter(|&i| inside.test(row[i])).map(|i| 1 << i).sum::<u32>();
                    assert_eq!(inside.row(row), bits);
                    assert_eq!(inside.row(&row[..5]), bits & 31);
                }
            }
        }
        for &v in values.iter().filter(|v| !v.is_nan()) {
            assert_eq!(from_order_key(order_key(v.to_bits())), v);
        }
    }
}
