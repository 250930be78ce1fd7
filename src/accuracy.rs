//! How far a mesh lies from the surface that it stands for: distances and normals of samples all over its triangles.

use crate::field::{NoForm, Surface};
use crate::mesh::{Mesh, Vertex};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Samples that are followed to the surface together.
const BATCH: usize = 256;
/// Newton steps to the surface, and steps along it.
const STEPS: usize = 12;
const SLIDES: usize = 4;

/// The error of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Accuracy {
    /// The largest distance of a sample from the surface, in world units.
    pub distance_max: f64,
    /// The root of the mean square of the distances, by area.
    pub distance_rms: f64,
    /// The root of the mean square, by area, of the angles in degrees between the mesh's normal (those of the vertices,
    /// interpolated) and the surface's at the nearest point.
    pub normal_rms: f64,
    /// The largest such angle.
    pub normal_max: f64,
    /// Samples that were taken.
    pub samples: usize,
    /// Samples of which no way to the surface was found; they count in nothing else.
    pub lost: usize,
}

/// Sums over some of the samples.
#[derive(Default)]
struct Sums {
    squares: f64,
    max: f64,
    angle_squares: f64,
    angle_max: f64,
    lost: usize,
}

impl Sums {
    fn add(mut self, other: Self) -> Self {
        self.squares += other.squares;
        self.max = self.max.max(other.max);
        self.angle_squares += other.angle_squares;
        self.angle_max = self.angle_max.max(other.angle_max);
        self.lost += other.lost;
        self
    }
}

/// Measures `mesh` against `surface` at about `samples` points, spread evenly over its area, the same at each call.
///
/// A sample's distance is that to a nearby point of the surface, found by Newton steps and then by sliding along the surface
/// towards the sample: never less than the true distance but for rounding, and equal to it where the nearest point is
/// reached that way.
///
/// # Errors
/// As [`Surface::values`].
pub fn measure(surface: &Surface<'_>, mesh: &Mesh, samples: usize) -> Result<Accuracy, NoForm> {
    // A triangle with a bad index has no area.
    let vertex = |v: u32| mesh.vertices.get(v as usize).copied();
    let corners =
        |t: &[u32; 3]| t.map(|v| vertex(v).unwrap_or(Vertex { position: [f32::NAN; 3], normal: [0.0; 3] }));
    // Where each triangle's area begins, if all are laid in a row.
    let mut starts = Vec::with_capacity(mesh.triangles.len() + 1);
    let mut area = 0.0;
    for triangle in &mesh.triangles {
        starts.push(area);
        let [a, b, c] = corners(triangle).map(|v| v.at().as_dvec3());
        let own = (b - a).cross(c - a).length() / 2.0;
        area += if own.is_finite() { own } else { 0.0 };
    }
    starts.push(area);
    if area == 0.0 || samples == 0 {
        return Ok(Accuracy::default());
    }
    let first_of = |i: usize| (starts[i] / area * samples as f64).ceil() as usize;
    let triangles: Vec<usize> = (0..mesh.triangles.len()).collect();
    // Tasks of about a batch, so that few triangles keep all cores busy.
    let task = (triangles.len() / (samples / BATCH).max(1)).clamp(1, 1 << 10);
    let parts = triangles.par_chunks(task).map(|triangles| {
        let (mut sums, mut batch) = (Sums::default(), Vec::with_capacity(BATCH));
        for &i in triangles {
            let own = corners(&mesh.triangles[i]);
            for k in first_of(i)..first_of(i + 1).min(samples) {
                let [a, b, c] = barycentric(k);
                let at = own[0].at() * a + own[1].at() * b + own[2].at() * c;
                let [na, nb, nc] = own.map(|v| Vec3::from(v.normal));
                batch.push((at, na * a + nb * b + nc * c));
                if batch.len() == BATCH {
                    sums = sums.add(follow(surface, &batch)?);
                    batch.clear();
                }
            }
        }
        Ok(sums.add(follow(surface, &batch)?))
    });
    // In order, so that sums come out the same on any number of threads.
    let parts = parts.collect::<Result<Vec<Sums>, NoForm>>()?;
    let sums = parts.into_iter().fold(Sums::default(), Sums::add);
    let found = (samples - sums.lost).max(1) as f64;
    Ok(Accuracy {
        distance_max: sums.max,
        distance_rms: (sums.squares / found).sqrt(),
        normal_rms: (sums.angle_squares / found).sqrt(),
        normal_max: sums.angle_max,
        samples,
        lost: sums.lost,
    })
}

