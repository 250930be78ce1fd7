//! Volumes as leaves: values and gradients against an independent reference, bounds, and both backends.

mod common;

use common::{Random, noise, small_brain};
use glam::{DMat3, DVec3, Mat3, Vec3};
use isoforge::compare::compare;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Points, Sense};
use isoforge::graph::interval::{ALL, Interval};
use isoforge::graph::leaf::{DualSlices, Leaf};
use isoforge::graph::volume::{Border, Gradient, Interpolation, Lookup, VolumeLeaf};
use isoforge::graph::{GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::volume::Volume;
use std::sync::Arc;

const BOTH: [Interpolation; 2] = [Interpolation::Nearest, Interpolation::Trilinear];

/// Turned, sheared, of unequal sides, with values that a sum of waves gives.
fn waves(cells: [u32; 3]) -> Arc<Volume> {
    let step = Mat3::from_rotation_z(0.3)
        * Mat3::from_cols_array(&[0.1, 0.0, 0.02, 0.0, 0.15, 0.0, 0.0, 0.01, 0.12]);
    let grid = Grid::new(cells, Vec3::new(-1.0, 0.3, 2.0), step).unwrap();
    Arc::new(common::sampled(grid, |p| (3.0 * p.x).sin() + (2.0 * p.y).cos() * p.z - 0.3))
}

/// In `f64`: grid coordinates, then the formula of a trilinear interpolant as a sum of eight weighted corners.
struct Reference<'a> {
    volume: &'a Volume,
    inverse: DMat3,
}

impl<'a> Reference<'a> {
    fn new(volume: &'a Volume) -> Self {
        Self { volume, inverse: volume.grid().step().as_dmat3().inverse() }
    }

    fn sample(&self, at: [i64; 3]) -> f64 {
        let n = self.volume.grid().points().to_array().map(i64::from);
        let [x, y, z] = [0, 1, 2].map(|k| at[k].clamp(0, n[k] - 1));
        f64::from(self.volume.values().get((x + n[0] * (y + n[1] * z)) as usize))
    }

    fn place(&self, p: DVec3) -> DVec3 {
        self.inverse * (p - self.volume.grid().origin().as_dvec3())
    }

    /// Of what `at` gives at the samples, clamped to the box.
    fn between(&self, by: Interpolation, p: DVec3, at: impl Fn([i64; 3]) -> f64) -> f64 {
        let last = self.volume.grid().cells().as_dvec3();
        let q = self.place(p).clamp(DVec3::ZERO, last);
        if by == Interpolation::Nearest {
            return at(q.to_array().map(|v| (v + 0.5).floor() as i64));
        }
        let low = q.floor();
        let f = q - low;
        let mut sum = 0.0;
        for corner in 0..8 {
            let one = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let weight: f64 = (0..3).map(|k| if one[k] == 1 { f[k] } else { 1.0 - f[k] }).product();
            sum += weight * at([0, 1, 2].map(|k| low[k] as i64 + one[k]));
        }
        sum
    }

    fn value(&self, by: Interpolation, p: DVec3) -> f64 {
        self.between(by, p, |at| self.sample(at))
    }

    /// The slope at a sample, central where there are two neighbours.
    fn slope(&self, at: [i64; 3], axis: usize, value: &dyn Fn([i64; 3]) -> f64) -> f64 {
        let last = i64::from(self.volume.grid().cells().to_array()[axis]);
        let (mut low, mut high) = (at, at);
        low[axis] = (at[axis] - 1).max(0);
        high[axis] = (at[axis] + 1).min(last);
        (value(high) - value(low)) / (high[axis] - low[axis]) as f64
    }

