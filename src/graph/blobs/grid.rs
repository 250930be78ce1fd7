//! Where the components lie: they are sorted by the cells of lookup grids, so that those near a point are
//! some runs of the one list.
//!
//! A component lies in the one cell that its centre is in; what reaches a point lies in the cells up to
//! the largest radius away. Components of very different sizes, and crowds far apart, have grids of their
//! own. There are at most twice as many cells as components, and a sum always runs through the list in its
//! order: every way to a value gives the same bits.

use super::Stored;
use rayon::prelude::*;

/// Size classes, at most.
const CLASSES: usize = 8;
/// Grids, at most.
const GRIDS: usize = 64;
/// The longest axis of a grid, in cells: its numbers are exact in `f32`.
const LONGEST: f64 = 1_048_576.0;

/// Cells over some of the components.
#[derive(Debug)]
pub(super) struct Grid {
    pub origin: [f32; 3],
    /// Cells a unit of length.
    pub inverse: f32,
    pub dims: [u32; 3],
    /// How far the largest component reaches, in cells, and what rounding may add.
    pub reach: f32,
    /// Of each cell, x fastest: its first component. Behind the last: the end.
    pub starts: Vec<u32>,
    /// Sums of the negative and of the positive peaks in boxes of 2³ cells, then of 4³ and so on, down to no more
    /// than 4 boxes along each axis.
    pub peaks: Vec<[f32; 2]>,
}

impl Grid {
    /// The first and the last cell, by place, of components that reach a box; `None` if none does.
    #[inline(always)]
    pub fn cells(&self, low: [f32; 3], high: [f32; 3]) -> Option<[[u32; 3]; 2]> {
        let mut cells = [[0; 3]; 2];
        for k in 0..3 {
            let last = (self.dims[k] - 1) as f32;
            let first = ((low[k] - self.origin[k]) * self.inverse - self.reach).floor();
            let first = if first > 0.0 { first } else { 0.0 };
            let end = ((high[k] - self.origin[k]) * self.inverse + self.reach).floor();
            let end = if end < last { end } else { last };
            // Not so for NaN either.
            let some = first <= end;
            if !some {
                return None;
            }
            cells[0][k] = first as u32;
            cells[1][k] = end as u32;
        }
        Some(cells)
    }

    /// The runs of components in those cells.
    #[inline(always)]
    pub fn runs(&self, [first, last]: [[u32; 3]; 2]) -> impl Iterator<Item = std::ops::Range<usize>> {
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        let [first, last] = [first, last].map(|place| place.map(|n| n as usize));
        (first[2]..=last[2]).flat_map(move |z| {
            (first[1]..=last[1]).map(move |y| {
                let row = nx * (y + ny * z);
                self.starts[row + first[0]] as usize..self.starts[row + last[0] + 1] as usize
            })
        })
    }
}

/// The component's cell along an axis.
fn cell_of(position: f32, origin: f32, inverse: f32) -> f32 {
    ((position - origin) * inverse).floor()
}

/// Some components by number, and the box around them.
struct Group {
    members: Vec<u32>,
    low: [f32; 3],
    high: [f32; 3],
    reach: f32,
}

type Bounds = ([f32; 3], [f32; 3], f32);

