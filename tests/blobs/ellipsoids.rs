//! Components that are turned and stretched.

use crate::common::{self, Random};
use crate::reference::{KERNELS, bits, gradients, kernel, points, some, values};
use glam::{DQuat, DVec3, Quat, Vec3};
use isoforge::compare::compare;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::Sense;
use isoforge::graph::GraphField;
use isoforge::graph::blobs::{Blobs, BlobsError, Ellipsoid, Ellipsoids, Kernel};
use isoforge::graph::interval::Interval;
use isoforge::graph::leaf::Leaf;
use isoforge::grid::Grid;

/// Turned at random, the longest axis up to 6 times the shortest.
fn turned(count: usize, seed: u64) -> Vec<Ellipsoid> {
    let mut random = Random(seed);
    let one = |component| {
        let mut unit = || 2.0 * random.unit() - 1.0;
        let rotation = Quat::from_xyzw(unit(), unit(), unit(), unit() + 1.5).normalize();
        let scale = Vec3::new(1.0 + 0.7 * unit(), 1.0 + 0.7 * unit(), 1.0 + 0.7 * unit());
        Ellipsoid { component, rotation, scale }
    };
    some(count, seed).into_iter().map(one).collect()
}

/// The sum in `f64`, and that of the magnitudes: the point is turned back, squeezed, and measured.
fn sum(of: Kernel, all: &[Ellipsoid], p: [f64; 3]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for e in all {
        let away = DVec3::from(p) - Vec3::from(e.component.position).as_dvec3();
        let rotation = DQuat::from_array(e.rotation.to_array().map(f64::from)).normalize();
        let r = (rotation.inverse() * away / e.scale.as_dvec3()).length();
        let part = f64::from(e.component.weight) * kernel(of, r, f64::from(e.component.radius));
        sums[0] += part;
        sums[1] += part.abs();
    }
    sums
}

/// Goes red when rows and columns of the rotation are changed about.
#[test]
fn are_those_of_the_reference() {
    for (n, of) in KERNELS.into_iter().enumerate() {
        let all = turned(1500, n as u64);
        let at = points(1500, 99);
        let leaf = Ellipsoids::new(of, &all).unwrap();
        let (values, with_slopes) = (values(&*leaf, &at), gradients(&*leaf, &at));
        assert_eq!(bits(&values), bits(&with_slopes[0]));
        let mut some = 0;
        for (i, value) in values.iter().enumerate() {
            let p = [0, 1, 2].map(|k| f64::from(at[k][i]));
            let [expected, magnitude] = sum(of, &all, p);
            let error = (f64::from(*value) - expected).abs();
            assert!(error <= 4e-5 * magnitude + 2e-6, "{of:?} {i}: {value}, {expected}");
            some += usize::from(magnitude > 0.0);
            for k in 0..3 {
                let beside = |step: f64| {
                    let mut p = p;
                    p[k] += step;
                    sum(of, &all, p)
                };
                let [[a, magnitude], [b, _]] = [beside(1e-6), beside(-1e-6)];
                let (found, expected) = (f64::from(with_slopes[k + 1][i]), (a - b) / 2e-6);
                let most = if of == Kernel::InverseSquare {
                    1e-3 * magnitude * magnitude.sqrt()
                } else {
                    2e-3 * magnitude / 0.015
                };
                assert!((found - expected).abs() <= most + 1e-3, "{of:?} {i} {k}: {found}, {expected}");
            }
        }
        assert!((200..1490).contains(&some), "{some}");
    }
}

#[test]
fn without_stretching_are_balls() {
    let mut all = turned(500, 4);
    all.iter_mut().for_each(|e| e.scale = Vec3::ONE);
    let at = points(500, 5);
    let balls = Blobs::new(Kernel::SoftObject, all.iter().map(|e| e.component).collect()).unwrap();
    let ellipsoids = Ellipsoids::new(Kernel::SoftObject, &all).unwrap();
    for (a, b) in values(&*balls, &at).iter().zip(values(&*ellipsoids, &at)) {
        assert!((a - b).abs() < 2e-4, "{a} {b}");
    }
}

