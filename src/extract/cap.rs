//! Closed borders: a source with a layer of points around its grid that are outside, so that the surface closes where the domain
//! ends.
//!
//! The samples of that layer are [`FAR`], by which emit knows that a vertex on an edge there lies on the last point of the domain
//! itself: the caps are flat, and the surface meets them where it met the border. Nothing else of the stages knows of
//! it, and each method closes as it does everywhere.

use super::{Options, Source};
use crate::field::differences::central;
use crate::field::{Field, LatticeValues, NoForm, Points, Sense, Wgsl, Within};
use crate::graph::interval::Interval;
use crate::grid::{Grid, GridError};
use crate::stage::emit::cpu::FAR;
use crate::stage::params::Params;
use crate::stage::shaders::{CAP_GRADIENT, CAP_INTERVAL, CAP_VALUE, CENTRAL, defines_density};
use crate::volume::Volume;
use glam::{Mat3, Vec3};
use std::sync::Arc;

/// Why borders cannot be closed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CapError {
    /// The grid has no room for two cells more.
    #[error("closed borders take two cells more along each axis: {0}")]
    Grid(#[from] GridError),
    /// The iso value is as large as what stands for outside.
    #[error("the iso value is {0}: borders are closed below 6e29")]
    Iso(f32),
    /// A volume and its copy need more bytes than allowed.
    #[error(
        "the volume and its copy with closed borders, as f32, need {needed} bytes, over the memory budget of {budget} bytes: raise the \
         budget (`Options::memory_budget`), or leave the border open"
    )]
    Budget {
        /// How many.
        needed: u64,
        /// How many there are.
        budget: u64,
    },
}

/// A source whose surface closes at the border of its domain.
#[derive(Debug)]
pub enum Capped<'a> {
    /// A field.
    Field(Box<CappedField<'a>>),
    /// A volume, whose samples are `f32` whatever they were.
    Volume(Volume),
}

impl<'a> Capped<'a> {
    /// `source` with a layer of outside points around it, for an extraction with `options`: two cells more along each axis. With
    /// another iso value or sense than theirs the layer is not outside, and the mesh is another. A
    /// volume is copied, as `f32`; both must fit the memory budget, and the extraction has what is left of it.
    ///
    /// # Errors
    /// [`CapError`].
    pub fn new(source: &Source<'a>, options: &Options) -> Result<Self, CapError> {
        let (iso, sense) = (options.iso, options.sense);
        if iso.abs() >= FAR / 2.0 {
            return Err(CapError::Iso(iso));
        }
        let grid = source.grid();
        let wider = grid.wider()?;
        let outward = match sense.unwrap_or(source.sense()) {
            Sense::Below => 1.0,
            Sense::Above => -1.0,
        };
        Ok(match source {
            Source::Field(field, _) => {
                let rows = grid.step().as_dmat3().inverse().as_mat3().transpose();
                let delta = Params::new(&wider, iso, source.sense()).delta;
                let near = grid.on_border();
                Self::Field(Box::new(CappedField {
                    field: *field,
                    grid: *grid,
                    wider,
                    rows,
                    near,
                    outward,
                    delta,
                }))
            }
            Source::Volume(volume) => {
                let (needed, budget) = (4 * wider.point_count() + volume.bytes(), options.memory_budget);
                if needed > budget {
                    return Err(CapError::Budget { needed, budget });
                }
                Self::Volume(padded(volume, wider, outward).ok_or(CapError::Budget { needed, budget })?)
            }
        })
    }

    /// The source to extract.
    pub fn source(&self) -> Source<'_> {
        match self {
            Self::Field(field) => Source::Field(&**field, field.wider),
            Self::Volume(volume) => Source::Volume(volume),
        }
    }
}

/// Nothing if there is no memory for it.
fn padded(volume: &Volume, wider: Grid, outward: f32) -> Option<Volume> {
    let count = wider.point_count() as usize;
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    values.resize(count, outward * FAR);
    let [nx, ny, nz] = volume.grid().points().to_array().map(|n| n as usize);
    let from = volume.values().as_slice();
    for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
        let (row, to) = (nx * (y + ny * z), 1 + (nx + 2) * (y + 1 + (ny + 2) * (z + 1)));
        for (x, value) in values[to..to + nx].iter_mut().enumerate() {
            *value = from.get(row + x);
        }
    }
    Some(Volume::window(wider, values.into()))
}

