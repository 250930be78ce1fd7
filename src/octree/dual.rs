//! The dual of an octree's surface: a polygon around each crossed minimal edge, and which polygons meet in a vertex.
//!
//! The minimal edges are found by the recursive procedures of Ju, Losasso, Schaefer & Warren 2002 (cell, face, edge). A
//! polygon has a corner in each of the three or four leaves around its edge. Two of its neighbouring corners lie in leaves
//! that share a face; the polygons whose edges bound that face are joined there in pairs. Walking around a leaf from
//! polygon to polygon gives its sheets, and each sheet one vertex (Schaefer, Ju & Warren 2007; here from the joined
//! polygons rather than from a table of cases, so that it holds beside smaller leaves, too). Every side is joined to one
//! other or lies on the grid's border, and every vertex has one fan: the surface is manifold whatever the tree and
//! the signs are.
//!
//! On the grid's border a leaf has flat cells beside it, one a face and one an edge of the border, so that the surface
//! reaches the border and is open there.

use super::tree::{EMPTY, OUTSIDE, Tree};
use glam::UVec3;
use rayon::prelude::*;

/// The [`Corner::place`] of a leaf itself.
pub const INNER: u8 = 13;
/// No partner, no vertex.
pub const NONE: u32 = u32::MAX;

/// A cell of the dual surface's vertices: a leaf, or a flat cell on the border beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Corner {
    /// The leaf.
    pub leaf: u32,
    /// Σ 3ᵏ(1 + dₖ), dₖ = −1 or 1 along the axes on which the border cell lies below or above the leaf.
    pub place: u8,
}

/// A crossed minimal edge and the corners around it, counter-clockwise seen from outside the solid (in a right-handed
/// grid).
#[derive(Debug, Clone, Copy)]
pub struct Polygon {
    /// Corners; of three, the last is the first again.
    pub corners: [Corner; 4],
    /// 3 or 4.
    pub count: u8,
    /// The edge's axis.
    pub axis: u8,
    /// A leaf with this whole edge.
    pub owner: u32,
    /// The edge's lower end.
    pub low: UVec3,
    /// Cells along the edge.
    pub length: u32,
    /// Signed values at the edge's ends.
    pub values: [f32; 2],
}

/// The polygons, and how they meet.
#[derive(Debug, Default)]
pub struct Dual {
    /// In an order that follows from the tree alone.
    pub polygons: Vec<Polygon>,
    /// Side s of polygon p is from corner s to the next; `joined[4 p + s]` is the side it is joined to.
    pub joined: Vec<u32>,
    /// The vertex at corner c of polygon p, at `4 p + c`.
    pub vertex: Vec<u32>,
    /// Of each vertex its cell, and where its polygons begin in `fans`.
    pub vertices: Vec<(Corner, u32)>,
    /// Polygons by vertex.
    pub fans: Vec<u32>,
    /// Sides whose vertices another side joins, too: a vertex must be put between.
    pub doubled: Vec<u32>,
}

impl Dual {
    /// Of `tree`; `mirrored` winds all the other way round.
    pub fn new(tree: &Tree, mirrored: bool) -> Self {
        let mut dual = Dual { polygons: polygons(tree, mirrored), ..Dual::default() };
        dual.join(tree);
        dual
    }

    /// The polygons around a vertex.
    pub fn fan(&self, vertex: u32) -> &[u32] {
        let end = self.vertices.get(vertex as usize + 1).map_or(self.fans.len(), |v| v.1 as usize);
        &self.fans[self.vertices[vertex as usize].1 as usize..end]
    }

