//! Closed borders.

use crate::common::{self, Random};
use crate::{bytes, on_cpu, on_gpu, options};
use glam::{Mat3, Vec3};
use isoforge::extract::{CapError, Capped, Normals, Options, Placement, Source};
use isoforge::field::named::Named;
use isoforge::field::user::UserField;
use isoforge::field::{Closure, Field, NoForm, Points, Sense, Wgsl};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::volume::{Values, Volume};

/// With borders closed, both backends; the same bytes.
fn capped(source: &Source<'_>, options: &Options) -> Mesh {
    let capped = Capped::new(source, options).unwrap();
    let mesh = on_cpu(&capped.source(), options);
    if let Some(extractor) = common::extractor() {
        let other = on_gpu(extractor, &capped.source(), options);
        assert_eq!(mesh.triangles, other.triangles, "{options:?}");
        assert!(!extractor.gpu().is_software() || bytes(&mesh) == bytes(&other), "{options:?}");
    }
    mesh
}

fn assert_closed(mesh: &Mesh, name: &str) {
    let report = mesh.check();
    assert!(report.is_closed_manifold() && report.misoriented_edges == 0, "{name}: {report}");
    assert!(report.volume > 0.0, "{name}: {report}");
}

/// A solid that fills all of its domain is the domain's box, whatever the method, the field's kind and the steps.
#[test]
fn a_full_domain_is_its_box() {
    let (low, high) = (Vec3::new(-1.0, 2.0, 0.25), Vec3::new(1.5, 3.0, 4.0));
    let grid = Grid::from_bounds([10, 7, 17], low, high).unwrap();
    let size = high - low;
    let field = Closure::new(Sense::Below, |_| -1.0);
    let dense = Volume::new(grid, vec![3.0; grid.point_count() as usize]).unwrap();
    let bytes = Volume::of(grid, Values::U8(vec![200; grid.point_count() as usize])).unwrap();
    let placements = [Placement::Linear, Placement::Midpoint, Placement::Snapped { epsilon: 1e-4 }];
    for options in
        options(0.0).into_iter().flat_map(|o| placements.map(|placement| Options { placement, ..o }))
    {
        let mut of_field =
            on_cpu(&Capped::new(&Source::Field(&field, grid), &options).unwrap().source(), &options);
        let mut of_volume = capped(&Source::Volume(&dense), &options);
        let mut of_bytes = capped(&Source::Volume(&bytes), &Options { iso: 100.0, ..options });
        for mesh in [&mut of_field, &mut of_volume, &mut of_bytes] {
            assert_closed(mesh, &format!("{options:?}"));
            let report = mesh.check();
            assert!(
                (report.volume - f64::from(size.x * size.y * size.z)).abs() < 1e-5,
                "{options:?}: {report}"
            );
            let (a, b) = mesh.bounds().unwrap();
            assert!(a.distance(low) < 1e-6 && b.distance(high) < 1e-6, "{a} {b}");
            // Normals look out of a side where a vertex lies on one alone.
            for vertex in &mesh.vertices {
                let sides =
                    [(vertex.at() - low), (high - vertex.at())].map(|d| d.to_array().map(|d| d.abs() < 1e-5));
                let on: Vec<(usize, f32)> = (0..3)
                    .flat_map(|k| [(sides[0][k], k, -1.0), (sides[1][k], k, 1.0)])
                    .filter_map(|(is_on, k, sign)| is_on.then_some((k, sign)))
                    .collect();
                if let [(k, sign)] = on[..] {
                    assert!(vertex.normal[k] * sign > 0.999, "{vertex:?}");
                }
            }
            mesh.remove_degenerate();
            assert_closed(mesh, "without zero-area triangles");
            assert_eq!(mesh.degenerate_count(), 0);
        }
    }
}

/// A surface that keeps away from the border has the same triangles, to the bit, with it closed, also where faces lie in planes of points, whose side
/// one rounding of their place would decide. Goes red when the wider grid counts its places from its own corner.
#[test]
fn elsewhere_nothing_changes() {
    for (name, iso) in [("cube", 1.1), ("octahedron", 0.8), ("sphere", 1.0)] {
        let (field, grid) = common::named(name, 60);
        let source = Source::Field(&field, grid);
        for options in options(iso) {
            let [open, closed] = [on_cpu(&source, &options), capped(&source, &options)].map(|mesh| {
                let of = |k: u32| mesh.vertices[k as usize].position.map(f32::to_bits);
                let mut triangles: Vec<_> = mesh.triangles.iter().map(|t| t.map(of)).collect();
                triangles.sort_unstable();
                triangles
            });
            assert!(open == closed, "{name}: {options:?}");
        }
    }
}

