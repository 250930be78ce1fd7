//! A whole grid: the Euler characteristic and the Betti numbers of its trilinear isosurface, piece by piece, from what
//! [`exact`](crate::exact) says of each cell. Nothing is triangulated.

use crate::exact::{Cell, Decided, around, decide_cell, faces, number};
use crate::grids::BORDER;
use std::cmp::Ordering;
use std::collections::BTreeSet;

/// A small grid of differences from iso, positive inside; its border is outside, so that the surface is closed.
pub struct Small {
    /// Points along each axis, the border's included.
    pub points: usize,
    pub values: Vec<i64>,
}

impl Small {
    /// A cell by itself.
    pub fn of_cell(cell: &Cell) -> Self {
        let mut values = vec![BORDER; 64];
        for (corner, value) in cell.iter().enumerate() {
            values[21 + (corner & 1) + 4 * (corner >> 1 & 1) + 16 * (corner >> 2)] = *value;
        }
        Self { points: 4, values }
    }
}

/// What an isosurface is, up to a homeomorphism of each piece (they are closed and orientable).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topology {
    /// The Euler characteristic of each piece, in order.
    pub pieces: Vec<i64>,
    /// The regions inside and those outside.
    pub regions: [usize; 2],
}

impl Topology {
    pub fn euler(&self) -> i64 {
        self.pieces.iter().sum()
    }

    /// b₀, b₁ and b₂: every piece is closed and in space, thus orientable.
    pub fn betti(&self) -> [i64; 3] {
        let pieces = self.pieces.len() as i64;
        [pieces, 2 * pieces - self.euler(), pieces]
    }
}

/// Sets that grow together.
pub struct Sets(Vec<u32>);

impl Sets {
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    pub fn find(&mut self, mut of: u32) -> u32 {
        while self.0[of as usize] != of {
            self.0[of as usize] = self.0[self.0[of as usize] as usize];
            of = self.0[of as usize];
        }
        of
    }