    /// Joins sides on faces, then walks around the leaves.
    fn join(&mut self, tree: &Tree) {
        let polygons = &self.polygons;
        // Corners (4 p + c) by leaf.
        let mut start = vec![0u32; tree.nodes.len() + 1];
        let corners = || {
            let of = |(p, polygon): (usize, &Polygon)| (0..polygon.count as usize).map(move |c| (p, c));
            polygons.iter().enumerate().flat_map(of)
        };
        for (p, c) in corners() {
            start[polygons[p].corners[c].leaf as usize] += 1;
        }
        let mut end = 0;
        for slot in &mut start {
            end += *slot;
            *slot = end;
        }
        let mut by_leaf = vec![0u32; end as usize];
        // From the last on, so that each leaf's corners keep their order.
        for (p, polygon) in polygons.iter().enumerate().rev() {
            for c in (0..polygon.count as usize).rev() {
                let slot = &mut start[polygon.corners[c].leaf as usize];
                *slot -= 1;
                by_leaf[*slot as usize] = (4 * p + c) as u32;
            }
        }
        let leaves: Vec<u32> =
            (0..tree.nodes.len() as u32).filter(|&l| start[l as usize] < start[l as usize + 1]).collect();
        let around = |leaf: u32| &by_leaf[start[leaf as usize] as usize..start[leaf as usize + 1] as usize];
        let pairs: Vec<Pairs> = leaves
            .par_chunks(1024)
            .map(|leaves| {
                let mut pairs = Pairs::default();
                leaves.iter().for_each(|&leaf| pairs.of_leaf(tree, polygons, around(leaf)));
                pairs
            })
            .collect();
        self.joined = vec![NONE; 4 * polygons.len()];
        for &[a, b] in pairs.iter().flat_map(|p| &p.pairs) {
            self.joined[a as usize] = b;
            self.joined[b as usize] = a;
        }
        self.vertex = vec![NONE; 4 * polygons.len()];
        for &leaf in &leaves {
            for &corner in around(leaf) {
                if self.vertex[corner as usize] == NONE {
                    self.walk(corner);
                }
            }
        }
        // Of a crossed face's pairs, two may lie between the same two vertices.
        for several in pairs.iter().flat_map(|p| &p.several) {
            let ends = |side: u32| {
                let count = u32::from(self.polygons[side as usize / 4].count);
                let next = side / 4 * 4 + (side % 4 + 1) % count;
                let (a, b) = (self.vertex[side as usize], self.vertex[next as usize]);
                (a.min(b), a.max(b))
            };
            for (i, [a, b]) in several.iter().enumerate() {
                if several[..i].iter().any(|[other, _]| ends(*other) == ends(*a)) {
                    self.doubled.extend([*a, *b]);
                }
            }
        }
    }

    /// Gives the corner, and those of the same sheet, a new vertex.
    fn walk(&mut self, first: u32) {
        let vertex = self.vertices.len() as u32;
        let begin = self.fans.len() as u32;
        self.vertices.push((self.polygons[first as usize / 4].corners[first as usize % 4], begin));
        let after = |side: u32, polygons: &[Polygon]| {
            let count = u32::from(polygons[side as usize / 4].count);
            side / 4 * 4 + (side % 4 + 1) % count
        };
        let before = |corner: u32, polygons: &[Polygon]| {
            let count = u32::from(polygons[corner as usize / 4].count);
            corner / 4 * 4 + (corner % 4 + count - 1) % count
        };
        let mut corner = first;
        loop {
            self.vertex[corner as usize] = vertex;
            self.fans.push(corner / 4);
            // The joined side runs the other way: it ends in this cell.
            match self.joined[corner as usize] {
                NONE => break,
                side => corner = after(side, &self.polygons),
            }
            if corner == first {
                return;
            }
        }
        // An open fan: the other way, too.
        corner = first;
        loop {
            match self.joined[before(corner, &self.polygons) as usize] {
                NONE => return,
                side => corner = side,
            }
            self.vertex[corner as usize] = vertex;
            self.fans.push(corner / 4);
        }
    }
}

/// Joined sides.
#[derive(Default)]
struct Pairs {
    pairs: Vec<[u32; 2]>,
    /// Those of faces with more than one.
    several: Vec<Vec<[u32; 2]>>,
    scratch: Vec<(Corner, Corner, u32)>,
}

impl Pairs {
    /// Of the sides whose lower cell is of this leaf.
    fn of_leaf(&mut self, tree: &Tree, polygons: &[Polygon], around: &[u32]) {
        let sides = &mut self.scratch;
        sides.clear();
        for &corner in around {
            let polygon = &polygons[corner as usize / 4];
            let (count, c) = (polygon.count as usize, corner as usize % 4);
            let own = polygon.corners[c];
            for (other, side) in [((c + 1) % count, c), ((c + count - 1) % count, (c + count - 1) % count)] {
                let other = polygon.corners[other];
                let open = own.place != INNER && other.place != INNER;
                if own < other && !open {
                    sides.push((own, other, (corner / 4 * 4) + side as u32));
                }
            }
        }
        sides.sort_unstable();
        for group in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            match group {
                [(_, _, a), (_, _, b)] => self.pairs.push([*a, *b]),
                [_] => {}
                _ => {
                    let pairs = around_face(tree, polygons, group);
                    self.pairs.extend(&pairs);
                    self.several.push(pairs);
                }
            }
        }
    }
}

