//! Constants that make no sense are refused and told apart; parameters that make none harm nothing.

use crate::{field, points, values};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::graph::Expr;
use isoforge::graph::shapes::*;
use isoforge::grid::Grid;

#[test]
fn constants() {
    let s = || sphere(1.0);
    let not_positive = |what: &str, result: Result<Expr, ShapeError>| match result {
        Err(ShapeError::NotPositive { what: named, .. }) => assert_eq!(named, what),
        other => panic!("{what}: {other:?}"),
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        not_positive("half axis", ellipsoid([1.0, bad, 1.0]));
        not_positive("radius", superellipsoid([1.0, 1.0, bad], 1.0, 1.0));
        not_positive("exponent", superellipsoid([1.0; 3], 1.0, bad));
        not_positive("exponent", superhyperboloid([1.0; 3], bad, 1.0));
        not_positive("exponent", supertorus([1.0; 3], 2.0, bad, 1.0));
        not_positive("height", cone(1.0, bad));
        not_positive("scale factor", s().scale(bad));
        not_positive("scale factor", s().scale_axes([1.0, 1.0, bad]));
        not_positive("taper factor", s().taper(1.0, bad, 0.0, 1.0));
        not_positive("period", s().repeat(Axis::X, bad, None));
        // A constant that is computed is one, too.
        not_positive("scale factor", s().scale(Expr::from(bad) * 1.0));
    }
    for bad in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
        let results =
            [half_space(bad, 0.0), s().rotate(bad, 0.1), s().mirror(bad, 0.0), s().symmetric(bad, 0.0)];
        for result in results {
            assert!(matches!(result, Err(ShapeError::NoDirection { .. })), "{result:?}");
        }
    }
    assert!(half_space([0.0, 1e-200, 0.0], 0.0).is_ok() && half_space([1e200, 0.0, 0.0], 0.0).is_ok());
    for (from, to) in [(1.0, 1.0), (1.0, 0.0), (f64::NAN, 1.0)] {
        let results = [s().twist(0.1, from, to), s().bend(0.1, from, to), s().taper(1.0, 1.0, from, to)];
        for result in results {
            assert!(matches!(result, Err(ShapeError::Empty { .. })), "{result:?}");
        }
    }
    let flat = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::X + DVec3::Y * 1.0000000000001);
    for matrix in [DMat3::ZERO, flat, DMat3::IDENTITY * f64::NAN] {
        let result = s().affine(DAffine3::from_mat3(matrix));
        assert!(matches!(result, Err(ShapeError::Singular { .. })), "{result:?}");
    }
    assert!(s().affine(DAffine3::from_scale(DVec3::splat(1e-9))).is_ok(), "small is not flat");
    for alpha in [-1.0, 1.5, f64::NAN] {
        let results = [s().r_union(s(), alpha), s().r_intersection(s(), alpha), s().r_difference(s(), alpha)];
        for result in results {
            assert!(matches!(result, Err(ShapeError::Alpha { .. })), "{result:?}");
        }
    }
    let zero = [0.0; 3];
    for (counts, found) in [([1, 2, 2], 4), ([9, 2, 2], 36), ([2, 2, 2], 7), ([usize::MAX, 2, 2], 0)] {
        let result = Lattice::new([0.0; 3], [1.0; 3], counts, vec![zero; found]);
        assert!(matches!(result, Err(ShapeError::Lattice { .. })), "{result:?}");
    }
    let result = Lattice::new([0.0; 3], [1.0, 0.0, 1.0], [2; 3], vec![zero; 8]);
    assert!(matches!(result, Err(ShapeError::Empty { .. })));
    assert_eq!(
        ellipsoid([0.0; 3]).unwrap_err().to_string(),
        "the half axis is 0: give a finite number above 0"
    );
}

/// The same with parameters: nothing panics, nothing that is drawn is NaN.
#[test]
fn parameters() {
    let p = || Expr::parameter("p", 1.0);
    let s = || box_([-0.6; 3], [0.5; 3]);
    let all = [
        ellipsoid((p(), 1.0, 1.0)).unwrap(),
        superellipsoid((p(), 1.0, 1.0), 1.0, p()).unwrap(),
        supertorus([0.3; 3], p(), p(), 1.0).unwrap(),
        s().exponential_union(sphere(0.7), p()),
        half_space((p(), 0.0, 0.0), 0.1).unwrap(),
        cone(0.5, p()).unwrap(),
        capsule([0.0; 3], (p(), 0.0, 0.0), 0.5),
        cylinder(p(), p()),
        s().scale(p()).unwrap(),
        s().scale_axes((1.0, p(), 1.0)).unwrap(),
        s().rotate((p(), 0.0, 0.0), p()).unwrap(),
        s().mirror((p(), 0.0, 0.0), 0.0).unwrap(),
        s().twist(0.2, 0.0, p()).unwrap(),
        s().bend(0.2, 0.0, p()).unwrap(),
        s().taper(1.0, p(), 0.0, p()).unwrap(),
        s().repeat(Axis::Z, p(), None).unwrap(),
        s().smooth_union(sphere(0.7), p()),
        s().r_union(sphere(0.7), p()).unwrap(),
        s().free_form(&Lattice::new([0.0; 3], (p(), 1.0, 1.0), [2; 3], vec![[0.1; 3]; 8]).unwrap()),
    ];
    let grid = Grid::from_bounds([17; 3], Vec3::splat(-1.1), Vec3::splat(1.2)).unwrap();
    let points = points(300, 1.5, 61);
    for (i, expr) in all.iter().enumerate() {
        let mut field = field(expr);
        assert!(field.set("p", 1e300).is_err(), "no 32-bit number");
        for value in [0.0, -1.0, 1e-300, 1e38, -1e38, 2.0] {
            field.set("p", value).unwrap();
            values(&field, &points);
            let (mesh, _) =
                extract_on_cpu(&Source::Field(&field, grid), &Options::new(0.0), &|_| {}).unwrap();
            let finite = mesh.vertices.iter().all(|v| v.at().is_finite() && Vec3::from(v.normal).is_finite());
            assert!(finite, "expression {i} with {value}");
        }
    }
}
