//! Bytes of a file to values in memory: the one place where every format's numbers are converted.

use super::error::OpenError;
use super::values::{Sample, Values, each_type};
use crate::memory;
use rayon::prelude::*;
use std::fmt;
use std::io::{self, Read};
use std::path::Path;
use std::str::FromStr;

/// The type of one stored value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scalar {
    /// Unsigned, 1 byte.
    U8,
    /// Signed, 1 byte.
    I8,
    /// Unsigned, 2 bytes.
    U16,
    /// Signed, 2 bytes.
    I16,
    /// Unsigned, 4 bytes.
    U32,
    /// Signed, 4 bytes.
    I32,
    /// IEEE 754 single precision.
    F32,
    /// IEEE 754 double precision.
    F64,
}

impl Scalar {
    /// Every scalar type, smallest first.
    pub const ALL: [Self; 8] =
        [Self::U8, Self::I8, Self::U16, Self::I16, Self::U32, Self::I32, Self::F32, Self::F64];

    /// Bytes that one value takes.
    pub const fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The short name: `u8`, `i8`, `u16`, `i16`, `u32`, `i32`, `f32` or `f64`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

impl fmt::Display for Scalar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that is no [`Scalar`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no scalar type: give u8, i8, u16, i16, u32, i32, f32 or f64")]
pub struct ParseScalarError(String);

impl FromStr for Scalar {
    type Err = ParseScalarError;

    /// Takes the short names and the common long ones (`uint8`, `float32`, `double`, ...), in
    /// either case.
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        Ok(match s.trim().to_ascii_lowercase().as_str() {
            "u8" | "uint8" | "uchar" | "byte" => Self::U8,
            "i8" | "int8" | "schar" => Self::I8,
            "u16" | "uint16" | "ushort" => Self::U16,
            "i16" | "int16" | "short" => Self::I16,
            "u32" | "uint32" | "uint" => Self::U32,
            "i32" | "int32" | "int" => Self::I32,
            "f32" | "float32" | "float" => Self::F32,
            "f64" | "float64" | "double" => Self::F64,
            _ => return Err(ParseScalarError(s.to_owned())),
        })
    }
}

/// The order of a value's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Endian {
    /// Lowest byte first.
    #[default]
    Little,
    /// Highest byte first.
    Big,
}

impl Endian {
    /// The byte order of this machine.
    pub(super) const NATIVE: Self = if cfg!(target_endian = "big") { Self::Big } else { Self::Little };
}

impl fmt::Display for Endian {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Little => "little",
            Self::Big => "big",
        })
    }
}

/// A name that is no [`Endian`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no byte order: give little or big")]
pub struct ParseEndianError(String);

impl FromStr for Endian {
    type Err = ParseEndianError;

    /// Takes `little`, `le`, `big` and `be`, in either case.
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        match s.trim().to_ascii_lowercase().as_str() {
            "little" | "le" => Ok(Self::Little),
            "big" | "be" => Ok(Self::Big),
            _ => Err(ParseEndianError(s.to_owned())),
        }
    }
}

/// How bytes stand for values: `value = stored * slope + intercept`, worked out in `f64`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coding {
    pub scalar: Scalar,
    pub endian: Endian,
    pub slope: f64,
    pub intercept: f64,
    /// Whether the values are text: of any range, and with fractions, whatever the type says.
    pub text: bool,
}

impl Coding {
    pub fn plain(scalar: Scalar, endian: Endian) -> Self {
        Self::scaled(scalar, endian, 1.0, 0.0)
    }

    pub fn scaled(scalar: Scalar, endian: Endian, slope: f64, intercept: f64) -> Self {
        Self { scalar, endian, slope, intercept, text: false }
    }

    fn is_plain(&self) -> bool {
        self.slope == 1.0 && self.intercept == 0.0
    }

