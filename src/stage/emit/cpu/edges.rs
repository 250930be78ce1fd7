//! The crossed owned edges of a brick, listed in the order of its vertices.

use crate::stage::classify::BrickRecord;
use crate::stage::classify::tetrahedra::DIRECTIONS;
use crate::stage::method::Method;
use multiversion::multiversion;

/// A point of a brick as one number: x, and from bit 4 on y, and from bit 8 on z. A step to a point further on is a number of the
/// same kind: the two are added.
const AXES: [u32; 3] = [0, 4, 8];
/// Where the step of an edge lies beside its owner.
const STEP: u32 = 12;

/// A crossed edge: the point that owns it, and the step from there to its other end.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Edge(u32);

impl Edge {
    /// The owner, as one number.
    #[inline(always)]
    pub(super) fn owner(self) -> u32 {
        self.0 & ((1 << STEP) - 1)
    }

    /// The step to the other end, as one number.
    #[inline(always)]
    pub(super) fn step(self) -> u32 {
        self.0 >> STEP
    }

    /// The owner's coordinate along an axis, from the brick's first point.
    #[inline(always)]
    pub(super) fn coordinate(self, axis: usize) -> u32 {
        self.0 >> AXES[axis] & 7
    }

    /// How far the edge goes along an axis: 0 or 1.
    #[inline(always)]
    pub(super) fn way(self, axis: usize) -> u32 {
        self.step() >> AXES[axis] & 1
    }

    /// The order of edges in a brick's record: by row, direction, place.
    fn order(self) -> [u32; 4] {
        [self.coordinate(2), self.coordinate(1), self.step(), self.coordinate(0)]
    }
}

/// The most edges that a brick owns: seven of each point, where cells are cut into tetrahedra.
const MOST: usize = 7 * 512;
/// So many edges are written at a time, of which the last may be none.
const ROUND: usize = 4;

/// The crossed edges of one brick after another, in the same memory.
pub(super) struct EdgeList(Box<[Edge; MOST + ROUND]>);

impl Default for EdgeList {
    fn default() -> Self {
        Self(Box::new([Edge(0); MOST + ROUND]))
    }
}

impl EdgeList {
    /// Those of the brick with this record and so many samples.
    #[inline(always)]
    pub(super) fn fill(&mut self, method: Method, extent: [usize; 3], record: &BrickRecord) -> &[Edge] {
        let count = match method {
            Method::MarchingCubes | Method::Mc33 => along_axes(&mut self.0, &record.rows),
            Method::Tetrahedra => in_seven_directions(&mut self.0, extent, record),
        };
        &self.0[..count]
    }
}

/// Lists the edges of rows, 24 bits each: those along x, y, z of eight points. Returns how many.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
fn along_axes(list: &mut [Edge; MOST + ROUND], rows: &[u32; 64]) -> usize {
    let mut count = 0;
    for (i, pair) in rows.as_chunks::<2>().0.iter().enumerate() {
        let mut left = u64::from(pair[0] & 0xff_ffff) | u64::from(pair[1] & 0xff_ffff) << 32;
        let end = count + left.count_ones() as usize;
        // Four a round, and most rows have no more: how many one has is not to be foreseen, and a branch on it often mispredicted.
        while count < end {
            for edge in &mut list[count..count + ROUND] {
                edge.0 = 64 * i as u32 + left.trailing_zeros();
                left &= left.wrapping_sub(1);
            }
            count += ROUND;
        }
        count = end;
    }
    for Edge(edge) in &mut list[..count] {
        // x, axis, y, z, from the lowest bit on.
        let [x, axis, y, z] = [*edge & 7, *edge >> 3 & 3, *edge >> 5 & 7, *edge >> 8];
        let step = 1 << (4 * axis);
        *edge = x << AXES[0] | y << AXES[1] | z << AXES[2] | step << STEP;
    }
    count
}

fn in_seven_directions(list: &mut [Edge; MOST + ROUND], extent: [usize; 3], record: &BrickRecord) -> usize {
    let record = record.tetrahedra();
    let mut places = list.iter_mut();
    for (y, z) in (0..8).flat_map(|z| (0..8).map(move |y| (y, z))) {
        for direction in DIRECTIONS {
            let step = (0..3).fold(0, |step, k| step | (direction >> k & 1) << AXES[k]);
            let row = (y as u32) << AXES[1] | (z as u32) << AXES[2] | step << STEP;
            let mut left = record.crossed(extent, y, z, direction);
            while left != 0
                && let Some(place) = places.next()
            {
                *place = Edge(row | left.trailing_zeros());
                left &= left - 1;
            }
        }
    }
    MOST + ROUND - places.len()
}

/// From the numbers of a brick's vertices to those they have after a change; what it needs is kept from brick to brick.
#[derive(Default)]
pub struct Renumber([EdgeList; 2]);

impl Renumber {
    /// Of a brick of `extent` samples with one record before and another after: the number that each vertex before has after,
    /// `first` being that of the brick's first vertex; nothing of those on edges that are no longer crossed, and of those
    /// within cells.
    pub fn brick(
        &mut self,
        method: Method,
        extent: [usize; 3],
        records: [&BrickRecord; 2],
        first: u32,
        numbers: &mut [u32],
    ) {
        let [before, after] = &mut self.0;
        let before = before.fill(method, extent, records[0]);
        let mut now = (first..).zip(after.fill(method, extent, records[1])).peekable();
        for (to, edge) in numbers.iter_mut().zip(before) {
            while now.next_if(|(_, other)| other.order() < edge.order()).is_some() {}
            if let Some((number, _)) = now.next_if(|(_, other)| *other == edge) {
                *to = number;
            }
        }
    }
}
