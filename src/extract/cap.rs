//! Closed borders: a source with a layer of points around its grid that are outside, so that the surface closes where the domain
//! ends.
//!
//! The points of that layer are so far from iso that the vertices on the edges to them lie on the last points of the domain
//! themselves: the caps are flat, and the surface meets them where it met the border. Nothing of the stages knows of
//! it, and each method closes as it does everywhere.

use super::Source;
use crate::field::differences::central;
use crate::field::{Field, LatticeValues, NoForm, Points, Sense, Wgsl, Within};
use crate::graph::interval::Interval;
use crate::grid::{Grid, GridError};
use crate::stage::shaders::CENTRAL;
use crate::volume::Volume;
use glam::{Mat3, Vec3};
use std::sync::Arc;

/// Values outside a field's domain. Positions along an edge to such a point are whole numbers: what is left of an edge is
/// less than an `f32` beside 1 tells.
const FAR: f32 = 1e30;
/// The same of a volume, in parts of its largest magnitude: gradients are made of it, too.
const FAR_PARTS: f32 = (1u64 << 40) as f32;
/// How near to the border, in grid steps, a vertex is one of the cap.
const ON_BORDER: f32 = 1e-3;

/// A source whose surface closes at the border of its domain.
#[derive(Debug)]
pub enum Capped<'a> {
    /// A field.
    Field(Box<CappedField<'a>>),
    /// A volume, whose samples are `f32` whatever they were.
    Volume(Volume),
}