    /// The type that such values are kept in.
    pub fn kept(&self) -> Scalar {
        match self.scalar {
            Scalar::U8 | Scalar::I8 | Scalar::U16 | Scalar::I16 if self.is_plain() && !self.text => {
                self.scalar
            }
            _ => Scalar::F32,
        }
    }

    /// No values yet, of the type that such values are kept in.
    pub fn none(&self) -> Values {
        match self.kept() {
            Scalar::U8 => Values::U8(Vec::new()),
            Scalar::I8 => Values::I8(Vec::new()),
            Scalar::U16 => Values::U16(Vec::new()),
            Scalar::I16 => Values::I16(Vec::new()),
            _ => Values::F32(Vec::new()),
        }
    }
}

/// What `f32` could not keep of the stored values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Loss {
    /// Values that are not the same number as `f32`.
    pub rounded: u64,
    /// Finite values that became infinite.
    pub overflowed: u64,
}

impl Loss {
    pub fn plus(self, other: Self) -> Self {
        Self { rounded: self.rounded + other.rounded, overflowed: self.overflowed + other.overflowed }
    }

    /// Converts one value and keeps the books.
    #[inline(always)]
    pub fn convert(&mut self, value: f64) -> f32 {
        let out = value as f32;
        // NaN differs from itself but loses nothing.
        self.rounded += u64::from(f64::from(out) != value && !value.is_nan());
        self.overflowed += u64::from(out.is_infinite() && value.is_finite());
        out
    }

    /// Tells the user. Rounding is worth a line only where the stored numbers themselves were
    /// exact: the result of a slope and intercept is rounded by nature.
    pub fn notes(&self, coding: &Coding, notes: &mut Vec<String>) {
        let scalar = coding.scalar;
        if self.overflowed > 0 {
            notes.push(format!("{} values are beyond the range of f32 and became infinite", self.overflowed));
        }
        if self.rounded > self.overflowed && coding.is_plain() {
            notes.push(match scalar {
                Scalar::F64 => "f64 values are rounded to f32".to_owned(),
                _ => format!("{scalar} values over 2^24 are rounded to f32 ({} of them)", self.rounded),
            });
        }
    }
}

/// Values that one task converts: large enough to pay for the task.
const TASK: usize = 1 << 16;

fn convert<const N: usize>(
    bytes: &[u8],
    out: &mut [f32],
    slope: f64,
    intercept: f64,
    number: impl Fn([u8; N]) -> f64 + Sync,
) -> Loss {
    let task = |(out, bytes): (&mut [f32], &[u8])| {
        let mut loss = Loss::default();
        for (out, bytes) in out.iter_mut().zip(bytes.as_chunks::<N>().0) {
            *out = loss.convert(number(*bytes) * slope + intercept);
        }
        loss
    };
    if out.len() <= TASK {
        return task((out, bytes));
    }
    out.par_chunks_mut(TASK).zip(bytes.par_chunks(TASK * N)).map(task).reduce(Loss::default, Loss::plus)
}

/// Decodes `out.len()` values from the start of `bytes`, which must hold that many.
fn decode(bytes: &[u8], coding: &Coding, out: &mut [f32]) -> Loss {
    debug_assert!(bytes.len() >= out.len() * coding.scalar.size());
    let Coding { scalar, endian, slope, intercept, .. } = *coding;
    macro_rules! with {
        ($t:ty) => {
            match endian {
                Endian::Little => {
                    convert(bytes, out, slope, intercept, |b| f64::from(<$t>::from_le_bytes(b)))
                }
                Endian::Big => convert(bytes, out, slope, intercept, |b| f64::from(<$t>::from_be_bytes(b))),
            }
        };
    }
    match scalar {
        Scalar::U8 => with!(u8),
        Scalar::I8 => with!(i8),
        Scalar::U16 => with!(u16),
        Scalar::I16 => with!(i16),
        Scalar::U32 => with!(u32),
        Scalar::I32 => with!(i32),
        Scalar::F32 => with!(f32),
        Scalar::F64 => with!(f64),
    }
}