/// Joins sides on one face, in pairs of neighbours around it such that runs of inside points are parted.
fn around_face(tree: &Tree, polygons: &[Polygon], group: &[(Corner, Corner, u32)]) -> Vec<[u32; 2]> {
    let (a, b, _) = group[0];
    let leaf = |corner: Corner| &tree.nodes[corner.leaf as usize];
    // Twice the centre of the face: of the smaller leaf, of their common part in general.
    let (low, high) = (leaf(a).low.max(leaf(b).low), leaf(a).high().min(leaf(b).high()));
    let mut normal = (0..3).find(|&k| low[k] == high[k]).unwrap_or(0);
    if a.leaf == b.leaf {
        let place = if a.place == INNER { b.place } else { a.place };
        normal = (0..3).find(|&k| [1, 3, 9].map(|w| place / w % 3)[k] != 1).unwrap_or(0);
    }
    let centre = (low + high).as_dvec3();
    let mut sides: Vec<(f64, bool, u32)> = group
        .iter()
        .map(|&(_, _, side)| {
            let polygon = &polygons[side as usize / 4];
            let mut middle = polygon.low * 2;
            middle[polygon.axis as usize] += polygon.length;
            let at = middle.as_dvec3() - centre;
            let (u, v) = (at[(normal + 1) % 3], at[(normal + 2) % 3]);
            // Whether the way around the face, from u to v, goes up the edge, and whether it enters a run of inside
            // points.
            let is_up = if polygon.axis as usize == (normal + 1) % 3 { v < 0.0 } else { u > 0.0 };
            let enters = (polygon.values[1] < 0.0) == is_up;
            (v.atan2(u), enters, side)
        })
        .collect();
    sides.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    if !sides[0].1 {
        sides.rotate_left(1);
    }
    sides.chunks_exact(2).map(|pair| [pair[0].2, pair[1].2]).collect()
}

/// The polygons of all crossed minimal edges.
fn polygons(tree: &Tree, mirrored: bool) -> Vec<Polygon> {
    let walk = Walk { tree, mirrored };
    let mut parts = vec![Part::Cell(0)];
    for k in 0..3 {
        parts.push(Part::Face(k, [OUTSIDE, 0]));
        parts.push(Part::Face(k, [0, OUTSIDE]));
        for q in 0..4 {
            let mut around = [OUTSIDE; 4];
            around[q] = 0;
            parts.push(Part::Edge(k, around));
        }
    }
    // Divided as often as it takes to have work for all threads.
    for _ in 0..4 {
        parts = parts.into_iter().flat_map(|part| walk.divided(part)).collect();
    }
    let of = |part: &Part| {
        let mut found = Vec::new();
        walk.run(*part, &mut found);
        found
    };
    parts.par_iter().with_max_len(16).map(of).collect::<Vec<_>>().concat()
}

#[derive(Clone, Copy)]
enum Part {
    Cell(u32),
    /// Across an axis, the lower node first.
    Face(usize, [u32; 2]),
    /// Along axis k, by the bits of axes k + 1 and k + 2.
    Edge(usize, [u32; 4]),
}

struct Walk<'a> {
    tree: &'a Tree,
    mirrored: bool,
}

/// The child's number with these bits along axes k, k + 1, k + 2.
#[inline(always)]
fn corner(k: usize, along: usize, u: usize, v: usize) -> usize {
    along << k | u << ((k + 1) % 3) | v << ((k + 2) % 3)
}

