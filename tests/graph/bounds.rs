//! Bounds of whole expressions, and what pruning leaves of them.

use crate::common::{self, Random};
use crate::{field, gradients, on_gpu, reference, values};
use isoforge::field::Field;
use isoforge::graph::blobs::skeleton::{kernel_expr, segment_square};
use isoforge::graph::blobs::{BLOBBY, Kernel};
use isoforge::graph::interval::Interval;
use isoforge::graph::shapes::{Vector, sphere};
use isoforge::graph::{Expr, x, y, z};

/// 10⁵ random boxes: no value lies beyond the interval, and the field pruned to the box gives the same bits.
///
/// Goes red when `min` prunes the smaller operand, and when `mul` leaves out one of its four products.
#[test]
fn of_random_expressions() {
    let mut random = Random(11);
    let (mut pruned, mut bounded) = (0, 0);
    for round in 0..500 {
        let pair = reference::random(&mut random, 3 + round % 40);
        let whole = field(&pair.expr);
        for _ in 0..200 {
            let size = [0.001, 0.05, 0.5, 3.0][random.next() as usize % 4];
            let region = [0; 3].map(|_| {
                let low = (random.unit() - 0.5) * 6.0;
                Interval::new(low, low + random.unit() * size)
            });
            let points: Vec<[f32; 3]> = (0..8)
                .map(|_| region.map(|r| (r.lo + random.unit() * (r.hi - r.lo)).clamp(r.lo, r.hi)))
                .collect();
            let known = whole.within(region);
            let own = values(&whole, &points);
            if known.range.is_bounded() {
                bounded += 1;
                assert!(
                    own.iter().all(|v| v.is_finite() && known.range.contains(*v)),
                    "{:?}: {own:?}",
                    known.range
                );
            }
            if let Some(simpler) = known.field {
                pruned += 1;
                let same =
                    |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
                let theirs = values(&*simpler, &points);
                assert!(same(&own, &theirs), "{own:?} {theirs:?} {simpler:?} {:?}", pair.expr);
                let [a, b] =
                    [&whole as &dyn Field, &*simpler].map(|f| gradients(f, &points).into_flattened());
                assert!(same(&a, &b), "gradients of {:?}", pair.expr);
            }
        }
    }
    assert!(pruned > 5_000 && bounded > 20_000, "{pruned} boxes pruned, {bounded} with bounds");
}

/// Of a minimum of many, however nested, a box keeps those alone that are not over some other one. Goes red when each minimum looks at its
/// own two operands alone: half of the line is kept, since it comes nearer step by step. Goes red for blends that hand nothing down, and where seams do.
#[test]
fn many_operands() {
    const COUNT: usize = 300;
    let part = |i: usize| {
        let far = (i as f64 - COUNT as f64 / 2.0) / 10.0;
        (x() - far).square() + y().square() + z().square()
    };
    let joined_by = |join: fn(Expr, Expr) -> Expr| {
        let mut parts: Vec<Expr> = (0..COUNT).map(part).collect();
        while parts.len() > 1 {
            parts = parts.chunks(2).map(|two| two.iter().cloned().reduce(join).unwrap()).collect();
        }
        parts.remove(0)
    };
    let parts = || (0..COUNT).map(part);
    let least = |low: f32| [low, 0.0, 0.0].map(|low| Interval::new(low, low + 0.4));
    for (name, expr) in [
        ("from the first on", parts().reduce(|a, b| a.min(b)).unwrap()),
        ("from the last on", parts().rev().reduce(|a, b| b.min(a)).unwrap()),
        ("balanced", joined_by(|a, b| a.min(b))),
        ("blended", joined_by(|a, b| a.smooth_union(b, 0.5))),
        ("of maxima", -parts().map(|part| -part).reduce(|a, b| a.max(b)).unwrap()),
        ("used twice", {
            let all = parts().reduce(|a, b| a.min(b)).unwrap();
            all.min(part(0).square()) + all.max(0.01)
        }),
    ] {
        let whole = field(&expr);
        let simpler = whole.within(least(0.0)).field.expect(name);
        let kept = simpler.as_graph().unwrap().operations();
        assert!(8 * kept < whole.operations(), "{name}: {kept} of {} operations", whole.operations());
        let mut random = Random(5);
        let points: Vec<[f32; 3]> = (0..500).map(|_| [0; 3].map(|_| random.unit() * 0.4)).collect();
        assert_eq!(values(&whole, &points), values(&*simpler, &points), "{name}");
        assert_eq!(gradients(&whole, &points), gradients(&*simpler, &points), "{name}");
    }
}

