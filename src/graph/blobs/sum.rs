//! Sums of components at points: values and gradients.

use super::grid::Grid;
use super::kernel::{Blobby, InverseSquare, Kernel, Metaball, Profile, SoftObject};
use super::{Blobs, Few, Stored, bounds};
use crate::field::Points;
use crate::graph::interval::Interval;
use crate::graph::leaf::{DualSlices, Leaf};
use multiversion::multiversion;
use std::any::Any;
use std::cell::RefCell;
use std::ops::Range;

/// Points that are looked at together.
const CHUNK: usize = 32;
/// Points whose sums are kept in registers.
const LANES: usize = 16;
/// Cells above which points are looked at apart.
const MOST_CELLS: u64 = 1000;

/// Where the components come from.
#[derive(Clone, Copy)]
pub(super) enum From<'a> {
    Grids(&'a [Grid], &'a [Stored]),
    List(&'a [Stored]),
}

impl Blobs {
    pub(super) fn from(&self) -> From<'_> {
        From::Grids(&self.grids, &self.components)
    }

    pub(super) fn sum_values(&self, at: Points<'_>, out: &mut [f32]) {
        LISTS.with_borrow_mut(|lists| values(self.kernel, self.from(), at, lists, out));
    }

    pub(super) fn sum_gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        LISTS.with_borrow_mut(|lists| gradients(self.kernel, self.from(), at, lists, out));
    }
}

impl Few {
    pub(super) fn from(&self) -> From<'_> {
        From::List(&self.components)
    }

    pub(super) fn sum_values(&self, at: Points<'_>, out: &mut [f32]) {
        LISTS.with_borrow_mut(|lists| values(self.kernel, self.from(), at, lists, out));
    }

    pub(super) fn sum_gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        LISTS.with_borrow_mut(|lists| gradients(self.kernel, self.from(), at, lists, out));
    }
}

/// The square of the distance, in radii, of a component from a box, times `part`. For each point of the box the
/// same operations give at least this: rounding keeps the order.
#[inline(always)]
pub(super) fn nearest(component: &Stored, low: [f32; 3], high: [f32; 3], part: f32) -> f32 {
    let mut d = [0.0; 3];
    for k in 0..3 {
        let (below, above) = (low[k] - component[k], component[k] - high[k]);
        let away = if below > above { below } else { above };
        d[k] = if away > 0.0 { away } else { 0.0 };
    }
    let [dx, dy, dz] = d;
    ((dx * dx + dy * dy + dz * dz) * part) * component[3]
}

type Corners = [[f32; 3]; 2];

/// The box around the points; NaN, which nothing reaches, is passed over.
#[inline(always)]
pub(super) fn corners(points: Points<'_>, range: &Range<usize>) -> Corners {
    let mut corners = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    for (k, axis) in [points.x, points.y, points.z].into_iter().enumerate() {
        let mut lows = [f32::INFINITY; 8];
        let mut highs = [f32::NEG_INFINITY; 8];
        let (eights, rest) = axis[range.clone()].as_chunks::<8>();
        for lanes in eights {
            for i in 0..8 {
                lows[i] = if lanes[i] < lows[i] { lanes[i] } else { lows[i] };
                highs[i] = if lanes[i] > highs[i] { lanes[i] } else { highs[i] };
            }
        }
        corners[0][k] = lows.iter().chain(rest).fold(f32::INFINITY, |a, &b| if b < a { b } else { a });
        corners[1][k] = highs.iter().chain(rest).fold(f32::NEG_INFINITY, |a, &b| if b > a { b } else { a });
    }
    corners
}

/// Whether points in the box lie so far apart that they are better looked at in two parts.
#[inline(always)]
fn is_wide(from: From<'_>, [low, high]: Corners) -> bool {
    let From::Grids(grids, _) = from else { return false };
    grids.iter().any(|grid| {
        grid.cells(low, high).is_some_and(|[first, last]| {
            // No product of three passes 64 bits.
            let sides = [0, 1, 2].map(|k| u64::from(last[k] - first[k] + 1));
            sides.iter().product::<u64>() > MOST_CELLS
        })
    })
}

/// Puts the components that reach the box into `into`, in order; it holds more than the ones it gives.
#[inline(always)]
fn gather<'a>(from: From<'_>, around: Corners, into: &'a mut Vec<Stored>) -> &'a [Stored] {
    let mut end = 0;
    match from {
        From::List(components) => end = gather_run(components, around, into, end),
        From::Grids(grids, components) => {
            for grid in grids {
                if let Some(cells) = grid.cells(around[0], around[1]) {
                    for run in grid.runs(cells) {
                        end = gather_run(&components[run], around, into, end);
                    }
                }
            }
        }
    }
    &into[..end]
}