impl Walk<'_> {
    fn divided(&self, part: Part) -> Vec<Part> {
        let mut parts = Vec::new();
        let is_leaf = match part {
            Part::Cell(node) => self.tree.is_leaf(node),
            Part::Face(_, nodes) => nodes.iter().all(|&n| self.tree.is_leaf(n)),
            Part::Edge(_, nodes) => nodes.iter().all(|&n| self.tree.is_leaf(n)),
        };
        if is_leaf {
            return vec![part];
        }
        self.below(part, &mut |part| parts.push(part));
        parts
    }

    fn run(&self, part: Part, found: &mut Vec<Polygon>) {
        match part {
            Part::Cell(node) if self.tree.is_leaf(node) => {}
            Part::Face(_, [a, b]) if self.tree.is_leaf(a) && self.tree.is_leaf(b) => {}
            Part::Edge(axis, nodes) if nodes.iter().all(|&n| self.tree.is_leaf(n)) => {
                found.extend(self.polygon(axis, nodes));
            }
            _ => self.below(part, &mut |part| self.run(part, found)),
        }
    }

    /// The parts of a part that are not without surface.
    fn below(&self, part: Part, call: &mut dyn FnMut(Part)) {
        let child = |node, corner| self.tree.child(node, corner);
        let mut face = |k: usize, nodes: [u32; 2]| {
            if !nodes.contains(&EMPTY) && nodes != [OUTSIDE; 2] {
                call(Part::Face(k, nodes));
            }
        };
        match part {
            Part::Cell(node) => {
                for k in 0..3 {
                    for (u, v) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                        face(k, [0, 1].map(|side| child(node, corner(k, side, u, v))));
                    }
                }
            }
            Part::Face(k, [a, b]) => {
                for (u, v) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    face(k, [child(a, corner(k, 1, u, v)), child(b, corner(k, 0, u, v))]);
                }
            }
            Part::Edge(..) => {}
        }
        let mut edge = |k: usize, nodes: [u32; 4]| {
            if !nodes.contains(&EMPTY) && nodes != [OUTSIDE; 4] {
                call(Part::Edge(k, nodes));
            }
        };
        match part {
            Part::Cell(node) => {
                for k in 0..3 {
                    for along in 0..2 {
                        edge(k, [0, 1, 2, 3].map(|q| child(node, corner(k, along, q & 1, q >> 1))));
                    }
                }
                for c in 0..8 {
                    let part = child(node, c);
                    if part < OUTSIDE && !self.tree.is_leaf(part) {
                        call(Part::Cell(part));
                    }
                }
            }
            Part::Face(k, [a, b]) => {
                let (u, v) = ((k + 1) % 3, (k + 2) % 3);
                for along in 0..2 {
                    // Along u the others are v and k, along v they are k and u.
                    let at = |side: usize, u: usize, v: usize| child([a, b][side], corner(k, 1 - side, u, v));
                    edge(u, [0, 1, 2, 3].map(|q| at(q >> 1, along, q & 1)));
                    edge(v, [0, 1, 2, 3].map(|q| at(q & 1, q >> 1, along)));
                }
            }
            Part::Edge(k, nodes) => {
                for along in 0..2 {
                    let at = |q: usize| child(nodes[q], corner(k, along, 1 - (q & 1), 1 - (q >> 1)));
                    edge(k, [0, 1, 2, 3].map(at));
                }
            }
        }
    }

    /// The polygon around a minimal edge along axis k, if it is crossed.
    fn polygon(&self, k: usize, nodes: [u32; 4]) -> Option<Polygon> {
        let (u, v) = ((k + 1) % 3, (k + 2) % 3);
        // The smallest leaf has the whole edge.
        let smallest = (0..4)
            .filter(|&q| nodes[q] < OUTSIDE)
            .min_by_key(|&q| self.tree.nodes[nodes[q] as usize].size)?;
        let owner = nodes[smallest];
        let leaf = &self.tree.nodes[owner as usize];
        let (far_u, far_v) = (1 - (smallest & 1), 1 - (smallest >> 1));
        let values = [0, 1].map(|along| leaf.values[corner(k, along, far_u, far_v)]);
        let inside = values.map(|v| v < 0.0);
        if inside[0] == inside[1] {
            return None;
        }
        let mut low = leaf.low;
        low[u] += leaf.size * far_u as u32;
        low[v] += leaf.size * far_v as u32;
        // A quadrant outside the grid is a border cell of its neighbour across the border.
        let corner_at = |q: usize| {
            if nodes[q] < OUTSIDE {
                return Some(Corner { leaf: nodes[q], place: INNER });
            }
            let weight = |axis: usize| [1i8, 3, 9][axis];
            let sign = |bit: usize| if bit == 1 { 1 } else { -1 };
            let step_u = sign(q & 1) * weight(u);
            let step_v = sign(q >> 1) * weight(v);
            for (across, step) in [(q ^ 1, step_u), (q ^ 2, step_v), (q ^ 3, step_u + step_v)] {
                if nodes[across] < OUTSIDE {
                    return Some(Corner { leaf: nodes[across], place: (INNER as i8 + step) as u8 });
                }
            }
            None
        };
        let mut order = [0, 1, 3, 2];
        if inside[1] != self.mirrored {
            order.reverse();
        }
        let mut corners = [Corner { leaf: owner, place: INNER }; 4];
        let mut count = 0;
        for q in order {
            let next = corner_at(q)?;
            if count == 0 || corners[count - 1] != next {
                corners[count] = next;
                count += 1;
            }
        }
        if corners[count - 1] == corners[0] {
            count -= 1;
        }
        if count < 4 {
            corners[3] = corners[0];
        }
        let polygon =
            Polygon { corners, count: count as u8, axis: k as u8, owner, low, length: leaf.size, values };
        (count >= 3).then_some(polygon)
    }
}
