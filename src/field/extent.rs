//! Where a field's surface lies, found by its intervals alone.

use super::Field;
use crate::graph::interval::Interval;
use glam::Vec3;
use rayon::prelude::*;

/// Half the edges of the cubes in which surfaces are looked for: bounds of high powers leave the range of numbers
/// in the larger, then the next is tried.
const FARTHEST: [f32; 3] = [1_048_576.0, 4096.0, 128.0];
/// Boxes from which on the rest is not looked at more closely.
const MANY: usize = 3000;
/// How small boxes get, as a part of what is left.
const FINEST: f32 = 1.0 / 48.0;

/// A box around all of the surface where the field is `iso`, a few hundredths too large, if bounds of the field tell:
/// `None` of surfaces without an end or without bounds, and where there is none. More than 10⁶ from the origin is not looked.
/// Where nothing is known of the field farther away (from 4096 or 128 on), what lies there is left out.
pub fn extent(field: &dyn Field, iso: f32) -> Option<[Vec3; 2]> {
    for farthest in FARTHEST {
        match within(field, iso, farthest) {
            Found::Box(corners) => return Some(corners),
            Found::Nothing => return None,
            Found::Unknown => {}
        }
    }
    None
}

enum Found {
    Box([Vec3; 2]),
    /// No surface, or one that leaves the cube.
    Nothing,
    /// No bounds at the cube's border.
    Unknown,
}

fn within(field: &dyn Field, iso: f32, farthest: f32) -> Found {
    let range =
        |low: Vec3, size: f32| field.range([0, 1, 2].map(|k| Interval { lo: low[k], hi: low[k] + size }));
    let crosses = |low: Vec3, size: f32| {
        let range = range(low, size);
        range.lo <= iso && range.hi >= iso
    };
    let is_outer = |low: Vec3, size: f32| low.abs().max((low + size).abs()).max_element() >= farthest;
    let mut size = 2.0 * farthest;
    let mut boxes = vec![Vec3::splat(-farthest)];
    let around = |boxes: &[Vec3], size: f32| {
        let low = boxes.iter().copied().reduce(Vec3::min)?;
        let high = boxes.iter().copied().reduce(Vec3::max)?;
        Some([low, high + size])
    };
    loop {
        size *= 0.5;
        let parts = |low: &Vec3| {
            let low = *low;
            (0..8u32)
                .map(move |i| low + Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * size)
        };
        boxes = boxes.par_iter().flat_map_iter(parts).filter(|low| crosses(*low, size)).collect();
        let Some([low, high]) = around(&boxes, size) else { return Found::Nothing };
        let extent = (high - low).max_element();
        if boxes.len() > MANY || size <= extent * FINEST {
            let mut outer = boxes.iter().filter(|low| is_outer(**low, size)).map(|low| range(*low, size));
            return match outer.next() {
                None => Found::Box([low, high]),
                Some(first) if first.is_bounded() || outer.any(|range| range.is_bounded()) => Found::Nothing,
                Some(_) => Found::Unknown,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Sense;
    use crate::graph::blobs::{Blobs, Component, Kernel};
    use crate::graph::shapes::*;
    use crate::graph::{Expr, GraphField, x, y, z};

    fn found(expr: &Expr, iso: f32) -> Option<[Vec3; 2]> {
        extent(&GraphField::new(expr, Sense::Below), iso)
    }

    /// That the box holds the other and is not much larger.
    fn is_close(found: Option<[Vec3; 2]>, low: [f32; 3], high: [f32; 3]) {
        let ([l, h], low, high) = (found.expect("an end"), Vec3::from(low), Vec3::from(high));
        let room = (high - low).max_element() * 0.15;
        assert!(l.cmple(low).all() && h.cmpge(high).all(), "{l} {h}");
        assert!((low - l).max(h - high).max_element() < room, "{l} {h}");
    }

    #[test]
    fn solids() {
        is_close(found(&sphere(1.0), 0.0), [-1.0; 3], [1.0; 3]);
        is_close(
            found(&sphere(1e-3).translate([1000.0, -5.0, 3.0]), 0.0),
            [999.999, -5.001, 2.999],
            [1000.001, -4.999, 3.001],
        );
        is_close(found(&box_([1.0, 2.0, 3.0], [2.0, 4.0, 6.0]), 0.0), [1.0, 2.0, 3.0], [2.0, 4.0, 6.0]);
        let two = sphere(1.0).union(sphere(2.0).translate([5e4, 0.0, 0.0]));
        is_close(found(&two, 0.0), [-1.0, -2.0, -2.0], [50_002.0, 2.0, 2.0]);
        let at = |position| Component { position, radius: 2.0, weight: 1.0 };
        let blobs = Blobs::new(Kernel::SoftObject, vec![at([50.0; 3]), at([60.0, 50.0, 50.0])]).unwrap();
        // Its eighth power is more than numbers hold.
        let cube = x().powi(8) + y().powi(8) + z().powi(8);
        is_close(found(&cube, 1.0), [-1.0; 3], [1.0; 3]);
        is_close(found(&blobs.expr(), 0.5), [49.0; 3], [61.0, 51.0, 51.0]);
    }

    #[test]
    fn surfaces_without_end_or_none_at_all() {
        assert_eq!(found(&infinite_cylinder(1.0), 0.0), None);
        let far = infinite_cylinder(1.0).translate([1e4, 0.0, 0.0]);
        assert_eq!(found(&sphere(1.0).union(far), 0.0), None);
        assert_eq!(found(&(x() * y()), 0.0), None);
        assert_eq!(found(&sphere(1.0), -2.0), None);
        assert_eq!(found(&sphere(1.0).translate([1e7, 0.0, 0.0]), 0.0), None);
    }
}
