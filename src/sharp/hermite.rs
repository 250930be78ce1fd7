//! Hermite data: for every crossed edge of the grid the point where it meets the surface, refined on the field, and the
//! surface's normal there; for every brick its mixed cells.

use crate::field::{NoForm, Surface};
use crate::grid::Grid;
use crate::stage::classify::cpu::{InsideRows, PlaneShape, cell_case, crossed_edges, mixed_cells};
use crate::stage::cull::bounds::Culled;
use crate::stage::inside::Inside;
use crate::stage::params::Params;
use crate::stage::sample::row::Sampler;
use glam::{DMat3, DVec3, UVec3, Vec3};

/// The grid in f64, where rounding plays no part.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    origin: DVec3,
    step: DMat3,
    inverse: DMat3,
    /// The shortest step, in world units.
    pub cell: f64,
}

impl Frame {
    pub fn new(grid: &Grid) -> Self {
        let step = grid.step().as_dmat3();
        Self { origin: grid.origin().as_dvec3(), step, inverse: step.inverse(), cell: grid.shortest_step() }
    }

    /// The step along an axis.
    pub fn along(&self, axis: usize) -> DVec3 {
        self.step.col(axis)
    }

    /// The world position at grid coordinates.
    pub fn world(&self, q: DVec3) -> DVec3 {
        self.origin + self.step * q
    }

    /// The grid coordinates of a world position.
    pub fn local(&self, p: DVec3) -> DVec3 {
        self.inverse * (p - self.origin)
    }

    /// A world direction in grid coordinates.
    pub fn local_direction(&self, d: DVec3) -> DVec3 {
        self.inverse * d
    }
}

/// A surface near one brick: the pruned field within it, the whole one beyond.
#[derive(Debug, Clone, Copy)]
pub struct Nearby<'a> {
    pub frame: &'a Frame,
    here: Surface<'a>,
    whole: Surface<'a>,
    low: DVec3,
    high: DVec3,
}

impl Nearby<'_> {
    /// Values and gradients at `points`, in place of what `found` held.
    pub fn evaluate(&self, points: &[DVec3], found: &mut Vec<(f64, DVec3)>) -> Result<(), NoForm> {
        let is_here = |p: &DVec3| {
            let q = self.frame.local(*p);
            q.cmpge(self.low).all() && q.cmple(self.high).all()
        };
        found.clear();
        found.resize(points.len(), (0.0, DVec3::ZERO));
        for (surface, wanted) in [(&self.here, true), (&self.whole, false)] {
            let own: Vec<usize> = (0..points.len()).filter(|&i| is_here(&points[i]) == wanted).collect();
            if own.is_empty() {
                continue;
            }
            let at: Vec<Vec3> = own.iter().map(|&i| points[i].as_vec3()).collect();
            let (mut values, mut gradients) = (vec![0.0; at.len()], vec![Vec3::ZERO; at.len()]);
            surface.values(&at, &mut values)?;
            surface.gradients(&at, &mut gradients)?;
            for (k, &i) in own.iter().enumerate() {
                found[i] = (f64::from(values[k]), gradients[k].as_dvec3());
            }
        }
        Ok(())
    }
}

/// Where a grid edge meets the surface.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// The edge's lower point.
    pub point: UVec3,
    /// The axis along which the edge runs.
    pub axis: u8,
    /// Whether the lower point is inside.
    pub rises: bool,
    /// In world units.
    pub at: DVec3,
    /// The unit gradient there; zero where there is none.
    pub normal: DVec3,
}

/// A mixed cell of a brick.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Its lowest corner, as a point of the grid.
    pub at: UVec3,
    pub case: u8,
}

/// What a brick owns.
#[derive(Debug, Default)]
pub struct BrickData {
    /// In the order of [`edge_key`].
    pub crossings: Vec<Crossing>,
    pub cells: Vec<Cell>,
    /// Samples that are not finite, at the brick's own points.
    pub non_finite: u64,
}

/// The order of the edges that a brick owns.
pub fn edge_key(point: UVec3, axis: u8) -> u32 {
    let p = point % 8;
    3 * (p.x + 8 * (p.y + 8 * p.z)) + u32::from(axis)
}

/// What is sampled, and how.
pub struct Scene<'a> {
    pub params: Params,
    pub inside: Inside,
    pub culled: Culled,
    pub surface: Surface<'a>,
    pub frame: Frame,
}

impl Scene<'_> {
    /// The surface near a brick.
    pub fn nearby(&self, brick: u32) -> Nearby<'_> {
        let low = self.params.brick_origin(brick);
        let high = (low + 8).min(UVec3::from(self.params.points) - 1);
        let here = self.surface.of(self.culled.fields.of_block(&self.params, brick, self.surface.field()));
        Nearby { frame: &self.frame, here, whole: self.surface, low: low.as_dvec3(), high: high.as_dvec3() }
    }
}

