//! An octree over a grid's cells, refined where a surface is.
//!
//! Nodes are cubes of 2ᵏ grid cells along each edge whose corners are grid points; the root is the smallest that covers
//! the grid. Of a node's eight children, those that interval bounds show to be free of surface are [`EMPTY`]
//! (Duff 1992), those that lie outside the grid are [`OUTSIDE`]. A leaf never reaches over the grid's border.
//!
//! The tree knows nothing of meshes: who contours it says, node by node, what is to be split ([`Tree::grow`]).

use super::fields::{Fields, WHOLE};
use crate::field::{NoForm, Surface};
use crate::graph::interval::Interval;
use crate::grid::Grid;
use glam::{UVec3, Vec3};
use rayon::prelude::*;

/// A child without surface: all its closed box lies on one side.
pub const EMPTY: u32 = u32::MAX;
/// A child outside the grid.
pub const OUTSIDE: u32 = u32::MAX - 1;
/// [`Node::children`] of a leaf.
const LEAF: u32 = u32::MAX;
/// What decides on nodes, several at a time, whether they are split.
pub type Judge<'a> = &'a (dyn Fn(&Fields, &[Sampled<'_>]) -> Result<Vec<Verdict>, NoForm> + Sync);

/// Nodes that one thread takes at a time: fixed, so that nothing depends on the threads.
const TASK: usize = 32;
/// From this size on a node's field is pruned; smaller ones have their parent's, so that batches stay large.
const PRUNED: u32 = 8;

/// A cube of grid cells.
#[derive(Debug, Clone, Copy)]
pub struct Node {
    /// The lowest corner, as a grid point.
    pub low: UVec3,
    /// Cells along an edge.
    pub size: u32,
    /// The surface's signed values at the corners, bits `zyx`.
    pub values: [f32; 8],
    /// What to evaluate within the node ([`Fields`]).
    pub field: u32,
    /// The group of children, or [`LEAF`].
    children: u32,
}

impl Node {
    /// Whether it was not split.
    pub fn is_leaf(&self) -> bool {
        self.children == LEAF
    }

    /// The highest corner, as a grid point.
    pub fn high(&self) -> UVec3 {
        self.low + self.size
    }
}

/// What is known of a node when it is decided whether to split it: the values at its 27 lattice points (corners,
/// and the middles of edges, faces and the cell), x fastest.
pub struct Sampled<'a> {
    /// The node.
    pub node: &'a Node,
    /// Signed values.
    pub lattice: &'a [f32; 27],
}

/// What becomes of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It is a leaf.
    Keep,
    /// It is to be split, if the budget allows.
    Split,
}

/// See the module.
#[derive(Debug)]
pub struct Tree {
    /// The root is the first.
    pub nodes: Vec<Node>,
    groups: Vec<[u32; 8]>,
    /// The pruned fields.
    pub fields: Fields,
    /// Leaves of the smallest size whose bounds do not exclude surface though no corner differs in sign. They are
    /// [`EMPTY`] in the tree.
    pub thin: u64,
    /// Cells along the root's edge.
    pub size: u32,
}

/// How far [`Tree::grow`] got.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Grown {
    /// Nodes that were to be split and were not, for want of budget.
    pub unsplit: u64,
    /// The size of the largest of them, in cells; 0 if there are none.
    pub unsplit_size: u32,
}

/// A child before it is one.
struct Child {
    low: UVec3,
    values: [f32; 8],
    /// A field that is simpler there, and the box it is for.
    pruned: Option<(std::sync::Arc<dyn crate::field::Field>, Vec3, Vec3)>,
}

enum Slot {
    Empty,
    Thin,
    Outside,
    Child(Box<Child>),
}

/// The world box around the points of the grid from `low` to `high`.
pub fn world_box(grid: &Grid, low: UVec3, high: UVec3) -> (Vec3, Vec3) {
    let corners = (0..8u32).map(|c| {
        let pick = |k: usize| if c >> k & 1 == 1 { high[k] } else { low[k] };
        grid.position(Vec3::new(pick(0) as f32, pick(1) as f32, pick(2) as f32))
    });
    corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
}