/// Puts those of a run behind `end`, and gives the new end.
#[inline(always)]
fn gather_run(run: &[Stored], [low, high]: Corners, into: &mut Vec<Stored>, mut end: usize) -> usize {
    if into.len() < end + run.len() {
        into.resize(2 * (end + run.len()), [0.0; 5]);
    }
    // Each is written, but only one that reaches the box moves the end: no branch is guessed wrongly.
    for component in run {
        into[end] = *component;
        end += usize::from(nearest(component, low, high, 1.0) < 1.0);
    }
    end
}

/// Lists that are made anew for each group of points, and of those for each chunk.
type Lists = [Vec<Stored>; 2];

thread_local! {
    static LISTS: RefCell<Lists> = const { RefCell::new([const { Vec::new() }; 2]) };
}

/// Takes chunks of points with the components that reach them. No closure: those are compiled for the oldest
/// processors, whatever the function around them is compiled for.
trait Take {
    fn take(&mut self, components: &[Stored], chunk: Range<usize>);
}

/// Hands on the chunks of all points.
#[inline(always)]
fn each_chunk(from: From<'_>, points: Points<'_>, lists: &mut Lists, taker: &mut impl Take) {
    let [group_list, list] = lists;
    let mut open = Vec::with_capacity(12);
    open.push(0..points.x.len());
    while let Some(range) = open.pop() {
        let around = corners(points, &range);
        if range.len() > 1 && is_wide(from, around) {
            let middle = range.start + range.len() / 2;
            open.extend([middle..range.end, range.start..middle]);
            continue;
        }
        let group = gather(from, around, group_list);
        if range.len() <= CHUNK {
            taker.take(group, range);
            continue;
        }
        for start in range.clone().step_by(CHUNK) {
            let chunk = start..(start + CHUNK).min(range.end);
            let around = corners(points, &chunk);
            taker.take(gather(From::List(group), around, list), chunk);
        }
    }
}

/// Whether the components that reach a box are the same, in the same order, as those of another sum: then all sums there
/// are. Not known of boxes of many cells, whose parts are better asked for.
pub(super) fn is_same((kernel, from): (Kernel, From<'_>), other: &dyn Leaf, at: [Interval; 3]) -> bool {
    let other: &dyn Any = other;
    let (other_kernel, other) = match (other.downcast_ref::<Blobs>(), other.downcast_ref::<Few>()) {
        (Some(blobs), _) => (blobs.kernel, blobs.from()),
        (_, Some(few)) => (few.kernel, few.from()),
        _ => return false,
    };
    let Some(around @ [low, high]) = bounds::corners(at) else { return false };
    let is_coarse = |from| match from {
        From::Grids(grids, _) => {
            grids.iter().any(|grid: &Grid| grid.cells(low, high).is_some_and(bounds::is_coarse))
        }
        From::List(_) => false,
    };
    if kernel != other_kernel || is_coarse(from) || is_coarse(other) {
        return false;
    }
    LISTS.with_borrow_mut(|[own, others]| {
        let (own, others) = (gather(from, around, own), gather(other, around, others));
        let [own, others]: [&[[u32; 5]]; 2] = [own, others].map(bytemuck::cast_slice);
        own == others
    })
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn values(kernel: Kernel, from: From<'_>, at: Points<'_>, lists: &mut Lists, out: &mut [f32]) {
    match kernel {
        Kernel::SoftObject => values_of(SoftObject, from, at, lists, out),
        Kernel::Metaball => values_of(Metaball, from, at, lists, out),
        Kernel::Blobby { .. } => values_of(Blobby(kernel.falloff()), from, at, lists, out),
        Kernel::InverseSquare => values_of(InverseSquare, from, at, lists, out),
    }
}

struct Values<'a, P> {
    profile: P,
    at: Points<'a>,
    out: &'a mut [f32],
}

impl<P: Profile> Take for Values<'_, P> {
    #[inline(always)]
    fn take(&mut self, components: &[Stored], chunk: Range<usize>) {
        for start in chunk.clone().step_by(LANES) {
            let own = start..(start + LANES).min(chunk.end);
            add(self.profile, components, lanes(self.at, &own), &mut self.out[own]);
        }
    }
}

#[inline(always)]
fn values_of(profile: impl Profile, from: From<'_>, at: Points<'_>, lists: &mut Lists, out: &mut [f32]) {
    each_chunk(from, at, lists, &mut Values { profile, at, out });
}

