//! `isoforge mesh-tools`.

use super::program::{done, files, folder, isoforge};
use serde_json::Value;
use std::path::Path;

fn check(here: &Path, file: &str) -> Value {
    serde_json::from_str(&done(here, &["check", file, "--json"]).out).expect("JSON")
}

/// A gyroid's mesh and a small ball's in one OFF file, as a soup of triangles with corners of their own.
fn soup(here: &Path) {
    let mut vertices = String::new();
    let mut faces = String::new();
    let mut count = 0;
    for (source, bounds) in
        [("torus", "-1.5,-1.5,-1.5,1.5,1.5,1.5"), ("x^2 + (y - 2)^2 + z^2 - 0.05", "-1,1,-1,1,3,1")]
    {
        done(
            here,
            &["extract", source, "-n", "24", "--bounds", bounds, "-o", "part.off", "--backend", "cpu", "-q"],
        );
        let text = std::fs::read_to_string(here.join("part.off")).expect("a file");
        let lines: Vec<&str> = text.lines().skip(2).collect();
        for face in lines.iter().filter(|line| line.starts_with("3 ")) {
            for v in face.split(' ').skip(1) {
                vertices += &format!("{}\n", lines[v.parse::<usize>().expect("a number")]);
            }
            faces += &format!("3 {} {} {}\n", count, count + 1, count + 2);
            count += 3;
        }
    }
    std::fs::write(here.join("soup.off"), format!("OFF\n{count} {} 0\n{vertices}{faces}", count / 3))
        .expect("a file");
    std::fs::remove_file(here.join("part.off")).expect("it is there");
}

#[test]
fn small_faces_are_told() {
    let here = folder();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\nl 1 3\n";
    std::fs::write(here.path().join("a.obj"), text).expect("a file");
    let said = "isoforge: a.obj: 1 face of fewer than three corners left out\n";
    for args in [&["check", "a.obj", "--json"][..], &["mesh-tools", "a.obj"]] {
        let run = done(here.path(), args);
        assert!(run.err.starts_with(said), "{}", run.err);
    }
    assert_eq!(done(here.path(), &["mesh-tools", "a.obj", "-q"]).err, "");
    std::fs::write(here.path().join("a.obj"), format!("{text}f 2\n")).expect("a file");
    assert!(done(here.path(), &["check", "a.obj"]).err.contains("a.obj: 2 faces of"));
}

#[test]
fn a_soup_becomes_one_smooth_closed_mesh() {
    let here = folder();
    soup(here.path());
    let run = done(
        here.path(),
        &[
            "mesh-tools",
            "soup.off",
            "--weld",
            "0",
            "--remove-below",
            "area=0.2",
            "--smooth",
            "5",
            "-o",
            "out.ply",
            "--stats",
            "stats.json",
            "--png",
            "out.png",
            "--size",
            "160x120",
        ],
    );
    for told in [
        "read: ",
        "open along",
        "--weld 0: ",
        "2 components, closed",
        "--remove-below: ",
        "1 component, closed",
        "the volume went",
    ] {
        assert!(run.err.contains(told), "`{told}` is not in {}", run.err);
    }
    let stats: Value =
        serde_json::from_str(&std::fs::read_to_string(here.path().join("stats.json")).expect("a file"))
            .expect("JSON");
    let steps = stats["steps"].as_array().expect("steps");
    let names: Vec<&str> = steps.iter().map(|step| step["step"].as_str().expect("a name")).collect();
    assert_eq!(names, ["read", "weld", "remove_below", "smooth"]);
    let count = |i: usize, key: &str| steps[i]["check"][key].as_u64().expect("a number");
    assert_eq!(count(0, "components"), count(0, "triangles"));
    assert_eq!((count(1, "components"), count(1, "boundary_edges"), count(2, "components")), (2, 0, 1));
    assert!(steps.iter().skip(1).all(|step| step["seconds"].as_f64().is_some()));
    let report = check(here.path(), "out.ply");
    assert_eq!((&report["genus"], &report["triangles"]), (&1.into(), &steps[3]["check"]["triangles"]));
    let image = image::open(here.path().join("out.png")).expect("a picture").to_rgb8();
    assert_ne!(image.get_pixel(80, 75), image.get_pixel(0, 0));
    assert_eq!(done(here.path(), &["mesh-tools", "soup.off", "--weld", "0", "-q"]).err, "");
}

#[test]
fn files_without_normals_get_some() {
    let here = folder();
    done(here.path(), &["extract", "sphere", "-n", "12", "-o", "a.off", "--backend", "cpu"]);
    done(here.path(), &["mesh-tools", "a.off", "-o", "a.obj"]);
    let text = std::fs::read_to_string(here.path().join("a.obj")).expect("a file");
    assert!(text.lines().any(|line| line.starts_with("vn ")) && !text.contains("vn 0 0 0\n"));
}

