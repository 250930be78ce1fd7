//! A field's surface at an iso value, as the adaptive methods ask for it: signed values, gradients and bounds at any
//! points.

use super::differences::central;
use super::{Field, NoForm, Points, Sense, Within};
use crate::graph::interval::{self as iv, Interval};
use glam::Vec3;

/// Points that are handed to the field at a time.
const CHUNK: usize = 256;

/// Where a field is `iso`, with the side that is inside.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    field: &'a dyn Field,
    iso: f32,
    /// 1 where the inside is below, −1 where it is above.
    sign: f32,
    delta: f32,
}

impl<'a> Surface<'a> {
    /// The surface of `field` at `iso`. Where the field has no gradient of its own, central differences over ± `delta`
    /// (world units, finite and over 0) stand in.
    ///
    /// # Errors
    /// [`NoForm::Cpu`] if only a GPU evaluates the field.
    pub fn new(field: &'a dyn Field, iso: f32, sense: Sense, delta: f32) -> Result<Self, NoForm> {
        let surface = Self::on_gpu(field, iso, sense, delta);
        surface.values(&[Vec3::ZERO], &mut [0.0])?;
        Ok(surface)
    }

    /// The same, also of a field that only a GPU evaluates: for what a GPU does on surfaces
    /// ([`crate::extract::Extractor::refine`]). Then what asks for values here fails with [`NoForm::Cpu`].
    pub fn on_gpu(field: &'a dyn Field, iso: f32, sense: Sense, delta: f32) -> Self {
        let sign = if sense == Sense::Below { 1.0 } else { -1.0 };
        Self { field, iso, sign, delta: delta.max(f32::MIN_POSITIVE) }
    }

    /// The field itself.
    pub fn field(&self) -> &'a dyn Field {
        self.field
    }

    /// The value of the field on the surface.
    pub fn iso(&self) -> f32 {
        self.iso
    }

    /// Which side of it is inside.
    pub fn sense(&self) -> Sense {
        if self.sign > 0.0 { Sense::Below } else { Sense::Above }
    }

    /// The step of the differences that stand in for a gradient.
    pub(crate) fn delta(&self) -> f32 {
        self.delta
    }

    /// The same surface of a field that is equal where it is asked from now on ([`Field::within`]).
    #[must_use]
    pub fn of<'b>(&self, field: &'b dyn Field) -> Surface<'b> {
        Surface { field, iso: self.iso, sign: self.sign, delta: self.delta }
    }

    /// The signed value that a sample of the field stands for: below 0 exactly where the inside test holds
    /// ([`crate::stage::inside::Inside`]); ties are 0, NaN and infinite samples are +∞, outside.
    #[inline(always)]
    pub fn signed(&self, sample: f32) -> f32 {
        if sample.is_finite() { self.sign * (sample - self.iso) } else { f32::INFINITY }
    }

    /// The signed values at `points`, into `out` of the same length.
    ///
    /// # Errors
    /// [`NoForm::Cpu`], never of a surface that [`Surface::new`] made.
    pub fn values(&self, points: &[Vec3], out: &mut [f32]) -> Result<(), NoForm> {
        let mut axes = [[0.0; CHUNK]; 3];
        for (points, out) in points.chunks(CHUNK).zip(out.chunks_mut(CHUNK)) {
            self.field.values(split(points, &mut axes), out)?;
            out.iter_mut().for_each(|v| *v = self.signed(*v));
        }
        Ok(())
    }

    /// The gradients of the signed values, which point out of the solid, into `out`. Those of graph fields are
    /// exact and have their true length, which of other fields ([`Field::gradients`]) nothing is known of.
    /// They may be zero or not finite.
    ///
    /// # Errors
    /// As [`Surface::values`].
    pub fn gradients(&self, points: &[Vec3], out: &mut [Vec3]) -> Result<(), NoForm> {
        let (mut axes, mut found) = ([[0.0; CHUNK]; 3], [[0.0; 3]; CHUNK]);
        for (points, out) in points.chunks(CHUNK).zip(out.chunks_mut(CHUNK)) {
            let (points, found) = (split(points, &mut axes), &mut found[..out.len()]);
            let mut scale = self.sign;
            match self.field.gradients(points, found) {
                Err(NoForm::Gradient) => {
                    central(self.field, points, self.delta, found)?;
                    scale /= 2.0 * self.delta;
                }
                other => other?,
            }
            out.iter_mut().zip(found).for_each(|(out, g)| *out = Vec3::from(*g) * scale);
        }
        Ok(())
    }

    /// Bounds of the signed values in the box from `low` to `high`; all numbers where nothing is known. No surface
    /// lies in a box whose bounds are on one side of 0.
    pub fn range(&self, low: Vec3, high: Vec3) -> Interval {
        self.signed_range(self.field.range([0, 1, 2].map(|k| Interval { lo: low[k], hi: high[k] })))
    }

    /// [`Field::within`] in the box from `low` to `high`, with the bounds of the signed values.
    pub fn within(&self, low: Vec3, high: Vec3) -> Within {
        let within = self.field.within([0, 1, 2].map(|k| Interval { lo: low[k], hi: high[k] }));
        Within { range: self.signed_range(within.range), field: within.field }
    }

    fn signed_range(&self, range: Interval) -> Interval {
        iv::mul(Interval::point(self.sign), iv::add(range, Interval::point(-self.iso)))
    }
}

/// The points by axes.
fn split<'a>(points: &[Vec3], axes: &'a mut [[f32; CHUNK]; 3]) -> Points<'a> {
    let n = points.len();
    for (k, axis) in axes.iter_mut().enumerate() {
        axis.iter_mut().zip(points).for_each(|(to, p)| *to = p[k]);
    }
    let [x, y, z] = axes;
    Points { x: &x[..n], y: &y[..n], z: &z[..n] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closure;
    use crate::graph::{GraphField, x, y, z};

    /// Goes red without the sign in any of the three.
    #[test]
    fn signs_and_lengths() {
        let ball = (x().square() + y().square() + z().square()) * 3.0;
        for (sense, sign) in [(Sense::Below, 1.0), (Sense::Above, -1.0)] {
            let graph = GraphField::new(&ball, sense);
            let rust = Closure::new(sense, |p| 3.0 * p.length_squared());
            for field in [&graph as &dyn Field, &rust] {
                let surface = Surface::new(field, 12.0, sense, 1e-2).unwrap();
                let points: Vec<Vec3> = (0..300).map(|i| Vec3::new(i as f32 / 100.0, 0.5, -0.25)).collect();
                let (mut values, mut gradients) = (vec![0.0; 300], vec![Vec3::ZERO; 300]);
                surface.values(&points, &mut values).unwrap();
                surface.gradients(&points, &mut gradients).unwrap();
                for (i, p) in points.iter().enumerate() {
                    assert!((values[i] - sign * (3.0 * p.length_squared() - 12.0)).abs() < 1e-4);
                    assert!(gradients[i].distance(*p * 6.0 * sign) < 1e-2, "{} {p}", gradients[i]);
                    let bounds = surface.range(*p - 0.1, *p + 0.1);
                    assert!(bounds.lo <= values[i] && values[i] <= bounds.hi, "{bounds:?}");
                }
            }
        }
    }

    #[test]
    fn not_finite_is_outside() {
        let graph = GraphField::new(&x(), Sense::Above);
        let surface = Surface::new(&graph, 1.0, Sense::Above, 1.0).unwrap();
        for sample in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(surface.signed(sample) > 0.0);
        }
        assert!(surface.signed(1.0) >= 0.0 && surface.signed(1.0f32.next_up()) < 0.0);
    }
}