/// Coordinates of up to [`LANES`] points; what is left repeats the last.
#[inline(always)]
fn lanes(at: Points<'_>, own: &Range<usize>) -> [[f32; LANES]; 3] {
    let mut lanes = [[0.0; LANES]; 3];
    for (to, axis) in lanes.iter_mut().zip([at.x, at.y, at.z]) {
        let from = &axis[own.clone()];
        if let Ok(full) = from.try_into() {
            *to = full;
        } else {
            to.fill(from[from.len() - 1]);
            to[..from.len()].copy_from_slice(from);
        }
    }
    lanes
}

#[inline(always)]
fn add(profile: impl Profile, components: &[Stored], at: [[f32; LANES]; 3], out: &mut [f32]) {
    let ([x, y, z], mut sum) = (at, [0.0; LANES]);
    for &[cx, cy, cz, inverse_square, weight] in components {
        for i in 0..LANES {
            let (dx, dy, dz) = (x[i] - cx, y[i] - cy, z[i] - cz);
            let q = (dx * dx + dy * dy + dz * dz) * inverse_square;
            sum[i] += weight * profile.value(q);
        }
    }
    out.copy_from_slice(&sum[..out.len()]);
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn gradients(kernel: Kernel, from: From<'_>, at: Points<'_>, lists: &mut Lists, out: DualSlices<'_>) {
    match kernel {
        Kernel::SoftObject => gradients_of(SoftObject, from, at, lists, out),
        Kernel::Metaball => gradients_of(Metaball, from, at, lists, out),
        Kernel::Blobby { .. } => gradients_of(Blobby(kernel.falloff()), from, at, lists, out),
        Kernel::InverseSquare => gradients_of(InverseSquare, from, at, lists, out),
    }
}

struct Gradients<'a, P> {
    profile: P,
    at: Points<'a>,
    out: DualSlices<'a>,
}

impl<P: Profile> Take for Gradients<'_, P> {
    #[inline(always)]
    fn take(&mut self, components: &[Stored], chunk: Range<usize>) {
        let DualSlices { value, derivatives: [by_x, by_y, by_z] } = &mut self.out;
        for start in chunk.clone().step_by(LANES) {
            let own = start..(start + LANES).min(chunk.end);
            let sums = add_gradients(self.profile, components, lanes(self.at, &own));
            for (out, sum) in [&mut *value, &mut *by_x, &mut *by_y, &mut *by_z].into_iter().zip(&sums) {
                out[own.clone()].copy_from_slice(&sum[..own.len()]);
            }
        }
    }
}

#[inline(always)]
fn gradients_of(
    profile: impl Profile,
    from: From<'_>,
    at: Points<'_>,
    lists: &mut Lists,
    out: DualSlices<'_>,
) {
    each_chunk(from, at, lists, &mut Gradients { profile, at, out });
}

/// The number where the mask is all ones, 0 where it is 0.
#[inline(always)]
fn masked(number: f32, mask: u32) -> f32 {
    f32::from_bits(number.to_bits() & mask)
}

#[inline(always)]
fn add_gradients(
    profile: impl Profile,
    components: &[Stored],
    [x, y, z]: [[f32; LANES]; 3],
) -> [[f32; LANES]; 4] {
    let [mut sum, mut by_x, mut by_y, mut by_z] = [[0.0; LANES]; 4];
    for &[cx, cy, cz, inverse_square, weight] in components {
        let twice = inverse_square + inverse_square;
        // Step by step, and masked as integers: of choices the compiler makes stores of some lanes only, which the next
        // component's loads wait for.
        let [mut values, mut slopes] = [[0.0; LANES]; 2];
        let mut masks = [0; LANES];
        for i in 0..LANES {
            let (dx, dy, dz) = (x[i] - cx, y[i] - cy, z[i] - cz);
            let q = (dx * dx + dy * dy + dz * dz) * inverse_square;
            values[i] = weight * profile.value(q);
            masks[i] = if q < 1.0 { u32::MAX } else { 0 };
            slopes[i] = masked((weight * profile.slope(q)) * twice, masks[i]);
        }
        // An infinite distance has no direction.
        for i in 0..LANES {
            sum[i] += values[i];
            by_x[i] += slopes[i] * masked(x[i] - cx, masks[i]);
            by_y[i] += slopes[i] * masked(y[i] - cy, masks[i]);
            by_z[i] += slopes[i] * masked(z[i] - cz, masks[i]);
        }
    }
    [sum, by_x, by_y, by_z]
}
