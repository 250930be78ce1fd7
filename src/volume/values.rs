//! The samples of a volume in memory, in the type that its file has them in.

use super::decode::Scalar;
use crate::memory;
use bytemuck::Pod;
use rayon::prelude::*;
use std::ops::Range;

/// A type that samples are kept in. Each of its values is the same number as `f32`, and all stages work on that number:
/// a volume's mesh does not depend on the type that its samples are kept in.
pub trait Sample: Pod + PartialOrd + Send + Sync {
    /// The type, by name.
    const SCALAR: Scalar;
    /// Not over any sample, NaN aside.
    const LOWEST: Self;
    /// Not under any sample, NaN aside.
    const HIGHEST: Self;
    /// Whether all samples are finite, whatever their bits.
    const ALWAYS_FINITE: bool;

    /// The sample as a number.
    fn to_f32(self) -> f32;
}

macro_rules! whole_samples {
    ($($type:ty, $scalar:ident;)*) => {$(
        impl Sample for $type {
            const SCALAR: Scalar = Scalar::$scalar;
            const LOWEST: Self = Self::MIN;
            const HIGHEST: Self = Self::MAX;
            const ALWAYS_FINITE: bool = true;

            #[inline(always)]
            fn to_f32(self) -> f32 {
                f32::from(self)
            }
        }
    )*};
}

whole_samples! { u8, U8; i8, I8; u16, U16; i16, I16; }

impl Sample for f32 {
    const SCALAR: Scalar = Scalar::F32;
    const LOWEST: Self = Self::NEG_INFINITY;
    const HIGHEST: Self = Self::INFINITY;
    const ALWAYS_FINITE: bool = false;

    #[inline(always)]
    fn to_f32(self) -> f32 {
        self
    }
}

/// Samples, x fastest, then y, then z, in their own type. Files of other types, and those with a slope or an intercept,
/// become `f32`.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Unsigned, 1 byte.
    U8(Vec<u8>),
    /// Signed, 1 byte.
    I8(Vec<i8>),
    /// Unsigned, 2 bytes.
    U16(Vec<u16>),
    /// Signed, 2 bytes.
    I16(Vec<i16>),
    /// IEEE 754 single precision.
    F32(Vec<f32>),
}

/// Borrowed [`Values`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "as those of `Values`")]
pub enum Slice<'a> {
    U8(&'a [u8]),
    I8(&'a [i8]),
    U16(&'a [u16]),
    I16(&'a [i16]),
    F32(&'a [f32]),
}

/// Evaluates an expression for the samples of `Values` or a `Slice`, whatever their type.
macro_rules! each_type {
    ($kind:ident, $values:expr, $samples:ident => $body:expr) => {
        match $values {
            $kind::U8($samples) => $body,
            $kind::I8($samples) => $body,
            $kind::U16($samples) => $body,
            $kind::I16($samples) => $body,
            $kind::F32($samples) => $body,
        }
    };
}
pub(crate) use each_type;

impl Values {
    /// How many samples there are.
    pub fn len(&self) -> usize {
        each_type!(Self, self, samples => samples.len())
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The type of the samples: u8, i8, u16, i16 or f32.
    pub fn scalar(&self) -> Scalar {
        fn of<T: Sample>(_: &[T]) -> Scalar {
            T::SCALAR
        }
        each_type!(Self, self, samples => of(samples))
    }

    /// The samples as they lie in memory, in this machine's byte order.
    pub fn bytes(&self) -> &[u8] {
        each_type!(Self, self, samples => bytemuck::cast_slice(samples))
    }

    /// Sample `i` as a number; panics past the end.
    #[inline(always)]
    pub fn get(&self, i: usize) -> f32 {
        each_type!(Self, self, samples => samples[i].to_f32())
    }

    /// All samples as numbers, one after another.
    pub fn iter(&self) -> impl Iterator<Item = f32> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }

    /// A copy of all samples as `f32`.
    pub fn to_f32(&self) -> Vec<f32> {
        let mut numbers = memory::zeroed(self.len());
        numbers.par_chunks_mut(CHUNK).enumerate().for_each(|(i, numbers)| {
            let range = CHUNK * i..CHUNK * i + numbers.len();
            self.as_slice().range(range).write_f32(numbers);
        });
        numbers
    }

    /// All samples, borrowed.
    #[inline(always)]
    pub fn as_slice(&self) -> Slice<'_> {
        match self {
            Self::U8(samples) => Slice::U8(samples),
            Self::I8(samples) => Slice::I8(samples),
            Self::U16(samples) => Slice::U16(samples),
            Self::I16(samples) => Slice::I16(samples),
            Self::F32(samples) => Slice::F32(samples),
        }
    }

    /// The lowest and the highest finite sample; `None` if none is finite.
    pub fn finite_range(&self) -> Option<(f32, f32)> {
        fn of<T: Sample>(samples: &[T]) -> (f32, f32) {
            let none = || (f32::INFINITY, f32::NEG_INFINITY);
            let join = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
            let chunk = |chunk: &[T]| {
                let finite = chunk.iter().map(|v| v.to_f32()).filter(|v| v.is_finite());
                finite.fold(none(), |range, v| join(range, (v, v)))
            };
            samples.par_chunks(CHUNK).map(chunk).reduce(none, join)
        }
        let (low, high) = each_type!(Self, self, samples => of(samples));
        (low <= high).then_some((low, high))
    }

    /// How many samples are NaN or infinite.
    pub fn non_finite_count(&self) -> u64 {
        let Self::F32(samples) = self else { return 0 };
        let odd = |chunk: &[f32]| chunk.iter().filter(|v| !v.is_finite()).count() as u64;
        samples.par_chunks(CHUNK).map(odd).sum()
    }
}

/// Samples that one task looks at.
const CHUNK: usize = 1 << 16;

impl<'a> Slice<'a> {
    /// These of the samples; panics where there are none.
    #[inline(always)]
    #[must_use]
    pub fn range(self, range: Range<usize>) -> Slice<'a> {
        match self {
            Self::U8(samples) => Self::U8(&samples[range]),
            Self::I8(samples) => Self::I8(&samples[range]),
            Self::U16(samples) => Self::U16(&samples[range]),
            Self::I16(samples) => Self::I16(&samples[range]),
            Self::F32(samples) => Self::F32(&samples[range]),
        }
    }

    /// How many samples there are.
    #[inline(always)]
    pub fn len(self) -> usize {
        each_type!(Self, self, samples => samples.len())
    }

    /// Whether there is none.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Sample `i` as a number; panics past the end.
    #[inline(always)]
    pub fn get(self, i: usize) -> f32 {
        each_type!(Self, self, samples => samples[i].to_f32())
    }

    /// Writes as many samples as there are numbers, from the first on.
    pub fn write_f32(self, numbers: &mut [f32]) {
        each_type!(Self, self, samples => {
            for (number, sample) in numbers.iter_mut().zip(samples) {
                *number = sample.to_f32();
            }
        });
    }
}

macro_rules! from_vectors {
    ($($variant:ident, $type:ty;)*) => {$(
        impl From<Vec<$type>> for Values {
            fn from(samples: Vec<$type>) -> Self {
                Self::$variant(samples)
            }
        }
    )*};
}

from_vectors! { U8, u8; I8, i8; U16, u16; I16, i16; F32, f32; }
