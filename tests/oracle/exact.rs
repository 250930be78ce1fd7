//! One cell of the trilinear interpolant, in whole numbers: which of its corners lie in one region of a face, and
//! which in one region of the body.
//!
//! A corner is a number of three bits, x lowest. A cell's values are differences from iso, positive inside and never 0.
//! Every component of {f > 0} and of {f < 0} in the cell has a corner, for along an axis f is linear, and so one can
//! go from any point to a corner without coming nearer to 0. Hence a partition of the corners tells all.

use std::cmp::Ordering;

/// Differences from iso at the corners; up to 2³⁰, so that everything here fits in an `i128`.
pub type Cell = [i64; 8];

/// Which corners are connected, by the lowest corner of each region.
pub type Regions = [u8; 8];

/// A rational number whose denominator is over 0.
#[derive(Debug, Clone, Copy)]
struct Ratio {
    over: i128,
    under: i128,
}

impl Ratio {
    fn cmp(self, other: Self) -> Ordering {
        (self.over * other.under).cmp(&(other.over * self.under))
    }
}

/// c₀ + c₁ w + c₂ w².
#[derive(Debug, Clone, Copy)]
struct Quadratic([i128; 3]);

impl Quadratic {
    /// The product of two lines, each given by its values at 0 and 1.
    fn product([a, a1]: [i64; 2], [b, b1]: [i64; 2]) -> Self {
        let [a, b, up, vp] = [a, b, a1 - a, b1 - b].map(i128::from);
        Self([a * b, a * vp + b * up, up * vp])
    }

    fn minus(self, other: Self) -> Self {
        Self([0, 1, 2].map(|i| self.0[i] - other.0[i]))
    }

    fn sign_at(self, w: Ratio) -> Ordering {
        let [c0, c1, c2] = self.0;
        (c0 * w.under * w.under + c1 * w.over * w.under + c2 * w.over * w.over).cmp(&0)
    }

    /// Where it is least or greatest, and its sign there; `None` for a line.
    fn extremum(self) -> Option<(Ratio, Ordering)> {
        let [c0, c1, c2] = self.0;
        let side = c2.signum();
        // c₀ − c₁² / 4 c₂.
        let sign = (4 * c2 * c0 - c1 * c1).signum() * side;
        (side != 0).then(|| (Ratio { over: -c1 * side, under: 2 * c2 * side }, sign.cmp(&0)))
    }
}

/// The four corners of a face, or the lower corners of the four lines along an axis, around it: the one at `first`
/// is the first of them.
pub fn around(axis: usize, first: u8) -> [u8; 4] {
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3].map(|other| 1u8 << other);
    [0, u, u | v, v].map(|corner| first | corner)
}

/// The six faces: those at the low and at the high end of each axis.
pub fn faces() -> [[u8; 4]; 6] {
    [0, 1, 2, 3, 4, 5].map(|i| around(i / 2, if i % 2 == 0 { 0 } else { 1 << (i / 2) }))
}

/// The asymptotic decider (Nielson and Hamann 1991): where the signs of a face alternate, the pair of corners that is
/// connected in it is the one with the larger product. `Less` means the second and the fourth corner.
pub fn decide(cell: &Cell, face: [u8; 4]) -> Option<Ordering> {
    let [a, b, c, d] = face.map(|corner| cell[corner as usize]);
    let alternate = (a > 0) == (c > 0) && (b > 0) == (d > 0) && (a > 0) != (b > 0);
    alternate.then(|| (a * c).cmp(&(b * d)))
}

/// What is known of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decided {
    /// The regions of the cell's surface alone.
    pub surface: Regions,
    /// Those of the whole cell.
    pub body: Regions,
    /// What each of [`faces`] says.
    pub faces: [Option<Ordering>; 6],
}

pub fn join(regions: &mut Regions, a: u8, b: u8) {
    let [low, high] = {
        let [a, b] = [regions[a as usize], regions[b as usize]];
        [a.min(b), a.max(b)]
    };
    regions.iter_mut().filter(|r| **r == high).for_each(|r| *r = low);
}

/// How many regions there are.
pub fn number(regions: &Regions) -> usize {
    (0..8).filter(|&corner| regions[corner] == corner as u8).count()
}

