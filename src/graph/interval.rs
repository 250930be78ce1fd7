//! Interval arithmetic on bounds of field values; the twin of `shaders/graph/interval.wgsl`.
//!
//! An interval is one of two things. Either both ends are smaller than [`UNBOUNDED`] in magnitude: then
//! every value that the field's own `f32` arithmetic can give for points of the box is finite and lies
//! between them, whether or not a driver contracts `a * b + c` or flushes denormals. Or it is
//! [`ALL`]: nothing is known, and NaN and infinities may occur. Bounds are widened by `STEP` of
//! themselves after each rounding operation, which is more than these differ by. Moore 1966; its use on
//! implicit surfaces: Duff 1992.

/// Lowest and highest value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lowest.
    pub lo: f32,
    /// Highest.
    pub hi: f32,
}

/// Ends of this magnitude say that nothing is known.
pub const UNBOUNDED: f32 = f32::MAX;

/// Of which nothing is known.
pub const ALL: Interval = Interval { lo: -UNBOUNDED, hi: UNBOUNDED };

/// 2⁻²¹: relative widening after an operation that WGSL rounds within 2.5 units in the last place.
const STEP: f32 = 1.0 / 2_097_152.0;
/// 2⁻¹⁰⁰: below it, drivers may take numbers for 0.
const TINY: f32 = f32::from_bits(27 << 23);

impl Interval {
    /// From `lo` to `hi`.
    #[inline(always)]
    pub const fn new(lo: f32, hi: f32) -> Self {
        Self { lo, hi }
    }

    /// One value; [`ALL`] if it is not finite.
    #[inline(always)]
    pub fn point(value: f32) -> Self {
        Self::new(value, value).checked(true)
    }

    /// Whether anything is known.
    #[inline(always)]
    pub fn is_bounded(self) -> bool {
        self.lo > -UNBOUNDED && self.hi < UNBOUNDED
    }

    /// Whether `value` lies within.
    pub fn contains(self, value: f32) -> bool {
        !self.is_bounded() || (self.lo <= value && value <= self.hi)
    }

    /// Itself if `known` and both ends are finite, else [`ALL`].
    #[inline(always)]
    fn checked(self, known: bool) -> Self {
        if known && self.lo > -UNBOUNDED && self.hi < UNBOUNDED && self.lo <= self.hi { self } else { ALL }
    }

    /// Wider by the part `by` of its ends; what may be flushed to zero reaches zero.
    #[inline(always)]
    fn widened(self, by: f32) -> Self {
        let lo = if self.lo > 0.0 && self.lo < TINY { 0.0 } else { self.lo - self.lo.abs() * by };
        let hi = if self.hi < 0.0 && self.hi > -TINY { 0.0 } else { self.hi + self.hi.abs() * by };
        Self::new(lo, hi)
    }

    #[inline(always)]
    fn rounded(self, known: bool) -> Self {
        self.widened(STEP).checked(known)
    }

    /// The smallest interval around both.
    #[inline(always)]
    pub fn hull(self, b: Self) -> Self {
        Self::new(self.lo.min(b.lo), self.hi.max(b.hi)).checked(self.is_bounded() && b.is_bounded())
    }

    /// Of a function that grows, wider by `relative` of the ends and by `absolute`.
    #[inline(always)]
    pub fn grown(self, known: bool, relative: f32, absolute: f32) -> Self {
        let w = self.widened(relative);
        Self::new(w.lo - absolute, w.hi + absolute).checked(known)
    }
}

/// `-a`.
#[inline(always)]
pub fn neg(a: Interval) -> Interval {
    Interval::new(-a.hi, -a.lo)
}

/// `a + b`.
#[inline(always)]
pub fn add(a: Interval, b: Interval) -> Interval {
    Interval::new(a.lo + b.lo, a.hi + b.hi).rounded(a.is_bounded() && b.is_bounded())
}

/// `a - b`.
#[inline(always)]
pub fn sub(a: Interval, b: Interval) -> Interval {
    Interval::new(a.lo - b.hi, a.hi - b.lo).rounded(a.is_bounded() && b.is_bounded())
}

/// `a * b`.
#[inline(always)]
pub fn mul(a: Interval, b: Interval) -> Interval {
    let (p, q, r, s) = (a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi);
    Interval::new(p.min(q).min(r.min(s)), p.max(q).max(r.max(s))).rounded(a.is_bounded() && b.is_bounded())
}

/// `a / b`; nothing is known where b can be 0.
#[inline(always)]
pub fn div(a: Interval, b: Interval) -> Interval {
    let known = a.is_bounded() && b.is_bounded() && (b.lo >= TINY || b.hi <= -TINY);
    let by = if known { b } else { Interval::new(1.0, 1.0) };
    let (p, q, r, s) = (a.lo / by.lo, a.lo / by.hi, a.hi / by.lo, a.hi / by.hi);
    Interval::new(p.min(q).min(r.min(s)), p.max(q).max(r.max(s))).rounded(known)
}

/// `|a|`.
#[inline(always)]
pub fn abs(a: Interval) -> Interval {
    let lo = a.lo.max(-a.hi).max(0.0);
    Interval::new(lo, (-a.lo).max(a.hi)).checked(a.is_bounded())
}

/// `a * a`.
#[inline(always)]
pub fn square(a: Interval) -> Interval {
    let m = abs(a);
    Interval::new(m.lo * m.lo, m.hi * m.hi).rounded(a.is_bounded())
}

