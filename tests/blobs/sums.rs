//! Sums of many, and their gradients.

use crate::reference::{KERNELS, bits, gradients, points, some, sum, values};
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::graph::interval::Interval;
use isoforge::graph::leaf::Leaf;

/// Goes red when a grid's reach is halved.
#[test]
fn are_those_of_the_reference() {
    for (n, of) in KERNELS.into_iter().enumerate() {
        let components = some(3000, n as u64);
        let at = points(3000, 99);
        let values = values(&*Blobs::new(of, components.clone()).unwrap(), &at);
        let mut none = 0;
        for (i, value) in values.iter().enumerate() {
            let [expected, magnitude] = sum(of, &components, [0, 1, 2].map(|k| f64::from(at[k][i])));
            assert!(
                (f64::from(*value) - expected).abs() <= 2e-5 * magnitude + 1e-6,
                "{of:?} {i}: {value}, {expected}"
            );
            none += usize::from(magnitude == 0.0);
        }
        assert!((10..2900).contains(&none), "{none}");
    }
}

/// Goes red when a slope loses its factor 2.
#[test]
fn gradients_are_differences() {
    for (n, of) in KERNELS.into_iter().enumerate() {
        let components = some(500, 20 + n as u64);
        let blobs = Blobs::new(of, components.clone()).unwrap();
        let at = points(1000, 7);
        let [value, by @ ..] = gradients(&*blobs, &at);
        assert_eq!(bits(&value), bits(&values(&*blobs, &at)), "{of:?}");
        let step = 1e-5;
        for i in 0..value.len() {
            let p = [0, 1, 2].map(|k| f64::from(at[k][i]));
            for k in 0..3 {
                let [mut high, mut low] = [p; 2];
                high[k] += step;
                low[k] -= step;
                let ([high, m], [low, _]) = (sum(of, &components, high), sum(of, &components, low));
                let expected = (high - low) / (2.0 * step);
                // A support's end, or the end of the core, between the two: no derivative there.
                if expected.abs() > 1e3 * m.max(1.0) {
                    continue;
                }
                let found = f64::from(by[k][i]);
                assert!(
                    (found - expected).abs() <= 2e-3 * (1.0 + m + expected.abs()),
                    "{of:?} {i}: {found}, {expected}"
                );
            }
        }
    }
}

/// However points are put together, the bits are the same. Goes red when a wide chunk is split wrongly.
#[test]
fn do_not_depend_on_the_points_beside() {
    let blobs = Blobs::new(Kernel::SoftObject, some(5000, 5)).unwrap();
    let at = points(777, 6);
    let all = values(&*blobs, &at);
    for i in (0..777).step_by(13) {
        let one = values(&*blobs, &at.clone().map(|axis| vec![axis[i]]));
        assert_eq!(bits(&one), bits(&all[i..i + 1]), "{i}");
    }
}

/// Goes red when `within` leaves out components farther than 0.9 of their radius.
#[test]
fn parts_have_the_same_bits() {
    for (n, of) in KERNELS.into_iter().enumerate() {
        let whole = Blobs::new(of, some(2000, 30 + n as u64)).unwrap();
        let mut parts = 0;
        for (i, side) in [1.0, 0.5, 0.3, 0.2, 0.1, 0.05, 0.01].into_iter().enumerate() {
            let mut at = points(200, i as u64);
            let corner = at.clone().map(|axis| axis[0]);
            for (axis, corner) in at.iter_mut().zip(corner) {
                axis.iter_mut().for_each(|v| *v = corner + side * v.fract().abs());
            }
            let over = |shrink: f32| corner.map(|low| Interval::new(low, low + side * shrink));
            let Some(part) = whole.within(over(1.0)) else { continue };
            parts += 1;
            assert_eq!(bits(&values(&*whole, &at)), bits(&values(&*part, &at)), "{of:?} {side}");
            let (a, b) = (gradients(&*whole, &at), gradients(&*part, &at));
            assert_eq!(a.map(|v| bits(&v)), b.map(|v| bits(&v)), "{of:?} {side}");
            let Some(smaller) = part.within(over(0.5)) else { continue };
            for (axis, corner) in at.iter_mut().zip(corner) {
                axis.iter_mut().for_each(|v| *v = corner + (*v - corner) * 0.5);
            }
            assert_eq!(bits(&values(&*whole, &at)), bits(&values(&*smaller, &at)), "{of:?} {side}");
        }
        assert!(parts >= 3, "{of:?}: {parts}");
    }
}

/// Memory stays in proportion where one droplet flies far from a dense crowd of very different sizes.
#[test]
fn data_stay_in_proportion() {
    let mut components = some(20_000, 8);
    components.push(Component { position: [1e6, -1e6, 3.0], radius: 1e-3, weight: 1.0 });
    components.push(Component { position: [0.0; 3], radius: 1e4, weight: 1.0 });
    let blobs = Blobs::new(Kernel::SoftObject, components).unwrap();
    assert_eq!(blobs.data().len() as u64 * 4, blobs.data_bytes());
    assert!(blobs.data_bytes() < 20_000 * 40, "{}", blobs.data_bytes());
    let [low, high] = blobs.support();
    assert!(low[1] <= -1e6 && high[0] >= 1e6 && low[2] <= -1e4);
}

/// Goes red when a component is added to the points within 0.9 of its radius only.
#[test]
fn at_lattices_have_the_same_bits() {
    let axis = |from: f32, step: f32, count: u32| -> Vec<f32> {
        (0..count).map(|i| from + step * i as f32).collect()
    };
    for (n, of) in KERNELS.into_iter().enumerate() {
        let whole = Blobs::new(of, some(3000, 60 + n as u64)).unwrap();
        let few = Blobs::new(of, some(20, 60 + n as u64)).unwrap();
        let part = few.within([Interval::new(0.9, 1.4); 3]);
        assert!(part.is_some());
        for (i, [nx, ny, nz]) in
            [[9, 9, 9], [1, 1, 1], [33, 1, 7], [3, 20, 2], [130, 9, 9]].into_iter().enumerate()
        {
            let from = if i % 2 == 0 { 0.9 } else { -0.7 };
            let step = 0.5 / nx.max(ny).max(nz) as f32;
            let axes = [axis(from, step, nx), axis(from, step, ny), axis(0.9, 1.3 * step, nz)];
            let mut at = [const { Vec::new() }; 3];
            for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x))))
            {
                let place = [x, y, z].map(|i| i as usize);
                (0..3).for_each(|k| at[k].push(axes[k][place[k]]));
            }
            let leaves = [Some(&*whole as &dyn Leaf), part.as_deref().filter(|_| i == 0)];
            for leaf in leaves.into_iter().flatten() {
                let mut out = vec![f32::NAN; at[0].len()];
                let axes = [&axes[0][..], &axes[1], &axes[2]];
                assert!(leaf.lattice().unwrap().lattice_values(axes, &mut out));
                assert_eq!(bits(&out), bits(&values(leaf, &at)), "{of:?} {nx} {ny} {nz}");
            }
        }
        // Steps of a few last bits, and none at all.
        for uneven in [axis(0.5, 1e-7, 9), vec![1.0, 0.0], vec![0.0, 1.0, 1.5], vec![f32::NAN; 2]] {
            let mut out = vec![0.0; uneven.len()];
            let lattice = whole.lattice().unwrap();
            assert!(!lattice.lattice_values([&uneven, &[0.0], &[0.0]], &mut out), "{uneven:?}");
        }
    }
}
