use super::*;
use crate::field::{Closure, Field, Sense};
use crate::graph::{Expr, GraphField, x, y, z};

/// Points in a layer around the unit sphere, the same every time.
fn around() -> Vec<Vec3> {
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    let direction = std::iter::repeat_with(|| Vec3::new(next(), next(), next())).filter(|v| v.length() > 0.1);
    direction.take(1500).enumerate().map(|(i, v)| v.normalize() * (0.91 + 0.0001 * i as f32)).collect()
}

fn checked(field: &dyn Field, iso: f32, epsilon: f32) -> (Vec<Vec3>, Projection) {
    let surface = Surface::new(field, iso, field.sense(), 1e-3).unwrap();
    let (start, radius) = (around(), 0.15);
    let mut points = start.clone();
    let found = project(&surface, &mut points, &vec![radius; start.len()], epsilon).unwrap();
    for ((p, from), converged) in points.iter().zip(&start).zip(&found.converged) {
        assert!(p.distance(*from) <= radius * 1.00001, "{from} went to {p}");
        assert!(*converged || p == from, "{p} moved and did not converge");
    }
    (points, found)
}

fn ball() -> Expr {
    x().square() + y().square() + z().square()
}

/// However long the gradients are, all points end within ε. Goes red when a bracket of any length counts as converged.
#[test]
fn badly_scaled_gradients() {
    for scale in [1e-30, 1e-10, 1.0, 1e10, 1e30] {
        for sense in [Sense::Below, Sense::Above] {
            for epsilon in [1e-2, 1e-4, 1e-6] {
                let field = GraphField::new(&(ball() * scale), sense);
                let (points, found) = checked(&field, scale as f32, epsilon);
                assert_eq!(found.failed(), 0, "{scale}");
                for p in &points {
                    assert!((p.length() - 1.0).abs() <= epsilon + 2e-7, "{scale} {epsilon}: {p}");
                }
            }
        }
    }
}

/// Gradients that are zero, tiny, or say nothing: the search to both sides finds what Newton's steps do not. Goes red
/// without [`Phase::Line`].
#[test]
fn signs_alone() {
    let step = Closure::new(Sense::Below, |p| if p.length() < 1.0 { -1.0 } else { 1.0 });
    let (points, found) = checked(&step, 0.0, 1e-5);
    // The direction of the search is a fixed one here, which misses the sphere at places.
    assert!(found.count() > 500, "{}", found.count());
    for (p, converged) in points.iter().zip(&found.converged) {
        assert!(!converged || (p.length() - 1.0).abs() <= 1.1e-5, "{p}");
    }
    let flat = Closure::new(Sense::Below, |p| (p.length() - 1.0).powi(9));
    let (points, found) = checked(&flat, 0.0, 1e-5);
    // The gradient is exactly zero near the surface.
    assert!(found.count() > 1000, "{}", found.count());
    for (p, converged) in points.iter().zip(&found.converged) {
        assert!(!converged || (p.length() - 1.0).abs() <= 1.1e-5, "{p}");
    }
}

/// NaN in half of space: points converge or stay, and none becomes NaN.
#[test]
fn not_finite() {
    let half = Closure::new(Sense::Below, |p| if p.x > 0.0 { f32::NAN } else { p.length() - 1.0 });
    let (points, found) = checked(&half, 0.0, 1e-4);
    for ((p, from), converged) in points.iter().zip(around()).zip(&found.converged) {
        assert!(p.is_finite());
        assert!(*converged || from.x > -0.16, "{from}");
    }
    let nothing = Closure::new(Sense::Below, |_| f32::NAN);
    assert_eq!(checked(&nothing, 0.0, 1e-4).1.count(), 0);
    let surface = Surface::new(&half, 0.0, Sense::Below, 1e-3).unwrap();
    let mut points = [Vec3::NAN, Vec3::NEG_X, Vec3::NEG_X * 0.9, Vec3::NEG_X * 0.9, Vec3::NEG_X * 0.9];
    let found = project(&surface, &mut points, &[1.0, 0.0, 0.0, f32::NAN], 1e-4).unwrap();
    assert_eq!(found.converged, [false, true, false, false, false]);
    assert!(points[0].is_nan() && points[2] == Vec3::NEG_X * 0.9);
}

/// Where floats are farther apart than ε, their spacing is the tolerance, and the search ends.
#[test]
fn far_from_the_origin() {
    let far = GraphField::new(&(x() - 1e6), Sense::Below);
    let surface = Surface::new(&far, 0.0, Sense::Below, 1e-3).unwrap();
    let mut points = vec![Vec3::new(999_990.0, 1e6, 3.0); 70];
    let found = project(&surface, &mut points, &[20.0; 70], 1e-9).unwrap();
    assert_eq!(found.count(), 70);
    assert!(points.iter().all(|p| (p.x - 1e6).abs() <= 0.5 && p.z == 3.0));
}