impl Group {
    fn new(of: &[Stored], members: Vec<u32>) -> Self {
        let none = || ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3], f32::INFINITY);
        let join = |a: Bounds, b: Bounds| -> Bounds {
            let each = |f: fn(f32, f32) -> f32, a: [f32; 3], b: [f32; 3]| [0, 1, 2].map(|k| f(a[k], b[k]));
            (each(f32::min, a.0, b.0), each(f32::max, a.1, b.1), a.2.min(b.2))
        };
        let one = |bounds: Bounds, &i: &u32| {
            let [x, y, z, inverse_square, _] = of[i as usize];
            join(bounds, ([x, y, z], [x, y, z], inverse_square))
        };
        let (low, high, least) = members.par_iter().fold(none, one).reduce(none, join);
        Self { members, low, high, reach: (1.0 / f64::from(least)).sqrt() as f32 }
    }

    fn extent(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| f64::from(self.high[k]) - f64::from(self.low[k]))
    }

    /// Of the box that its components reach.
    fn volume(&self) -> f64 {
        self.extent().iter().map(|side| side + 2.0 * f64::from(self.reach)).product()
    }

    /// Edge of the cells: the reach, but longer where that would be too many cells.
    fn cell(&self) -> f64 {
        let most = 2.0 * self.members.len() as f64 + 64.0;
        let extent = self.extent();
        let mut cell = f64::from(self.reach).max(extent.iter().fold(0.0, |a: f64, &b| a.max(b)) / LONGEST);
        loop {
            let count: f64 = extent.iter().map(|side| (side / cell).floor() + 1.0).product();
            if count <= most {
                return cell;
            }
            cell *= (count / most).cbrt().max(1.02);
        }
    }

    /// Its two halves along the longest side, if there is much nothing between or around them.
    fn halves(&self, of: &[Stored]) -> Option<[Group; 2]> {
        let extent = self.extent();
        let axis = (0..3).fold(0, |a, b| if extent[b] > extent[a] { b } else { a });
        let middle = (0.5 * (f64::from(self.low[axis]) + f64::from(self.high[axis]))) as f32;
        let (left, right): (Vec<u32>, Vec<u32>) =
            self.members.par_iter().partition(|&&i| of[i as usize][axis] < middle);
        if left.is_empty() || right.is_empty() {
            return None;
        }
        let halves = [left, right].map(|members| Group::new(of, members));
        (halves[0].volume() + halves[1].volume() < 0.5 * self.volume()).then_some(halves)
    }

    /// The grid, whose components follow `before` others, and the members in its order.
    fn grid(&self, of: &[Stored], before: u32) -> (Grid, Vec<u32>) {
        let cell = self.cell();
        let (origin, inverse) = (self.low, (1.0 / cell) as f32);
        let dims = [0, 1, 2].map(|k| cell_of(self.high[k], origin[k], inverse) as u32 + 1);
        let key = |&i: &u32| {
            let [x, y, z] = [0, 1, 2].map(|k| cell_of(of[i as usize][k], origin[k], inverse) as u32);
            x + dims[0] * (y + dims[1] * z)
        };
        let keys: Vec<u32> = self.members.par_iter().map(key).collect();
        let longest = dims.iter().fold(0, |a, &b| a.max(b)) as f32;
        let reach = self.reach * inverse * 1.00001 + (longest + 2.0) / LONGEST as f32;
        let (mut starts, order) = sort(&keys, dims.iter().product());
        let members = order.par_iter().map(|&i| self.members[i as usize]).collect();
        starts.par_iter_mut().for_each(|start| *start += before);
        (Grid { origin, inverse, dims, reach, starts, peaks: Vec::new() }, members)
    }
}

/// A stable counting sort: where each of `cells` keys begins, with the end behind the last, and the numbers
/// of the keys in order. Each thread takes a range of cells, and looks for it through all keys.
fn sort(keys: &[u32], cells: u32) -> (Vec<u32>, Vec<u32>) {
    let part = (cells as usize).div_ceil(rayon::current_num_threads()).max(1 << 12);
    let mut starts = vec![0u32; cells as usize + 1];
    starts[..cells as usize].par_chunks_mut(part).enumerate().for_each(|(n, counts)| {
        let first = (n * part) as u32;
        for key in keys {
            if let Some(count) = counts.get_mut(key.wrapping_sub(first) as usize) {
                *count += 1;
            }
        }
    });
    let mut sum = 0;
    for start in &mut starts {
        sum += std::mem::replace(start, sum);
    }
    let mut order = vec![0u32; keys.len()];
    let (mut parts, mut left) = (Vec::new(), &mut order[..]);
    for first in (0..cells as usize).step_by(part) {
        let own = &starts[first..(first + part).min(cells as usize)];
        let end = starts[first + own.len()] - own[0];
        let (mine, rest) = left.split_at_mut(end as usize);
        left = rest;
        parts.push((first as u32, own, mine));
    }
    parts.into_par_iter().for_each(|(first, own, mine)| {
        let mut next: Vec<u32> = own.iter().map(|start| start - own[0]).collect();
        for (number, key) in (0..).zip(keys) {
            if let Some(next) = next.get_mut(key.wrapping_sub(first) as usize) {
                mine[*next as usize] = number;
                *next += 1;
            }
        }
    });
    (starts, order)
}