/// Samples a brick, and refines its crossings.
pub fn brick_data(scene: &Scene<'_>, brick: u32, sampler: &mut Sampler) -> Result<BrickData, NoForm> {
    let Scene { params, inside, culled, surface, frame } = scene;
    let here = culled.fields.of_block(params, brick, surface.field());
    let samples = sampler.brick(params, here, brick, || 1)?;
    let origin = params.brick_origin(brick);
    let mut data = BrickData::default();
    let rows = InsideRows::new(&samples, *inside);
    let mut ends = Vec::new();
    for z in 0..8usize {
        let (corners, shape) = (rows.corners(z), PlaneShape::new(samples.extent, z));
        let mut mixed = mixed_cells(&corners, shape);
        while mixed != 0 {
            let cell = mixed.trailing_zeros();
            mixed &= mixed - 1;
            let at = origin + UVec3::new(cell % 8, cell / 8, z as u32);
            data.cells.push(Cell { at, case: cell_case(&corners, cell) });
        }
        let edges = crossed_edges(&corners, shape);
        let mut any = edges[0] | edges[1] | edges[2];
        while any != 0 {
            let bit = any.trailing_zeros();
            any &= any - 1;
            let local = [bit as usize % 8, bit as usize / 8, z];
            for axis in (0..3usize).filter(|&axis| edges[axis] >> bit & 1 == 1) {
                let mut next = local;
                next[axis] += 1;
                let [a, b] = [local, next].map(|[x, y, z]| surface.signed(samples.at(x, y, z)));
                let point = origin + UVec3::from(local.map(|n| n as u32));
                let (at, normal, rises) = (DVec3::ZERO, DVec3::ZERO, corners[0] >> bit & 1 == 1);
                data.crossings.push(Crossing { point, axis: axis as u8, rises, at, normal });
                ends.push([f64::from(a), f64::from(b)]);
            }
        }
    }
    data.non_finite = samples.owned_non_finite();
    let surface = surface.of(here);
    refine(&surface, frame, &mut data.crossings, &ends)?;
    Ok(data)
}

/// Rounds of root finding: bisection alone would leave a 2⁻¹⁵th of an edge, and the secants leave far less.
const ROUNDS: usize = 15;

/// Finds where the edges meet the surface: secants that stay between the ends (the Illinois rule), bisection in every
/// third round, all edges of a brick at once.
fn refine(
    surface: &Surface<'_>,
    frame: &Frame,
    crossings: &mut [Crossing],
    ends: &[[f64; 2]],
) -> Result<(), NoForm> {
    struct Bracket {
        t: [f64; 2],
        f: [f64; 2],
        /// The end that the last secant moved.
        moved: Option<usize>,
        best: (f64, f64),
    }
    let mut brackets: Vec<Bracket> = (crossings.iter().zip(ends))
        .map(|(c, ends)| {
            let (t, f) = if c.rises { ([0.0, 1.0], *ends) } else { ([1.0, 0.0], [ends[1], ends[0]]) };
            let best = if f[1].abs() < f[0].abs() { (f[1].abs(), t[1]) } else { (f[0].abs(), t[0]) };
            Bracket { t, f, moved: None, best }
        })
        .collect();
    let mut open: Vec<usize> = (0..brackets.len()).filter(|&i| brackets[i].best.0 > 0.0).collect();
    let (mut points, mut values, mut tried) = (Vec::new(), Vec::new(), Vec::new());
    let world = |c: &Crossing, t: f64| {
        let mut q = c.point.as_dvec3();
        q[c.axis as usize] += t;
        frame.world(q)
    };
    for round in 0..ROUNDS {
        points.clear();
        tried.clear();
        for &i in &open {
            let Bracket { t, f, .. } = &brackets[i];
            let secant = t[0] - f[0] * (t[1] - t[0]) / (f[1] - f[0]);
            let (low, high) = (t[0].min(t[1]), t[0].max(t[1]));
            let is_good = secant.is_finite() && low < secant && secant < high && round % 3 != 2;
            let t = if is_good { secant } else { (t[0] + t[1]) / 2.0 };
            tried.push((t, is_good));
            points.push(world(&crossings[i], t).as_vec3());
        }
        values.resize(points.len(), 0.0);
        surface.values(&points, &mut values)?;
        for (k, &i) in open.iter().enumerate() {
            let (bracket, value, (t, is_secant)) = (&mut brackets[i], f64::from(values[k]), tried[k]);
            let end = usize::from(value >= 0.0);
            bracket.t[end] = t;
            bracket.f[end] = value;
            if is_secant && bracket.moved == Some(end) {
                bracket.f[1 - end] /= 2.0;
            }
            bracket.moved = is_secant.then_some(end);
            if value.abs() <= bracket.best.0 {
                bracket.best = (value.abs(), t);
            }
        }
        open.retain(|&i| brackets[i].best.0 > 0.0 && (brackets[i].t[0] - brackets[i].t[1]).abs() > 1e-7);
        if open.is_empty() {
            break;
        }
    }
    points.clear();
    for (crossing, bracket) in crossings.iter_mut().zip(&brackets) {
        // Where the field jumps, no value is near 0: the jump is where the ends are.
        let t = if bracket.best.1 == bracket.t[0] || bracket.best.1 == bracket.t[1] || bracket.best.0 == 0.0 {
            bracket.best.1
        } else {
            (bracket.t[0] + bracket.t[1]) / 2.0
        };
        crossing.at = world(crossing, t);
        points.push(crossing.at.as_vec3());
    }
    let mut gradients = vec![Vec3::ZERO; points.len()];
    surface.gradients(&points, &mut gradients)?;
    for (crossing, gradient) in crossings.iter_mut().zip(gradients) {
        crossing.normal = unit(gradient.as_dvec3());
    }
    Ok(())
}

/// The vector at unit length; zero where it has no direction.
pub fn unit(v: DVec3) -> DVec3 {
    if v.is_finite() { v.normalize_or_zero() } else { DVec3::ZERO }
}
