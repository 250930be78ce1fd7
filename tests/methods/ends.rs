//! emit on the CPU takes few of a field's samples once more (src/stage/emit/cpu/ends.rs): those that decide anything.

use crate::{common, on_cpu, options};
use glam::{Mat3, Vec3};
use isoforge::extract::{Capped, Source};
use isoforge::field::{Closure, Field, NoForm, Points, Sense, Wgsl};
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::mesh::{Mesh, Vertex};

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

/// A field of which the last bits depend on how many points are asked for together, as in a vector loop with a remainder that rounds
/// in another way, and which is next to iso at the first point of every brick.
#[derive(Debug)]
struct Uneven {
    /// What is added to few points, and to all of a brick.
    last_bits: [f32; 2],
}

impl Field for Uneven {
    fn sense(&self) -> Sense {
        Sense::Below
    }

    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        let last_bits = self.last_bits[usize::from(points.x.len() == 729)];
        for (i, out) in out.iter_mut().enumerate() {
            let p = Vec3::new(points.x[i], points.y[i], points.z[i]);
            *out =
                (std::f32::consts::PI * p / 8.0).to_array().map(f32::sin).iter().product::<f32>() + last_bits;
        }
        Ok(())
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        Err(NoForm::Gpu)
    }
}

/// What is inside classify says alone: where emit finds other last bits, vertices move by as much, and triangles stay.
///
/// Goes red when `emit_brick` (src/extract/cpu.rs) tests the first point anew.
#[test]
fn of_fields_whose_last_bits_vary() {
    let grid = Grid::new([32; 3], Vec3::splat(-8.0), Mat3::IDENTITY).unwrap();
    let [uneven, even] = [-1e-7, 1e-7].map(|few| Uneven { last_bits: [few, 1e-7] });
    for options in options(0.0) {
        let [own, expected] = [&uneven, &even].map(|field| {
            let source = Source::Field(field, grid);
            let capped = Capped::new(&source, &options).unwrap();
            [on_cpu(&source, &options), on_cpu(&capped.source(), &options)]
        });
        for (own, expected) in own.iter().zip(&expected) {
            assert!(
                own.triangles.len() > 1000 && own.triangles == expected.triangles,
                "{:?}",
                options.method
            );
            let near = |(a, b): (&Vertex, &Vertex)| a.at().distance(b.at()) < 1e-5;
            let far = own.vertices.iter().zip(&expected.vertices).filter(|pair| !near(*pair)).count();
            // On edges that run within iso the last bits decide.
            assert!(far * 10 < own.vertices.len(), "{:?}: {far}", options.method);
        }
    }
}
