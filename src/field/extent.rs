//! Where a field's surface lies, found by its intervals or by samples.

use super::{Field, Points, Sense};
use crate::graph::GraphField;
use crate::graph::interval::{ALL, Interval};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Half the edges of the cubes in which surfaces are looked for: bounds of high powers leave the range of numbers
/// in the larger, then the next is tried.
const FARTHEST: [f32; 3] = [1_048_576.0, 4096.0, 128.0];
/// Boxes from which on the rest is not looked at more closely.
const MANY: usize = 3000;
/// How small boxes get, as a part of what is left.
const FINEST: f32 = 1.0 / 48.0;
/// How often the cube is halved at first, at most.
const SHELLS: u32 = 30;

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

/// Samples along each axis of a box.
const SAMPLES: usize = 64;
/// Half the edges of the cubes that are sampled: the largest, and how many, each half of the one before.
const CUBES: (f32, u32) = (16_777_216.0, 32);
/// Boxes that are sampled within the first cube that holds something.
const CLOSER: u32 = 8;

/// A box around what samples find inside, a few hundredths too large, where [`extent`] finds none. It need not hold all: samples
/// may miss a part whose radius is below an eighteenth of its distance from the origin. `None` of what has no end, where nothing is found,
/// of what is so thin that closer samples do not find it again, and of fields that only a GPU evaluates.
pub fn sampled_extent(field: &dyn Field, iso: f32, sense: Sense) -> Option<[Vec3; 2]> {
    let (largest, count) = CUBES;
    let most = |[low, high]: [Vec3; 2]| low.abs().max(high.abs()).max_element();
    // What is found in the cubes, and the steps of the samples where it was found first. Smaller cubes, as long as they are larger than
    // what is found, may find more.
    let mut found: Option<([Vec3; 2], [Vec3; 2])> = None;
    for half in (0..count).map(|i| largest * 0.5f32.powi(i as i32)) {
        let cube = [Vec3::splat(-half), Vec3::splat(half)];
        if found.is_some_and(|(all, _)| most(all) >= half) {
            break;
        }
        let Some(here) = inside(field, iso, sense, cube) else { continue };
        found = match found {
            Some((all, first)) => Some((hull(all, here), first)),
            // Nothing of the outermost samples, half a step from the border: else it goes on beyond.
            None => (most(here) < half * (1.0 - 1.5 / SAMPLES as f32)).then_some((here, cube)),
        };
    }
    let (all, first) = found?;
    let mut found = grown(all, first);
    for _ in 0..CLOSER {
        let here = inside(field, iso, sense, found)?;
        let (closer, step) = (grown(here, found), (found[1] - found[0]) / SAMPLES as f32);
        // Nothing of the outermost samples.
        let is_within = here[0].cmpgt(found[0] + step).all() && here[1].cmplt(found[1] - step).all();
        if is_within && (found[1] - found[0]).cmple((closer[1] - closer[0]) * 1.1).all() {
            return (!leaves(field, iso, sense, closer)).then_some(closer);
        }
        found = closer;
    }
    // It grew at every look.
    None
}

/// A box larger by two steps of the samples of another, on each side.
fn grown([low, high]: [Vec3; 2], [from, to]: [Vec3; 2]) -> [Vec3; 2] {
    let step = (to - from) * (2.0 / SAMPLES as f32);
    [low - step, high + step]
}

/// The box of those samples of a box that are inside; they lie in the middle of as many cells.
fn inside(field: &dyn Field, iso: f32, sense: Sense, [low, high]: [Vec3; 2]) -> Option<[Vec3; 2]> {
    let step = (high - low) / SAMPLES as f32;
    let at = |i: [usize; 3]| low + step * (Vec3::from(i.map(|i| i as f32)) + 0.5);
    let plane = |z: usize| {
        among(field, iso, sense, (0..SAMPLES * SAMPLES).map(|i| at([i % SAMPLES, i / SAMPLES, z])))
    };
    (0..SAMPLES).into_par_iter().filter_map(plane).reduce_with(hull)
}