fn corner_offset(c: usize) -> UVec3 {
    UVec3::new(c as u32 & 1, c as u32 >> 1 & 1, c as u32 >> 2)
}

/// Whether bounds say that a closed box lies on one side of the surface.
pub fn excludes(range: Interval) -> bool {
    range.is_bounded() && (range.lo >= 0.0 || range.hi < 0.0)
}

impl Tree {
    /// The root alone.
    ///
    /// # Errors
    /// [`NoForm`] as [`Surface::values`].
    pub fn new(surface: &Surface<'_>, grid: &Grid) -> Result<Self, NoForm> {
        let size = grid.cells().max_element().next_power_of_two();
        let points: Vec<Vec3> = (0..8).map(|c| grid.position((corner_offset(c) * size).as_vec3())).collect();
        let mut values = [0.0; 8];
        surface.values(&points, &mut values)?;
        let root = Node { low: UVec3::ZERO, size, values, field: WHOLE, children: LEAF };
        Ok(Self { nodes: vec![root], groups: Vec::new(), fields: Fields::default(), thin: 0, size })
    }

    /// A node's child, itself for a leaf; [`EMPTY`] and [`OUTSIDE`] are their own children.
    #[inline(always)]
    pub fn child(&self, node: u32, corner: usize) -> u32 {
        if node >= OUTSIDE {
            return node;
        }
        match self.nodes[node as usize].children {
            LEAF => node,
            group => self.groups[group as usize][corner],
        }
    }

    /// Whether nothing is below.
    #[inline(always)]
    pub fn is_leaf(&self, node: u32) -> bool {
        node >= OUTSIDE || self.nodes[node as usize].is_leaf()
    }

    /// Splits `first` and what comes of them, size by size, as long as `verdict` says so of each whole chunk of nodes.
    /// Nodes of one cell are never split, those that reach over the grid's border always. `budget` is the most nodes.
    ///
    /// # Errors
    /// [`NoForm`] as [`Surface::values`].
    pub fn grow(
        &mut self,
        surface: &Surface<'_>,
        grid: &Grid,
        budget: u64,
        first: Vec<u32>,
        verdict: Judge<'_>,
    ) -> Result<Grown, NoForm> {
        let mut grown = Grown::default();
        let mut frontier = first;
        let mut forced = true;
        while !frontier.is_empty() {
            let parts: Vec<Vec<Option<[Slot; 8]>>> = frontier
                .par_chunks(TASK)
                .map(|ids| self.split_chunk(surface, grid, ids, forced, verdict))
                .collect::<Result<_, _>>()?;
            forced = false;
            let mut next = Vec::new();
            for (id, slots) in frontier.iter().zip(parts.into_iter().flatten()) {
                let Some(slots) = slots else { continue };
                let node = self.nodes[*id as usize];
                let straddles = node.high().cmpgt(grid.cells()).any();
                if self.nodes.len() as u64 + 8 > budget && !straddles {
                    grown.unsplit += 1;
                    grown.unsplit_size = grown.unsplit_size.max(node.size);
                    continue;
                }
                let mut group = [EMPTY; 8];
                for (slot, to) in slots.into_iter().zip(&mut group) {
                    *to = match slot {
                        Slot::Empty => EMPTY,
                        Slot::Outside => OUTSIDE,
                        Slot::Thin => {
                            self.thin += 1;
                            EMPTY
                        }
                        Slot::Child(child) => {
                            let field = match child.pruned {
                                Some((field, low, high)) => self.fields.add(field, low, high, node.field),
                                None => node.field,
                            };
                            let new = self.nodes.len() as u32;
                            let (low, values, size) = (child.low, child.values, node.size / 2);
                            self.nodes.push(Node { low, size, values, field, children: LEAF });
                            if size > 1 {
                                next.push(new);
                            }
                            new
                        }
                    };
                }
                self.nodes[*id as usize].children = self.groups.len() as u32;
                self.groups.push(group);
            }
            frontier = next;
        }
        Ok(grown)
    }

