//! Numbers of the scene as a whole: cells, iso, bounds, camera, refine, which may be formulas of parameters.

use isoforge::scene::{OpenOptions, Scene};
use std::path::Path;

const TEXT: &str = "cells = ['n', 20, 'n/2']\niso = 'level'\nbounds = [[-1, -1, '-h'], [1, 1, 'h']]\n\
    refine = { flatness = 'flatness', epsilon = 1e-4, step = '2*h', depth = 'n/10' }\ncamera = { fov = 'n' }\n\
    [parameters]\nn = 40\nlevel = 0.25\nh = 1.5\nflatness = 0.95\nr = 1\n\
    [nodes.ball]\nkind = 'sphere'\nradius = 'r'";

fn with(parameters: &[(&str, f64)]) -> Scene {
    let parameters = parameters.iter().map(|(name, value)| ((*name).to_string(), *value)).collect();
    let options = OpenOptions { parameters, ..OpenOptions::default() };
    Scene::parse(TEXT, Path::new("test.toml"), &options).unwrap_or_else(|error| panic!("{error}"))
}

/// Goes red when the values given at opening are passed over.
#[test]
fn settings_follow_parameters() {
    let scene = with(&[]);
    assert_eq!((scene.cells, scene.iso), (Some([40, 20, 20]), Some(0.25)));
    let refine = scene.refine;
    assert_eq!((refine.flatness, refine.epsilon), (Some(0.95), Some(1e-4)));
    assert_eq!((refine.step, refine.depth, scene.camera.fov), (Some(3.0), Some(4), Some(40.0)));

    let scene = with(&[("n", 60.0), ("h", 2.0), ("r", 3.0), ("level", -1.0), ("nowhere", 1.0)]);
    assert_eq!((scene.cells, scene.iso), (Some([60, 20, 30]), Some(-1.0)));
    assert_eq!(scene.bounds.map(|[low, high]| (low.z, high.z)), Some((-2.0, 2.0)));
    assert_eq!(scene.refine.depth, Some(6));
    // The field's own parameters have those values, too, and stay parameters.
    let mut field = scene.field();
    assert_eq!(field.parameters().collect::<Vec<_>>(), [("r", 3.0)]);
    field.set("r", 1.0).unwrap();
    // What is no number keeps the file's.
    assert_eq!(with(&[("n", f64::NAN)]).cells, Some([40, 20, 20]));
}

/// The scenes after the 2003 module say all of its parameters by name.
#[test]
fn the_module_of_2003() {
    for name in ["kugeldiff", "metaflight", "kugelzylinder"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
        let open = |parameters: &[(&str, f64)]| {
            let parameters = parameters.iter().map(|(name, value)| ((*name).to_string(), *value)).collect();
            let options = OpenOptions { parameters, ..OpenOptions::default() };
            Scene::open(&folder.join(format!("{name}.toml")), &options).unwrap()
        };
        let plain = open(&[]);
        let all = [("samples", 40.0), ("iso", 0.125), ("flatness", 0.5), ("epsilon", 0.25), ("step", 0.75)];
        let changed = open(&all);
        assert!(all.iter().all(|(name, _)| plain.parameters.iter().any(|p| p == name)), "{name}");
        assert_eq!(changed.cells.unwrap()[0], 40);
        assert_eq!(changed.iso, Some(0.125));
        let refine = changed.refine;
        assert_eq!((refine.flatness, refine.epsilon, refine.step), (Some(0.5), Some(0.25), Some(0.75)));
        assert!(plain.refine.flatness > Some(0.5) && plain.refine.depth > Some(1), "{name}");
    }
}

/// Numbers that are known once the file is read are formulas of parameters, too: each was refused as a text once.
#[test]
fn numbers_of_lists_and_files_follow_parameters() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("p.xyz"), "2\n\nC 0 0 0\nC 1 0 0\n").unwrap();
    let picture = image::GrayImage::from_fn(4, 3, |x, y| image::Luma([(40 * x + 20 * y) as u8]));
    picture.save(folder.path().join("p.png")).unwrap();
    let values = |keys: &str, k: f64| {
        let text = format!("[parameters]\nk = 7\n[nodes.a]\n{keys}");
        let options = OpenOptions { parameters: vec![("k".into(), k)], ..OpenOptions::default() };
        let scene = Scene::parse(&text, &folder.path().join("test.toml"), &options);
        super::values(&scene.unwrap_or_else(|error| panic!("{error}")).field())
    };
    for (keys, number) in [
        ("kind = 'blobs'\ncomponents = [{ at = [0, 0, 0], radius = N, weight = N }]", 0.5),
        (
            "kind = 'blobs'\ncomponents = [{ at = [0, 0, 0], rotate = { axis = [1, 2, 3], turns = N }, scale = [1, 2, 1] }]",
            0.125,
        ),
        ("kind = 'points'\nfile = 'p.xyz'\niso = N", 0.25),
        ("kind = 'points'\nfile = 'p.xyz'\nsupport = N\nradius = N", 1.5),
        ("kind = 'noise'\noctaves = 3\ngain = N", 0.75),
        ("kind = 'sphere'\nradius = 1\naffine = [[N, 0, 0, N], [0, 1, 0, 0], [0, 0, 1, 0]]", 0.5),
        ("kind = 'heightfield'\nfile = 'p.png'\nheight = 1\nsize = [N, 2]", 3.0),
    ] {
        let [formula, plain] =
            ["'2*k/2'".to_string(), format!("{number:?}")].map(|n| values(&keys.replace('N', &n), number));
        assert!(formula == plain, "{keys}");
        assert!(plain.iter().any(|v| *v != plain[0]), "{keys}: a constant field tells nothing");
    }
}
