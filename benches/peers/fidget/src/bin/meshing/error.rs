//! How far a mesh and the surface it stands for are from each other, in both directions: a mesh that lacks a piece has no
//! point that is far from the surface.

use glam::{DMat3, DVec3};
use isoforge::mesh::Mesh;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;
use rayon::prelude::*;

/// A solid as an intersection: inside where all of these are negative. None changes faster than the point moves, so that it
/// bounds the distance to where it is zero. Shapes of fewer parts fill up with −∞.
pub type Parts = fn(DVec3) -> [f64; 4];

/// The largest and the RMS distance.
pub type Errors = [f64; 2];

/// The sets of up to three parts that meet in faces, creases and corners, faces first.
const SETS: [&[usize]; 14] = [
    &[0],
    &[1],
    &[2],
    &[3],
    &[0, 1],
    &[0, 2],
    &[1, 2],
    &[0, 3],
    &[1, 3],
    &[2, 3],
    &[0, 1, 2],
    &[0, 1, 3],
    &[0, 2, 3],
    &[1, 2, 3],
];

/// A Newton step: the shortest that makes all parts of the set zero to first order.
fn step(parts: Parts, set: &[usize], at: DVec3) -> DVec3 {
    let values = parts(at);
    let [dx, dy, dz] = DVec3::AXES.map(|axis| (parts(at + axis * 1e-6), parts(at - axis * 1e-6)));
    let mut gradients = [DVec3::ZERO; 3];
    let mut right = DVec3::ZERO;
    // The Gram matrix, with ones for parts that the set does not have.
    let mut gram = DMat3::IDENTITY;
    for (i, &k) in set.iter().enumerate() {
        gradients[i] = DVec3::new(dx.0[k] - dx.1[k], dy.0[k] - dy.1[k], dz.0[k] - dz.1[k]) / 2e-6;
        right[i] = values[k];
    }
    for i in 0..set.len() {
        for j in 0..set.len() {
            gram.col_mut(i)[j] = gradients[i].dot(gradients[j]);
        }
    }
    let by = gram.inverse() * right;
    at - (gradients[0] * by.x + gradients[1] * by.y + gradients[2] * by.z)
}

/// The point near `p` where the parts of the set are zero, if that is on the solid's surface.
fn onto(parts: Parts, set: &[usize], p: DVec3) -> Option<DVec3> {
    let mut at = p;
    for _ in 0..8 {
        let values = parts(at);
        if set.iter().all(|&k| values[k].abs() < 1e-13) {
            break;
        }
        at = step(parts, set, at);
    }
    let values = parts(at);
    (set.iter().all(|&k| values[k].abs() < 1e-8) && values.iter().all(|&v| v < 1e-8)).then_some(at)
}

/// The point of the surface next to `p`: the nearest of the faces, creases and corners around.
fn nearest(parts: Parts, p: DVec3) -> DVec3 {
    let values = parts(p);
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&a, &b| values[a].abs().total_cmp(&values[b].abs()));
    let (mut best, mut distance) = (None, f64::INFINITY);
    for set in SETS {
        let set: Vec<usize> = set.iter().map(|&i| order[i]).collect();
        // What is at least so far away cannot be nearer.
        if set.iter().any(|&k| values[k].abs() >= distance) {
            continue;
        }
        if let Some(at) = onto(parts, &set, p)
            && at.distance(p) < distance
        {
            (best, distance) = (Some(at), at.distance(p));
        }
    }
    // Where the parts are far from distances, Newton's steps may leave for elsewhere: onto whichever part is outermost
    // then, one after the other.
    best.unwrap_or_else(|| {
        (0..32).fold(p, |at, _| {
            let values = parts(at);
            let outermost = (0..4).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
            step(parts, &[outermost], at)
        })
    })
}

fn corners(mesh: &Mesh, triangle: [u32; 3]) -> [DVec3; 3] {
    triangle.map(|v| mesh.vertices[v as usize].at().as_dvec3())
}

fn twice_area([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).cross(c - a).length()
}

/// Largest and RMS of distances and their weights.
fn errors(distances: impl ParallelIterator<Item = (f64, f64)>) -> Errors {
    let (largest, sum, weights) = distances
        .map(|(d, weight)| (d, weight * d * d, weight))
        .reduce(|| (0.0, 0.0, 0.0), |a, b| (a.0.max(b.0), a.1 + b.1, a.2 + b.2));
    [largest, (sum / weights).sqrt()]
}

/// From the mesh to the surface: 15 points of each triangle, which share its area.
fn to_surface(parts: Parts, mesh: &Mesh) -> Errors {
    errors(mesh.triangles.par_iter().flat_map_iter(|&t| {
        let [a, b, c] = corners(mesh, t);
        let weight = twice_area([a, b, c]);
        (0..=4).flat_map(move |i| {
            (0..=4 - i).map(move |j| {
                let (u, v) = (f64::from(i) / 4.0, f64::from(j) / 4.0);
                let p = a * u + b * v + c * (1.0 - u - v);
                (nearest(parts, p).distance(p), weight)
            })
        })
    }))
}

