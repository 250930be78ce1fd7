//! The quadric error function of dual contouring: the point that lies closest to a set of planes (Ju, Losasso,
//! Schaefer & Warren 2002, *Dual contouring of Hermite data*).

use glam::{DMat3, DVec3};

/// A plane: a point of a surface, and the unit normal there.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// A point in the plane.
    pub at: DVec3,
    /// At unit length.
    pub normal: DVec3,
}

/// Where planes meet.
#[derive(Debug, Clone, Copy)]
pub struct Meeting {
    /// The point closest to all planes; of a line or a plane of such points, that nearest to the start.
    pub at: DVec3,
    /// 3 where they meet in a point, 2 in a line, 1 where they are one plane, 0 without planes.
    pub rank: usize,
    /// Where the rank is 2, the line's direction.
    pub line: DVec3,
}

/// Directions in which the planes' normals vary less than this part of what they have in common (as squares) count as
/// none: tan²(4°), an edge between planes that are turned by 8° against each other.
const TRUNCATION: f64 = 0.005;

/// The minimiser of Σ (normal · (x − at))² that is nearest to `start`.
pub fn meet(planes: impl Iterator<Item = Plane>, start: DVec3) -> Meeting {
    let (mut a, mut b) = (DMat3::ZERO, DVec3::ZERO);
    for Plane { at, normal } in planes {
        a += DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        b += normal * normal.dot(at - start);
    }
    let (values, vectors) = eigen(a);
    let most = values[0].max(values[1]).max(values[2]);
    let mut meeting = Meeting { at: start, rank: 0, line: DVec3::ZERO };
    for (value, vector) in values.into_iter().zip(vectors) {
        if value > TRUNCATION * most {
            meeting.at += vector * (vector.dot(b) / value);
            meeting.rank += 1;
        } else {
            meeting.line = vector;
        }
    }
    meeting
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix, by Jacobi rotations.
fn eigen(symmetric: DMat3) -> ([f64; 3], [DVec3; 3]) {
    let (mut a, mut vectors) = (symmetric.to_cols_array_2d(), [DVec3::X, DVec3::Y, DVec3::Z]);
    for _ in 0..12 {
        let [xy, xz, yz] = [a[0][1].abs(), a[0][2].abs(), a[1][2].abs()];
        let diagonal = a[0][0].abs() + a[1][1].abs() + a[2][2].abs();
        if xy + xz + yz <= 1e-15 * diagonal {
            break;
        }
        for [p, q] in [[0, 1], [0, 2], [1, 2]] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (one, two) = (a[p], a[q]);
            a[p] = std::array::from_fn(|k| c * one[k] - s * two[k]);
            a[q] = std::array::from_fn(|k| s * one[k] + c * two[k]);
            (vectors[p], vectors[q]) = (vectors[p] * c - vectors[q] * s, vectors[p] * s + vectors[q] * c);
        }
    }
    ([a[0][0], a[1][1], a[2][2]], vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(at: [f64; 3], normal: [f64; 3]) -> Plane {
        Plane { at: at.into(), normal: DVec3::from(normal).normalize() }
    }

    #[test]
    fn planes_meet() {
        let [a, b] = [plane([1.0, 9.0, -4.0], [1.0, 0.2, 0.1]), plane([0.3, 2.0, 1.0], [0.3, 1.0, -0.4])];
        let c = plane([0.0, 1.0, 7.0], [0.1, -0.3, 1.0]);
        let off = |p: Plane, at: DVec3| p.normal.dot(at - p.at).abs();
        let start = DVec3::new(0.2, 0.3, 0.4);
        let corner = meet([a, b, c, a].into_iter(), start);
        assert!(corner.rank == 3 && [a, b, c].into_iter().all(|p| off(p, corner.at) < 1e-9), "{corner:?}");
        let edge = meet([a, b, b].into_iter(), start);
        assert!(edge.rank == 2 && [a, b].into_iter().all(|p| off(p, edge.at) < 1e-9), "{edge:?}");
        assert!(
            (edge.at - start).dot(edge.line).abs() < 1e-9
                && edge.line.cross(a.normal.cross(b.normal)).length() < 1e-9
        );
        let flat = meet([a, a].into_iter(), start);
        assert!(
            flat.rank == 1 && off(a, flat.at) < 1e-9 && (flat.at - start).cross(a.normal).length() < 1e-9
        );
        assert_eq!(meet([].into_iter(), start).rank, 0);
    }
}
