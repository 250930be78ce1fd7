//! The brick map on the CPU; twin of `shaders/shared/map.wgsl` and `shaders/scan/map.wgsl`.
//!
//! A bit a brick says whether it is active, and beside each 32 of them stands how many are before: the slot of an active
//! brick is that and a population count. A quarter of a byte a brick, so that a grid costs next to nothing where there
//! is no surface (rank and select: Jacobson 1989).

use super::cpu::{Range, straddles};
use crate::stage::params::Params;

/// Which bricks of a slab are active, and in which slots.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BrickMap {
    /// Of each 32 bricks: their bits, lowest first, and the active bricks before them; behind the last: no bits, and
    /// all active bricks.
    pub words: Vec<[u32; 2]>,
}

impl BrickMap {
    /// Words of the map of so many bricks, the one behind the last included.
    pub fn word_count(bricks: u64) -> u64 {
        bricks.div_ceil(32) + 1
    }

    /// The map whose words have these bits.
    pub fn of_bits(bits: impl Iterator<Item = u32>) -> Self {
        let mut before = 0u32;
        let mut words: Vec<[u32; 2]> = bits
            .map(|bits| {
                let word = [bits, before];
                before += bits.count_ones();
                word
            })
            .collect();
        words.push([0, before]);
        Self { words }
    }

    /// The bricks that `keeps` says, of so many.
    pub fn new(bricks: u32, keeps: impl Fn(u32) -> bool) -> Self {
        let word = |first: u32| {
            let end = bricks.min(first.saturating_add(32));
            (first..end).fold(0, |bits, brick| bits | u32::from(keeps(brick)) << (brick - first))
        };
        Self::of_bits((0..bricks).step_by(32).map(word))
    }

    /// The bricks whose ranges can have samples on both sides of iso.
    pub fn of_ranges(params: &Params, ranges: &[Range]) -> Self {
        Self::new(ranges.len() as u32, |brick| straddles(params, ranges[brick as usize]))
    }

    /// How many bricks are active.
    pub fn active(&self) -> u32 {
        self.words.last().map_or(0, |word| word[1])
    }

    /// The active bricks before `brick`, which may be one past the last.
    pub fn slot(&self, brick: u32) -> u32 {
        let [bits, before] = self.words[brick as usize / 32];
        before + (bits & ((1 << (brick % 32)) - 1)).count_ones()
    }

    /// The active bricks, in order.
    pub fn list(&self) -> Vec<u32> {
        let mut list = Vec::with_capacity(self.active() as usize);
        for (first, [bits, _]) in (0..).step_by(32).zip(&self.words) {
            let mut left = *bits;
            while left != 0 {
                list.push(first + left.trailing_zeros());
                left &= left - 1;
            }
        }
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_and_list() {
        for bricks in [1u32, 31, 32, 33, 64, 100] {
            let map = BrickMap::new(bricks, |brick| brick % 3 == 1);
            let list: Vec<u32> = (0..bricks).filter(|brick| brick % 3 == 1).collect();
            assert_eq!(map.list(), list);
            assert_eq!(map.words.len() as u64, BrickMap::word_count(bricks.into()));
            for (slot, &brick) in list.iter().enumerate() {
                assert_eq!(map.slot(brick) as usize, slot);
            }
            assert_eq!(map.slot(bricks) as usize, list.len());
            assert_eq!(map.active() as usize, list.len());
        }
    }
}
