//! Where a vertex goes: the point nearest to the tangent planes of the surface around it (Garland & Heckbert 1997; Ju et
//! al. 2002; for contouring Kobbelt et al. 2001).

use glam::{DMat3, DVec3};

/// A tangent plane of the surface.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// A point of the surface.
    pub at: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

/// How much better, in largest distance to the planes, a point must be that more directions are given up for.
const GAIN: f64 = 0.6;
/// Directions whose share of the normals is smaller are not moved along: what is measured there is rounding.
const NOISE: f64 = 1e-6;

/// Where nothing but the height counts, the part of it that is gone: all of it lies above the surface by about as much
/// as the mean of the points lies below, and triangles between such vertices are nearer to it in their middles.
const HEIGHT: f64 = 0.75;

/// The point for planes around `mean`, and its largest distance to a plane. Of the minimisers of the quadric error along
/// one, two and three directions around `mean` the first that is within `enough` of all planes, or not much worse than the
/// next: a flat or evenly curved surface keeps its vertices in the middle of their cells, creases and corners
/// get theirs. `clamp` brings a point into its cell.
pub fn minimiser(planes: &[Plane], mean: DVec3, enough: f64, clamp: impl Fn(DVec3) -> DVec3) -> (DVec3, f64) {
    let error = |x: DVec3| planes.iter().map(|p| p.normal.dot(x - p.at).abs()).fold(0.0, f64::max);
    let mut ata = DMat3::ZERO;
    let mut atb = DVec3::ZERO;
    for p in planes {
        ata += DMat3::from_cols(p.normal * p.normal.x, p.normal * p.normal.y, p.normal * p.normal.z);
        atb += p.normal * p.normal.dot(p.at - mean);
    }
    let (mut best, mut least) = (mean, error(mean));
    let (values, vectors) = eigen(ata);
    let mut x = mean;
    let mut height = DVec3::ZERO;
    for j in 0..3 {
        // The first direction is always worth it: it is the height.
        if least <= enough && j > 0 || values[j] <= NOISE * values[0] || values[0] <= 0.0 {
            break;
        }
        let step = vectors[j] * (vectors[j].dot(atb) / values[j]);
        if j == 0 {
            height = step;
        }
        x += step;
        let at = clamp(x);
        let now = error(at);
        if now < least * if j == 0 { 1.0 } else { GAIN } {
            (best, least) = (at, now);
            if j > 0 {
                height = DVec3::ZERO;
            }
        }
    }
    (clamp(best - height * (1.0 - HEIGHT)), least)
}

/// Eigenvalues of a symmetric matrix, largest first, and unit eigenvectors (Jacobi rotations).
fn eigen(mut a: DMat3) -> ([f64; 3], [DVec3; 3]) {
    let mut v = DMat3::IDENTITY;
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = a.col(q)[p];
            if off.abs() <= 1e-15 * (a.col(p)[p].abs() + a.col(q)[q].abs()) {
                continue;
            }
            let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let off = t * off;
            // The third axis' entries turn as the eigenvectors do.
            let r = 3 - p - q;
            let (ap, aq) = (a.col(p)[r], a.col(q)[r]);
            let mut set = |i: usize, j: usize, value: f64| {
                a.col_mut(i)[j] = value;
                a.col_mut(j)[i] = value;
            };
            set(p, r, c * ap - s * aq);
            set(q, r, s * ap + c * aq);
            set(p, q, 0.0);
            a.col_mut(p)[p] -= off;
            a.col_mut(q)[q] += off;
            let (vp, vq) = (v.col(p), v.col(q));
            *v.col_mut(p) = vp * c - vq * s;
            *v.col_mut(q) = vp * s + vq * c;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a.col(j)[j].total_cmp(&a.col(i)[i]));
    (order.map(|i| a.col(i)[i]), order.map(|i| v.col(i)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planes(normals: &[DVec3]) -> Vec<Plane> {
        let corner = DVec3::new(0.1, -0.2, 0.3);
        let at = |n: &DVec3| Plane { at: corner + n.any_orthonormal_vector() * 0.5, normal: *n };
        normals.iter().map(at).collect()
    }
    #[test]
    fn corners_and_creases_are_found() {
        let oblique = DVec3::new(1.0, 2.0, 2.0) / 3.0;
        let corner = planes(&[DVec3::X, DVec3::Y, oblique]);
        let (at, error) = minimiser(&corner, DVec3::ZERO, 1e-6, |x| x);
        assert!(error < 1e-9 && at.distance(DVec3::new(0.1, -0.2, 0.3)) < 1e-9, "{at} {error}");
        let crease = planes(&[DVec3::X, oblique]);
        let (at, error) = minimiser(&crease, DVec3::ZERO, 1e-6, |x| x);
        assert!(error < 1e-9 && at.length() < 1.0, "{at} {error}");
    }
}