/// Noise up to the border, and surfaces that leave the domain.
#[test]
fn borders_close() {
    let mut random = Random(2);
    for (i, step) in
        [Mat3::IDENTITY, Mat3::from_rotation_z(0.4) * Mat3::from_diagonal(Vec3::new(1.0, -0.5, 2.0))]
            .into_iter()
            .enumerate()
    {
        let grid = Grid::new([9, 14 + i as u32, 8], Vec3::new(1.0, -2.0, 0.5), step).unwrap();
        let noise =
            Volume::new(grid, (0..grid.point_count()).map(|_| random.unit() - 0.5).collect()).unwrap();
        let ties =
            Volume::new(grid, (0..grid.point_count()).map(|_| (random.next() % 3) as f32).collect()).unwrap();
        for (volume, iso) in [(&noise, 0.0), (&ties, 1.0)] {
            for sense in [Sense::Below, Sense::Above] {
                for options in options(iso) {
                    let options = Options { sense: Some(sense), ..options };
                    assert_closed(&capped(&Source::Volume(volume), &options), &format!("{i}, {options:?}"));
                }
            }
        }
        let gyroid = Named::new("gyroid").unwrap();
        let small = Grid::new([21, 15, 18], Vec3::splat(-1.0), step * 0.1).unwrap();
        for sense in [Sense::Below, Sense::Above] {
            for options in options(0.1) {
                let options = Options { sense: Some(sense), ..options };
                let source = Source::Field(&gyroid, small);
                let mesh = capped(&source, &options);
                assert_closed(&mesh, &format!("gyroid {i}, {options:?}"));
                // Where the domain does not end, nothing is different: both halves fill it.
                let other = if sense == Sense::Below { Sense::Above } else { Sense::Below };
                let rest = capped(&source, &Options { sense: Some(other), ..options });
                let box_volume = f64::from(step.determinant().abs()) * 1e-3 * (21.0 * 15.0 * 18.0);
                let sum = mesh.check().volume + rest.check().volume;
                assert!((sum - box_volume).abs() < 1e-3 * box_volume, "{sum} of {box_volume}");
            }
        }
    }
    // A field without gradient, that a GPU has as it was written; its vertices snapped, too.
    let wgsl = "fn radius(p: vec3<f32>) -> f32 { return sqrt((p.x * p.x + p.y * p.y) + p.z * p.z); }\n\
                fn density(p: vec3<f32>) -> f32 { return radius(p) - 1.2; }";
    let ball = |p: Vec3| ((p.x * p.x + p.y * p.y) + p.z * p.z).sqrt() - 1.2;
    let ball =
        Closure::new(Sense::Below, ball).with_wgsl(UserField::new(wgsl, "ball", Sense::Below).unwrap());
    let grid = Grid::from_bounds([17, 20, 15], Vec3::NEG_ONE, Vec3::ONE).unwrap();
    for options in options(0.0) {
        for placement in [Placement::Linear, Placement::Snapped { epsilon: 1e-4 }] {
            let mesh = capped(&Source::Field(&ball, grid), &Options { placement, ..options });
            assert_closed(&mesh, &format!("ball, {options:?}"));
            // The ball without the caps beyond the box's sides.
            let cut = std::f64::consts::PI * 0.2f64.powi(2) * (3.6 - 0.2) / 3.0;
            let expected = std::f64::consts::PI * 4.0 / 3.0 * 1.2f64.powi(3) - 6.0 * cut;
            assert!((mesh.check().volume / expected - 1.0).abs() < 0.01, "{}", mesh.check().volume);
        }
    }
    // Culling by intervals changes nothing, nor do normals by differences; a field without gradient has them always.
    let gyroid = Named::new("gyroid").unwrap();
    let grid = Grid::from_bounds([40; 3], Vec3::splat(-1.0), Vec3::splat(1.0)).unwrap();
    let source = Source::Field(&gyroid, grid);
    let options = Options::new(0.1);
    let mesh = capped(&source, &options);
    assert!(bytes(&mesh) == bytes(&capped(&source, &Options { cull: false, ..options })));
    let central = capped(&source, &Options { normals: Normals::Central { delta: None }, ..options });
    assert_eq!(mesh.triangles, central.triangles);
    // Open edges are counted where there are any.
    assert!(
        on_cpu(&source, &options).open_edges_at_border(&grid)
            == on_cpu(&source, &options).check().boundary_edges as u64
    );
    assert_eq!(mesh.open_edges_at_border(&grid), 0);
    // Triangles of vertices that there are not count for nothing.
    let mut bad = on_cpu(&source, &options);
    let before = bad.open_edges_at_border(&grid);
    bad.triangles.push([u32::MAX, 0, 1]);
    assert_eq!(bad.open_edges_at_border(&grid), before);
}

