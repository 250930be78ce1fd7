//! Scenes, WGSL and pictures within scenes.

use super::same;
use isoforge::graph::shapes::*;
use isoforge::graph::{x, y, z};
use isoforge::scene::{Fault, OpenOptions, Scene, SceneError};
use std::path::Path;

fn write(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).unwrap();
}

fn open(folder: &Path, name: &str) -> Result<Scene, SceneError> {
    Scene::open(&folder.join(name), &OpenOptions::default())
}

fn fault(result: Result<Scene, SceneError>) -> (String, Fault) {
    let error = result.expect_err("refused");
    let text = error.to_string();
    match error {
        SceneError::At(place) => (text, place.fault),
        other => panic!("{other}"),
    }
}

const WHEEL: &str =
    "[parameters]\nr = 1\nw = 0.5\n[nodes.w]\nkind = 'cylinder'\nradius = 'r'\nheight = 'w'\n";

#[test]
fn parameters_of_imports_stay_apart() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    write(folder.path(), "parts/wheel.toml", WHEEL);
    let car = "[parameters]\nr = 0.5\n\
               [nodes.front]\nkind = 'scene'\nfile = 'parts/wheel.toml'\nparameters = {r = 'r/2'}\n\
               [nodes.back]\nkind = 'scene'\nfile = 'parts/wheel.toml'\ntranslate = [2, 0, 0]\n\
               [nodes.car]\nkind = 'union'\nof = ['front', 'back']\n";
    write(folder.path(), "car.toml", car);
    let scene = open(folder.path(), "car.toml").unwrap();
    same(&scene, &cylinder(0.25, 0.5).union(cylinder(1.0, 0.5).translate([2.0, 0.0, 0.0])));
    let mut field = scene.field();
    let mut names: Vec<String> = field.parameters().map(|(name, _)| name.into()).collect();
    names.sort();
    assert_eq!(names, ["back.r", "back.w", "front.w", "r"]);
    field.set("back.r", 2.0).unwrap();
    let expected = cylinder(0.25, 0.5).union(cylinder(2.0, 0.5).translate([2.0, 0.0, 0.0]));
    let expected = isoforge::graph::GraphField::new(&expected, scene.sense);
    assert_eq!(super::values(&field), super::values(&expected));
}

/// A name with a point in it is not a name within a name.
#[test]
fn names_with_points() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "wheel.toml", WHEEL);
    write(folder.path(), "pair.toml", "[nodes.b]\nkind = 'scene'\nfile = 'wheel.toml'\nparameters = {w = 1}");
    let both = "[nodes.a]\nkind = 'scene'\nfile = 'pair.toml'\n\
                [nodes.'a.b']\nkind = 'scene'\nfile = 'wheel.toml'\nparameters = {w = 2}\n\
                [nodes.u]\nkind = 'union'\nof = ['a', 'a.b']\n";
    write(folder.path(), "both.toml", both);
    let field = open(folder.path(), "both.toml").unwrap().field();
    let mut names: Vec<&str> = field.parameters().map(|(name, _)| name).collect();
    names.sort_unstable();
    assert_eq!(names, ["\"a.b\".r", "a.b.r"]);
}

/// One of a density without an iso value stays a density.
#[test]
fn an_imported_density() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "a.toml", "[nodes.a]\nkind = 'blob'\nradius = 1\n");
    let b = |kind: &str| format!("[nodes.b]\nkind = '{kind}'\nof = {{kind = 'scene', file = 'a.toml'}}\n");
    write(folder.path(), "b.toml", &b("sum"));
    let found = open(folder.path(), "b.toml").unwrap();
    assert_eq!((found.iso, found.sense), (None, isoforge::field::Sense::Above));
    write(folder.path(), "b.toml", &b("union"));
    assert!(matches!(fault(open(folder.path(), "b.toml")), (_, Fault::Density)));
}

/// At 0 and below inside, whatever its own iso and side are.
#[test]
fn an_import_is_a_solid() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "a.toml", "iso = 0.5\ninside = 'above'\n[nodes.a]\nkind = 'sphere'\nradius = 1\n");
    write(folder.path(), "b.toml", "[nodes.b]\nkind = 'scene'\nfile = 'a.toml'\n");
    same(&open(folder.path(), "b.toml").unwrap(), &-(sphere(1.0) - 0.5));
}

