//! Culling of fields by intervals; CPU twin of `shaders/bounds.wgsl`.
//!
//! The sizes of the boxes are not the shader's, and need not be: bounds of a box hold those of its parts, also as they
//! are rounded, so that the bricks that are left are those whose own bounds say so.
//!
//! Boxes of bricks are looked at from large to small (Duff 1992): one whose interval lies on one side of iso
//! has no surface, and of one that may have, the field is pruned to what matters there, for the
//! boxes within. Conservative: it never changes the mesh.

use super::cpu::{Range, straddles};
use crate::field::{Field, Within};
use crate::graph::GraphField;
use crate::graph::interval::{self as iv, Interval};
use crate::stage::inside::order_key;
use crate::stage::params::Params;
use glam::UVec3;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Bricks along the edge of a block.
const BLOCK: u32 = 4;
/// Bricks along the edge of the boxes that are looked at first.
const LARGEST: u32 = 32;
/// Bricks along the edge of the boxes that one thread takes.
const SHARED: u32 = 8;

/// The bricks that may hold surface, in order, and the pruned fields of their blocks.
#[derive(Debug, Default)]
pub struct Culled {
    /// Numbers of the bricks.
    pub active: Vec<u32>,
    /// The pruned fields.
    pub fields: BlockFields,
    /// Boxes of bricks, from the first to before the end, where nothing changed ([`cull_changed`]).
    pub same: Vec<[UVec3; 2]>,
}

impl Culled {
    fn joined(mut self, other: Self) -> Self {
        self.active.extend(other.active);
        self.fields.0.extend(other.fields.0);
        self.same.extend(other.same);
        self
    }
}

/// Operations from which on a field is pruned once more for each brick. That takes as long as to evaluate it at some 64 points, of 729 in the
/// brick.
const LONG: usize = 256;

/// Whether pruning a field for a brick may save more than it takes.
fn is_long(field: &dyn Field) -> bool {
    field.as_graph().is_some_and(|field| field.operations() >= LONG && field.has_choices())
}

fn operations(field: &dyn Field) -> usize {
    field.as_graph().map_or(0, GraphField::operations)
}

/// The field in a brick.
pub enum FieldIn<'a> {
    /// That of all bricks around.
    Block(&'a dyn Field),
    /// Pruned for this one.
    Brick(Arc<dyn Field>),
}

impl FieldIn<'_> {
    /// The field itself.
    pub fn get(&self) -> &dyn Field {
        match self {
            Self::Block(field) => *field,
            Self::Brick(field) => &**field,
        }
    }
}

/// Pruned fields by the number of the block of bricks that they hold in; none where the whole field does.
#[derive(Debug, Default)]
pub struct BlockFields(HashMap<u32, Arc<dyn Field>>);

impl BlockFields {
    /// A field that is the same as the whole one in that brick.
    pub fn field_in<'a>(&'a self, params: &Params, brick: u32, whole: &'a dyn Field) -> FieldIn<'a> {
        let of_block = self.of_block(params, brick, whole);
        let own = || {
            let first = params.brick_origin(brick) / 8;
            let own = of_block.within(region(params, first, first + 1)).field?;
            (2 * operations(&*own) <= operations(of_block)).then_some(own)
        };
        let own = if self.prunes_bricks(of_block) { own() } else { None };
        own.map_or(FieldIn::Block(of_block), FieldIn::Brick)
    }

    /// The field that all bricks of a brick's block have in common.
    pub fn of_block<'a>(&'a self, params: &Params, brick: u32, whole: &'a dyn Field) -> &'a dyn Field {
        if self.0.is_empty() {
            return whole;
        }
        let block = block_of(params, params.brick_origin(brick) / 8);
        self.0.get(&block).map_or(whole, |field| &**field)
    }

    /// Whether the bricks of a block with this field may have fields of their own.
    pub fn prunes_bricks(&self, of_block: &dyn Field) -> bool {
        !self.0.is_empty() && is_long(of_block)
    }

    /// Prunes `whole` in those blocks of `bricks` that are not in `seen` yet.
    pub fn reach(&mut self, params: &Params, whole: &dyn Field, bricks: &[u32], seen: &mut HashSet<u32>) {
        let mut reached = Vec::new();
        for &brick in bricks {
            let place = params.brick_origin(brick) / 8;
            if seen.insert(block_of(params, place)) {
                reached.push(place / BLOCK * BLOCK);
            }
        }
        let extent = UVec3::from(params.slab_extent);
        let pruned = reached.into_par_iter().filter_map(|first| {
            let within = whole.within(region(params, first, (first + BLOCK).min(extent)));
            Some((block_of(params, first), within.field?))
        });
        self.0.par_extend(pruned);
    }
}

fn block_of(params: &Params, brick: UVec3) -> u32 {
    let [nx, ny, _] = params.slab_extent.map(|n| n.div_ceil(BLOCK));
    let b = brick / BLOCK;
    b.x + nx * (b.y + ny * b.z)
}

/// The box of points of the bricks from `first` to before `end`.
fn region(params: &Params, first: UVec3, end: UVec3) -> [Interval; 3] {
    region_of_cells(params, first * 8, end * 8)
}

