//! What makes no field is refused, by number.

use isoforge::graph::blobs::{Blobs, BlobsError, Component, Kernel};

fn refused(kernel: Kernel, change: impl Fn(&mut Component)) -> BlobsError {
    let mut components = vec![Component { position: [1.0; 3], radius: 1.0, weight: 1.0 }; 5000];
    change(&mut components[3210]);
    change(&mut components[4999]);
    Blobs::new(kernel, components).unwrap_err()
}

#[test]
fn is_named() {
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-30, 1e30] {
        let error = refused(Kernel::SoftObject, |c| c.radius = bad);
        assert!(matches!(error, BlobsError::Radius { index: 3210, .. }), "{error}");
        assert!(error.to_string().contains("component 3210"), "{error}");
    }
    for bad in [f32::NAN, f32::NEG_INFINITY, 1e30] {
        let error = refused(Kernel::Metaball, |c| c.position[2] = bad);
        assert!(matches!(error, BlobsError::Position { index: 3210, .. }), "{error}");
        let error = refused(Kernel::Metaball, |c| c.weight = bad);
        assert!(matches!(error, BlobsError::Weight { index: 3210, .. }), "{error}");
    }
    let error = refused(Kernel::InverseSquare, |c| (c.radius, c.weight) = (1e-8, 1e10));
    assert!(matches!(error, BlobsError::Weight { index: 3210, .. }), "{error}");
    assert_eq!(Blobs::new(Kernel::SoftObject, Vec::new()).unwrap_err(), BlobsError::Empty);
    for least in [0.0, 1.0, f32::NAN, -1.0] {
        let error = refused(Kernel::Blobby { least }, |_| {});
        assert!(matches!(error, BlobsError::CutOff { .. }), "{error}");
    }
}
