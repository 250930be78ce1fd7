//! CPU twin of `emit_vertices` in `shaders/emit/cubes.wgsl` and `shaders/emit/tetrahedra.wgsl`, for volumes.

use super::around::{Around, CENTRE, PITCH};
use super::crossings::Crossings;
use super::edges::Edge;
use crate::mesh::Vertex;
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::volume::Values;
use crate::volume::values::each_type;
use glam::UVec3;
use multiversion::multiversion;

/// Vertices whose arithmetic is done together.
const LANES: usize = 16;

/// The vertices on the edges of a brick of a volume: normals from central differences at both ends of the edge,
/// interpolated as the vertex is (Lorensen & Cline 1987). Tells whether any had to be marked for the normals stage.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt"))]
pub fn emit_volume_vertices(
    params: &Params,
    inside: Inside,
    values: &Values,
    origin: UVec3,
    edges: &[Edge],
    around: &mut Around,
    vertices: &mut [Vertex],
) -> bool {
    let origin = origin.to_array();
    each_type!(Values, values, samples => around.fill(params, samples, origin, edges));
    if origin.iter().zip(params.points).all(|(&first, n)| first > 0 && first + 9 < n) {
        volume_vertices::<true>(params, inside, origin, edges, around, vertices)
    } else {
        volume_vertices::<false>(params, inside, origin, edges, around, vertices)
    }
}

/// `INTERIOR`: no difference asks for a sample beyond the volume's end.
#[inline(always)]
fn volume_vertices<const INTERIOR: bool>(
    params: &Params,
    inside: Inside,
    origin: [u32; 3],
    edges: &[Edge],
    around: &Around,
    vertices: &mut [Vertex],
) -> bool {
    let mut batch = Crossings::<LANES>::new();
    // At both ends of the edges, along the axes: twice the slopes where all are central differences.
    let mut slopes = [[[1.0; LANES]; 3]; 2];
    let factor = if INTERIOR { 0.5 } else { 1.0 };
    let mut marked = false;
    for (edges, vertices) in edges.chunks(LANES).zip(vertices.chunks_mut(LANES)) {
        batch.set(params, origin, edges);
        for (i, edge) in edges.iter().enumerate().take(LANES) {
            for (end, samples) in around.ends(*edge).into_iter().enumerate() {
                batch.ends[end][i] = samples[CENTRE];
                for k in 0..3 {
                    let [low, high] = [samples[CENTRE - PITCH[k]], samples[CENTRE + PITCH[k]]];
                    slopes[end][k][i] = if INTERIOR {
                        high - low
                    } else {
                        let coordinate = origin[k] + edge.coordinate(k) + end as u32 * edge.way(k);
                        slope([low, samples[CENTRE], high], coordinate, params.points[k])
                    };
                }
            }
        }
        batch.place(params);
        let mut vectors = [[0.0; LANES]; 3];
        let [a, b] = &slopes;
        for (k, vector) in vectors.iter_mut().enumerate() {
            let [x, y, z] = [params.outward_x[k], params.outward_y[k], params.outward_z[k]];
            for i in 0..LANES {
                let between = |axis: usize| {
                    let [a, b] = [a[axis][i] * factor, b[axis][i] * factor];
                    a + (b - a) * batch.t[i]
                };
                vector[i] = (x * between(0) + y * between(1)) + z * between(2);
            }
        }
        marked |= batch.write(inside, &vectors, vertices);
    }
    marked
}

/// The difference per grid step along an axis with so many points, of three samples next to each other: central inside, one-sided
/// at the border.
#[inline(always)]
fn slope([low, here, high]: [f32; 3], coordinate: u32, points: u32) -> f32 {
    let (has_lower, has_upper) = (coordinate > 0, coordinate < points - 1);
    match (has_lower, has_upper) {
        (true, true) => (high - low) * 0.5,
        (true, false) => here - low,
        (false, true) => high - here,
        (false, false) => 0.0,
    }
}