/// The box of points of the cells from `first` to before `end`, cut off at the grid's end.
pub fn region_of_cells(params: &Params, first: UVec3, end: UVec3) -> [Interval; 3] {
    let high = end.min(UVec3::from(params.points) - 1);
    let [x, y, z] =
        [0, 1, 2].map(|i| Interval::new(first[i] as f32 - params.margin, high[i] as f32 - params.margin));
    let world = |k: usize| {
        let along = |step: [f32; 3], by| iv::mul(Interval::point(step[k]), by);
        let (along_x, along_y, along_z) =
            (along(params.step_x, x), along(params.step_y, y), along(params.step_z, z));
        iv::add(Interval::point(params.origin[k]), iv::add(iv::add(along_x, along_y), along_z))
    };
    [world(0), world(1), world(2)]
}

/// Whether a field with this range in a box can have samples on both sides of iso there.
pub fn can_cross(params: &Params, range: Interval) -> bool {
    straddles(params, keys(range))
}

fn keys(range: Interval) -> Range {
    if range.is_bounded() { [range.lo, range.hi].map(|v| order_key(v.to_bits())) } else { [0, u32::MAX] }
}

/// The bricks of the whole grid that may hold surface.
pub fn cull_field(params: &Params, field: &dyn Field) -> Culled {
    cull_changed(params, field, None, 0.0)
}

/// The bricks that may hold surface but for those in boxes where the field is what it was `before`, bit for bit. These
/// are in [`Culled::same`]. `reach` is how far around a brick its vertices' normals are taken from, in world units.
pub fn cull_changed(params: &Params, field: &dyn Field, before: Option<&GraphField>, reach: f32) -> Culled {
    let extent = UVec3::from(params.slab_extent);
    let boxes = extent.map(|n| n.div_ceil(LARGEST));
    let descent = Descent { params, reach };
    let parts = (0..boxes.element_product()).into_par_iter().map(|i| {
        let first = UVec3::new(i % boxes.x, i / boxes.x % boxes.y, i / (boxes.x * boxes.y)) * LARGEST;
        let mut found = Culled::default();
        descent.descend(Here { field, pruned: None, before }, first, LARGEST, &mut found);
        found
    });
    let mut all = parts.reduce(Culled::default, Culled::joined);
    all.active.par_sort_unstable();
    all
}

struct Descent<'a> {
    params: &'a Params,
    reach: f32,
}

/// What is known in the box around.
#[derive(Clone, Copy)]
struct Here<'a> {
    field: &'a dyn Field,
    /// The field again, where it has been pruned.
    pruned: Option<&'a Arc<dyn Field>>,
    before: Option<&'a GraphField>,
}

impl Descent<'_> {
    fn descend(&self, here: Here<'_>, first: UVec3, side: u32, found: &mut Culled) {
        let extent = UVec3::from(self.params.slab_extent);
        if first.cmpge(extent).any() {
            return;
        }
        let end = (first + side).min(extent);
        let mut region = region(self.params, first, end);
        if self.reach > 0.0 {
            if !can_cross(self.params, here.field.range(region)) {
                return;
            }
            region = region.map(|side| iv::add(side, Interval::new(-self.reach, self.reach)));
        }
        // Of bricks no pruned field is kept: there are too many (`BlockFields::field_in`).
        let is_brick = side == 1;
        let Within { range, field: simpler } = if is_brick {
            Within { range: here.field.range(region), field: None }
        } else {
            here.field.within(region)
        };
        if !can_cross(self.params, range) {
            return;
        }
        if let (Some(before), Some(field)) = (here.before, here.field.as_graph())
            && field.is_same(before, region)
        {
            found.same.push([first, end]);
            return;
        }
        if is_brick {
            found.active.push(first.x + extent.x * (first.y + extent.y * first.z));
            return;
        }
        let pruned = simpler.as_ref().or(here.pruned);
        let field = pruned.map_or(here.field, |field| &**field);
        let simpler = here.before.and_then(|before| before.within(region).field);
        let before = simpler.as_ref().and_then(|field| field.as_graph()).or(here.before);
        if side == BLOCK
            && let Some(pruned) = pruned
        {
            found.fields.0.insert(block_of(self.params, first), pruned.clone());
        }
        // Blocks are divided into bricks at once, larger boxes and long fields into eight.
        let (parts, next) = if side == BLOCK && !is_long(field) { (BLOCK, 1) } else { (2, side / 2) };
        let here = Here { field, pruned, before };
        let of_part = |i: u32, found: &mut Culled| {
            let place = UVec3::new(i % parts, i / parts % parts, i / (parts * parts));
            self.descend(here, first + place * next, next, found);
        };
        let count = parts * parts * parts;
        if side > SHARED {
            let of_parts = (0..count).into_par_iter().map(|i| {
                let mut found = Culled::default();
                of_part(i, &mut found);
                found
            });
            let of_parts = of_parts.reduce(Culled::default, Culled::joined);
            *found = std::mem::take(found).joined(of_parts);
        } else {
            (0..count).for_each(|i| of_part(i, found));
        }
    }
}