/// Copies values that are kept in their own type, turning their bytes round where they are not this machine's.
fn copy<T: Sample>(bytes: &[u8], endian: Endian, out: &mut [T]) {
    let out: &mut [u8] = bytemuck::cast_slice_mut(out);
    out.copy_from_slice(&bytes[..out.len()]);
    if endian != Endian::NATIVE && size_of::<T>() > 1 {
        out.par_chunks_mut(TASK)
            .for_each(|out| out.chunks_exact_mut(size_of::<T>()).for_each(<[u8]>::reverse));
    }
}

/// Decodes `count` values from the start of `bytes`, which must hold that many, behind `values`, which must be of the
/// coding's type and have the room.
pub(super) fn append(bytes: &[u8], coding: &Coding, values: &mut Values, count: usize) -> Loss {
    fn end<T: Sample>(samples: &mut Vec<T>, count: usize) -> &mut [T] {
        let start = samples.len();
        samples.resize(start + count, T::zeroed());
        &mut samples[start..]
    }
    match values {
        Values::F32(values) => return decode(bytes, coding, end(values, count)),
        Values::U8(values) => copy(bytes, coding.endian, end(values, count)),
        Values::I8(values) => copy(bytes, coding.endian, end(values, count)),
        Values::U16(values) => copy(bytes, coding.endian, end(values, count)),
        Values::I16(values) => copy(bytes, coding.endian, end(values, count)),
    }
    Loss::default()
}

/// Grows `values` by `more`, or says that memory is short.
pub(super) fn grow(file: &Path, dims: [u64; 3], values: &mut Values, more: usize) -> Result<(), OpenError> {
    each_type!(Values, values, samples => samples.try_reserve(more))
        .map_err(|_| OpenError::no_memory(file, dims))?;
    each_type!(Values, values, samples => memory::prefer_huge_pages(samples));
    Ok(())
}

/// Reads `dims` values from `reader` through a bounded buffer.
///
/// `reserve` is how many values the source is known to hold (0 where that can't be known): memory
/// beyond it is taken only as values arrive, so a header's promise alone allocates nothing.
pub(super) fn read_values(
    file: &Path,
    reader: &mut dyn Read,
    dims: [u64; 3],
    coding: &Coding,
    reserve: u64,
) -> Result<(Values, Loss), OpenError> {
    let count = dims[0] * dims[1] * dims[2];
    let size = coding.scalar.size();
    let mut values = coding.none();
    grow(file, dims, &mut values, usize::try_from(reserve.min(count)).unwrap_or(usize::MAX))?;
    let mut buffer = vec![0_u8; (count * size as u64).min(8 << 20) as usize];
    let mut loss = Loss::default();
    while (values.len() as u64) < count {
        let wanted = (count - values.len() as u64).min((buffer.len() / size) as u64) as usize * size;
        let got = fill(reader, &mut buffer[..wanted]).map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => OpenError::Truncated {
                file: file.to_owned(),
                need: count * size as u64,
                have: "the compressed data ends before them".to_owned(),
            },
            _ => OpenError::reading(file, e),
        })?;
        if got < wanted {
            let have = values.len() as u64 * size as u64 + got as u64;
            return Err(OpenError::Truncated {
                file: file.to_owned(),
                need: count * size as u64,
                have: format!("there are only {have}"),
            });
        }
        let more = got / size;
        grow(file, dims, &mut values, more)?;
        loss = loss.plus(append(&buffer[..got], coding, &mut values, more));
    }
    Ok((values, loss))
}

/// Reads until `buffer` is full or the input ends; returns how much came.
pub(super) fn fill(reader: &mut dyn Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut got = 0;
    while got < buffer.len() {
        match reader.read(&mut buffer[got..]) {
            Ok(0) => break,
            Ok(n) => got += n,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(got)
}