/// Far from the origin, too, where coordinates are rounded by more than a thousandth of a step, caps look out of the domain and open
/// borders are found.
#[test]
fn far_grids_have_caps() {
    let field = Closure::new(Sense::Below, |_| -1.0);
    for (origin, step, cells) in
        [(1000.0, 0.001, 100), (1000.0, 0.01, 60), (-4000.0, 0.02, 33), (0.0, 0.01, 50)]
    {
        let grid =
            Grid::new([cells; 3], Vec3::splat(origin), Mat3::from_diagonal(Vec3::splat(step))).unwrap();
        let source = Source::Field(&field, grid);
        let (low, high) = (grid.origin(), grid.position(grid.cells().as_vec3()));
        for options in options(0.0) {
            let mesh = on_cpu(&Capped::new(&source, &options).unwrap().source(), &options);
            for vertex in &mesh.vertices {
                let sides = (0..3).flat_map(|k| [(k, low[k], -1.0), (k, high[k], 1.0)]);
                let on: Vec<_> = sides.filter(|&(k, side, _)| vertex.position[k] == side).collect();
                if let [(k, _, sign)] = on[..] {
                    assert!(vertex.normal[k] * sign > 0.999, "{origin}, {options:?}: {vertex:?}");
                }
            }
            assert_eq!(mesh.open_edges_at_border(&grid), 0);
            // Without the cap of one side its edges are open.
            let mut open = mesh.clone();
            open.triangles.retain(|t| t.iter().any(|&v| mesh.vertices[v as usize].position[0] != high.x));
            assert_eq!(open.open_edges_at_border(&grid), open.check().boundary_edges as u64, "{origin}");
            assert!(open.check().boundary_edges >= 4 * cells as usize);
        }
    }
}

/// A field's text of the gradient may have that of its value in it, however it is written.
#[test]
fn a_gradient_with_the_value_in_it() {
    #[derive(Debug)]
    struct Ball(Closure<fn(Vec3) -> f32>, &'static str);
    impl Field for Ball {
        fn sense(&self) -> Sense {
            self.0.sense()
        }
        fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
            self.0.values(points, out)
        }
        fn gradients(&self, points: Points<'_>, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
            for (i, out) in out.iter_mut().enumerate() {
                *out = [2.0 * points.x[i], 2.0 * points.y[i], 2.0 * points.z[i]];
            }
            Ok(())
        }
        fn wgsl(&self) -> Result<Wgsl, NoForm> {
            let value = format!(
                "{}(p: vec3<f32>) -> f32 {{ return ((p.x * p.x + p.y * p.y) + p.z * p.z) - 1.4; }}",
                self.1
            );
            let gradient =
                format!("{value}\nfn density_gradient(p: vec3<f32>) -> vec3<f32> {{ return 2.0 * p; }}");
            Ok(Wgsl {
                value: value.into(),
                gradient: Some(gradient.into()),
                interval: None,
                planes: None,
                data: [].into(),
                parameters: Vec::new(),
                counts_loops: false,
            })
        }
    }
    let value: fn(Vec3) -> f32 = |p| ((p.x * p.x + p.y * p.y) + p.z * p.z) - 1.4;
    let grid = Grid::from_bounds([17, 20, 15], Vec3::NEG_ONE, Vec3::ONE).unwrap();
    for written in ["fn density", "fn  density\n "] {
        let ball = Ball(Closure::new(Sense::Below, value), written);
        for options in options(0.0) {
            for placement in [Placement::Linear, Placement::Snapped { epsilon: 1e-4 }] {
                let options = Options { placement, ..options };
                let capped = Capped::new(&Source::Field(&ball, grid), &options).unwrap();
                let mesh = on_cpu(&capped.source(), &options);
                assert_closed(&mesh, &format!("{options:?}"));
                if let Some(extractor) = common::extractor() {
                    let other = on_gpu(extractor, &capped.source(), &options);
                    assert_closed(&other, &format!("{options:?}"));
                    let volumes = [mesh.check().volume, other.check().volume];
                    assert!((volumes[0] / volumes[1] - 1.0).abs() < 1e-4, "{options:?}: {volumes:?}");
                }
            }
        }
    }
}

/// Values and iso values of any size, and what is refused.
#[test]
fn large_numbers_and_little_memory() {
    let grid = Grid::from_bounds([8; 3], Vec3::splat(-1.5), Vec3::splat(1.5)).unwrap();
    let slope = Closure::new(Sense::Below, |p: Vec3| (p.x - 0.3) * 1e31);
    let dense = Volume::new(grid, (0..729).map(|i| 1e31 + 1e28 * (i % 9) as f32).collect()).unwrap();
    for options in options(0.0) {
        for (source, iso, sense) in [
            (Source::Field(&slope, grid), 0.0, Sense::Below),
            (Source::Field(&slope, grid), 5e29, Sense::Below),
            (Source::Field(&slope, grid), -5e29, Sense::Above),
            (Source::Volume(&dense), 5e29, Sense::Above),
        ] {
            let options = Options { iso, sense: Some(sense), ..options };
            let mesh = on_cpu(&Capped::new(&source, &options).unwrap().source(), &options);
            assert_closed(&mesh, &format!("{options:?}"));
            let (low, high) = mesh.bounds().unwrap();
            assert!(
                low.cmpge(Vec3::splat(-1.500_001)).all() && high.cmple(Vec3::splat(1.500_001)).all(),
                "{low} {high}"
            );
        }
        let huge = Options { iso: 1e30, ..options };
        assert!(matches!(Capped::new(&Source::Field(&slope, grid), &huge), Err(CapError::Iso(_))));
        let tight = Options { memory_budget: 5000, ..options };
        let refused = Capped::new(&Source::Volume(&dense), &tight);
        assert!(matches!(refused, Err(CapError::Budget { needed: 8240, budget: 5000 })), "{refused:?}");
    }
}