/// Square root; nothing is known where a can be negative.
#[inline(always)]
pub fn sqrt(a: Interval) -> Interval {
    Interval::new(a.lo.max(0.0).sqrt(), a.hi.max(0.0).sqrt()).rounded(a.is_bounded() && a.lo >= 0.0)
}

/// Largest whole number not above.
#[inline(always)]
pub fn floor(a: Interval) -> Interval {
    Interval::new(a.lo.floor(), a.hi.floor()).checked(a.is_bounded())
}

/// −1, 0 or 1.
#[inline(always)]
pub fn sign(a: Interval) -> Interval {
    let of = |v: f32| {
        if v > 0.0 {
            1.0
        } else if v < 0.0 {
            -1.0
        } else {
            0.0
        }
    };
    Interval::new(of(a.lo), of(a.hi)).checked(a.is_bounded())
}

/// The smaller.
#[inline(always)]
pub fn min(a: Interval, b: Interval) -> Interval {
    Interval::new(a.lo.min(b.lo), a.hi.min(b.hi)).checked(a.is_bounded() && b.is_bounded())
}

/// The larger.
#[inline(always)]
pub fn max(a: Interval, b: Interval) -> Interval {
    Interval::new(a.lo.max(b.lo), a.hi.max(b.hi)).checked(a.is_bounded() && b.is_bounded())
}

/// 1 where `a < b`, else 0.
#[inline(always)]
pub fn less(a: Interval, b: Interval) -> Interval {
    let lo = if a.hi < b.lo { 1.0 } else { 0.0 };
    let hi = if a.lo >= b.hi { 0.0 } else { 1.0 };
    Interval::new(lo, hi).checked(a.is_bounded() && b.is_bounded())
}

/// 1 where `a <= b`, else 0.
#[inline(always)]
pub fn less_equal(a: Interval, b: Interval) -> Interval {
    let lo = if a.hi <= b.lo { 1.0 } else { 0.0 };
    let hi = if a.lo > b.hi { 0.0 } else { 1.0 };
    Interval::new(lo, hi).checked(a.is_bounded() && b.is_bounded())
}

/// `a` where the condition is not 0, else `b`.
#[inline(always)]
pub fn select(condition: Interval, a: Interval, b: Interval) -> Interval {
    if !condition.is_bounded() {
        ALL
    } else if condition.lo > 0.0 || condition.hi < 0.0 {
        a
    } else if condition.lo == 0.0 && condition.hi == 0.0 {
        b
    } else {
        a.hull(b)
    }
}

/// Sine of an angle in turns, given that of the ends.
#[inline(always)]
pub fn wave(a: Interval, ends: (f32, f32), top: f32) -> Interval {
    // Whether a whole number and `top` (a quarter more or less) lies within, by a margin for rounding.
    let margin = 1e-5 + 1e-6 * a.lo.abs().max(a.hi.abs());
    let holds = |at: f32| (a.lo - margin - at).ceil() <= a.hi + margin - at;
    let known = a.is_bounded() && a.lo.abs() < 65536.0 && a.hi.abs() < 65536.0;
    let hi = if holds(top) { 1.0 } else { ends.0.max(ends.1) };
    let lo = if holds(top + 0.5) { -1.0 } else { ends.0.min(ends.1) };
    // The angle of a large number of turns is rounded.
    Interval::new(lo, hi).grown(known, 0.0, 2e-6 + 4e-6 * a.lo.abs().max(a.hi.abs()))
}

/// An angle in radians as turns.
#[inline(always)]
pub fn in_turns(a: Interval) -> Interval {
    Interval::new(a.lo * IN_TURNS, a.hi * IN_TURNS).checked(a.is_bounded())
}

const IN_TURNS: f32 = 0.159_154_94;

/// `a` to the power `b`; nothing is known where a can be negative, or 0 and b not positive.
#[inline(always)]
pub fn pow(a: Interval, b: Interval) -> Interval {
    use crate::field::functions::pow;
    let known = a.is_bounded() && b.is_bounded() && (a.lo > 1e-30 || (a.lo >= 0.0 && b.lo > 0.0));
    let (p, q, r, s) = (pow(a.lo, b.lo), pow(a.lo, b.hi), pow(a.hi, b.lo), pow(a.hi, b.hi));
    Interval::new(p.min(q).min(r.min(s)), p.max(q).max(r.max(s))).grown(known, 1e-4, 0.0)
}

/// The angle of the points (b, a).
#[inline(always)]
pub fn atan2(a: Interval, b: Interval) -> Interval {
    use crate::field::functions::atan2;
    // A little more than π.
    const MOST: f32 = 3.15;
    let known = a.is_bounded() && b.is_bounded();
    // Round the origin or across the negative axis the angle jumps.
    let whole = b.lo <= 0.0 && a.lo <= 0.0 && a.hi >= 0.0;
    let (p, q, r, s) = (atan2(a.lo, b.lo), atan2(a.lo, b.hi), atan2(a.hi, b.lo), atan2(a.hi, b.hi));
    let ends = Interval::new(p.min(q).min(r.min(s)), p.max(q).max(r.max(s)));
    (if whole { Interval::new(-MOST, MOST) } else { ends }).grown(known, 1e-5, 1e-6)
}