/// A field in the domain of its grid, and far outside around it.
#[derive(Debug)]
pub struct CappedField<'a> {
    field: &'a dyn Field,
    /// The domain.
    grid: Grid,
    wider: Grid,
    /// The rows of the matrix that takes a way in the world to grid steps.
    rows: Mat3,
    /// How near to the border, in grid steps, a vertex is one of the cap.
    near: f32,
    /// 1 where values grow outwards, -1 where they fall.
    outward: f32,
    /// The step of differences, for a field without gradient.
    delta: f32,
}

/// Where a box lies.
enum Place {
    Inside,
    /// Within, and at the border.
    Border,
    Outside,
}

impl CappedField<'_> {
    /// Grid coordinates of a point in the world.
    fn coordinates(&self, p: Vec3) -> Vec3 {
        let [x, y, z] = [self.rows.x_axis, self.rows.y_axis, self.rows.z_axis];
        let way = p - self.grid.origin();
        Vec3::new(x.dot(way), y.dot(way), z.dot(way))
    }

    /// Whether a point is of the domain. Points of the grid are half a step or more from where that changes.
    fn has(&self, p: Vec3) -> bool {
        let (q, cells) = (self.coordinates(p), self.grid.cells().as_vec3());
        q.cmpge(Vec3::splat(-0.5)).all() && q.cmple(cells + 0.5).all()
    }

    /// The gradient of a cap at a point of one: out of the domain; 0 elsewhere.
    fn cap_gradient(&self, p: Vec3) -> Vec3 {
        let (q, cells) = (self.coordinates(p), self.grid.cells().as_vec3());
        let rows = [self.rows.x_axis, self.rows.y_axis, self.rows.z_axis];
        (0..3).fold(Vec3::ZERO, |sum, k| {
            let low = if q[k] < self.near { -rows[k].normalize() } else { Vec3::ZERO };
            let high = if q[k] > cells[k] - self.near { rows[k].normalize() } else { Vec3::ZERO };
            sum + (low + high) * self.outward
        })
    }

    fn place(&self, region: [Interval; 3]) -> Place {
        let corner = |i: usize| {
            let side = |k: usize| if i >> k & 1 == 0 { region[k].lo } else { region[k].hi };
            self.coordinates(Vec3::new(side(0), side(1), side(2)))
        };
        let (low, high) =
            (1..8).fold((corner(0), corner(0)), |(low, high), i| (low.min(corner(i)), high.max(corner(i))));
        let cells = self.grid.cells().as_vec3();
        if low.cmpgt(cells + 0.5).any() || high.cmplt(Vec3::splat(-0.5)).any() {
            Place::Outside
        } else if low.cmpgt(Vec3::splat(self.near)).all() && high.cmplt(cells - self.near).all() {
            Place::Inside
        } else {
            Place::Border
        }
    }

    fn far(&self) -> f32 {
        self.outward * FAR
    }
}

