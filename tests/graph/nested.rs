//! A leaf that evaluates a field of its own.

use crate::{common, field, gradients, on_gpu, values};
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Field, LatticeValues, Points};
use isoforge::graph::interval::Interval;
use isoforge::graph::leaf::{DualSlices, Leaf, LeafWgsl};
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use std::sync::Arc;

/// A field as a leaf.
#[derive(Debug)]
struct Inner(GraphField);

impl LatticeValues for Inner {
    fn lattice_values(&self, axes: [&[f32]; 3], out: &mut [f32]) -> bool {
        self.0.lattice().is_some_and(|lattice| lattice.lattice_values(axes, out))
    }
}

impl Leaf for Inner {
    fn values(&self, at: Points<'_>, out: &mut [f32]) {
        let lattice = self.0.lattice();
        // The way of lattices, too, one point at a time.
        for i in 0..out.len() {
            let axes = [&at.x[i..=i], &at.y[i..=i], &at.z[i..=i]];
            if lattice.is_none_or(|lattice| !lattice.lattice_values(axes, &mut out[i..=i])) {
                self.0.values(Points { x: axes[0], y: axes[1], z: axes[2] }, &mut out[i..=i]).unwrap();
            }
        }
        self.0.values(at, out).unwrap();
    }

    fn lattice(&self) -> Option<&dyn LatticeValues> {
        Some(self)
    }

    fn gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        self.0.values(at, out.value).unwrap();
        let mut all = vec![[0.0; 3]; at.x.len()];
        self.0.gradients(at, &mut all).unwrap();
        for (axis, slopes) in out.derivatives.into_iter().enumerate() {
            slopes.iter_mut().zip(&all).for_each(|(slope, gradient)| *slope = gradient[axis]);
        }
    }

    fn interval(&self, at: [Interval; 3]) -> Interval {
        self.0.range(at)
    }

    /// [`ball`], which is the field within.
    fn wgsl(&self, name: &str, _: usize) -> LeafWgsl {
        LeafWgsl {
            value: format!("fn {name}(p: vec3<f32>) -> f32 {{ return length(p) - 0.8; }}\n"),
            gradient: format!(
                "fn {name}_gradient(p: vec3<f32>) -> vec4<f32> {{ return vec4<f32>(length(p) - 0.8, p / length(p)); }}\n"
            ),
            interval: format!(
                "fn {name}_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {{ return ALL; }}\n"
            ),
        }
    }
}

fn ball() -> Expr {
    (x().square() + y().square() + z().square()).sqrt() - 0.8
}

/// Goes red (it panicked) when scratch stays borrowed while leaves are asked.
#[test]
fn a_leaf_may_evaluate_a_field() {
    let leaf = Expr::leaf(Arc::new(Inner(field(&ball()))));
    let rest = |e: Expr| e.max(z() - 0.3) + (x() * y()) * 0.1;
    let (nested, flat) = (field(&rest(leaf)), field(&rest(ball())));
    let points: Vec<[f32; 3]> = (0..150).map(|i| [i as f32 * 0.01, 0.3, i as f32 * -0.02]).collect();
    assert_eq!(values(&nested, &points), values(&flat, &points));
    assert_eq!(gradients(&nested, &points), gradients(&flat, &points));
    if let Some(gpu) = common::gpu() {
        for (a, b) in on_gpu::values(gpu, &nested, &points).into_iter().zip(values(&nested, &points)) {
            assert!((a - b).abs() < 1e-6, "{a} on the GPU, {b} on the CPU");
        }
    }
    let grid = Grid::from_bounds([20; 3], Vec3::NEG_ONE, Vec3::ONE).unwrap();
    let mesh = |field: &GraphField| {
        extract_on_cpu(&Source::Field(field, grid), &Options::new(0.0), &|_| {}).unwrap().0
    };
    let found = mesh(&nested);
    assert!(found.triangles.len() > 1000 && found == mesh(&flat));
}
