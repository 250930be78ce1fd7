//! Each named surface against its formula in `f64`.

use crate::{check, values};
use isoforge::field::named::{self, Named};
use std::f64::consts::{SQRT_2, TAU};

/// The formula of a named field, of a point and the parameters in their order.
fn reference(name: &str, [x, y, z]: [f64; 3], p: &[f64]) -> f64 {
    let [px, py, pz] = [x, y, z].map(|c| TAU * c / p.first().copied().unwrap_or(1.0));
    let sheet = |v: f64| if p[1] == 0.0 { v } else { v.abs() - p[1] / 2.0 };
    let over = |c: f64, i: usize| (c / p[i]).powi(2);
    let raised = |c: f64, a: f64, e: f64| (c / a).abs().powf(2.0 / e);
    match name {
        "sphere" => (x * x + y * y + z * z).sqrt(),
        "octahedron" => x.abs() + y.abs() + z.abs(),
        "cube" => x.abs().max(y.abs()).max(z.abs()),
        "torus" => {
            let (major, minor) = (p[0] * p[0], p[1] * p[1]);
            (x * x + y * y + z * z + major - minor).powi(2) - 4.0 * major * (x * x + y * y)
        }
        "gyroid" => sheet(px.sin() * py.cos() + py.sin() * pz.cos() + pz.sin() * px.cos()),
        "schwarz_p" => sheet(px.cos() + py.cos() + pz.cos()),
        "schwarz_d" => sheet(
            px.sin() * py.sin() * pz.sin()
                + px.sin() * py.cos() * pz.cos()
                + px.cos() * py.sin() * pz.cos()
                + px.cos() * py.cos() * pz.sin(),
        ),
        "neovius" => sheet(3.0 * (px.cos() + py.cos() + pz.cos()) + 4.0 * px.cos() * py.cos() * pz.cos()),
        "quadric" => {
            let terms = [x * x, y * y, z * z, 2.0 * x * y, 2.0 * x * z, 2.0 * y * z, x, y, z, 1.0];
            terms.iter().zip(p).map(|(t, p)| t * p).sum()
        }
        "ellipsoid" => over(x, 0) + over(y, 1) + over(z, 2),
        "hyperboloid_one_sheet" | "hyperboloid_two_sheets" => over(x, 0) + over(y, 1) - over(z, 2),
        "hyperbolic_paraboloid" => over(x, 0) - over(y, 1) - z,
        "elliptic_paraboloid" => over(x, 0) + over(y, 1) - z,
        "elliptic_cone" => over(x, 0) + over(y, 1) - over(z, 2),
        "elliptic_cylinder" => over(x, 0) + over(y, 1),
        "pair_of_planes" => over(x, 0) - over(y, 1),
        "superellipsoid" => {
            let s = raised(x, p[0], p[4]) + raised(y, p[1], p[4]);
            (s.powf(p[4] / p[3]) + raised(z, p[2], p[3])).powf(p[3] / 2.0)
        }
        "superhyperboloid" => {
            let s = raised(x, p[0], p[4]) + raised(y, p[1], p[4]);
            s.powf(p[4] / 2.0) - (1.0 + raised(z, p[2], p[3])).powf(p[3] / 2.0)
        }
        "supertorus" => {
            let s = raised(x, p[0], p[5]) + raised(y, p[1], p[5]);
            let across = raised(s.powf(p[5] / 2.0) - p[3], 1.0, p[4]);
            (across + raised(z, p[2], p[4])).powf(p[4] / 2.0)
        }
        "steiner" => (x * y).powi(2) + (x * z).powi(2) + (y * z).powi(2) + x * y * z,
        "boy" => {
            let (xx, yy, zz) = (x * x, y * y, z * z);
            let u = 1.0 - z;
            64.0 * u.powi(3) * z.powi(3) - 48.0 * u * u * zz * (3.0 * xx + 3.0 * yy + 2.0 * zz)
                + 12.0
                    * u
                    * z
                    * (27.0 * (xx + yy).powi(2) - 24.0 * zz * (xx + yy)
                        + 36.0 * SQRT_2 * y * z * (yy - 3.0 * xx)
                        + 4.0 * zz * zz)
                + (9.0 * xx + 9.0 * yy - 2.0 * zz)
                    * (-81.0 * (xx + yy).powi(2) - 72.0 * zz * (xx + yy)
                        + 108.0 * SQRT_2 * x * z * (xx - 3.0 * yy)
                        + 4.0 * zz * zz)
        }
        "reducible" => (x + p[0]) * (x * x + y * y + z * z - p[1] * p[1]),
        other => panic!("{other} has no reference: write its formula here"),
    }
}