/// Evenly spread points of a triangle (Roberts' R2 sequence, folded).
fn barycentric(k: usize) -> [f32; 3] {
    let [mut u, mut v] =
        [0.754_877_666_246_692_7, 0.569_840_290_998_053_2].map(|r: f64| (k as f64 * r + 0.5).fract());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let uv = Vec2::new(u as f32, v as f32);
    [1.0 - uv.x - uv.y, uv.x, uv.y]
}

/// The sums of samples: places with the mesh's normals there.
fn follow(surface: &Surface<'_>, samples: &[(Vec3, Vec3)]) -> Result<Sums, NoForm> {
    let count = samples.len();
    let mut sums = Sums::default();
    let mut at: Vec<Vec3> = samples.iter().map(|(at, _)| *at).collect();
    let mut arrived = newton(surface, &mut at)?;
    let mut normals = vec![Vec3::ZERO; count];
    let mut slid = vec![Vec3::ZERO; count];
    for _ in 0..SLIDES {
        surface.gradients(&at, &mut normals)?;
        for i in 0..count {
            let (way, normal) = (samples[i].0 - at[i], normals[i].normalize_or_zero());
            slid[i] = at[i] + (way - normal * way.dot(normal));
        }
        let on_surface = newton(surface, &mut slid)?;
        for i in 0..count {
            let nearer = slid[i].distance_squared(samples[i].0) < at[i].distance_squared(samples[i].0);
            if on_surface[i] && (nearer || !arrived[i]) {
                (at[i], arrived[i]) = (slid[i], true);
            }
        }
    }
    surface.gradients(&at, &mut normals)?;
    for i in 0..count {
        if !arrived[i] {
            sums.lost += 1;
            continue;
        }
        let distance = f64::from(samples[i].0.distance(at[i]));
        let angle = samples[i].1.as_dvec3().angle_between(normals[i].as_dvec3()).to_degrees();
        let angle = if angle.is_finite() { angle } else { 0.0 };
        sums = sums.add(Sums {
            squares: distance * distance,
            max: distance,
            angle_squares: angle * angle,
            angle_max: angle,
            lost: 0,
        });
    }
    Ok(sums)
}

/// Newton steps along the gradient; which points arrived: those whose last step was as short as rounding makes it, or
/// short beside their way.
fn newton(surface: &Surface<'_>, points: &mut [Vec3]) -> Result<Vec<bool>, NoForm> {
    let (mut values, mut gradients) = (vec![0.0; points.len()], vec![Vec3::ZERO; points.len()]);
    let starts = points.to_vec();
    let mut arrived = vec![false; points.len()];
    for _ in 0..STEPS {
        surface.values(points, &mut values)?;
        surface.gradients(points, &mut gradients)?;
        for i in 0..points.len() {
            let gradient = gradients[i].as_dvec3();
            let step = -gradient * (f64::from(values[i]) / gradient.length_squared());
            if values[i] == 0.0 || !step.is_finite() {
                arrived[i] = values[i] == 0.0;
                continue;
            }
            points[i] += step.as_vec3();
            let (size, way) = (points[i].abs().max_element(), points[i].distance(starts[i]));
            arrived[i] = step.length() <= f64::from(1e-6 * size).max(f64::from(1e-3 * way));
        }
        if arrived.iter().all(|&arrived| arrived) {
            break;
        }
    }
    Ok(arrived)
}