/// Sorts the components into grids: their numbers in the order of the sums, they themselves in it, and the grids.
pub(super) fn arrange(components: &[Stored], peak: f32) -> (Vec<u32>, Vec<Stored>, Vec<Grid>) {
    let mut open = classes(components);
    open.reverse();
    let (mut sorted, mut grids) = (Vec::with_capacity(components.len()), Vec::new());
    let mut numbers = Vec::with_capacity(components.len());
    while let Some(group) = open.pop() {
        let sparse = group.cell() > 1.5 * f64::from(group.reach) && group.members.len() >= 64;
        if sparse
            && grids.len() + open.len() + 2 <= GRIDS
            && let Some([left, right]) = group.halves(components)
        {
            open.extend([right, left]);
            continue;
        }
        let (mut grid, order) = group.grid(components, sorted.len() as u32);
        sorted.par_extend(order.par_iter().map(|&i| components[i as usize]));
        numbers.extend_from_slice(&order);
        grid.peaks = peaks(&grid, &sorted, peak);
        grids.push(grid);
    }
    (numbers, sorted, grids)
}

/// The components by size: within a class they differ by 2, or more where there would be too many classes.
fn classes(components: &[Stored]) -> Vec<Group> {
    let squares = || components.par_iter().map(|component| component[3]);
    let (low, high) = (squares().reduce(|| f32::INFINITY, f32::min), squares().reduce(|| 0.0, f32::max));
    // Of squares.
    let factor = (f64::from(high) / f64::from(low)).powf(1.0 / CLASSES as f64).max(4.0);
    let class = |inverse_square: f32| {
        ((f64::from(inverse_square) / f64::from(low)).ln() / factor.ln()).clamp(0.0, (CLASSES - 1) as f64)
            as usize
    };
    let all = 0..components.len() as u32;
    let members: Vec<Vec<u32>> = if f64::from(high) <= factor * f64::from(low) {
        vec![all.collect()]
    } else {
        let mut members = vec![Vec::new(); CLASSES];
        all.for_each(|i| members[class(components[i as usize][3])].push(i));
        members
    };
    let full = members.into_iter().filter(|members| !members.is_empty());
    full.map(|members| Group::new(components, members)).collect()
}

/// Boxes along each axis, and the first, of the peaks over boxes of `2 << level` cells.
#[inline(always)]
pub(super) fn peak_level(dims: [u32; 3], level: u32) -> ([u32; 3], usize) {
    let boxes = |level: u32| dims.map(|n| ((n - 1) >> (level + 1)) + 1);
    let before = (0..level).map(|level| boxes(level).iter().map(|&n| n as usize).product::<usize>()).sum();
    (boxes(level), before)
}

fn peaks(grid: &Grid, sorted: &[Stored], peak: f32) -> Vec<[f32; 2]> {
    let place = |i: usize, n: [u32; 3]| {
        let i = i as u32;
        [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])]
    };
    let (boxes, _) = peak_level(grid.dims, 0);
    let count = |boxes: [u32; 3]| boxes.iter().map(|&n| n as usize).product::<usize>();
    let lowest = (0..count(boxes)).into_par_iter().map(|i| {
        let first = place(i, boxes).map(|n| 2 * n);
        let last = [0, 1, 2].map(|k| (first[k] + 1).min(grid.dims[k] - 1));
        let mut sums = [0f64; 2];
        for component in grid.runs([first, last]).flat_map(|run| &sorted[run]) {
            sums[usize::from(component[4] > 0.0)] += f64::from(component[4]) * f64::from(peak);
        }
        sums.map(|sum| sum as f32)
    });
    let mut all: Vec<[f32; 2]> = lowest.collect();
    let mut level = 0;
    while peak_level(grid.dims, level).0.iter().any(|&n| n > 4) {
        let (from, before) = peak_level(grid.dims, level);
        let (boxes, first_of_next) = peak_level(grid.dims, level + 1);
        for i in 0..count(boxes) {
            let [x, y, z] = place(i, boxes).map(|n| 2 * n);
            let mut sums = [0f32; 2];
            for (dz, dy, dx) in (0..8).map(|i| (i / 4, i / 2 % 2, i % 2)) {
                let at = [x + dx, y + dy, z + dz];
                if at[0] < from[0] && at[1] < from[1] && at[2] < from[2] {
                    let [negative, positive] =
                        all[before + (at[0] + from[0] * (at[1] + from[1] * at[2])) as usize];
                    sums = [sums[0] + negative, sums[1] + positive];
                }
            }
            all.push(sums);
        }
        debug_assert_eq!(all.len(), first_of_next + count(boxes));
        level += 1;
    }
    all
}
