//! Bounds over boxes.

use crate::common::Random;
use crate::reference::{KERNELS, some, values};
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::graph::interval::{ALL, Interval};
use isoforge::graph::leaf::Leaf;

/// No value lies outside its interval, in 10⁵ boxes of all sizes. Goes red when far and near are changed about
/// for negative weights.
#[test]
fn hold_all_values() {
    let mut random = Random(3);
    let mut zero = [0; 2];
    for (n, of) in KERNELS.into_iter().enumerate() {
        let whole = Blobs::new(of, some(20_000, 50 + n as u64)).unwrap();
        for i in 0..25_000 {
            let side = 3.0 * 2f32.powi(-(i % 11));
            // Near the components, in the crowd far away, and about the edges of both.
            let (middle, half) =
                ([0.0, 40.0, 0.0, 40.0, 20.0][i as usize % 5], if i % 3 == 0 { 5.0 } else { 1.5 });
            let low = [0; 3].map(|_| middle + half * (2.0 * random.unit() - 1.0));
            let over = low.map(|low| Interval::new(low, low + side));
            let at = low.map(|low| (0..24).map(|_| low + side * random.unit()).collect::<Vec<f32>>());
            let mut check = |leaf: &dyn Leaf| {
                let range = leaf.interval(over);
                assert!(range.is_bounded(), "{of:?} {over:?}");
                zero[0] += usize::from(range == Interval::new(0.0, 0.0));
                zero[1] += 1;
                for value in values(leaf, &at) {
                    assert!(range.contains(value), "{of:?} {over:?}: {value} is not in {range:?}");
                }
            };
            check(&*whole);
            if let Some(part) = whole.within(over) {
                check(&*part);
            }
        }
    }
    assert!(zero[0] > 5000 && zero[0] < zero[1] * 3 / 4, "{zero:?}");
}

#[test]
fn are_exactly_zero_where_nothing_reaches() {
    let blobs = Blobs::new(Kernel::SoftObject, some(5000, 1)).unwrap();
    for (low, high) in [(10.0, 30.0), (-1e30, -10.0), (50.0, 1e38)] {
        let over = [Interval::new(low, high); 3];
        assert_eq!(blobs.interval(over), Interval::new(0.0, 0.0));
        let part = blobs.within(over).unwrap();
        assert_eq!(part.interval(over), Interval::new(0.0, 0.0));
    }
    assert_eq!(blobs.interval([ALL, Interval::new(0.0, 1.0), Interval::new(0.0, 1.0)]), ALL);
}

/// In a large box a single peak counts, wherever it is. Goes red when peaks leave out the last box along an axis.
#[test]
fn hold_single_peaks_in_large_boxes() {
    for (n, at) in [0, 19, 19 * 20, 19 * 400, 7999, 4211].into_iter().enumerate() {
        let weight = if n % 2 == 0 { 2.0 } else { -2.0 };
        let one = |i: usize| Component {
            position: [i % 20, i / 20 % 20, i / 400].map(|v| v as f32),
            radius: 0.9,
            weight: if i == at { weight } else { 0.0 },
        };
        let blobs = Blobs::new(Kernel::SoftObject, (0..8000).map(one).collect()).unwrap();
        for side in [19.0, 11.0] {
            let over = one(at).position.map(|v| if v > 9.0 { (v - side, v) } else { (v, v + side) });
            let range = blobs.interval(over.map(|(low, high)| Interval::new(low, high)));
            assert!(range.is_bounded() && range.contains(weight) && range.contains(0.0), "{at}: {range:?}");
        }
    }
}