    fn smooth(&self, at: [i64; 3], axis: usize) -> f64 {
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let mut sum = 0.0;
        for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
            let mut near = at;
            near[a] += i;
            near[b] += j;
            sum += f64::from([1, 2, 1][(i + 1) as usize] * [1, 2, 1][(j + 1) as usize]) / 16.0
                * self.sample(near);
        }
        sum
    }

    fn gradient(&self, by: Gradient, p: DVec3) -> DVec3 {
        let axes = [0, 1, 2];
        let slopes = match by {
            Gradient::Exact => {
                let step = 1e-6;
                let to = |k: usize, by: f64| p + self.volume.grid().step().as_dmat3().col(k) * by;
                let at = |p| self.value(Interpolation::Trilinear, p);
                axes.map(|k| (at(to(k, step)) - at(to(k, -step))) / (2.0 * step))
            }
            Gradient::Central(by) => {
                axes.map(|k| self.between(by, p, |at| self.slope(at, k, &|at| self.sample(at))))
            }
            Gradient::Sobel(by) => {
                axes.map(|k| self.between(by, p, |at| self.slope(at, k, &|at| self.smooth(at, k))))
            }
        };
        let q = self.place(p);
        let last = self.volume.grid().cells().as_dvec3();
        let inside = axes.map(|k| q[k] >= 0.0 && q[k] <= last[k]);
        self.inverse.transpose() * DVec3::from(axes.map(|k| if inside[k] { slopes[k] } else { 0.0 }))
    }
}

/// Points in and about the volume's box, not too close to the planes where something jumps.
fn about(volume: &Volume, count: usize) -> [Vec<f32>; 3] {
    let mut random = Random(11);
    let reference = Reference::new(volume);
    let cells = volume.grid().cells().as_vec3();
    let mut out = [const { Vec::new() }; 3];
    while out[0].len() < count {
        let q = Vec3::from([0; 3].map(|_| random.unit() * 1.3 - 0.15)) * cells;
        let p = volume.grid().position(q);
        let q = reference.place(p.as_dvec3());
        let jumps = (q * 2.0 - (q * 2.0).round()).abs().min_element() < 1e-3;
        if !jumps {
            (0..3).for_each(|k| out[k].push(p[k]));
        }
    }
    out
}

fn evaluated(leaf: &dyn Leaf, [x, y, z]: &[Vec<f32>; 3]) -> [Vec<f32>; 4] {
    let mut out = [0; 4].map(|_| vec![f32::NAN; x.len()]);
    let [value, a, b, c] = &mut out;
    leaf.gradients(Points { x, y, z }, DualSlices { value, derivatives: [a, b, c] });
    let mut values = vec![0.0; x.len()];
    leaf.values(Points { x, y, z }, &mut values);
    let bits = |v: &[f32]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&values), bits(&out[0]));
    out
}

fn gradients() -> impl Iterator<Item = Gradient> {
    let by = |make: fn(Interpolation) -> Gradient| BOTH.map(make);
    [Gradient::Exact].into_iter().chain(by(Gradient::Central)).chain(by(Gradient::Sobel))
}

/// Goes red when the rows and columns of the world-to-grid matrix change places, when Sobel's middle weight is 1,
/// and when a difference at the border is halved.
#[test]
fn values_and_gradients_are_those_of_the_reference() {
    for cells in [[9, 12, 7], [1, 1, 1], [2, 1, 5]] {
        let volume = waves(cells);
        let reference = Reference::new(&volume);
        let at = about(&volume, 1500);
        for (value, gradient) in BOTH.into_iter().flat_map(|v| gradients().map(move |g| (v, g))) {
            let lookup = Lookup { value, gradient, border: Border::Clamp };
            let found = evaluated(&*VolumeLeaf::new(volume.clone(), lookup).unwrap(), &at);
            for i in 0..at[0].len() {
                let p = DVec3::from([0, 1, 2].map(|k| f64::from(at[k][i])));
                let expected = reference.value(value, p);
                assert!(
                    (f64::from(found[0][i]) - expected).abs() < 5e-5,
                    "{lookup:?} {i}: {} {expected}",
                    found[0][i]
                );
                let slope = reference.gradient(gradient, p);
                for k in 0..3 {
                    let error = (f64::from(found[k + 1][i]) - slope[k]).abs();
                    assert!(error < 2e-3, "{cells:?} {lookup:?} {i} {k}: {} {}", found[k + 1][i], slope[k]);
                }
            }
        }
    }
}