impl<'a> Capped<'a> {
    /// `source` with a layer of outside points around it: two cells more along each axis. `iso` and `sense` are those of the
    /// extraction. A volume is copied, as `f32`.
    ///
    /// # Errors
    /// [`GridError`] if the grid has no room for two cells more.
    pub fn new(source: &Source<'a>, iso: f32, sense: Option<Sense>) -> Result<Self, GridError> {
        let grid = source.grid();
        let step = grid.step();
        let origin = grid.origin() - (step.x_axis + step.y_axis + step.z_axis);
        let wider = Grid::new((grid.cells() + 2).to_array(), origin, step)?;
        let outward = match sense.unwrap_or(source.sense()) {
            Sense::Below => 1.0,
            Sense::Above => -1.0,
        };
        Ok(match source {
            Source::Field(field, _) => {
                let rows = grid.step().as_dmat3().inverse().as_mat3().transpose();
                let delta = grid.shortest_step() as f32 / 100.0;
                Self::Field(Box::new(CappedField { field: *field, grid: *grid, wider, rows, outward, delta }))
            }
            Source::Volume(volume) => Self::Volume(padded(volume, wider, iso, outward)),
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

fn padded(volume: &Volume, wider: Grid, iso: f32, outward: f32) -> Volume {
    let most = volume.finite_range().map_or(0.0, |(low, high)| low.abs().max(high.abs()));
    let far = (outward * most.max(iso.abs()).max(f32::MIN_POSITIVE) * FAR_PARTS).clamp(-FAR, FAR);
    let [nx, ny, nz] = volume.grid().points().to_array().map(|n| n as usize);
    let mut values = vec![far; (nx + 2) * (ny + 2) * (nz + 2)];
    let from = volume.values().as_slice();
    for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
        let (row, to) = (nx * (y + ny * z), 1 + (nx + 2) * (y + 1 + (ny + 2) * (z + 1)));
        for (x, value) in values[to..to + nx].iter_mut().enumerate() {
            *value = from.get(row + x);
        }
    }
    Volume::window(wider, values.into())
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
            let low = if q[k] < ON_BORDER { -rows[k].normalize() } else { Vec3::ZERO };
            let high = if q[k] > cells[k] - ON_BORDER { rows[k].normalize() } else { Vec3::ZERO };
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
        } else if low.cmpgt(Vec3::splat(ON_BORDER)).all() && high.cmplt(cells - ON_BORDER).all() {
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
        let number = |v: f32| format!("{v:?}f");
        let vector = |v: Vec3| format!("vec3<f32>({}, {}, {})", number(v.x), number(v.y), number(v.z));
        let rows = [self.rows.x_axis, self.rows.y_axis, self.rows.z_axis];
        let cells = self.grid.cells().as_vec3();
        // Each text has its own copy, since others may lie beside it.
        let coordinates = |of: &str| {
            format!(
                "fn {of}_coordinates(p: vec3<f32>) -> vec3<f32> {{\n    let way = p - {};\n    \
                 return vec3<f32>(dot({}, way), dot({}, way), dot({}, way));\n}}\n",
                vector(self.grid.origin()),
                vector(rows[0]),
                vector(rows[1]),
                vector(rows[2]),
            )
        };
        let (far, end) = (number(self.far()), vector(cells + 0.5));
        let value = format!(
            "{}{}fn density(p: vec3<f32>) -> f32 {{\n    let q = capped_coordinates(p);\n    \
             if all(q >= vec3<f32>(-0.5)) && all(q <= {end}) {{\n        return capped_density(p);\n    }}\n    \
             return {far};\n}}\n",
            renamed(&own.value, "capped_"),
            coordinates("capped"),
        );
        let uncapped = match &own.gradient {
            Some(gradient) => renamed(gradient, "uncapped_"),
            None => renamed(&[&own.value, CENTRAL].join("\n"), "uncapped_"),
        };
        let mut gradient = uncapped + &coordinates("cap");
        gradient += "fn density_gradient(p: vec3<f32>) -> vec3<f32> {\n    let q = cap_coordinates(p);\n    var of_cap = vec3<f32>(0.0);\n";
        for (k, row) in rows.into_iter().enumerate() {
            let out = row.normalize() * self.outward;
            let axis = ["x", "y", "z"][k];
            let (low, high) = (number(ON_BORDER), number(cells[k] - ON_BORDER));
            gradient += &format!("    if q.{axis} < {low} {{ of_cap -= {}; }}\n", vector(out));
            gradient += &format!("    if q.{axis} > {high} {{ of_cap += {}; }}\n", vector(out));
        }
        gradient += "    if any(of_cap != vec3<f32>(0.0)) {\n        return of_cap;\n    }\n    return uncapped_density_gradient(p);\n}\n";
        let interval = own.interval.as_ref().map(|interval| {
            let (inner, last) = (number(ON_BORDER), vector(cells - ON_BORDER));
            format!(
                "{}{}fn density_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {{\n    \
                 var low = bounds_coordinates(vec3<f32>(x.x, y.x, z.x));\n    var high = low;\n    \
                 for (var i = 1u; i < 8u; i++) {{\n        \
                 let q = bounds_coordinates(vec3<f32>(x[i & 1u], y[(i >> 1u) & 1u], z[i >> 2u]));\n        \
                 low = min(low, q);\n        high = max(high, q);\n    }}\n    \
                 if any(low > {end}) || any(high < vec3<f32>(-0.5)) {{\n        return iv_point({far});\n    }}\n    \
                 let inside = capped_density_interval(x, y, z);\n    \
                 if all(low > vec3<f32>({inner})) && all(high < {last}) {{\n        return inside;\n    }}\n    \
                 return iv_hull(inside, iv_point({far}));\n}}\n",
                renamed(interval, "capped_"),
                coordinates("bounds"),
            )
        });
        Ok(Wgsl {
            value: value.into(),
            gradient: Some(gradient.into()),
            interval: interval.map(Arc::from),
            planes: None,
            ..own
        })
    }
}

impl LatticeValues for CappedField<'_> {
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

/// The text with `prefix` before the names of a field's functions.
fn renamed(text: &str, prefix: &str) -> String {
    const NAMES: [&str; 3] = ["density", "density_gradient", "density_interval"];
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut made = String::with_capacity(text.len() + 64);
    let mut rest = text;
    while !rest.is_empty() {
        let end = rest.find(|c| !is_of_name(c)).unwrap_or(rest.len());
        let (name, after) = rest.split_at(end);
        if NAMES.contains(&name) {
            made += prefix;
        }
        made += name;
        let next = after.find(is_of_name).unwrap_or(after.len());
        made += &after[..next];
        rest = &after[next..];
    }
    made
}