/// Of the kernel around a line a box keeps those parts alone that are within the kernel's radius, and where none is, nothing of the line. Goes
/// red without what comparisons and products hand down, and where a factor's limits are those of the product.
#[test]
fn what_kernels_reach() {
    let segment = |i: usize| [i, i + 1].map(|i| [i as f64 / 10.0, 0.0, 0.0]);
    let line = (0..300).map(|i| segment(i).map(Vector::from)).map(|[a, b]| segment_square(a, b));
    let square = line.reduce(|a, b| a.min(b)).unwrap();
    let mut random = Random(6);
    for kernel in [Kernel::SoftObject, Kernel::Metaball, BLOBBY] {
        for radius in [0.01, 0.3, 5.0] {
            let whole = field(&kernel_expr(kernel, &square, radius));
            for (low, reached) in [(0.2, true), (0.995, true), (1.1, false)] {
                let low = low * radius;
                let size = 0.5 * radius;
                // As far as two radii from the line.
                let region = [(10.0, size), (low, 2.0 * radius), (0.0, 0.1 * size)];
                let region = region.map(|(low, size)| Interval::new(low as f32, (low + size) as f32));
                let simpler = whole.within(region).field.unwrap();
                let kept = simpler.as_graph().unwrap().operations();
                // Of the line the parts within the radius of the box, or the kernel of a constant alone.
                let parts = 10.0 * (2.0 * radius + size) + 2.0;
                let most = if reached { parts * whole.operations() as f64 / 300.0 } else { 0.0 } + 16.0;
                assert!(kept as f64 <= most, "{kernel:?} {radius}, {low}: {kept} of {most}");
                let points: Vec<[f32; 3]> = (0..500)
                    .map(|_| region.map(|r| (r.lo + random.unit() * (r.hi - r.lo)).min(r.hi)))
                    .collect();
                assert_eq!(values(&whole, &points), values(&*simpler, &points), "{kernel:?} {radius}");
                assert_eq!(gradients(&whole, &points), gradients(&*simpler, &points), "{kernel:?} {radius}");
            }
        }
    }
}

/// Pruned blends have the same bits: 3000 random boxes of 200 random nests of blends, and of what looks like one. Goes red where a
/// part counts only as far as the other one reaches, without the seam's radius.
#[test]
fn many_blends() {
    let mut random = Random(7);
    let mut pruned = 0;
    for round in 0..200 {
        let count = 2 + round % 40;
        let radius = [1e-3, 0.05, 0.2, 1.0][round % 4];
        let mut parts: Vec<Expr> = (0..count)
            .map(|_| {
                let at = [0; 3].map(|_| f64::from(random.unit() - 0.5) * 4.0);
                sphere(0.05 + f64::from(random.unit()) * 0.3).translate(at)
            })
            .collect();
        while parts.len() > 1 {
            let (a, b) = (parts.swap_remove(random.next() as usize % parts.len()), parts.pop().unwrap());
            let seam = |least: f64, factor: f64| {
                (radius - (&a - &b).abs()).max(least * radius).square() * (factor / radius)
            };
            parts.push(match random.next() % 30 {
                0 => a.smooth_difference(&b, radius),
                1 => a.smooth_intersection(&b, radius),
                2 => a.union(&b),
                3 => -a.smooth_intersection(-&b, radius),
                4 => b.smooth_union(&a, Expr::parameter("radius", radius)),
                // What they are made of counts by itself, too.
                5 => a.smooth_union(&b, radius) + (&a - &b).abs() * 0.1,
                6 => (&a - &b) * 0.1 + a.smooth_union(&b, radius),
                7 => a.min(&b) * 0.1 + a.smooth_union(&b, radius),
                8 => a.smooth_intersection(&b, radius) + seam(0.0, 0.25) * 3.0,
                // No blends, though they look like some.
                9 => a.min(&b) - seam(0.1, 0.25),
                10 => a.min(&b) - seam(0.0, 4.0),
                11 => a.min(&b) + seam(0.0, 0.25),
                12 => a.max(&b) - seam(0.0, 0.25),
                13 => a.min(b.square()) - seam(0.0, 0.25),
                14 => a.max(-0.2) * b.max(-0.3),
                15 => a.less(&b).select(&a, b.min(0.1)),
                _ => a.smooth_union(&b, radius),
            });
        }
        let whole = field(&parts[0]);
        for _ in 0..15 {
            let size = [0.01, 0.1, 0.5, 3.0][random.next() as usize % 4];
            let region = [0; 3].map(|_| {
                let low = (random.unit() - 0.5) * 5.0;
                Interval::new(low, low + random.unit() * size)
            });
            let Some(simpler) = whole.within(region).field else { continue };
            pruned += 1;
            let points: Vec<[f32; 3]> = (0..64)
                .map(|_| region.map(|r| (r.lo + random.unit() * (r.hi - r.lo)).clamp(r.lo, r.hi)))
                .collect();
            let bits = |field: &dyn Field| -> Vec<u32> {
                let gradients = gradients(field, &points).into_flattened();
                values(field, &points).into_iter().chain(gradients).map(f32::to_bits).collect()
            };
            assert_eq!(bits(&whole), bits(&*simpler), "{:?}", parts[0]);
        }
    }
    assert!(pruned > 2000, "{pruned} boxes pruned");
}

