//! CPU twin of `shaders/sample.wgsl`.

use crate::field::{Field, NoForm, Points};
use crate::grid::SAMPLES_PER_BRICK;
use crate::stage::params::Params;
use glam::UVec3;
use multiversion::multiversion;

/// The field's values at the 9³ points of the brick at `origin`, x fastest. Points past the grid's end
/// repeat the last one; no stage looks at them.
///
/// # Errors
/// [`NoForm::Cpu`].
pub fn sample(
    params: &Params,
    field: &dyn Field,
    origin: UVec3,
    samples: &mut [f32; SAMPLES_PER_BRICK],
) -> Result<(), NoForm> {
    let [mut x, mut y, mut z] = [[0.0; SAMPLES_PER_BRICK]; 3];
    positions(params, origin, [&mut x, &mut y, &mut z]);
    field.values(Points { x: &x, y: &y, z: &z }, samples)
}

/// World positions of the points, in the order of operations of `Params::grid_position`.
#[multiversion(targets("x86_64+avx2"))]
fn positions(params: &Params, origin: UVec3, out: [&mut [f32; SAMPLES_PER_BRICK]; 3]) {
    let origin = origin.to_array();
    let mut point = [[0.0; 9]; 3];
    for (axis, point) in point.iter_mut().enumerate() {
        for (local, coordinate) in (0..).zip(point) {
            *coordinate = (origin[axis] + local).min(params.points[axis] - 1) as f32 - params.margin;
        }
    }
    for (k, out) in out.into_iter().enumerate() {
        // What x and y add is the same in every plane.
        let mut plane = [0.0; 81];
        for y in 0..9 {
            for x in 0..9 {
                plane[x + 9 * y] = params.step_x[k] * point[0][x] + params.step_y[k] * point[1][y];
            }
        }
        for (z, out) in out.chunks_exact_mut(81).enumerate() {
            let along_z = params.step_z[k] * point[2][z];
            for (out, in_plane) in out.iter_mut().zip(&plane) {
                *out = params.origin[k] + (in_plane + along_z);
            }
        }
    }
}