#[test]
fn broken_corners_are_left_out_and_told() {
    let here = folder();
    std::fs::write(
        here.path().join("a.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 1 1 inf\nf 1 2 3\nf 1 2 4\nf 2 5 3\n",
    )
    .expect("a file");
    assert_eq!(check(here.path(), "a.obj")["non_finite_vertices"], 2);
    let run = done(here.path(), &["mesh-tools", "a.obj", "-o", "b.off"]);
    assert!(
        run.err.contains("2 NaN or infinite positions")
            && run.err.contains("2 triangles and 2 vertices left out"),
        "{}",
        run.err
    );
    let report = check(here.path(), "b.off");
    assert_eq!((&report["triangles"], &report["vertices"]), (&1.into(), &3.into()));
}

#[test]
fn check_and_tools_say_alike_what_is_wrong_with_a_file() {
    let here = folder();
    let off = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    std::fs::write(here.path().join("far.off"), format!("{off}3 0 1 2\n3 0 2 4\n")).expect("a file");
    std::fs::write(here.path().join("odd.off"), format!("{off}4 0 1 2 3\n2 0 1\n")).expect("a file");
    for command in ["check", "mesh-tools"] {
        let run = isoforge(here.path(), &[command, "far.off"]);
        assert_eq!(run.code, Some(1));
        assert!(run.err.contains("far.off, line 8: face 1 names vertex 4, but there are 4; "), "{}", run.err);
        // A quad is two triangles, a line none.
        let run = done(here.path(), &[command, "odd.off"]);
        let told = if command == "check" {
            "triangles               2\n"
        } else {
            "4 vertices, 2 triangles, 1 component"
        };
        assert!((run.out + &run.err).contains(told));
    }
}

#[test]
fn what_cannot_work_is_refused() {
    let here = folder();
    std::fs::write(here.path().join("a.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").expect("a file");
    std::fs::write(here.path().join("empty.ply"), "").expect("a file");
    let before = files(here.path());
    let refused = |args: &[&str], code: i32, words: &[&str]| {
        let run = isoforge(here.path(), &[&["mesh-tools"], args].concat());
        assert_eq!(run.code, Some(code), "{args:?}: {}", run.err);
        for word in words {
            assert!(run.err.contains(word), "{args:?}: `{word}` is not in {}", run.err);
        }
        assert_eq!(files(here.path()), before, "{args:?}");
    };
    refused(&["missing.off"], 1, &["missing.off"]);
    refused(&["a.xyz"], 2, &["a.xyz", ".ply"]);
    refused(&["empty.ply"], 1, &["empty.ply", "the file is empty"]);
    refused(&["a.off", "--weld", "-1"], 2, &["--weld", "zero or more"]);
    refused(&["a.off", "--weld", "nan"], 2, &["--weld", "zero or more"]);
    refused(&["a.off", "--remove-below", "area=2"], 2, &["--remove-below", "from 0 to 1"]);
    refused(&["a.off", "--remove-below", "many"], 2, &["--remove-below", "area=PART"]);
    refused(&["a.off", "--smooth", "0"], 2, &["--smooth"]);
    refused(&["a.off", "-o", "b.xyz"], 2, &["b.xyz", ".ply"]);
    refused(&["a.off", "-o", "nowhere/b.ply"], 1, &["nowhere"]);
    refused(&["a.off", "--png", "b.jpg"], 1, &["b.jpg", ".png"]);
    refused(&["a.off", "--strips"], 2, &["--output"]);
    refused(&["a.off", "--simplify-error", "inf"], 2, &["--simplify-error", "finite"]);
    #[cfg(not(feature = "meshopt"))]
    for flag in ["--optimize", "--strips"] {
        refused(&["a.off", flag, "-o", "b.glb"], 2, &[flag, "--features meshopt", "C++"]);
    }
    #[cfg(feature = "meshopt")]
    refused(&["a.off", "--strips", "-o", "b.ply"], 2, &["b.ply", ".glb"]);
}

fn torus(here: &Path) {
    done(here, &["extract", "torus", "-n", "48", "-o", "a.ply", "--backend", "cpu", "--no-degenerate"]);
}

#[test]
fn simplify_keeps_to_its_budget() {
    let here = folder();
    torus(here.path());
    let whole = check(here.path(), "a.ply");
    let run = done(here.path(), &["mesh-tools", "a.ply", "--simplify", "2000", "-o", "b.ply"]);
    for told in ["--simplify: ", "the surface moved by"] {
        assert!(run.err.contains(told), "`{told}` is not in {}", run.err);
    }
    let simple = check(here.path(), "b.ply");
    let triangles = simple["triangles"].as_u64().expect("a number");
    assert!((1990..=2000).contains(&triangles) && simple["genus"] == 1 && simple["boundary_edges"] == 0);
    let volume = |report: &Value| report["volume"].as_f64().expect("a number");
    assert!((volume(&simple) / volume(&whole) - 1.0).abs() < 0.01);
    let run = done(here.path(), &["mesh-tools", "a.ply", "--simplify-error", "0.01", "-o", "c.ply"]);
    assert!(check(here.path(), "c.ply")["triangles"].as_u64() < Some(3000), "{}", run.err);
    // A torus has a handle, and no fewer than 14 triangles.
    let run = done(here.path(), &["mesh-tools", "a.ply", "--simplify", "4", "-o", "d.ply"]);
    assert!(run.err.contains("triangles are left"), "{}", run.err);
    assert_eq!(check(here.path(), "d.ply")["genus"], 1);
}

#[cfg(feature = "meshopt")]
#[test]
fn meshopt_orders_and_strips() {
    let here = folder();
    torus(here.path());
    let run =
        done(here.path(), &["mesh-tools", "a.ply", "--optimize", "--strips", "-o", "b.glb", "--stats", "-"]);
    for told in ["--optimize: ", "vertices fetched a triangle", "indices in the strip"] {
        assert!(run.err.contains(told), "`{told}` is not in {}", run.err);
    }
    let stats: Value = serde_json::from_str(&run.out).expect("JSON");
    assert_eq!(stats["steps"][2]["step"], "strips");
    let ordered = check(here.path(), "b.glb");
    assert_eq!(ordered["triangles"], check(here.path(), "a.ply")["triangles"]);
    assert!(ordered["genus"] == 1 && ordered["boundary_edges"] == 0);
}