/// Expressions, boxes and points where pruning went wrong once: of a product both factors gave less than their limits, and its value was more; what
/// took the place of values that do not matter was infinite, and the difference of two such NaN; an intersection's zero lost its sign.
#[test]
fn replaced_values_do_no_harm() {
    let large = |least: f64| (x() * 1e38).min(least) * 100.0;
    let box_of = |lows: [f32; 3], highs: [f32; 3]| [0, 1, 2].map(|k| Interval::new(lows[k], highs[k]));
    for (expr, region, point) in [
        (
            (y().max(0.1) * z().max(0.1)).max(x()),
            box_of([0.5, -2.0, -2.0], [2.0, 1.0, 1.0]),
            [0.5, -2.0, -2.0],
        ),
        (large(5.0).smooth_union(large(6.0), 1.0).min(y()), box_of([0.0; 3], [1.0; 3]), [0.5; 3]),
        ((-x()).smooth_intersection(y() - 10.0, 1.0), box_of([-1.0, 0.0, 0.0], [1.0; 3]), [0.0, 0.5, 0.5]),
        (
            x().max(0.5).less(z().min(3.0)).select(y(), x()).min(z()),
            box_of([5.0, 0.0, 0.0], [6.0, 1.0, 1.0]),
            [5.0, 0.5, 0.25],
        ),
    ] {
        let whole = field(&expr);
        let simpler = whole.within(region).field;
        let simpler = simpler.as_deref().unwrap_or(&whole);
        let bits = |field: &dyn Field| values(field, &[point])[0].to_bits();
        assert_eq!(bits(&whole), bits(simpler), "{expr:?}");
        assert_eq!(gradients(&whole, &[point]), gradients(simpler, &[point]), "{expr:?}");
    }
}

/// What is over the limit counts all the same where two blended parts are never so far apart that their seam ends, since then it is computed
/// without that end, and where the seam is deeper than a blend's. Left out, the first of two planes would make a hole of the seam, 20 below the
/// third plane, or fill it.
#[test]
fn seams_that_are_none() {
    let mut pruned = 0;
    let plane = |at: f64, slope: f64| x() * slope + at;
    for (factor, w) in [(0.25, plane(1.2, 0.05)), (4.0, plane(1.0, 0.5))] {
        let u = plane(2.05, 0.01).min(plane(1.0, 10.0));
        let seam = (1.0 - (&u - &w).abs()).max(0.0).square() * factor;
        let whole = field(&(u.min(&w) - seam).min(plane(1.0, -0.001)));
        let known = whole.within([0; 3].map(|_| Interval::new(0.0, 1.0)));
        pruned += usize::from(known.field.is_some());
        let Some(simpler) = known.field else { continue };
        let points: Vec<[f32; 3]> = (0..100).map(|i| [i as f32 / 100.0, 0.0, 0.0]).collect();
        assert_eq!(values(&whole, &points), values(&*simpler, &points), "{factor}");
    }
    assert_eq!(pruned, 1);
}