#[test]
fn borders() {
    let volume = waves([5, 5, 5]);
    let [low, high] = [-0.25, 5.25].map(|q| volume.grid().position(Vec3::splat(q)));
    let at = [0, 1, 2].map(|k| vec![low[k], high[k], f32::NAN, f32::INFINITY]);
    let lookup = Lookup { border: Border::Constant(-7.5), ..Lookup::default() };
    let found = evaluated(&*VolumeLeaf::new(volume.clone(), lookup).unwrap(), &at);
    assert_eq!(found[0], [-7.5; 4]);
    assert!(found[1..].iter().all(|v| *v == [0.0; 4]), "{found:?}");
    let found = evaluated(&*VolumeLeaf::new(volume.clone(), Lookup::default()).unwrap(), &at);
    assert_eq!(found[0][..2], [volume.values().get(0), volume.values().get(215)]);
    assert!(found[1..].iter().all(|v| v[..2] == [0.0; 2]), "{found:?}");
}

/// No value lies outside its interval, in 10⁴ boxes. Goes red when a range leaves out the samples at its end, or
/// the border's value.
#[test]
fn bounds_hold() {
    let mut random = Random(5);
    let mut known = 0;
    let grid = *waves([33, 9, 21]).grid();
    for (n, volume) in
        [waves([33, 9, 21]), Arc::new(noise(grid, 1)), waves([1, 40, 1])].into_iter().enumerate()
    {
        for border in [Border::Clamp, Border::Constant(0.25)] {
            for value in BOTH {
                let leaf =
                    VolumeLeaf::new(volume.clone(), Lookup { value, border, ..Lookup::default() }).unwrap();
                for i in 0..8500 {
                    let q = Vec3::from([0; 3].map(|_| random.unit() * 1.4 - 0.2))
                        * volume.grid().cells().as_vec3();
                    let low = volume.grid().position(q);
                    let side = 2f32.powi(-(i % 12)) * 3.0;
                    let over = low.to_array().map(|low| Interval::new(low, low + side));
                    let range = leaf.interval(over);
                    let at = low
                        .to_array()
                        .map(|low| (0..24).map(|_| low + side * random.unit()).collect::<Vec<_>>());
                    for v in &evaluated(&*leaf, &at)[0] {
                        assert!(range.contains(*v), "{n} {border:?} {value:?} {over:?}: {v} {range:?}");
                        assert!(v.is_finite() || range == ALL);
                    }
                    known += usize::from(range.is_bounded());
                }
            }
        }
    }
    assert!((50_000..102_000).contains(&known), "{known}");
}

/// As a field of its own and as an operand; culled, whole, and on the adapter.
#[test]
fn as_operands_on_both_backends() {
    let brain = Arc::new(small_brain());
    let (low, high) = (brain.grid().origin(), brain.grid().position(brain.grid().cells().as_vec3()));
    let (low, high) = (low.min(high), low.max(high));
    let middle = (0.5 * (low + high)).as_dvec3();
    let grid = Grid::from_bounds([40, 44, 36], low - 3.0, high + 3.0).unwrap();
    for (gradient, border) in [
        (Gradient::Exact, Border::Clamp),
        (Gradient::Central(Interpolation::Trilinear), Border::Constant(-50.0)),
        (Gradient::Sobel(Interpolation::Nearest), Border::Constant(-50.0)),
        (Gradient::Sobel(Interpolation::Trilinear), Border::Clamp),
    ] {
        let leaf =
            VolumeLeaf::new(brain.clone(), Lookup { value: Interpolation::Trilinear, gradient, border })
                .unwrap();
        let away = (x() - middle.x).square() + (y() - middle.y).square() + (z() - middle.z).square();
        let bent = leaf.expr().at([x() + (y() * 0.01).sin_turns(), y(), z()]);
        for (expr, iso) in [(leaf.expr(), 10.0), (bent.min(away.sqrt() - 2.0), 5.0)] {
            let field = GraphField::new(&expr, Sense::Above);
            let source = Source::Field(&field, grid);
            let (culled, report) = extract_on_cpu(&source, &Options::new(iso), &|_| {}).unwrap();
            let all = Options { cull: false, ..Options::new(iso) };
            let (whole, all) = extract_on_cpu(&source, &all, &|_| {}).unwrap();
            assert!(culled.triangles.len() > 300, "{gradient:?}: {}", culled.triangles.len());
            assert!(culled == whole && report.active_bricks < all.active_bricks, "{gradient:?}");
            let Some(extractor) = common::extractor() else { continue };
            let compared = compare(extractor, &source, &Options::new(iso)).unwrap();
            for row in compared.rows {
                assert!(row.agrees() && row.differing == 0, "{gradient:?}: {row:?}");
            }
        }
    }
}