    /// The children of those nodes that are to be split. Nodes that are `forced` ask for no verdict.
    fn split_chunk(
        &self,
        surface: &Surface<'_>,
        grid: &Grid,
        ids: &[u32],
        forced: bool,
        verdict: Judge<'_>,
    ) -> Result<Vec<Option<[Slot; 8]>>, NoForm> {
        let nodes: Vec<Node> = ids.iter().map(|&id| self.nodes[id as usize]).collect();
        let lattices = self.lattices(surface, grid, &nodes)?;
        let straddles = |node: &Node| node.high().cmpgt(grid.cells()).any();
        let asked: Vec<usize> =
            (0..nodes.len()).filter(|&i| nodes[i].size > 1 && !forced && !straddles(&nodes[i])).collect();
        let sampled: Vec<Sampled<'_>> =
            asked.iter().map(|&i| Sampled { node: &nodes[i], lattice: &lattices[i] }).collect();
        let mut split: Vec<bool> = nodes.iter().map(|n| n.size > 1).collect();
        for (&i, verdict) in asked.iter().zip(verdict(&self.fields, &sampled)?) {
            split[i] = verdict == Verdict::Split;
        }
        let children = |i: usize| {
            let node = &nodes[i];
            let half = node.size / 2;
            std::array::from_fn(|c| {
                let offset = corner_offset(c);
                let low = node.low + offset * half;
                if low.cmpge(grid.cells()).any() {
                    return Slot::Outside;
                }
                let values: [f32; 8] = std::array::from_fn(|d| {
                    let at = offset + corner_offset(d);
                    lattices[i][(at.x + 3 * at.y + 9 * at.z) as usize]
                });
                let (lo, hi) = world_box(grid, low, (low + half).min(grid.cells()));
                let here = self.fields.surface(surface, node.field);
                let mixed = values.iter().any(|v| *v < 0.0) && values.iter().any(|v| *v >= 0.0);
                if half >= PRUNED {
                    let within = here.within(lo, hi);
                    if excludes(within.range) && !mixed {
                        return Slot::Empty;
                    }
                    let pruned = within.field.map(|field| (field, lo, hi));
                    return Slot::Child(Box::new(Child { low, values, pruned }));
                }
                if !mixed && excludes(here.range(lo, hi)) {
                    return Slot::Empty;
                }
                if half == 1 && !mixed {
                    return Slot::Thin;
                }
                Slot::Child(Box::new(Child { low, values, pruned: None }))
            })
        };
        Ok((0..nodes.len()).map(|i| split[i].then(|| children(i))).collect())
    }

    /// The signed values at the 27 lattice points of each node, corners from the nodes themselves. Points outside
    /// the grid are evaluated, too.
    fn lattices(&self, surface: &Surface<'_>, grid: &Grid, nodes: &[Node]) -> Result<Vec<[f32; 27]>, NoForm> {
        let is_corner = |i: usize| i % 3 != 1 && i / 3 % 3 != 1 && i / 9 != 1;
        let mut points = Vec::with_capacity(19 * nodes.len());
        let mut fields = Vec::with_capacity(19 * nodes.len());
        for node in nodes.iter().filter(|n| n.size > 1) {
            for i in (0..27).filter(|&i| !is_corner(i)) {
                let at = UVec3::new(i as u32 % 3, i as u32 / 3 % 3, i as u32 / 9);
                points.push(grid.position((node.low + at * (node.size / 2)).as_vec3()));
                fields.push(node.field);
            }
        }
        let mut values = vec![0.0; points.len()];
        self.fields.values(surface, &fields, &points, &mut values)?;
        let mut values = values.into_iter();
        let lattice = |node: &Node| {
            std::array::from_fn(|i| {
                if is_corner(i) {
                    node.values[corner_of(i)]
                } else if node.size > 1 {
                    values.next().unwrap_or(f32::INFINITY)
                } else {
                    f32::INFINITY
                }
            })
        };
        Ok(nodes.iter().map(lattice).collect())
    }
}

/// The corner that lattice point `i` is.
fn corner_of(i: usize) -> usize {
    (i % 3 / 2) | ((i / 3 % 3 / 2) << 1) | ((i / 9 / 2) << 2)
}