/// Whole expressions give the same bits on a software GPU, sums and products in whatever order they stand.
///
/// Goes red when `hide_operations` (src/gpu/exact.rs) leaves sums as they are: Mesa reorders them.
#[test]
fn same_bits_on_the_gpu() {
    let Some(gpu) = common::gpu().filter(|gpu| gpu.is_software()) else { return };
    let mut random = Random(21);
    for round in 0..30 {
        let sum = (0..6).map(|_| reference::random(&mut random, 2 + round % 6).expr * (x() + 0.1) + y());
        let sum = sum.reduce(|a, b| a + 0.3 + b * 1.7 + 0.1).unwrap();
        let own = field(&sum);
        let points: Vec<[f32; 3]> = (0..500).map(|_| [0; 3].map(|_| (random.unit() - 0.5) * 3.0)).collect();
        for (a, b) in on_gpu::values(gpu, &own, &points).into_iter().zip(values(&own, &points)) {
            assert!(
                a == b || (!a.is_finite() && !b.is_finite()),
                "{a:?} on the GPU, {b:?} on the CPU: {sum:?}"
            );
        }
    }
}

/// Drivers take NaN for impossible: what 0 times it is, and its difference from itself, both twins must agree on.
///
/// Goes red without the rules of `Graph::op` (src/graph/lower.rs) for 0, 1 and negatives.
#[test]
fn what_nan_cancels_out_of_is_a_number() {
    let Some(gpu) = common::gpu() else { return };
    let nan = || (z() * 2.0 + 3.0).asin();
    let sums = [
        x() + 0.0 * nan(),
        x() + nan() * 0.0,
        x() + Expr::from(0.0) / nan(),
        x() + (nan() - nan()),
        x() + (nan() + -nan()),
        x() + (-nan() + nan()),
        x() + (nan() * y() - y() * nan()),
        x() + ((-nan()).abs() - nan().abs()),
        x() + (nan().pow(0.0) - 1.0),
        x() * (Expr::from(1.0) - 0.0) + 0.0 * y().ln(),
    ];
    let points: Vec<[f32; 3]> = (-4..5).map(|i| [i as f32 * 0.3, -1.0, i as f32 * 0.1]).collect();
    for sum in sums {
        let own = field(&sum);
        let wanted: Vec<f32> = points.iter().map(|p| p[0]).collect();
        assert_eq!(values(&own, &points), wanted, "{sum:?}");
        assert_eq!(on_gpu::values(gpu, &own, &points), wanted, "{sum:?}");
    }
}

/// Values against an independent `f64` evaluation, where neither is at a jump.
#[test]
fn values_of_random_expressions() {
    let mut random = Random(5);
    let (mut close, mut all) = (0, 0);
    for round in 0..400 {
        let pair = reference::random(&mut random, 2 + round % 25);
        let own = field(&pair.expr);
        let points: Vec<[f32; 3]> = (0..50).map(|_| [0; 3].map(|_| (random.unit() - 0.5) * 3.0)).collect();
        for (p, v) in points.iter().zip(values(&own, &points)) {
            let expected = (pair.value)(p.map(f64::from));
            if expected.is_nan() {
                continue;
            }
            all += 1;
            // How much it changes nearby says how far rounding can carry it.
            let nearby = [-1e-5, 1e-5].map(|d| (pair.value)(p.map(|c| f64::from(c) + d)));
            let spread = nearby.iter().fold(0.0f64, |m, n| m.max((n - expected).abs()));
            let near = (f64::from(v) - expected).abs() <= 1e-3 * expected.abs().max(1.0) + 2.0 * spread;
            close += u32::from(near || (!v.is_finite() && expected.abs() >= 1e30));
        }
    }
    // Jumps (floor, less) and poles make a few differ.
    assert!(close > all / 1000 * 995, "{close} of {all}");
}
