//! The bricks that hold surface, between the CPU's stages: their records, and tasks over them.

use super::ExtractError;
use crate::memory;
use crate::mesh::Vertex;
use crate::stage::classify::BrickRecord;
use crate::stage::scan::cpu::scan;
use std::ops::Range;

/// Bricks that one task takes.
pub(crate) const TASK: usize = 32;

/// Bytes of a brick in [`Kept`].
pub(crate) const KEPT_BYTES: u64 = size_of::<BrickRecord>() as u64 + 8 + 4 + 1;

/// Bytes of a mesh of so many: more than `usize` counts on 32 bits.
pub(super) fn mesh_bytes(vertices: usize, triangles: usize) -> u64 {
    vertices as u64 * size_of::<Vertex>() as u64 + triangles as u64 * 12
}

/// Gives a vector a length, and new memory only where that is more than it had: zeroed pages, which cost nothing until they
/// are written.
pub(super) fn resize<T: bytemuck::Zeroable + Copy>(items: &mut Vec<T>, length: usize) {
    if length > items.capacity() {
        // The old memory first: both together may be too much.
        *items = Vec::new();
        *items = memory::zeroed(length);
    } else {
        items.resize(length, T::zeroed());
    }
}

/// The bricks that hold surface, with what classify says of them.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    pub(crate) bricks: Vec<u32>,
    pub(crate) records: Vec<BrickRecord>,
    /// Vertices and triangles of each; once emitted, those before it, and the totals behind the last.
    pub(crate) counts: Vec<[u32; 2]>,
    /// Whether the first point of each is inside.
    pub(crate) first_inside: Vec<bool>,
    /// NaN and infinite samples of a field, of bricks without surface too.
    pub(crate) non_finite: u64,
    /// What the bricks and those of the tasks that found them took for a moment, as they were gathered.
    pub(crate) gathered_bytes: u64,
}

impl Kept {
    /// What the bricks take in memory.
    pub(crate) fn bytes(&self) -> u64 {
        self.bricks.len() as u64 * KEPT_BYTES
    }

    pub(super) fn clear(&mut self) {
        self.bricks.clear();
        self.records.clear();
        self.counts.clear();
        self.first_inside.clear();
        self.non_finite = 0;
        self.gathered_bytes = 0;
    }

    /// Adds a brick, if it has triangles or vertices.
    #[inline(always)]
    pub(super) fn push(&mut self, brick: u32, record: &BrickRecord, count: [u32; 2], first_inside: bool) {
        if count != [0; 2] {
            self.bricks.push(brick);
            self.records.push(*record);
            self.counts.push(count);
            self.first_inside.push(first_inside);
        }
    }

    /// Drops the bricks without triangles and vertices.
    pub(super) fn drop_empty(&mut self) {
        let mut to = 0;
        for from in 0..self.counts.len() {
            if self.counts[from] != [0; 2] {
                if to < from {
                    (self.bricks[to], self.records[to], self.counts[to]) =
                        (self.bricks[from], self.records[from], self.counts[from]);
                    self.first_inside[to] = self.first_inside[from];
                }
                to += 1;
            }
        }
        self.bricks.truncate(to);
        self.records.truncate(to);
        self.counts.truncate(to);
        self.first_inside.truncate(to);
    }

    /// Vertices and triangles of all bricks.
    pub(crate) fn totals(&self) -> Result<[usize; 2], ExtractError> {
        let add = |t: [u64; 2], c: &[u32; 2]| [t[0] + u64::from(c[0]), t[1] + u64::from(c[1])];
        let [vertices, triangles] = self.counts.iter().fold([0; 2], add);
        if vertices > u64::from(u32::MAX) || 3 * triangles > u64::from(u32::MAX) {
            return Err(ExtractError::TooLarge { vertices, triangles });
        }
        Ok([vertices as usize, triangles as usize])
    }

    /// From counts to offsets.
    pub(crate) fn scan(&mut self) {
        self.counts.push([0; 2]);
        scan(&mut self.counts);
    }

    /// Vertices and triangles of a slot, once there are offsets.
    #[inline(always)]
    pub(crate) fn own(&self, slot: usize) -> [Range<usize>; 2] {
        [0, 1].map(|i| self.counts[slot][i] as usize..self.counts[slot + 1][i] as usize)
    }

    /// The room for a slot's vertices and triangles, off the front of what is left.
    #[inline(always)]
    pub(crate) fn take_own<'a>(
        &self,
        slot: usize,
        vertices: &mut &'a mut [Vertex],
        triangles: &mut &'a mut [[u32; 3]],
    ) -> (&'a mut [Vertex], &'a mut [[u32; 3]]) {
        let [own_vertices, own_triangles] = self.own(slot).map(|own| own.len());
        let (first_vertices, rest) = std::mem::take(vertices).split_at_mut(own_vertices);
        *vertices = rest;
        let (first_triangles, rest) = std::mem::take(triangles).split_at_mut(own_triangles);
        *triangles = rest;
        (first_vertices, first_triangles)
    }

    pub(crate) fn reserve(&mut self, bricks: usize) {
        self.bricks.reserve_exact(bricks);
        self.records.reserve_exact(bricks);
        self.counts.reserve_exact(bricks + 1);
        self.first_inside.reserve_exact(bricks);
    }

    /// A copy of the bricks from slot `first` on, with `less` taken off their numbers.
    pub(super) fn tail(&self, first: usize, less: u32) -> Self {
        Self {
            bricks: self.bricks[first..].iter().map(|brick| brick - less).collect(),
            records: self.records[first..].to_vec(),
            counts: self.counts[first..].to_vec(),
            first_inside: self.first_inside[first..].to_vec(),
            ..Self::default()
        }
    }

    /// Adds the bricks of tasks, so many in all. For a moment there are both.
    pub(super) fn gather(&mut self, bricks: usize, tasks: Vec<Self>) {
        self.reserve(bricks);
        for mut task in tasks {
            self.append(&mut task);
        }
        self.gathered_bytes = 2 * self.bytes();
    }

    pub(crate) fn append(&mut self, other: &mut Self) {
        self.bricks.append(&mut other.bricks);
        self.records.append(&mut other.records);
        self.counts.append(&mut other.counts);
        self.first_inside.append(&mut other.first_inside);
        self.non_finite += other.non_finite;
    }
}

/// A run of slots and the part of the mesh that is theirs.
pub(crate) struct Task<'a> {
    pub(crate) slots: Range<usize>,
    pub(crate) vertices: &'a mut [Vertex],
    pub(crate) triangles: &'a mut [[u32; 3]],
}

pub(crate) fn tasks<'a>(
    offsets: &[[u32; 2]],
    slots: Range<usize>,
    mut vertices: &'a mut [Vertex],
    mut triangles: &'a mut [[u32; 3]],
) -> Vec<Task<'a>> {
    let mut tasks = Vec::with_capacity(slots.len().div_ceil(TASK));
    for first in slots.clone().step_by(TASK) {
        let end = (first + TASK).min(slots.end);
        let size = [0, 1].map(|i| (offsets[end][i] - offsets[first][i]) as usize);
        let (own_vertices, own_triangles);
        (own_vertices, vertices) = vertices.split_at_mut(size[0]);
        (own_triangles, triangles) = triangles.split_at_mut(size[1]);
        tasks.push(Task { slots: first..end, vertices: own_vertices, triangles: own_triangles });
    }
    tasks
}