/// Points of the true surface.
pub struct Samples {
    parts: Parts,
    /// The points and the areas they stand for; those of creases and corners stand for none.
    points: Vec<(DVec3, f64)>,
}

impl Samples {
    /// From the vertices of a fine mesh of the shape, with cells of size `cell`.
    pub fn new(parts: Parts, fine: &Mesh, cell: f64) -> Self {
        let mut areas = vec![0.0; fine.vertices.len()];
        for &t in &fine.triangles {
            t.into_iter().for_each(|v| areas[v as usize] += twice_area(corners(fine, t)));
        }
        let vertices = fine.vertices.par_iter().zip(areas);
        let points = vertices.flat_map_iter(|(v, area)| {
            let p = nearest(parts, v.at().as_dvec3());
            let values = parts(p);
            let meeting = SETS.into_iter().filter(|set| set.len() > 1);
            let close = meeting.filter(move |set| set.iter().all(|&k| values[k].abs() < cell));
            let creases = close.filter_map(move |set| onto(parts, set, p));
            std::iter::once((p, area)).chain(creases.map(|at| (at, 0.0)))
        });
        Self { parts, points: points.collect() }
    }

    /// How many there are, and how many of them are of creases and corners.
    pub fn count(&self) -> [usize; 2] {
        [self.points.len(), self.points.iter().filter(|p| p.1 == 0.0).count()]
    }

    /// From the surface to the nearest triangle.
    fn to_mesh(&self, mesh: &Mesh) -> Errors {
        let vertices = mesh.vertices.iter().map(|v| v.at().as_dvec3().to_array().into()).collect();
        // One without area has no plane to be projected to, and its edges are others' too.
        let good = mesh.triangles.iter().copied().filter(|&t| twice_area(corners(mesh, t)) > 0.0);
        let tree = TriMesh::new(vertices, good.collect()).unwrap();
        errors(self.points.par_iter().map(|&(p, area)| {
            let found: [f64; 3] = tree.project_local_point(p.to_array().into(), false).point.into();
            (DVec3::from(found).distance(p), area)
        }))
    }

    /// The errors of both directions, the larger of each; and those from the mesh to the surface alone.
    pub fn errors(&self, mesh: &Mesh) -> [Errors; 2] {
        let (one, other) = (to_surface(self.parts, mesh), self.to_mesh(mesh));
        [[one[0].max(other[0]), one[1].max(other[1])], one]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isoforge::mesh::Vertex;

    const CUT: Parts = |p| {
        let [x, y, z] = (p.abs() - 0.61).to_array();
        [x, y, z, 0.75 - p.length()]
    };

    #[test]
    fn nearest_goes_to_faces_edges_corners_and_the_sharp_rim() {
        let rim = 0.75f64.mul_add(0.75, -0.61 * 0.61).sqrt();
        for (p, distance) in [
            (DVec3::new(0.65, 0.5, 0.5), 0.04),
            (DVec3::new(0.64, 0.65, 0.5), 0.05),
            (DVec3::new(0.62, 0.63, 0.63), 0.03),
            (DVec3::new(0.61, 0.2, 0.0), rim - 0.2),
            (DVec3::new(0.63, rim - 0.05, 0.0), 0.05f64.hypot(0.02)),
        ] {
            let found = nearest(CUT, p).distance(p);
            assert!((found - distance).abs() < 1e-6, "{p}: {found}, not {distance}");
        }
    }

    /// The reason for all this: half a cube's faces are on the cube, but not the cube.
    #[test]
    fn what_is_missing_is_seen_from_the_surface_alone() {
        let parts: Parts = |p| {
            let [x, y, z] = (p.abs() - 0.5).to_array();
            [x, y, z, f64::NEG_INFINITY]
        };
        let at = |i: u32| Vertex {
            position: [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 - 0.5),
            ..Vertex::default()
        };
        let mut mesh = Mesh {
            vertices: (0..8).map(at).collect(),
            triangles: vec![
                [0, 2, 1],
                [1, 2, 3],
                [4, 5, 6],
                [5, 7, 6],
                [0, 1, 4],
                [1, 5, 4],
                [2, 6, 3],
                [3, 6, 7],
                [0, 4, 2],
                [2, 4, 6],
                [1, 3, 5],
                [3, 7, 5],
            ],
        };
        let samples = Samples::new(parts, &mesh, 0.1);
        let [both, one] = samples.errors(&mesh);
        assert!(both[0] < 1e-6 && one[0] < 1e-6, "{both:?}, {one:?}");
        mesh.triangles.truncate(2);
        let [both, one] = samples.errors(&mesh);
        assert!((both[0] - 1.0).abs() < 1e-6 && one[0] < 1e-6, "{both:?}, {one:?}");
    }
}
