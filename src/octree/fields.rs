//! The pruned fields of a tree, and evaluation at points that have different ones.

use crate::field::{Field, NoForm, Surface};
use glam::Vec3;
use std::sync::Arc;

/// The number of the whole field.
pub const WHOLE: u32 = u32::MAX;

/// A field that is the whole one in a box.
#[derive(Debug)]
struct Pruned {
    field: Arc<dyn Field>,
    low: Vec3,
    high: Vec3,
    /// The one it was pruned from.
    parent: u32,
}

/// Fields that are simpler in a box each.
#[derive(Debug, Default)]
pub struct Fields {
    all: Vec<Pruned>,
}

impl Fields {
    /// Keeps `field`, which is equal to `parent` in the box from `low` to `high`, and gives its number.
    pub fn add(&mut self, field: Arc<dyn Field>, low: Vec3, high: Vec3, parent: u32) -> u32 {
        self.all.push(Pruned { field, low, high, parent });
        self.all.len() as u32 - 1
    }

    /// The surface of field `number`.
    pub fn surface<'a>(&'a self, whole: &Surface<'a>, number: u32) -> Surface<'a> {
        self.all.get(number as usize).map_or(*whole, |pruned| whole.of(&*pruned.field))
    }

    /// The first of `number` and those it was pruned from that holds at `point`.
    #[inline]
    pub fn at(&self, mut number: u32, point: Vec3) -> u32 {
        while let Some(pruned) = self.all.get(number as usize) {
            if point.cmpge(pruned.low).all() && point.cmple(pruned.high).all() {
                break;
            }
            number = pruned.parent;
        }
        number
    }

    /// [`Surface::values`] at points that each lie in the box of a field of their own.
    pub fn values(
        &self,
        whole: &Surface<'_>,
        fields: &[u32],
        points: &[Vec3],
        out: &mut [f32],
    ) -> Result<(), NoForm> {
        self.grouped(whole, fields, points, out, |surface, points, out| surface.values(points, out))
    }

    /// [`Surface::gradients`] at points that each lie in the box of a field of their own.
    pub fn gradients(
        &self,
        whole: &Surface<'_>,
        fields: &[u32],
        points: &[Vec3],
        out: &mut [Vec3],
    ) -> Result<(), NoForm> {
        self.grouped(whole, fields, points, out, |surface, points, out| surface.gradients(points, out))
    }

    fn grouped<T: Copy + Default>(
        &self,
        whole: &Surface<'_>,
        fields: &[u32],
        points: &[Vec3],
        out: &mut [T],
        evaluate: impl Fn(&Surface<'_>, &[Vec3], &mut [T]) -> Result<(), NoForm>,
    ) -> Result<(), NoForm> {
        let Some(&first) = fields.first() else { return Ok(()) };
        if fields.iter().all(|f| *f == first) {
            return evaluate(&self.surface(whole, first), points, out);
        }
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.sort_by_key(|&i| fields[i as usize]);
        let (mut at, mut found) = (Vec::new(), Vec::new());
        for group in order.chunk_by(|&a, &b| fields[a as usize] == fields[b as usize]) {
            at.clear();
            at.extend(group.iter().map(|&i| points[i as usize]));
            found.clear();
            found.resize(group.len(), T::default());
            evaluate(&self.surface(whole, fields[group[0] as usize]), &at, &mut found)?;
            group.iter().zip(&found).for_each(|(&i, v)| out[i as usize] = *v);
        }
        Ok(())
    }
}
