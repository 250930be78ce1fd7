//! Scene files as sources.

use super::program::{done, folder, isoforge};
use std::path::Path;

const BALL: &str = "camera = { azimuth = 100, elevation = -40, fov = 20 }\n\
                    [parameters]\nr = 1\n[nodes.ball]\nkind = 'sphere'\nradius = 'r'\ntranslate = [5, 0, 0]\n\
                    [nodes.cut]\nkind = 'difference'\nof = ['ball', { kind = 'sphere', radius = 4.5 }]\n";

fn write(folder: &Path, text: &str) {
    std::fs::write(folder.join("s.toml"), text).expect("a file");
}

fn extract(folder: &Path, more: &[&str]) -> String {
    let args =
        [&["extract", "s.toml", "--backend", "cpu", "-n", "40", "-o", "m.ply", "--png", "m.png"], more]
            .concat();
    done(folder, &args).err
}

/// The corners of the mesh.
fn bounds(folder: &Path) -> [[f32; 2]; 3] {
    let mesh = isoforge::mesh::read::read(&folder.join("m.ply")).expect("a mesh").mesh;
    let (low, high) = mesh.bounds().expect("vertices");
    [0, 1, 2].map(|k| [low[k], high[k]])
}

#[test]
fn a_scene_finds_its_bounds_and_takes_parameters() {
    let here = folder();
    write(here.path(), BALL);
    let said = extract(here.path(), &[]);
    assert!(said.contains("the scene names no bounds; its surface lies within"), "{said}");
    let [x, y, _] = bounds(here.path());
    assert!((x[1] - 6.0).abs() < 0.05 && (y[1] - 1.0).abs() < 0.05, "{x:?} {y:?}");
    extract(here.path(), &["--param", "r=2"]);
    let [x, y, _] = bounds(here.path());
    assert!((x[1] - 7.0).abs() < 0.1 && (y[1] - 2.0).abs() < 0.1, "{x:?} {y:?}");
    // The user's words go before the scene's.
    extract(here.path(), &["-I", "0.5", "--bounds", "3,-3,-3,9,3,3"]);
    assert!((bounds(here.path())[0][1] - 6.5).abs() < 0.1);
    let endless = BALL.replace("'sphere'\nradius = 'r'", "'cylinder'\nradius = 'r'");
    write(here.path(), &endless.replace("translate = [5, 0, 0]", ""));
    let said = extract(here.path(), &[]);
    assert!(said.contains("no bounds, and none are found"), "{said}");
}

#[test]
fn the_scene_has_the_camera_unless_the_user_does() {
    let here = folder();
    let picture = |more: &[&str]| {
        extract(here.path(), more);
        std::fs::read(here.path().join("m.png")).expect("a picture")
    };
    write(here.path(), BALL);
    let own = picture(&[]);
    let other = picture(&["--azimuth", "10"]);
    write(here.path(), BALL.split_once('\n').expect("lines").1);
    assert_eq!(own, picture(&["--azimuth", "100", "--elevation", "-40", "--fov", "20"]));
    assert_eq!(other, picture(&["--azimuth", "10", "--elevation", "-40", "--fov", "20"]));
    assert_ne!(own, other);
}

#[test]
fn bad_input() {
    let here = folder();
    let refused = |text: &str, more: &[&str], code: i32, words: &str| {
        write(here.path(), text);
        let run = isoforge(here.path(), &[&["extract", "s.toml", "-o", "m.ply"], more].concat());
        assert_eq!(run.code, Some(code), "{}", run.err);
        assert!(run.err.contains(words), "{}", run.err);
        assert!(!here.path().join("m.ply").exists());
    };
    refused(BALL, &["--param", "q=1"], 2, "--param q: there is no parameter `q`; there are r");
    refused(BALL, &["--param", "r=nan"], 2, "give a finite 32-bit number");
    refused(BALL, &["--dims", "2,2,2", "--type", "u8"], 2, "--dims");
    refused(BALL, &["--kernel", "soft"], 2, "--kernel is for points");
    refused(BALL, &["-n", "0"], 2, "-n");
    refused(
        &BALL.replace("'ball',", "'bell',"),
        &[],
        1,
        "s.toml:10:7: nodes.cut.of[0]: there is no node `bell` (did you mean `ball`?)",
    );
    refused(&BALL.replace("'sphere'\n", "\"sphere\n"), &[], 1, "s.toml:5:");
    let density =
        BALL.replace("'sphere'\nradius = 'r'", "'blob'\nradius = 'r'").replace("of = ['ball', ", "of = [");
    let density = format!("surface = 'ball'\n{density}");
    refused(&density, &[], 2, "its surface is a density: say at which value, with -I VALUE");
    refused(BALL, &["--param", "r=1e300"], 2, "give a finite 32-bit number");
    write(here.path(), &density);
    extract(here.path(), &["-I", "0.5"]);
    let [x, ..] = bounds(here.path());
    assert!((x[1] - 5.5).abs() < 0.05, "{x:?}");
    std::fs::remove_file(here.path().join("m.ply")).expect("it is there");
    let run = isoforge(here.path(), &["extract", "none.toml"]);
    assert!(run.code == Some(1) && run.err.contains("none.toml cannot be read"), "{}", run.err);
}

/// The box that makes no grid is called by the name of who gave it.
#[test]
fn a_box_that_is_no_grid() {
    let here = folder();
    write(here.path(), &format!("bounds = [[16777215, 0, 0], [16777217, 1, 1]]\n{BALL}"));
    let args = ["extract", "s.toml", "-o", "m.ply"];
    for (more, code, words) in [
        (&[][..], 1, "isoforge: bounds: the grid is so far"),
        (&["--bounds", "16777215,0,0,16777217,1,1"], 2, "isoforge: --bounds: the grid is so far"),
    ] {
        let run = isoforge(here.path(), &[&args, more].concat());
        assert!(run.code == Some(code) && run.err.starts_with(words), "{:?} {}", run.code, run.err);
    }
}