/// Goes red when any factor of any formula is changed, and for a named field that has no formula above.
#[test]
fn with_default_and_other_parameters() {
    for definition in named::ALL {
        let field = Named::new(definition.name).unwrap();
        let defaults: Vec<f64> = definition.parameters.iter().map(|p| p.default).collect();
        let half = definition.half_edge;
        check(definition.name, &field, half, &|p| reference(definition.name, p, &defaults));
        if defaults.is_empty() {
            continue;
        }
        // Each parameter another, and none the same as another.
        let others: Vec<f64> =
            defaults.iter().enumerate().map(|(i, d)| d * (0.8 + 0.1 * i as f64) + 0.15).collect();
        let field = definition
            .parameters
            .iter()
            .zip(&others)
            .fold(field, |field, (p, value)| field.with(p.name, *value).unwrap());
        check(definition.name, &field, half, &|p| reference(definition.name, p, &others));
    }
}

#[test]
fn a_torus_without_major_radius_is_a_sphere() {
    let torus = Named::new("torus").unwrap().with("R", 0.0).unwrap().with("r", 0.6).unwrap();
    // Squared, as its formula is: 0 on the sphere, above 0 elsewhere.
    check("torus R=0", &torus, 1.5, &|[x, y, z]| (x * x + y * y + z * z - 0.36).powi(2));
    let on_sphere = values(&torus, &[[0.6, 0.0, 0.0], [0.36, 0.48, 0.0], [0.0, 0.0, -0.6]]);
    assert!(on_sphere.iter().all(|v| v.abs() < 1e-12), "{on_sphere:?}");
}

/// The general quadric with the numbers of a named one is that.
#[test]
fn the_quadric_is_each_of_its_kinds() {
    let ellipsoid = Named::new("ellipsoid").unwrap();
    let factors = [("a", 1.0 / 1.69), ("b", 1.0), ("c", 1.0 / 0.49), ("d", 0.0), ("e", 0.0), ("f", 0.0)];
    let quadric = factors
        .iter()
        .fold(Named::new("quadric").unwrap(), |field, (name, value)| field.with(name, *value).unwrap());
    let points = crate::points(1000, 1.5, 71);
    for (a, b) in values(&ellipsoid, &points).iter().zip(values(&quadric, &points)) {
        assert!((a - 1.0 - b).abs() < 1e-6, "{a}, not {b}");
    }
    assert!(quadric.with("a", f64::NAN).unwrap_err().to_string().ends_with("it takes a finite number"));
}

/// Exponents of 1 give the ellipsoid, whose field is the root of the quadric's.
#[test]
fn a_superellipsoid_of_exponents_1_is_the_ellipsoid() {
    let set = |field: Named, values: &[(&str, f64)]| {
        values.iter().fold(field, |field, (name, value)| field.with(name, *value).unwrap())
    };
    let ellipsoid = set(Named::new("ellipsoid").unwrap(), &[("a", 0.9), ("b", 0.7), ("c", 1.2)]);
    let numbers = [("a1", 0.9), ("a2", 0.7), ("a3", 1.2), ("e1", 1.0), ("e2", 1.0)];
    let super_one = set(Named::new("superellipsoid").unwrap(), &numbers);
    let points = crate::points(2000, 1.5, 73);
    for (root, square) in values(&super_one, &points).iter().zip(values(&ellipsoid, &points)) {
        assert!((root - square.sqrt()).abs() < 2e-6 * root.max(1.0), "{root}, not {}", square.sqrt());
    }
    for bad in [0.0, -1.0, f64::NAN] {
        assert!(Named::new("supertorus").unwrap().with("e1", bad).is_err());
    }
    // The vertex on the z axis, where the section is 0, has a normal.
    let up = crate::gradients(&super_one, &[[0.0, 0.0, 1.2]])[0];
    assert!(up[0] == 0.0 && up[1] == 0.0 && (up[2] - 1.0 / 1.2).abs() < 1e-5, "{up:?}");
}
