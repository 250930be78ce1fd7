//! The box is in the frame, whatever the box and the view.

use glam::Vec3;
use isoforge::render::{Camera, RenderError, View};
use proptest::prelude::*;

fn corners(low: Vec3, high: Vec3) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        let pick = |bit: usize, a: f32, b: f32| if i & bit == 0 { a } else { b };
        Vec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
    })
}

/// The farthest that a corner is from the middle of the frame, whose rim is at 1.
fn reach(camera: &Camera, low: Vec3, high: Vec3) -> f32 {
    let mut reach = 0.0f32;
    for corner in corners(low, high) {
        let [x, y, z, w] = camera.project(corner).to_array();
        assert!(w > 0.0 && z > 0.0 && z < w, "{corner} has depth {z} of {w}");
        reach = reach.max((x / w).abs()).max((y / w).abs());
    }
    reach
}

#[test]
fn every_view_shows_the_whole_box_and_fills_the_frame() {
    let boxes = [Vec3::ONE, Vec3::new(3.0, 1.0, 0.2), Vec3::new(0.1, 0.1, 5.0)];
    for half in boxes {
        for azimuth in (-360..=360).step_by(45) {
            for elevation in (-90..=90).step_by(30) {
                for (fov, size) in [(35.0, [1024, 768]), (5.0, [300, 900]), (120.0, [1600, 100])] {
                    let view = View { azimuth: azimuth as f32 + 7.0, elevation: elevation as f32, fov, size };
                    let centre = Vec3::new(10.0, -20.0, 5.0);
                    let (low, high) = (centre - half, centre + half);
                    let camera = Camera::fit((low, high), &view).unwrap();
                    let reach = reach(&camera, low, high);
                    assert!(reach <= 0.97, "{reach} with {view:?}");
                    // The farthest corner touches the margin unless the eye would be in the box.
                    assert!(reach >= 0.95 || fov > 90.0, "{reach} with {view:?}");
                }
            }
        }
    }
}

proptest! {
    #[test]
    fn any_box_fits(
        low in prop::array::uniform3(-1e3f32..1e3),
        side in prop::array::uniform3(1e-2f32..1e3),
        azimuth in -720f32..720.0,
        elevation in -180f32..180.0,
        fov in 1f32..150.0,
        width in 1u32..4000,
        height in 1u32..4000,
    ) {
        // Strips of one pixel's width would put the camera where f32 is coarse.
        prop_assume!(width < height * 50 && height < width * 50);
        let low = Vec3::from(low);
        let high = low + Vec3::from(side);
        let view = View { azimuth, elevation, fov, size: [width, height] };
        let camera = Camera::fit((low, high), &view).unwrap();
        prop_assert!(reach(&camera, low, high) <= 1.0);
    }
}

#[test]
fn degenerate_boxes_give_ordinary_cameras() {
    let point = |p: Vec3| Some((p, p));
    let cases = [
        None,
        point(Vec3::ZERO),
        point(Vec3::new(1e6, -3.0, 0.0)),
        point(Vec3::splat(1e-40)),
        Some((Vec3::ZERO, Vec3::X)),
        Some((Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0))),
        Some((Vec3::ZERO, Vec3::splat(1e-36))),
        Some((Vec3::splat(-1e36), Vec3::splat(1e36))),
        Some((Vec3::ONE, -Vec3::ONE)),
    ];
    for bounds in cases {
        for (azimuth, elevation) in [(0.0, 0.0), (30.0, 25.0), (0.0, 90.0), (90.0, -90.0)] {
            let view = View { azimuth, elevation, ..View::default() };
            let camera = Camera::fit(bounds, &view).unwrap_or_else(|e| panic!("{bounds:?}: {e}"));
            let (a, b) = bounds.unwrap_or_default();
            for corner in corners(a, b) {
                let p = camera.project(corner);
                assert!(p.is_finite() && p.w > 0.0, "{bounds:?} {view:?}: {p}");
                assert!(p.x.abs() <= p.w && p.y.abs() <= p.w && p.z >= 0.0 && p.z <= p.w, "{bounds:?}: {p}");
            }
        }
    }
}

#[test]
fn z_is_up_and_azimuth_turns_from_x_to_y() {
    let seen = |azimuth, elevation, p| {
        let view = View { azimuth, elevation, ..View::default() };
        Camera::fit((-Vec3::ONE, Vec3::ONE), &view).unwrap().project(p)
    };
    // From +x: +y to the right, +z up, +x nearer.
    assert!(seen(0.0, 0.0, Vec3::Y).x > 0.1);
    assert!(seen(0.0, 0.0, Vec3::Z).y > 0.1);
    assert!(seen(0.0, 0.0, Vec3::X).w < seen(0.0, 0.0, -Vec3::X).w);
    // From +y: +x to the left. From above: +x down.
    assert!(seen(90.0, 0.0, Vec3::X).x < -0.1);
    assert!(seen(0.0, 90.0, Vec3::X).y < -0.1);
    let camera = Camera::fit((-Vec3::ONE, Vec3::ONE), &View { azimuth: 90.0, ..View::default() }).unwrap();
    assert!(camera.eye().y > 1.0 && camera.eye().z > 0.5);
}

#[test]
fn impossible_views_are_refused() {
    let fit = |view: View| Camera::fit((Vec3::ZERO, Vec3::ONE), &view);
    for size in [[0, 10], [10, 0], [16385, 1], [16384, 16384], [u32::MAX, u32::MAX]] {
        let error = fit(View { size, ..View::default() }).unwrap_err();
        assert!(matches!(error, RenderError::Size { .. }), "{error}");
        assert!(error.to_string().contains("16384"), "{error}");
    }
    for fov in [0.0, -10.0, 180.0, f32::NAN] {
        assert!(matches!(fit(View { fov, ..View::default() }), Err(RenderError::Angle { .. })));
    }
    for azimuth in [f32::NAN, f32::INFINITY, 1e30] {
        assert!(matches!(fit(View { azimuth, ..View::default() }), Err(RenderError::Angle { .. })));
    }
    for bad in [f32::NAN, f32::INFINITY, f32::MAX] {
        let bounds = (Vec3::ZERO, Vec3::splat(bad));
        assert!(matches!(Camera::fit(bounds, &View::default()), Err(RenderError::Bounds)));
    }
}
