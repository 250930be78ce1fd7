//! CPU twin of `shaders/emit/centres.wgsl`: the vertices within cells that topologically correct marching cubes needs.

use super::crossings::unsnapped;
use super::field::Gradients;
use super::snap::{Cell, snap_within};
use crate::field::unit::{has_direction, unit};
use crate::field::{NoForm, Points};
use crate::mesh::Vertex;
use crate::stage::classify::BrickRecord;
use crate::stage::inside::Inside;
use crate::stage::method::Placement;
use crate::stage::normals::cpu::mark;
use crate::stage::params::Params;
use crate::stage::samples::Samples;
use crate::stage::trilinear::Corners;
use crate::table::EDGE_CORNERS;
use crate::volume::Values;
use glam::{UVec3, Vec3};

/// What the normals of centres come from.
#[derive(Debug, Clone, Copy)]
pub enum NormalsOf<'a> {
    /// A field's gradient there.
    Field(Gradients<'a>),
    /// A volume's central differences at the cell's corners, interpolated as the samples are.
    Volume(&'a Values),
}

/// The centres of a brick, the last one first: what lies behind the vertices on its edges. Tells whether any had to be
/// marked for the normals stage.
///
/// # Errors
/// [`NoForm::Cpu`].
pub fn emit_centres(
    params: &Params,
    inside: Inside,
    normals: NormalsOf<'_>,
    origin: UVec3,
    samples: &Samples<'_>,
    record: &BrickRecord,
    vertices: &mut [Vertex],
) -> Result<bool, NoForm> {
    let mut places = vertices.iter_mut().rev();
    let mut marked = false;
    for row in (0..64).filter(|&row| record.centres(row) > 0) {
        for x in 0..samples.extent[0] - 1 {
            let cell = [x, row % 8, row / 8];
            let corners = Corners::of_cell(params.iso, inside, samples, cell);
            let Some(entry) = corners.undecided() else { continue };
            for (i, vertex) in (0..entry.centres()).zip(&mut places) {
                let within = centre(params, samples, cell, entry.around(i));
                let lowest = origin + UVec3::from(cell.map(|n| n as u32));
                let mut p = (lowest.as_vec3() - params.margin) + within;
                let vector = match normals {
                    NormalsOf::Field(field) => {
                        let mut vector = outward_of_field(params, &field, p)?;
                        if matches!(params.placement, Placement::Snapped { .. }) {
                            let samples = samples.of_cell(cell);
                            let cell = Cell { lowest: lowest.as_vec3(), samples };
                            p = snap_within(params, inside, field.here, &cell, within, vector)?;
                            vector = outward_of_field(params, &field, p)?;
                        }
                        vector
                    }
                    NormalsOf::Volume(values) => outward(params, values, lowest, within),
                };
                let position = params.domain_position(p);
                let known = has_direction(vector);
                marked |= !known;
                let normal = if known { unit(vector).into() } else { mark(0, !corners.is_inside(0)) };
                *vertex = Vertex { position: position.into(), normal };
            }
        }
    }
    Ok(marked)
}

/// The mean of the vertices on some edges of a cell, as the samples place these, from its lowest corner in grid steps.
fn centre(params: &Params, samples: &Samples<'_>, [x, y, z]: [usize; 3], around: u32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (edge, ends) in EDGE_CORNERS.iter().enumerate().filter(|(edge, _)| around >> edge & 1 == 1) {
        let [a, b] = ends.map(usize::from);
        let sample = |k: usize| samples.at(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
        let t = unsnapped(params, sample(a), sample(b));
        let lower = UVec3::new(a as u32 & 1, a as u32 >> 1 & 1, a as u32 >> 2).as_vec3();
        sum += lower + Vec3::AXES[edge / 4] * t;
    }
    sum / around.count_ones() as f32
}

/// The outward vector of a field so many grid steps in the domain.
fn outward_of_field(params: &Params, field: &Gradients<'_>, p: Vec3) -> Result<Vec3, NoForm> {
    let [x, y, z] = params.domain_position(p).to_array().map(|v| [v]);
    let mut gradient = [[0.0; 3]];
    field.at(Points { x: &x, y: &y, z: &z }, params.delta, &mut gradient)?;
    Ok(Vec3::from(gradient[0]) * params.outward_sign)
}

/// The outward vector at a place within the cell of a volume.
fn outward(params: &Params, values: &Values, lowest: UVec3, within: Vec3) -> Vec3 {
    let at = |x, y, z| gradient(params, values, lowest + UVec3::new(x, y, z));
    let between = |a: Vec3, b: Vec3, t: f32| a + (b - a) * t;
    let row = |y, z| between(at(0, y, z), at(1, y, z), within.x);
    let plane = |z| between(row(0, z), row(1, z), within.y);
    let g = between(plane(0), plane(1), within.z);
    let [x, y, z] = [params.outward_x, params.outward_y, params.outward_z].map(Vec3::from);
    (x * g.x + y * g.y) + z * g.z
}

/// Differences per grid step at a point: central inside, one-sided at the border.
fn gradient(params: &Params, values: &Values, point: UVec3) -> Vec3 {
    let sample = |p: UVec3| {
        let [x, y, z] = (p - UVec3::from(params.source_first)).to_array().map(|n| n as usize);
        let [nx, ny, _] = params.source_extent.map(|n| n as usize);
        values.as_slice().get(x + nx * (y + ny * z))
    };
    let slope = |k: usize| {
        let (mut low, mut high) = (point, point);
        let (lower, upper) = (point[k] > 0, point[k] < params.points[k] - 1);
        low[k] -= u32::from(lower);
        high[k] += u32::from(upper);
        let difference = sample(high) - sample(low);
        if lower && upper { difference * 0.5 } else { difference }
    };
    Vec3::new(slope(0), slope(1), slope(2))
}
