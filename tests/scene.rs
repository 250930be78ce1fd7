//! Scene files: what nodes mean, what they refuse and how they say it, imports.

mod common;

#[path = "scene/faults.rs"]
mod faults;
#[path = "scene/imports.rs"]
mod imports;
#[path = "scene/nodes.rs"]
mod nodes;
#[path = "scene/settings.rs"]
mod settings;

use isoforge::field::{Field, Points};
use isoforge::graph::{Expr, GraphField};
use isoforge::scene::{OpenOptions, Scene};
use std::path::Path;

/// The scene of a text, as if it lay among the examples.
fn scene(text: &str) -> Scene {
    parse(text).unwrap_or_else(|error| panic!("{error}"))
}

fn parse(text: &str) -> Result<Scene, isoforge::scene::SceneError> {
    Scene::parse(text, Path::new("examples/scenes/test.toml"), &OpenOptions::default())
}

/// Values at some points.
fn values(field: &GraphField) -> Vec<f32> {
    let [mut x, mut y, mut z] = [const { Vec::new() }; 3];
    for i in 0..1000 {
        let i = i as f32;
        x.push((i * 0.618_034).fract() * 4.0 - 2.0);
        y.push((i * 0.754_877_7).fract() * 4.0 - 2.0);
        z.push((i * 0.569_840_3).fract() * 4.0 - 2.0);
    }
    let mut out = vec![0.0; x.len()];
    field.values(Points { x: &x, y: &y, z: &z }, &mut out).unwrap();
    out
}

/// Whether a scene's field has the values of an expression, bit for bit, and not all the same.
fn same(scene: &Scene, expected: &Expr) {
    let (found, expected) = (values(&scene.field()), values(&GraphField::new(expected, scene.sense)));
    let other = found.iter().zip(&expected).position(|(a, b)| a.to_bits() != b.to_bits());
    assert_eq!(other.map(|i| (i, found[i], expected[i])), None, "point, found, expected");
    assert!(found.iter().any(|v| *v != found[0]), "a constant field tells nothing");
}
