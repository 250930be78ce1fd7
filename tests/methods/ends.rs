//! emit on the CPU takes few of a field's samples once more (src/stage/emit/cpu/ends.rs): those that decide anything.

use crate::{common, on_cpu, options};
use glam::{Mat3, Vec3};
use isoforge::extract::{Capped, Source};
use isoforge::field::{Closure, Field, Points, Sense};
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;

/// Triangles, and positions bit for bit: normals of volumes come from elsewhere.
fn shape(mesh: Mesh) -> (Vec<[u32; 3]>, Vec<[u32; 3]>) {
    (mesh.triangles, mesh.vertices.iter().map(|v| v.position.map(f32::to_bits)).collect())
}

/// The mesh of a field is that of the volume of its values, which has all samples at hand; with noise so fine that most cells are
/// undecided, with blobs, which have lattices, and with a closure.
///
/// Goes red when `ends` leaves the far ends along z out, when `has_undecided` looks at the first plane alone, and when `some` (src/stage/sample/row.rs) takes rows for planes.
#[test]
fn of_fields_as_of_their_values() {
    let mut random = common::Random(5);
    let fluid = (0..40).map(|_| Component {
        position: random.in_ball().into(),
        radius: 0.3 + 0.3 * random.unit(),
        weight: if random.below(4) == 0 { -1.0 } else { 1.0 },
    });
    let blobs = Blobs::new(Kernel::SoftObject, fluid.collect()).unwrap();
    let fine = |seed| Expr::noise(seed).at([x() * 7.1 + 0.137, y() * 7.3 + 0.271, z() * 6.9 + 0.113]);
    let noise = GraphField::new(&fine(3), Sense::Below);
    let blob = GraphField::new(&Expr::leaf(blobs.clone()), Sense::Above);
    let both = GraphField::new(&(Expr::leaf(blobs) - 0.3 * fine(4) * z()), Sense::Above);
    let closure =
        Closure::new(Sense::Above, |p: Vec3| (5.0 * p.x).sin() + (4.0 * p.y).cos() * (6.0 * p.z).sin());
    let fields: [(&str, &dyn Field, f32); 4] =
        [("noise", &noise, 0.02), ("blob", &blob, 0.4), ("both", &both, 0.3), ("closure", &closure, 0.1)];
    let along = Grid::from_bounds([35, 18, 23], Vec3::splat(-1.1), Vec3::new(1.3, 1.2, 1.1)).unwrap();
    let turn = Mat3::from_rotation_y(0.4) * along.step();
    let turned = Grid::new(along.cells().into(), Vec3::splat(-0.9), turn).unwrap();
    for (name, field, iso) in fields {
        for grid in [along, turned] {
            let value = |p: Vec3| {
                let mut out = [0.0];
                field.values(Points { x: &[p.x], y: &[p.y], z: &[p.z] }, &mut out).unwrap();
                out[0]
            };
            let volume = common::sampled(grid, value);
            for options in options(iso) {
                let options = isoforge::extract::Options { sense: Some(field.sense()), ..options };
                let sources = [Source::Field(field, grid), Source::Volume(&volume)];
                let [own, whole] = sources.map(|source| shape(on_cpu(&source, &options)));
                assert!(own.0.len() > 100 && own == whole, "{name}, {grid:?}, {:?}", options.method);
                let [own, whole] = sources.map(|source| {
                    let capped = Capped::new(&source, &options).unwrap();
                    shape(on_cpu(&capped.source(), &options))
                });
                assert!(own.0.len() > 100 && own == whole, "{name}, capped, {:?}", options.method);
            }
        }
    }
}