/// No value lies outside its interval, in 10⁵ boxes. Goes red when the box's corners are taken without the signs of the rows.
#[test]
fn bounds_hold_all_values() {
    let mut random = Random(3);
    let mut zero = 0;
    for (n, of) in KERNELS.into_iter().enumerate() {
        let leaf = Ellipsoids::new(of, &turned(3000, 50 + n as u64)).unwrap();
        for i in 0..25_000 {
            let side = 3.0 * 2f32.powi(-(i % 11));
            let (middle, half) = ([0.0, 40.0, 20.0][i as usize % 3], if i % 3 == 0 { 5.0 } else { 1.5 });
            let low = [0; 3].map(|_| middle + half * (2.0 * random.unit() - 1.0));
            let over = low.map(|low| Interval::new(low, low + side));
            let at = low.map(|low| (0..24).map(|_| low + side * random.unit()).collect::<Vec<f32>>());
            let range = leaf.interval(over);
            assert!(range.is_bounded(), "{of:?} {over:?}");
            zero += usize::from(range == Interval::new(0.0, 0.0));
            for value in values(&*leaf, &at) {
                assert!(range.contains(value), "{of:?} {over:?}: {value} is not in {range:?}");
            }
        }
    }
    assert!((5000..90_000).contains(&zero), "{zero}");
}

/// Stage by stage, and culled as not. Goes red when the shader turns the gradient with rows for columns.
#[test]
fn are_the_same_on_the_adapter() {
    for (n, of) in KERNELS.into_iter().enumerate() {
        let near = turned(600, n as u64).into_iter().filter(|e| e.component.position[0] < 20.0);
        let leaf = Ellipsoids::new(of, &near.collect::<Vec<_>>()).unwrap();
        let field = GraphField::new(&leaf.expr(), Sense::Above);
        let grid = Grid::from_bounds([40, 43, 39], Vec3::splat(-2.6), Vec3::splat(2.6)).unwrap();
        let source = Source::Field(&field, grid);
        let options = Options::new(if of == Kernel::InverseSquare { 40.0 } else { 0.5 });
        let (culled, report) = extract_on_cpu(&source, &options, &|_| {}).unwrap();
        let (whole, all) = extract_on_cpu(&source, &Options { cull: false, ..options }, &|_| {}).unwrap();
        assert!(culled == whole && culled.triangles.len() > 1000, "{of:?}");
        assert!(report.active_bricks < all.active_bricks, "{of:?}");
        let Some(extractor) = common::extractor() else { continue };
        let compared = compare(extractor, &source, &options).unwrap();
        for row in &compared.rows {
            assert!(row.agrees() && row.differing == 0, "{of:?}: {row:?}");
        }
        assert_eq!(leaf.data().len() as u64 * 4, leaf.data_bytes());
    }
}

#[test]
fn bad_ones_are_named() {
    let refused = |change: &dyn Fn(&mut Ellipsoid)| {
        let mut all = turned(9, 1);
        change(&mut all[7]);
        Ellipsoids::new(Kernel::SoftObject, &all).unwrap_err()
    };
    for scale in [Vec3::new(1.0, 0.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::NAN, Vec3::INFINITY] {
        assert!(matches!(refused(&|e| e.scale = scale), BlobsError::Scale { index: 7, .. }), "{scale}");
    }
    for rotation in [Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0)] {
        assert!(matches!(refused(&|e| e.rotation = rotation), BlobsError::Rotation { index: 7, .. }));
    }
    assert!(matches!(refused(&|e| e.component.radius = 0.0), BlobsError::Radius { index: 7, .. }));
    assert!(matches!(
        refused(&|e| e.scale = Vec3::new(1e-20, 1.0, 1.0)),
        BlobsError::Radius { index: 7, .. }
    ));
    assert_eq!(Ellipsoids::new(Kernel::SoftObject, &[]).unwrap_err(), BlobsError::Empty);
}