/// Decides everything in a cell; `None` where 0 is the value of a saddle of a face or of the body, so that the surface
/// is none there.
pub fn decide_cell(cell: &Cell) -> Option<Decided> {
    let mut surface = [0, 1, 2, 3, 4, 5, 6, 7];
    for corner in 0..8u8 {
        for beside in [1, 2, 4].map(|bit| corner | bit) {
            if (cell[corner as usize] > 0) == (cell[beside as usize] > 0) {
                join(&mut surface, corner, beside);
            }
        }
    }
    let decided = faces().map(|face| decide(cell, face));
    for ([a, b, c, d], decision) in faces().into_iter().zip(decided) {
        match decision {
            Some(Ordering::Equal) => return None,
            Some(Ordering::Greater) => join(&mut surface, a, c),
            Some(Ordering::Less) => join(&mut surface, b, d),
            None => (),
        }
    }
    let mut body = surface;
    through(&mut body, cell, 0)?;
    // The answer is the same whichever way the slices lie.
    for axis in [1, 2] {
        let mut other = surface;
        through(&mut other, cell, axis)?;
        assert_eq!(body, other, "axis {axis} of {cell:?}");
    }
    Some(Decided { surface, body, faces: decided })
}

/// Joins what slices across an axis join. In a slice f is bilinear, with corners A, B, C, D that are linear in its
/// height w; where their signs alternate, A·C − B·D tells the pair that is connected, and this over a run of heights
/// that ends where a corner changes its sign.
fn through(regions: &mut Regions, cell: &Cell, axis: usize) -> Option<()> {
    let corners = around(axis, 0);
    let lines = corners.map(|corner| [cell[corner as usize], cell[(corner | 1 << axis) as usize]]);
    let [a, b, c, d] = lines;
    let q = Quadratic::product(a, c).minus(Quadratic::product(b, d));
    for positive in [[true, false, true, false], [false, true, false, true]] {
        let Some([low, high]) = run(lines, positive) else { continue };
        let mut signs = [q.sign_at(low), q.sign_at(high), Ordering::Equal];
        if let Some((at, sign)) = q.extremum()
            && low.cmp(at) == Ordering::Less
            && at.cmp(high) == Ordering::Less
        {
            if sign == Ordering::Equal {
                return None;
            }
            signs[2] = sign;
        }
        // The ends are not of the run, but what is over or under 0 there is so beside them.
        for (sign, [m, n]) in [(Ordering::Greater, [0, 2]), (Ordering::Less, [1, 3])] {
            if signs.contains(&sign) {
                // The end of the line that has the sign of the run.
                let end = |i: usize| {
                    let at_low = (lines[i][0] > 0) == positive[i];
                    corners[i] | if at_low { 0 } else { 1 << axis }
                };
                join(regions, end(m), end(n));
            }
        }
    }
    Some(())
}

/// The heights between which the four lines have these signs; `None` where there are none.
fn run(lines: [[i64; 2]; 4], positive: [bool; 4]) -> Option<[Ratio; 2]> {
    let [mut low, mut high] = [Ratio { over: 0, under: 1 }, Ratio { over: 1, under: 1 }];
    for ([at_0, at_1], positive) in lines.into_iter().zip(positive) {
        // a / (a − b), in whichever signs make the denominator positive.
        let [a, b] = [at_0, at_1].map(|v| i128::from(v.abs()));
        let zero = Ratio { over: a, under: a + b };
        match [at_0, at_1].map(|v| (v > 0) == positive) {
            [true, true] => (),
            [false, false] => return None,
            [true, false] if zero.cmp(high) == Ordering::Less => high = zero,
            [false, true] if low.cmp(zero) == Ordering::Less => low = zero,
            _ => (),
        }
    }
    (low.cmp(high) == Ordering::Less).then_some([low, high])
}

#[test]
fn known_cells() {
    let regions =
        |cell: Cell| decide_cell(&cell).map(|decided| [decided.surface, decided.body].map(|r| number(&r)));
    // Two opposite corners inside: a tunnel joins them where the middle is inside (Chernyaev's cases 4.1.2 and 4.1.1).
    assert_eq!(regions([9, -1, -1, -1, -1, -1, -1, 9]), Some([3, 2]));
    assert_eq!(regions([2, -1, -1, -1, -1, -1, -1, 2]), Some([3, 3]));
    // In the middle the mean of the corners is 0.
    assert_eq!(regions([3, -1, -1, -1, -1, -1, -1, 3]), None);
    // Two corners of a face: its saddle is below 0, at 0, above 0.
    assert_eq!(regions([2, -2, -2, 1, -9, -9, -9, -9]), Some([3, 3]));
    assert_eq!(regions([2, -2, -2, 2, -9, -9, -9, -9]), None);
    assert_eq!(regions([2, -2, -2, 3, -9, -9, -9, -9]), Some([2, 2]));
    // Signs that alternate, and nothing else: singular all over.
    assert_eq!(regions([1, -1, -1, 1, -1, 1, 1, -1]), None);
}
