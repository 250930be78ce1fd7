//! CPU twin of `shaders/sample.wgsl`.

use crate::field::{Field, NoForm, Points};
use crate::grid::SAMPLES_PER_BRICK;
use crate::stage::params::Params;
use glam::{UVec3, Vec3};

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
    let last = UVec3::from(params.points) - UVec3::ONE;
    let [mut x, mut y, mut z] = [[0.0; SAMPLES_PER_BRICK]; 3];
    for place in 0..SAMPLES_PER_BRICK as u32 {
        let local = UVec3::new(place % 9, place / 9 % 9, place / 81);
        let point: Vec3 = (origin + local).min(last).as_vec3();
        let position = params.grid_position(point);
        x[place as usize] = position.x;
        y[place as usize] = position.y;
        z[place as usize] = position.z;
    }
    field.values(Points { x: &x, y: &y, z: &z }, samples)
}