impl Field for CappedField<'_> {
    fn sense(&self) -> Sense {
        self.field.sense()
    }

    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        self.field.values(points, out)?;
        for (i, value) in out.iter_mut().enumerate() {
            if !self.has(Vec3::new(points.x[i], points.y[i], points.z[i])) {
                *value = self.far();
            }
        }
        Ok(())
    }

    fn lattice(&self) -> Option<&dyn LatticeValues> {
        self.field.lattice().is_some().then_some(self)
    }

    fn gradients(&self, points: Points<'_>, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        match self.field.gradients(points, out) {
            Err(NoForm::Gradient) => central(self.field, points, self.delta, out)?,
            done => done?,
        }
        for (i, gradient) in out.iter_mut().enumerate() {
            let of_cap = self.cap_gradient(Vec3::new(points.x[i], points.y[i], points.z[i]));
            if of_cap != Vec3::ZERO {
                *gradient = of_cap.into();
            }
        }
        Ok(())
    }

    fn within(&self, region: [Interval; 3]) -> Within {
        let far = Interval::point(self.far());
        match self.place(region) {
            Place::Inside => self.field.within(region),
            Place::Border => Within { range: self.field.range(region).hull(far), field: None },
            Place::Outside => Within { range: far, field: None },
        }
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        let own = self.field.wgsl()?;
        let capped = |text: &str, name: &str, cap: &str| {
            Arc::from([&renamed(text), &self.constants(name), cap].join("\n"))
        };
        let value: Arc<str> = capped(&own.value, "VALUE", CAP_VALUE);
        let gradient = match &own.gradient {
            Some(both) if defines_density(both) => {
                capped(both, "VALUE", &[CAP_VALUE, &self.constants("GRADIENT"), CAP_GRADIENT].join("\n"))
            }
            Some(gradient) => capped(gradient, "GRADIENT", CAP_GRADIENT),
            // Differences need the values; a text that has them says so by defining `density`.
            None => [&value, &*capped(CENTRAL, "GRADIENT", CAP_GRADIENT)].join("\n").into(),
        };
        Ok(Wgsl {
            value,
            gradient: Some(gradient),
            interval: own.interval.as_ref().map(|interval| capped(interval, "INTERVAL", CAP_INTERVAL)),
            planes: None,
            ..own
        })
    }
}

impl CappedField<'_> {
    /// The domain in WGSL; each text has its own copy, since others may lie beside it.
    fn constants(&self, name: &str) -> String {
        let vector = |v: Vec3| format!("vec3<f32>({:?}f, {:?}f, {:?}f)", v.x, v.y, v.z);
        let three = |rows: [Vec3; 3]| format!("array<vec3<f32>, 3>({})", rows.map(vector).join(", "));
        let rows = [self.rows.x_axis, self.rows.y_axis, self.rows.z_axis];
        let out = rows.map(|row| row.normalize() * self.outward);
        format!(
            "const {name}_ORIGIN = {};\nconst {name}_ROWS = {};\nconst {name}_CELLS = {};\nconst {name}_OUT = {};\n\
             const {name}_FAR = {:?}f;\nconst {name}_NEAR = {:?}f;\n",
            vector(self.grid.origin()),
            three(rows),
            vector(self.grid.cells().as_vec3()),
            three(out),
            self.far(),
            self.near,
        )
    }
}

impl LatticeValues for CappedField<'_> {
    fn points_as_a_brick(&self) -> usize {
        self.field.lattice().map_or(0, LatticeValues::points_as_a_brick)
    }

    fn lattice_values(&self, axes: [&[f32]; 3], out: &mut [f32]) -> bool {
        if !self.field.lattice().is_some_and(|lattice| lattice.lattice_values(axes, out)) {
            return false;
        }
        let region = axes.map(|axis| {
            let (low, high) = axis.iter().fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)));
            Interval { lo: low, hi: high }
        });
        if matches!(self.place(region), Place::Inside) {
            return true;
        }
        let [xs, ys, zs] = axes;
        let points = zs
            .iter()
            .flat_map(|&z| ys.iter().flat_map(move |&y| xs.iter().map(move |&x| Vec3::new(x, y, z))));
        for (value, p) in out.iter_mut().zip(points) {
            if !self.has(p) {
                *value = self.far();
            }
        }
        true
    }
}

/// The text with `capped_` before the names of a field's functions.
fn renamed(text: &str) -> String {
    const NAMES: [&str; 3] = ["density", "density_gradient", "density_interval"];
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut made = String::with_capacity(text.len() + 64);
    let mut rest = text;
    while !rest.is_empty() {
        let (name, after) = rest.split_at(rest.find(|c| !is_of_name(c)).unwrap_or(rest.len()));
        if NAMES.contains(&name) {
            made += "capped_";
        }
        made += name;
        let next = after.find(is_of_name).unwrap_or(after.len());
        made += &after[..next];
        rest = &after[next..];
    }
    made
}
