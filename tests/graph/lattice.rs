//! Values at the points of a lattice, in which parts of the expression are computed once a plane or once for all planes.

use crate::common::{self, Random};
use crate::{field, on_gpu, reference, values};
use isoforge::field::Field;
use isoforge::graph::interval::Interval;
use isoforge::graph::{Expr, x, y, z};

/// As [`Field::values`] gives them, bit for bit.
fn check(field: &dyn Field, axes: &[Vec<f32>; 3], what: &Expr) -> bool {
    let Some(lattice) = field.lattice() else { return false };
    let [xs, ys, zs] = axes;
    let mut own = vec![f32::NAN; xs.len() * ys.len() * zs.len()];
    assert!(lattice.lattice_values([xs, ys, zs], &mut own));
    let plane = |z| ys.iter().flat_map(move |&y| xs.iter().map(move |&x| [x, y, z]));
    let points: Vec<[f32; 3]> = zs.iter().flat_map(|&z| plane(z)).collect();
    for ((a, b), at) in own.iter().zip(values(field, &points)).zip(points) {
        assert!(
            a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()),
            "{a:?}, not {b:?}, at {at:?}: {what:?}"
        );
    }
    true
}

/// Random expressions, whole and pruned to the lattice's box, at lattices of a brick, of rows of bricks and of fewer points.
///
/// Goes red when the values that are the same in all planes are taken of the plane before, and when a register of such a value
/// is given to another.
#[test]
fn of_random_expressions() {
    let mut random = Random(31);
    let (mut whole, mut pruned) = (0, 0);
    for round in 0..1500 {
        let expr = reference::random(&mut random, 2 + round % 40).expr;
        let sizes = [[9, 9, 9], [33, 9, 9], [1, 5, 2], [9, 1, 9]][random.next() as usize % 4];
        let axes = sizes.map(|count| {
            let (first, step) = ((random.unit() - 0.5) * 4.0, 0.1 * random.unit());
            (0..count).map(|i| first + step * i as f32).collect::<Vec<_>>()
        });
        let own = field(&expr);
        whole += u32::from(check(&own, &axes, &expr));
        let region = [0, 1, 2].map(|k| Interval::new(axes[k][0], axes[k][axes[k].len() - 1]));
        if let Some(simpler) = own.within(region).field {
            pruned += u32::from(check(&*simpler, &axes, &expr));
        }
    }
    assert!(whole > 900 && pruned > 30, "{whole} expressions, {pruned} of them pruned");
}

/// The two parts of WGSL together are the whole, on a software GPU bit for bit.
///
/// Goes red when the first part's values are not those that the second part asks for.
#[test]
fn same_bits_by_planes_on_the_gpu() {
    let Some(gpu) = common::gpu().filter(|gpu| gpu.is_software()) else { return };
    let mut random = Random(41);
    let mut tried = 0;
    for round in 0..30 {
        let own = field(&(reference::random(&mut random, 4 + round).expr + x() * y() + z()));
        if own.wgsl().unwrap().planes.is_none() {
            continue;
        }
        tried += 1;
        let points: Vec<[f32; 3]> = (0..300).map(|_| [0; 3].map(|_| (random.unit() - 0.5) * 3.0)).collect();
        let [whole, parts] =
            [on_gpu::values(gpu, &own, &points), on_gpu::values_by_planes(gpu, &own, &points)];
        for (a, b) in whole.into_iter().zip(parts) {
            assert!(
                a == b || (!a.is_finite() && !b.is_finite()),
                "{a:?} as a whole, {b:?} in parts: {own:?}"
            );
        }
    }
    assert!(tried > 20, "{tried}");
}

/// What has nothing to compute but coordinates and numbers, or one coordinate alone.
#[test]
fn of_few_axes() {
    let axes = [9, 9, 9].map(|count| (0..count).map(|i| i as f32 * 0.25 - 1.0).collect::<Vec<_>>());
    for expr in
        [x().sin(), y().sin(), z().sin(), x() * y(), x() + z(), y() * z(), z().square() + x().square() * z()]
    {
        let hoists = check(&field(&expr), &axes, &expr);
        assert_eq!(
            hoists,
            ![x() + z(), y() * z()].map(|e| format!("{e:?}")).contains(&format!("{expr:?}")),
            "{expr:?}"
        );
    }
}
