//! The oracle's own cross-check: the same interpolant, sampled so finely that tetrahedra tell its topology. No face or
//! body is decided here.
//!
//! Freudenthal's tetrahedra (1942) of a cube are chains of corners, each with more bits than the one before; those of
//! all cubes fit together. In a tetrahedron the interpolant is linear, so that there is a vertex for every edge between
//! two signs, an edge for every such triangle, and one polygon for every such tetrahedron.

use crate::common::Random;
use crate::exact::Cell;
use crate::grids::Kind;
use crate::topology::{Sets, Small, topology};
use rayon::prelude::*;

/// What [`Topology`](crate::topology::Topology) has of it: the Euler characteristic, and the regions inside and outside.
#[derive(Debug, PartialEq, Eq)]
pub struct Sampled {
    pub euler: i64,
    pub regions: [usize; 2],
}

/// The signs of the interpolant of `grid` on a lattice of `k` steps a cell; `true` inside.
fn signs(grid: &Small, k: usize) -> (usize, Vec<bool>) {
    let n = grid.points;
    let fine = (n - 1) * k + 1;
    // A sample is k³ times the value, in whole numbers. One axis after the other.
    let mut values: Vec<i64> = grid.values.clone();
    let mut shape = [n; 3];
    for axis in 0..3 {
        let mut next = shape;
        next[axis] = fine;
        let mut stretched = Vec::with_capacity(next.iter().product());
        for z in 0..next[2] {
            for y in 0..next[1] {
                for x in 0..next[0] {
                    let mut low = [x, y, z];
                    let along = low[axis];
                    low[axis] = along / k;
                    let at = |p: [usize; 3]| values[p[0] + shape[0] * (p[1] + shape[1] * p[2])];
                    let part = (along % k) as i64;
                    let mut high = low;
                    high[axis] += usize::from(part > 0);
                    stretched.push(at(low) * (k as i64 - part) + at(high) * part);
                }
            }
        }
        (values, shape) = (stretched, next);
    }
    (fine, values.into_iter().map(|v| v > 0).collect())
}

/// What the chains that begin at the lowest corner of a cube add to V − E + F, for every pattern of its signs.
fn chains() -> Vec<i64> {
    let of = |pattern: u8| {
        let mut sum = 0;
        let signs = |chain: &[u8]| chain.iter().map(|corner| pattern >> corner & 1).sum::<u8>();
        let mixed = |chain: &[u8]| i64::from(signs(chain) > 0 && (signs(chain) as usize) < chain.len());
        for a in 1..8u8 {
            sum += mixed(&[0, a]);
            for b in (a + 1..8).filter(|b| b & a == a) {
                sum -= mixed(&[0, a, b]);
                sum += (b + 1..8).filter(|c| c & b == b).map(|c| mixed(&[0, a, b, c])).sum::<i64>();
            }
        }
        sum
    };
    (0..=255).map(of).collect()
}

/// The topology of the interpolant of `grid`, as `k` samples a cell tell it.
pub fn supersample(grid: &Small, k: usize) -> Sampled {
    let (n, inside) = signs(grid, k);
    let chains = chains();
    let offsets = [0, 1, 2, 3, 4, 5, 6, 7usize].map(|c| (c & 1) + n * ((c >> 1 & 1) + n * (c >> 2)));
    let mut regions = Sets::new(inside.len());
    let mut euler = 0;
    // Beyond the last points all is outside, and no chain that begins there counts: cubes suffice.
    for base in
        (0..n - 1).flat_map(|z| (0..n - 1).flat_map(move |y| (0..n - 1).map(move |x| x + n * (y + n * z))))
    {
        let pattern = (0..8).fold(0, |bits, c| bits | u8::from(inside[base + offsets[c]]) << c);
        euler += chains[pattern as usize];
        // Where all is of one sign, the edges along the axes connect it.
        let edges: &[usize] =
            if pattern == 0 || pattern == 255 { &[1, 2, 4] } else { &[1, 2, 3, 4, 5, 6, 7] };
        for corner in edges.iter().filter(|c| (pattern >> **c & 1) == (pattern & 1)) {
            regions.join(base as u32, (base + offsets[*corner]) as u32);
        }
    }
    // The last points are of the border, which is one region, and begin no cube.
    for point in 0..inside.len() {
        if [point % n, point / n % n, point / (n * n)].contains(&(n - 1)) {
            regions.join(0, point as u32);
        }
    }
    let mut counts = [0, 0];
    for (point, inside) in (0u32..).zip(&inside) {
        counts[usize::from(!inside)] += usize::from(regions.find(point) == point);
    }
    Sampled { euler, regions: counts }
}

/// Goes red when `decide` is turned round, when `through` joins nothing or forgets the extremum between the ends of a run
/// (all in `exact.rs`), and when `topology` takes a component for a disc whatever its loops.
#[test]
fn the_oracle_is_what_fine_samples_tell() {
    // Whole cells with small whole numbers: what is not singular is not nearly so either.
    let mut random = Random(11);
    let mut small = || (1 + (random.next() % 9) as i64) * if random.next() % 2 == 1 { 1 } else { -1 };
    let mut grids: Vec<(String, Small)> = (0..300)
        .map(|_| {
            let cell: Cell = [0; 8].map(|_| small());
            (format!("{cell:?}"), Small::of_cell(&cell))
        })
        .collect();
    for (kind, n) in [(Kind::Uniform, 3), (Kind::Integers, 3), (Kind::Turns, 3)] {
        grids.extend((0..100).map(|seed| (format!("{kind:?} {n} {seed}"), kind.grid(n, seed))));
    }
    grids.retain(|(_, grid)| topology(grid).is_some());
    let regular = grids.len();
    let unlike: Vec<_> = grids.into_par_iter().filter_map(unlike).collect();
    eprintln!("{regular} grids compared");
    assert!(regular > 550, "most are not singular");
    assert!(unlike.is_empty(), "{} of {regular} are not what samples tell: {:?}", unlike.len(), unlike[0]);
}

/// What fine samples tell, and what the oracle says, where these differ however fine they are.
fn unlike((name, grid): (String, Small)) -> Option<(String, Sampled, Sampled)> {
    let exact = topology(&grid)?;
    let expected = Sampled { euler: exact.euler(), regions: exact.regions };
    // So fine that few things are missed, and finer only where something is: what is not there is not found.
    let mut found = supersample(&grid, 12);
    for k in [24, 48] {
        if found != expected {
            found = supersample(&grid, k);
        }
    }
    (found != expected).then_some((name, found, expected))
}