/// Whether any of the samples on the faces of a box is inside: something thin and endless may have been missed by those within.
fn leaves(field: &dyn Field, iso: f32, sense: Sense, [low, high]: [Vec3; 2]) -> bool {
    const ACROSS: usize = 8 * SAMPLES;
    let step = (high - low) / ACROSS as f32;
    let row = |row: usize| {
        let (face, j) = (row / ACROSS, row % ACROSS);
        let (axis, end) = (face / 2, [low, high][face % 2]);
        let point = |i: usize| {
            let mut point = low + step * 0.5;
            point[axis] = end[axis];
            point[(axis + 1) % 3] += step[(axis + 1) % 3] * i as f32;
            point[(axis + 2) % 3] += step[(axis + 2) % 3] * j as f32;
            point
        };
        among(field, iso, sense, (0..ACROSS).map(point)).is_some()
    };
    (0..6 * ACROSS).into_par_iter().any(row)
}

/// The box of those points that are inside.
fn among(field: &dyn Field, iso: f32, sense: Sense, points: impl Iterator<Item = Vec3>) -> Option<[Vec3; 2]> {
    let points: Vec<Vec3> = points.collect();
    let axis = |k: usize| points.iter().map(|point| point[k]).collect::<Vec<f32>>();
    let [x, y, z] = [axis(0), axis(1), axis(2)];
    let mut values = vec![f32::NAN; x.len()];
    field.values(Points { x: &x, y: &y, z: &z }, &mut values).ok()?;
    let is_inside = |value: f32| match sense {
        Sense::Below => value < iso,
        Sense::Above => value > iso,
    };
    let found = points.iter().zip(values).filter(|(_, value)| is_inside(*value));
    found.map(|(point, _)| [*point; 2]).reduce(hull)
}