#[test]
fn imports_that_cannot_be() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "a.toml", "[nodes.a]\nkind = 'scene'\nfile = 'b.toml'\n");
    write(folder.path(), "b.toml", "[nodes.b]\nkind = 'scene'\nfile = 'a.toml'\n");
    let (text, _) = fault(open(folder.path(), "a.toml"));
    assert!(text.contains("a.toml → b.toml → a.toml") && text.contains("b.toml:3:8: nodes.b.file"), "{text}");

    write(folder.path(), "wheel.toml", WHEEL);
    write(folder.path(), "c.toml", "[nodes.c]\nkind = 'scene'\nfile = 'wheel.toml'\nparameters = {q = 1}\n");
    let (text, fault_) = fault(open(folder.path(), "c.toml"));
    assert!(matches!(fault_, Fault::NoParameter { .. }) && text.contains("it has r, w"), "{text}");

    write(folder.path(), "d.toml", "[nodes.d]\nkind = 'scene'\nfile = 'none.toml'\n");
    let (text, _) = fault(open(folder.path(), "d.toml"));
    assert!(text.contains("d.toml:3:8: nodes.d.file") && text.contains("none.toml cannot be read"), "{text}");

    write(folder.path(), "e.toml", "[nodes.e]\nkind = 'scene'\nfile = 'f.toml'\n");
    write(folder.path(), "f.toml", "[nodes.f]\nkind = 'sphere'\nradius = 0.5.5\n");
    let (text, _) = fault(open(folder.path(), "e.toml"));
    assert!(text.contains("f.toml:3:"), "{text}");

    // Each imports the next; then two of the next, which doubles at each level.
    for i in 0..80 {
        let next = format!("[nodes.n]\nkind = 'scene'\nfile = '{}.toml'\n", i + 1);
        write(folder.path(), &format!("{i}.toml"), &next);
        let two = "{kind = 'scene', file = 'NEXT.toml'}".replace("NEXT", &format!("t{}", i + 1));
        write(
            folder.path(),
            &format!("t{i}.toml"),
            &format!("[nodes.n]\nkind = 'union'\nof = [{two}, {two}]\n"),
        );
    }
    let (text, _) = fault(open(folder.path(), "0.toml"));
    assert!(text.contains("64 deep"), "{text}");
    write(folder.path(), "t40.toml", "[nodes.n]\nkind = 'sphere'\nradius = 1\n");
    let (text, _) = fault(open(folder.path(), "t0.toml"));
    assert!(text.contains("over 1000 scenes"), "{text}");
}

#[test]
fn wgsl_in_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let source = "fn density(p: vec3<f32>) -> f32 { return p.x * p.y - p.z; }";
    write(folder.path(), "f.wgsl", source);
    write(folder.path(), "a.toml", "[nodes.a]\nkind = 'wgsl'\nfile = 'f.wgsl'\n");
    same(&open(folder.path(), "a.toml").unwrap(), &(x() * y() - z()));
    write(folder.path(), "b.toml", &format!("[nodes.a]\nkind = 'wgsl'\ntext = '{source}'\n"));
    same(&open(folder.path(), "b.toml").unwrap(), &(x() * y() - z()));
    let endless = "fn density(p: vec3<f32>) -> f32 { var s = p.x; while s < 9.0 { s += p.y; } return s; }";
    write(folder.path(), "c.toml", &format!("[nodes.a]\nkind = 'wgsl'\ntext = '{endless}'\n"));
    let (text, fault_) = fault(open(folder.path(), "c.toml"));
    assert!(matches!(fault_, Fault::Obstacle(_)) && text.contains("`while` at line 1"), "{text}");
}

/// A picture's rows run from high to low y, black is 0 and white is the height.
#[test]
fn heights_of_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let mut image = image::GrayImage::new(3, 2);
    image.put_pixel(2, 0, image::Luma([255]));
    image.save(folder.path().join("h.png")).unwrap();
    let text = "[nodes.a]\nkind = 'heightfield'\nfile = 'h.png'\nsize = [4, 2]\nheight = 3\n";
    write(folder.path(), "a.toml", text);
    let field = open(folder.path(), "a.toml").unwrap().field();
    let at = |x: f32, y: f32| {
        let mut out = [0.0];
        let points = isoforge::field::Points { x: &[x], y: &[y], z: &[0.0] };
        isoforge::field::Field::values(&field, points, &mut out).unwrap();
        -out[0]
    };
    for (x, y, height) in
        [(2.0, 1.0, 3.0), (2.0, -1.0, 0.0), (-2.0, 1.0, 0.0), (1.0, 1.0, 1.5), (2.0, 0.0, 1.5)]
    {
        assert!((at(x, y) - height).abs() < 1e-6, "{x} {y}: {}", at(x, y));
    }
    let little = OpenOptions { max_bytes: Some(100), ..OpenOptions::default() };
    let (text_, fault_) = fault(Scene::open(&folder.path().join("a.toml"), &little));
    assert!(matches!(fault_, Fault::LargePicture { .. }) && text_.contains("3x2"), "{text_}");
    assert!(text_.contains("`OpenOptions::max_bytes`") && !text_.contains("--"), "{text_}");
    #[cfg(unix)]
    {
        let made = std::process::Command::new("mkfifo").arg(folder.path().join("pipe.png")).status();
        assert!(made.unwrap().success());
        write(folder.path(), "c.toml", &text.replace("h.png", "pipe.png"));
        let (text, _) = fault(open(folder.path(), "c.toml"));
        assert!(text.contains("pipe.png cannot be used: it is no file"), "{text}");
    }
    write(folder.path(), "b.toml", &text.replace("h.png", "none.png"));
    let (text, _) = fault(open(folder.path(), "b.toml"));
    assert!(text.contains("none.png cannot be used"), "{text}");
}

#[test]
fn memory_is_bounded() {
    let text = "[nodes.a]\nkind = 'volume'\niso = 10\nfile = '../../tests/data/brain_24.nii.gz'\n";
    let options = OpenOptions { max_bytes: Some(1000), ..OpenOptions::default() };
    let (text, _) = fault(Scene::parse(text, Path::new("examples/scenes/test.toml"), &options));
    assert!(text.contains("1000") && text.contains("nodes.a"), "{text}");
    // Flags are the program's.
    assert!(text.contains("`OpenOptions::max_bytes`") && !text.contains("--"), "{text}");
}
