//! One component: the kernels' formulas, joints and ends.

use crate::reference::{KERNELS, kernel, values};
use isoforge::graph::blobs::{BLOBBY, Blobs, Component, Kernel};

fn along_x(of: Kernel, radius: f32, weight: f32, at: &[f32]) -> Vec<f32> {
    let blobs = Blobs::new(of, vec![Component { position: [0.0; 3], radius, weight }]).unwrap();
    values(&*blobs, &[at.to_vec(), vec![0.0; at.len()], vec![0.0; at.len()]])
}

/// Goes red when 17/9 is taken for 16/9, or the metaball's second piece for (1 − r/b)².
#[test]
fn are_their_formulas() {
    let at: Vec<f32> = (0..2000).map(|i| (i as f32 + 0.5) / 1600.0 * 1.7).collect();
    for of in KERNELS {
        for (r, value) in at.iter().zip(along_x(of, 1.7, 1.0, &at)) {
            let expected = kernel(of, f64::from(*r), f64::from(1.7f32));
            let scale = kernel(of, 0.0, 1.7).min(expected.max(1.0));
            assert!(
                (f64::from(value) - expected).abs() <= 2e-6 * scale,
                "{of:?} at {r}: {value}, {expected}"
            );
        }
    }
}

/// Goes red when the metaball's pieces meet at 1/8 instead of 1/9, and when a support ends early.
#[test]
fn pieces_join_and_end_at_the_support() {
    let third = 1.0f32 / 3.0;
    let [before, after] = [third - 1e-4, third + 1e-4].map(|r| along_x(Kernel::Metaball, 1.0, 1.0, &[r])[0]);
    assert!(before > after && before - after < 5e-4, "{before} {after}");
    let just_before = f32::from_bits(1f32.to_bits() - 64);
    let after = [1.0, f32::from_bits(1f32.to_bits() + 1), 1.5, 1e30, f32::INFINITY, f32::NAN];
    for of in KERNELS {
        let jump = match of {
            Kernel::Blobby { least } => least,
            Kernel::InverseSquare => 1.0,
            _ => 0.0,
        };
        let last = along_x(of, 1.0, 1.0, &[just_before])[0];
        assert!(last >= jump * 0.999 && last - jump < 1e-4, "{of:?}: {last}");
        assert_eq!(along_x(of, 1.0, 1.0, &after), [0.0; 6], "{of:?}");
    }
    assert!(along_x(Kernel::InverseSquare, 2.0, 1.0, &[0.0])[0] == 262_144.0);
}

/// The surface of a lone component at the reach that `reach_of` says.
#[test]
fn reaches() {
    for of in [Kernel::SoftObject, Kernel::Metaball, BLOBBY] {
        for iso in [0.1, 0.5, 0.9] {
            let reach = of.reach_of(iso).unwrap();
            assert!((along_x(of, 1.0, 1.0, &[reach])[0] - iso).abs() < 1e-5, "{of:?} {iso}");
        }
    }
    let radius = Kernel::blobby_radius(2.0, 1e-3);
    let value = along_x(BLOBBY, radius, 3.0, &[0.7])[0];
    assert!((f64::from(value) - 3.0 * (-2.0 * 0.49f64).exp()).abs() < 1e-5, "{value}");
}