    pub fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [a, b].map(|of| self.find(of));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// The edge of a cell between two corners: its lower one, and its axis.
fn edge(a: u8, b: u8) -> (u8, usize) {
    (a & b, (a ^ b).trailing_zeros() as usize)
}

/// Where the surface crosses the faces of a cell: pairs of edges.
fn segments(cell: &Cell, decided: &Decided) -> Vec<[(u8, usize); 2]> {
    let mut all = Vec::with_capacity(12);
    for (face, decision) in faces().into_iter().zip(decided.faces) {
        let edges = [0, 1, 2, 3].map(|i| edge(face[i], face[(i + 1) % 4]));
        let crossed = |i: &usize| {
            let [a, b] = [face[*i], face[(*i + 1) % 4]].map(|corner| cell[corner as usize] > 0);
            a != b
        };
        match decision {
            // The pair that is not connected is cut off, each by the edges beside it.
            Some(Ordering::Greater) => all.extend([[edges[0], edges[1]], [edges[2], edges[3]]]),
            Some(_) => all.extend([[edges[3], edges[0]], [edges[1], edges[2]]]),
            None => {
                let mut both = (0..4).filter(crossed).map(|i| edges[i]);
                if let (Some(a), Some(b)) = (both.next(), both.next()) {
                    all.push([a, b]);
                }
            }
        }
    }
    all
}

/// A boundary loop of the surface in a cell: one of its edges, and the regions inside and outside that lie beside it.
struct Loop {
    edge: (u8, usize),
    between: (u8, u8),
}

/// The loops of a cell. A component of the surface separates two regions, and regions and components form a tree, for a
/// cell has no holes; so two loops are of one component where they lie between the same two regions.
fn loops(cell: &Cell, decided: &Decided, segments: &[[(u8, usize); 2]]) -> Vec<Loop> {
    let name = |(low, axis): (u8, usize)| u32::from(low) + 8 * axis as u32;
    let mut sets = Sets::new(24);
    segments.iter().for_each(|[a, b]| sets.join(name(*a), name(*b)));
    let beside = |(low, axis): (u8, usize)| {
        let [low, high] = [low, low | 1 << axis].map(usize::from);
        let [a, b] = [decided.body[low], decided.body[high]];
        if cell[low] > 0 { (a, b) } else { (b, a) }
    };
    let mut all: Vec<Loop> = Vec::with_capacity(4);
    for edge in segments.iter().flatten().copied() {
        let first = sets.find(name(edge));
        let first = ((first % 8) as u8, first as usize / 8);
        let between = beside(edge);
        assert_eq!(between, beside(first), "the same all along a loop: {cell:?}");
        if all.iter().all(|known| known.edge != first) {
            all.push(Loop { edge: first, between });
        }
    }
    // On the surface of the cell, a sphere, loops and regions form a tree just as components and regions do in it.
    assert_eq!(all.len() + 1, number(&decided.surface), "{cell:?}");
    all
}

/// The topology of a grid, or `None` where a cell is singular.
pub fn topology(grid: &Small) -> Option<Topology> {
    let n = grid.points;
    let offset =
        |corner: u8| (corner & 1) as usize + n * ((corner >> 1 & 1) as usize + n * (corner >> 2) as usize);
    let offsets = [0, 1, 2, 3, 4, 5, 6, 7].map(offset);
    let mut regions = Sets::new(grid.values.len());
    let mut sheets = Sets::new(3 * grid.values.len());
    // What belongs to the piece that an edge is of: twice the Euler characteristic, for a segment is of two cells.
    let mut twice: Vec<(u32, i64)> = Vec::new();
    for base in
        (0..n - 1).flat_map(|z| (0..n - 1).flat_map(move |y| (0..n - 1).map(move |x| x + n * (y + n * z))))
    {
        let cell: Cell = offsets.map(|offset| grid.values[base + offset]);
        let point = |corner: u8| (base + offsets[corner as usize]) as u32;
        let inside = cell.iter().filter(|v| **v > 0).count();
        if inside % 8 == 0 {
            (1..8).for_each(|corner| regions.join(point(0), point(corner)));
            continue;
        }
        let decided = decide_cell(&cell)?;
        (0..8).for_each(|corner| regions.join(point(corner), point(decided.body[corner as usize])));
        let global = |(low, axis): (u8, usize)| 3 * point(low) + axis as u32;
        let segments = segments(&cell, &decided);
        for [a, b] in &segments {
            sheets.join(global(*a), global(*b));
            twice.push((global(*a), -1));
        }
        // A component is a sphere without a disc for each of its loops.
        let loops = loops(&cell, &decided, &segments);
        let mut components = 0;
        for (i, Loop { edge, between }) in loops.iter().enumerate() {
            let first = loops.iter().position(|other| other.between == *between).unwrap_or(i);
            sheets.join(global(*edge), global(loops[first].edge));
            twice.push((global(*edge), if first == i { 4 - 2 } else { -2 }));
            components += usize::from(first == i);
        }
        assert_eq!(components + 1, number(&decided.body), "{cell:?}");
    }
    for (point, value) in (0u32..).zip(&grid.values) {
        let next = |axis: u32| grid.values.get(point as usize + n.pow(axis)).copied();
        // The border is of one sign: there are no crossed edges from the end of a row to the next row.
        let crossed = |axis: &u32| next(*axis).is_some_and(|next| (next > 0) != (*value > 0));
        twice.extend((0..3).filter(crossed).map(|axis| (3 * point + axis, 2)));
    }
    let mut sums = vec![(0, false); 3 * grid.values.len()];
    for (edge, part) in twice {
        let piece = &mut sums[sheets.find(edge) as usize];
        *piece = (piece.0 + part, true);
    }
    let mut pieces: Vec<i64> = sums.into_iter().filter(|piece| piece.1).map(|piece| piece.0).collect();
    assert!(pieces.iter().all(|twice| twice % 4 == 0), "closed and orientable: χ is even");
    pieces.iter_mut().for_each(|twice| *twice /= 2);
    pieces.sort_unstable();
    let mut counts = [0, 0];
    for (point, value) in (0u32..).zip(&grid.values) {
        counts[usize::from(*value <= 0)] += usize::from(regions.find(point) == point);
    }
    // Space has no holes either: regions and pieces form a tree.
    assert_eq!(pieces.len() + 1, counts[0] + counts[1]);
    Some(Topology { pieces, regions: counts })
}

#[test]
fn known_shapes() {
    let shape = |inside: fn([i32; 3]) -> bool| {
        let at = |i: i32| [i % 7 - 3, i / 7 % 7 - 3, i / 49 - 3];
        let values = (0..343).map(|i| if inside(at(i)) { 5 } else { -7 }).collect();
        let found = topology(&Small { points: 7, values }).expect("no face is ambiguous");
        (found.pieces.clone(), found.betti(), found.regions)
    };
    assert_eq!(shape(|_| false), (vec![], [0, 0, 0], [0, 1]));
    assert_eq!(shape(|p| p == [0, 0, 0]), (vec![2], [1, 0, 1], [1, 1]));
    // A ring, two with a bar in common, and a shell around a point.
    assert_eq!(shape(|[x, y, z]| z == 0 && x.abs().max(y.abs()) == 1), (vec![0], [1, 2, 1], [1, 1]));
    let eight = |[x, y, z]: [i32; 3]| z == 0 && y.abs() <= 1 && x.abs() <= 2 && (y != 0 || x % 2 == 0);
    assert_eq!(shape(eight), (vec![-2], [1, 4, 1], [1, 1]));
    let shell = |p: [i32; 3]| p == [0; 3] || p.map(i32::abs).into_iter().max() == Some(2);
    assert_eq!(shape(shell), (vec![2, 2, 2], [3, 0, 3], [2, 2]));
}

/// All that is assumed of [`around`] and [`faces`].
#[test]
fn faces_are_faces() {
    for (i, face) in faces().into_iter().enumerate() {
        let [axis, high] = [i / 2, i % 2];
        assert!(face.iter().all(|corner| (corner >> axis & 1) as usize == high));
        assert_eq!(face.iter().copied().collect::<BTreeSet<_>>().len(), 4);
        assert!(
            (0..4).all(|i| (face[i] ^ face[(i + 1) % 4]).count_ones() == 1),
            "neighbours are beside each other"
        );
    }
    assert_eq!(around(0, 1), faces()[1]);
}