fn hull(a: [Vec3; 2], b: [Vec3; 2]) -> [Vec3; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

enum Found {
    Box([Vec3; 2]),
    /// No surface, or one that leaves the cube.
    Nothing,
    /// No bounds at the cube's border.
    Unknown,
}

/// Operations of all pruned fields that a level leaves to the next together: some 250 MB.
const ROOM: usize = 1 << 23;

/// A box that the surface may be in.
struct Part {
    /// Its lowest corner.
    low: Vec3,
    /// What the field takes there.
    range: Interval,
    /// The field as it is pruned to the box around or one around that, if that makes it much simpler: one for all parts of that box.
    field: Option<Arc<dyn Field>>,
}

fn region(low: Vec3, size: f32) -> [Interval; 3] {
    [0, 1, 2].map(|k| Interval { lo: low[k], hi: low[k] + size })
}

fn operations(field: &dyn Field) -> usize {
    field.as_graph().map_or(0, GraphField::operations)
}

/// A field as it is pruned to a box, if it then has half of its operations or less.
fn much_simpler(field: &dyn Field, region: [Interval; 3]) -> Option<Arc<dyn Field>> {
    field.within(region).field.filter(|own| operations(&**own) <= operations(field) / 2)
}

/// Half the edges of a cube around the origin, smaller by halves, outside of which bounds show nothing of the surface that the
/// cube of `half` may hold: a shell around it takes six boxes, where its parts are 56.
fn without_shells(field: &dyn Field, iso: f32, mut half: f32) -> f32 {
    let is_empty = |half: f32, face: usize| {
        let mut region = [Interval::new(-half, half); 3];
        let (near, far) = (0.5 * half, half);
        region[face / 2] = [Interval::new(-far, -near), Interval::new(near, far)][face % 2];
        !may_hold(iso, field.range(region))
    };
    for _ in 0..SHELLS {
        if !(0..6).into_par_iter().all(|face| is_empty(half, face)) {
            break;
        }
        half *= 0.5;
    }
    half
}

fn may_hold(iso: f32, range: Interval) -> bool {
    range.lo <= iso && range.hi >= iso
}

fn within(field: &dyn Field, iso: f32, farthest: f32) -> Found {
    let half = without_shells(field, iso, farthest);
    let mut size = 2.0 * half;
    let mut boxes = vec![Part { low: Vec3::splat(-half), range: ALL, field: None }];
    let around = |boxes: &[Part], size: f32| {
        let low = boxes.iter().map(|part| part.low).reduce(Vec3::min)?;
        let high = boxes.iter().map(|part| part.low).reduce(Vec3::max)?;
        Some([low, high + size])
    };
    loop {
        size *= 0.5;
        let most = ROOM / boxes.len();
        let parts = |whole: &Part| {
            let around = whole.field.as_deref().unwrap_or(field);
            let own = much_simpler(around, region(whole.low, 2.0 * size));
            let here = own.as_deref().unwrap_or(around);
            let kept = own.as_ref().filter(|own| operations(&***own) <= most).or(whole.field.as_ref());
            let part = |i: u32| {
                let low = whole.low + Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * size;
                let range = here.range(region(low, size));
                may_hold(iso, range).then(|| Part { low, range, field: kept.cloned() })
            };
            (0..8).filter_map(part).collect::<Vec<_>>()
        };
        boxes = boxes.par_iter().flat_map_iter(parts).collect();
        let Some([low, high]) = around(&boxes, size) else { return Found::Nothing };
        let extent = (high - low).max_element();
        if boxes.len() > MANY || size <= extent * FINEST {
            let is_outer =
                |part: &&Part| part.low.abs().max((part.low + size).abs()).max_element() >= farthest;
            let mut outer = boxes.iter().filter(is_outer);
            return match outer.next() {
                None => Found::Box([low, high]),
                Some(first) if first.range.is_bounded() || outer.any(|part| part.range.is_bounded()) => {
                    Found::Nothing
                }
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

    /// The largest cube that is left holds all of the surface, and the next would not, or bounds cannot tell.
    #[test]
    fn shells_without_surface_are_left_out() {
        let left = |expr: &Expr| without_shells(&GraphField::new(expr, Sense::Below), 0.0, 4096.0);
        for (radius, half) in [(0.9, 1.0), (1.1, 2.0), (1000.0, 1024.0), (4000.0, 4096.0), (5000.0, 4096.0)] {
            assert_eq!(left(&sphere(radius)), half, "{radius}");
            for axis in 0..3 {
                for sign in [1.0, -1.0] {
                    let mut at = [0.0; 3];
                    at[axis] = sign * 0.9 * radius;
                    assert_eq!(left(&sphere(0.1 * radius).translate(at)), half, "{radius} {at:?}");
                }
            }
        }
        assert_eq!(left(&infinite_cylinder(1.0)), 4096.0);
        assert!(left(&(sphere(1.0) + 1.0)) < 1.0);
    }

    /// Of deformed solids intervals know little where it matters, and nothing of spheres as large as the cubes that they are tried on.
    #[test]
    fn solids_by_samples() {
        let twisted = box_([-5.0, -5.0, -10.0], [5.0, 5.0, 10.0]).twist(0.1, -10.0, 10.0).unwrap();
        let bent = box_([-2.0, -0.3, -0.2], [2.0, 0.3, 0.2]).bend(0.2, -2.0, 2.0).unwrap();
        let apart = sphere(1.0).union(sphere(1.0).translate([30.0, 0.0, 0.0]));
        let far = sphere(1e6).translate([3e6, 0.0, 0.0]);
        let corner = 5.0 * std::f32::consts::SQRT_2;
        let by_samples =
            |expr: &Expr, iso| sampled_extent(&GraphField::new(expr, Sense::Below), iso, Sense::Below);
        assert_eq!(found(&twisted, 0.0), None);
        is_close(by_samples(&twisted, 0.0), [-corner, -corner, -10.0], [corner, corner, 10.0]);
        assert_eq!(found(&bent, 0.0), None);
        let [low, high] = by_samples(&bent, 0.0).expect("an end");
        assert!(
            low.y < -0.3 && high.y > 0.3 && high.z > 1.2 && (high - low).max_element() < 3.0,
            "{low} {high}"
        );
        is_close(by_samples(&apart, 0.0), [-1.0; 3], [31.0, 1.0, 1.0]);
        is_close(by_samples(&far, 0.0), [2e6, -1e6, -1e6], [4e6, 1e6, 1e6]);
        is_close(by_samples(&sphere(1e-3), 0.0), [-1e-3; 3], [1e-3; 3]);
        for endless in [infinite_cylinder(1.0), x() * y(), -sphere(1.0), x() - 1e7] {
            assert_eq!(by_samples(&endless, 0.0), None);
        }
        // Rods and sheets that samples hit here and there.
        for (a, b) in [(0.31, 0.17), (0.9, 0.6), (0.05, 0.02), (0.013, 0.7), (-0.44, 0.21)] {
            let rod = ((a * x() - y()).square() + (b * x() - z()).square()).sqrt() - 1.0;
            let sheet = (z() + a * x() + b * y()).abs() - 0.02;
            for endless in [rod, sheet] {
                assert_eq!(by_samples(&endless, 0.0), None, "{a} {b}");
            }
        }
        // What a larger cube hits by chance is not all.
        let far = sphere(0.8).translate([9.0, 1.0, 0.0]);
        is_close(by_samples(&sphere(0.88).union(far), 0.0), [-0.88; 3], [9.8, 1.8, 0.88]);
        assert_eq!(by_samples(&sphere(1.0), -2.0), None);
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
