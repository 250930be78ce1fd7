//! `isoforge extract`.

use super::program::{cpu_alone, done, files, folder, isoforge, volume};
use serde_json::Value;

#[test]
fn writes_every_format_and_a_picture_on_both_backends() {
    let here = folder();
    for backend in ["cpu", "gpu"].into_iter().take(if cpu_alone() { 1 } else { 2 }) {
        for format in ["off", "obj", "ply", "stl", "glb"] {
            let (file, picture) = (format!("{backend}.{format}"), format!("{backend}.png"));
            done(
                here.path(),
                &[
                    "extract",
                    "torus",
                    "-L",
                    "1.5",
                    "-n",
                    "24",
                    "-I",
                    "0",
                    "-o",
                    &file,
                    "--png",
                    &picture,
                    "--size",
                    "160x120",
                    "--backend",
                    backend,
                ],
            );
            let check = done(here.path(), &["check", &file, "--json"]);
            let report: Value = serde_json::from_str(&check.out).expect("one JSON object");
            assert_eq!(report["boundary_edges"], 0, "{file}");
            assert_eq!(report["genus"], 1, "{file}");
            let image = image::open(here.path().join(&picture)).expect("a picture").to_rgb8();
            assert_eq!(image.dimensions(), (160, 120));
            assert_ne!(image.get_pixel(80, 75), image.get_pixel(0, 0), "something is drawn");
        }
    }
    if !cpu_alone() {
        let bytes = |name| std::fs::read(here.path().join(name)).expect("a file");
        assert!(bytes("cpu.ply") == bytes("gpu.ply"), "both backends give the same file");
    }
}

#[test]
fn a_formula_is_a_field() {
    let here = folder();
    let formula = "sqrt(x^2 + y^2 +\n z^2) - r";
    done(
        here.path(),
        &["extract", formula, "--param", "r=0.8", "-n", "24", "-o", "a.ply", "--backend", "cpu"],
    );
    done(here.path(), &["extract", "sphere", "-I", "0.8", "-n", "24", "-o", "b.ply", "--backend", "cpu"]);
    let report = |file| {
        let check = done(here.path(), &["check", file, "--json"]);
        serde_json::from_str::<Value>(&check.out).expect("one JSON object")
    };
    assert_eq!(report("a.ply")["triangles"], report("b.ply")["triangles"]);
    assert_eq!(report("a.ply")["boundary_edges"], 0);
    if !cpu_alone() {
        let run = done(here.path(), &["compare", "x*y + sin(4*z)/2", "-n", "16"]);
        assert!(run.out.contains("sin(4*z)/2, iso 0"), "{}", run.out);
    }
}

/// The layout is the user's word, whatever the file's name ends in.
#[test]
fn raw_values_in_a_file_of_any_ending() {
    let here = folder();
    let samples: Vec<u8> = (0..64_u8).map(|i| i * 3).collect();
    std::fs::write(here.path().join("a.raw"), &samples).expect("a file");
    std::fs::write(here.path().join("a.map"), [&[9; 16], &samples[..]].concat()).expect("a file");
    let layout = ["-I", "50", "--dims", "4,4,4", "--type", "u8", "--backend", "cpu"];
    done(here.path(), &[&["extract", "a.raw", "-o", "raw.ply"], &layout[..]].concat());
    let map = ["extract", "a.map", "--skip-bytes", "16", "-o", "map.ply"];
    done(here.path(), &[&map[..], &layout[..]].concat());
    let bytes = |name| std::fs::read(here.path().join(name)).expect("a file");
    assert!(bytes("raw.ply") == bytes("map.ply"));
    // As the second source, too, and in a scene.
    let by = [
        "extract",
        "4*x - 1",
        "--bounds",
        "0,0,0,3,3,3",
        "-n",
        "4",
        "--color-by",
        "a.map",
        "--skip-bytes",
        "16",
    ];
    done(here.path(), &[&by[..], &["-o", "b.ply"], &layout[2..]].concat());
    let scene = "[nodes.n]\nkind = 'volume'\nfile = 'a.map'\ndims = [4, 4, 4]\ntype = 'u8'\nskip_bytes = 16\niso = 50\n";
    std::fs::write(here.path().join("a.toml"), scene).expect("a file");
    let run = done(here.path(), &["extract", "a.toml", "-n", "4", "-o", "c.ply", "--backend", "cpu"]);
    assert!(!run.err.contains("empty"), "{}", run.err);
}

/// Of a volume that says its spacing (1, here), the user's word counts more.
#[test]
fn spacing_of_any_volume() {
    let here = folder();
    let volume = volume();
    let extract = ["extract", volume.to_str().expect("UTF-8"), "-I", "40", "--backend", "cpu", "-o", "a.ply"];
    let depth = |more: &[&str]| {
        done(here.path(), &[&extract[..], more].concat());
        let report: Value =
            serde_json::from_str(&done(here.path(), &["check", "a.ply", "--json"]).out).expect("JSON");
        let z = |corner: usize| report["bounds"][corner][2].as_f64().expect("a number");
        z(1) - z(0)
    };
    assert!((depth(&["--spacing", "1,1,2.5"]) / depth(&[]) - 2.5).abs() < 1e-4);
}

#[test]
fn stats_have_their_keys() {
    let here = folder();
    let volume = volume();
    let run = done(
        here.path(),
        &["extract", volume.to_str().expect("UTF-8"), "-I", "40", "--stats", "-", "-o", "a.ply"],
    );
    let stats: Value = serde_json::from_str(&run.out).expect("one JSON object and nothing else");
    let keys = [
        "vertices",
        "triangles",
        "bricks",
        "active_bricks",
        "non_finite_samples",
        "backend",
        "adapter",
        "peak_bytes",
        "seconds",
    ];
    for key in keys {
        assert!(stats.get(key).is_some(), "{key}");
    }
    for key in ["read", "upload", "cull", "sample", "classify", "scan", "emit", "readback", "write", "total"]
    {
        assert!(stats["seconds"].get(key).is_some(), "seconds.{key}");
    }
    assert!(stats["triangles"].as_u64().expect("a number") > 0);
    assert!(stats["seconds"]["read"].as_f64().expect("a number") > 0.0);
    done(here.path(), &["extract", "sphere", "-n", "8", "--stats", "s.json", "--quiet"]);
    assert!(
        std::fs::read_to_string(here.path().join("s.json")).expect("the file").starts_with("{\"vertices\":")
    );
}

#[test]
fn quiet_is_quiet_and_a_note_names_the_backend() {
    let here = folder();
    let quiet = done(here.path(), &["extract", "sphere", "-n", "8", "--backend", "cpu", "-q", "-o", "a.off"]);
    assert_eq!((quiet.out.as_str(), quiet.err.as_str()), ("", ""));
    let loud = done(here.path(), &["extract", "sphere", "-n", "8", "-o", "a.off"]);
    assert!(loud.err.contains("CPU") || loud.err.contains("GPU"), "{}", loud.err);
    assert_eq!(loud.err.lines().count(), if loud.err.contains("no GPU") { 2 } else { 1 });
    assert!(!loud.err.contains("nothing is written"), "{}", loud.err);
    let unwritten = done(here.path(), &["extract", "sphere", "-n", "8", "--backend", "cpu"]);
    assert!(unwritten.err.contains("nothing is written"), "{}", unwritten.err);
}

#[test]
fn an_empty_mesh_is_a_warning_with_the_range() {
    let here = folder();
    for backend in ["cpu", "gpu"].into_iter().take(if cpu_alone() { 1 } else { 2 }) {
        let args = [
            "extract",
            "sphere",
            "-L",
            "2",
            "-n",
            "16",
            "-I",
            "9",
            "-o",
            "e.glb",
            "--png",
            "e.png",
            "--backend",
            backend,
        ];
        let run = done(here.path(), &args);
        assert!(
            run.err.contains("empty") && run.err.replace("about ", "").contains("from 0 to 3.46"),
            "{}",
            run.err
        );
        assert_eq!(files(here.path()), ["e.glb", "e.png"]);
    }
}

#[test]
fn ties_are_counted_and_removed() {
    let here = folder();
    // Samples lie on the octahedron's faces exactly, and several edges end at each of them.
    let args = [
        "extract",
        "octahedron",
        "-L",
        "2",
        "-n",
        "8",
        "-I",
        "1",
        "--backend",
        "cpu",
        "--stats",
        "-",
        "-o",
        "c.off",
    ];
    let count = |args: &[&str]| -> (u64, u64) {
        let stats: Value = serde_json::from_str(&done(here.path(), args).out).expect("JSON");
        (
            stats["degenerate_triangles"].as_u64().expect("a count"),
            stats["removed_triangles"].as_u64().expect("a count"),
        )
    };
    let (degenerate, removed) = count(&args);
    assert!(degenerate > 0 && removed == 0);
    assert_eq!(count(&[&args[..], &["--no-degenerate"]].concat()), (0, degenerate));
    let check = done(here.path(), &["check", "c.off", "--strict"]);
    assert!(check.out.contains("Euler number            2"), "{}", check.out);
}

#[test]
fn raw_volumes_and_parameters() {
    let here = folder();
    let mut bytes = vec![0xffu8; 3];
    for i in 0..6u16 * 5 * 4 {
        let (x, y, z) = (i % 6, i / 6 % 5, i / 30);
        let inside = (2..4).contains(&x) && y == 2 && (1..3).contains(&z);
        bytes.extend((if inside { 1000u16 } else { 0 }).to_be_bytes());
    }
    std::fs::write(here.path().join("a.raw"), bytes).expect("a file");
    done(
        here.path(),
        &[
            "extract",
            "a.raw",
            "--dims",
            "6,5,4",
            "--type",
            "u16",
            "--endian",
            "big",
            "--skip-bytes",
            "3",
            "--spacing",
            "2,1,1",
            "--origin",
            "-10,0,0",
            "-I",
            "500",
            "-o",
            "a.ply",
            "--backend",
            "cpu",
        ],
    );
    let report: Value =
        serde_json::from_str(&done(here.path(), &["check", "a.ply", "--json"]).out).expect("JSON");
    assert_eq!(report["bounds"], serde_json::json!([[-7.0, 1.5, 0.5], [-3.0, 2.5, 2.5]]));
    let args = [
        "extract",
        "torus",
        "--param",
        "R=0.5",
        "--param",
        "r=0.25",
        "-n",
        "32",
        "-o",
        "t.ply",
        "--backend",
        "cpu",
    ];
    done(here.path(), &args);
    let report: Value =
        serde_json::from_str(&done(here.path(), &["check", "t.ply", "--json"]).out).expect("JSON");
    assert!((report["bounds"][1][0].as_f64().expect("a number") - 0.75).abs() < 0.02);
}

#[test]
fn a_user_function_is_meshed() {
    if cpu_alone() {
        return;
    }
    let here = folder();
    let source = "fn is_inside(p: vec3<f32>) -> f32 { return length(p) - 1.0; }\n\
                  fn density(p: vec3<f32>) -> f32 { return is_inside(p); }\n";
    std::fs::write(here.path().join("ball.wgsl"), source).expect("a file");
    done(here.path(), &["extract", "ball.wgsl", "-n", "20", "-o", "ball.ply"]);
    let report: Value =
        serde_json::from_str(&done(here.path(), &["check", "ball.ply", "--json"]).out).expect("JSON");
    assert!((report["volume"].as_f64().expect("a number") - 4.19).abs() < 0.1, "{report}");
}

/// `--stats` alone reads the mesh back only where there is room; a run that cannot read the mesh back fails before it draws, with the
/// bytes that it takes.
#[test]
fn reading_back_is_planned_for() {
    if cpu_alone() {
        return;
    }
    let here = folder();
    let base = ["extract", "gyroid", "-n", "64", "--backend", "gpu", "--size", "16x16", "--png", "a.png"];
    let run = |more: &[&str], budget: &str| {
        isoforge(here.path(), &[&base[..], &["--memory-budget", budget], more].concat())
    };
    let stats = |more: &[&str], budget: &str| -> Value {
        serde_json::from_str(&run(more, budget).out).expect("one JSON object")
    };
    let refused = run(&["-o", "a.ply"], "3M");
    assert_eq!(refused.code, Some(1), "{}", refused.err);
    assert!(files(here.path()).is_empty(), "{:?}", files(here.path()));
    let (_, tail) = refused.err.split_once("in main memory needs ").expect("the need");
    let needed: u64 = tail.split(' ').next().and_then(|n| n.parse().ok()).expect("a number");
    let [less, enough] = [needed - 1, needed].map(|n| n.to_string());

    assert_eq!(run(&["-o", "a.ply"], &less).code, Some(1));
    assert!(files(here.path()).is_empty(), "{:?}", files(here.path()));
    let unread = stats(&["--stats", "-"], &less);
    assert_eq!(
        (&unread["degenerate_triangles"], &unread["seconds"]["readback"]),
        (&Value::Null, &Value::Null)
    );
    assert!(unread["peak_bytes"].as_u64().is_some_and(|n| n < needed));
    let counted = stats(&["--stats", "-"], &enough);
    let read = stats(&["--stats", "-", "-o", "a.ply"], &enough);
    assert!(counted["open_edges"].as_u64().is_some_and(|n| n > 0), "{counted}");
    for key in ["open_edges", "degenerate_triangles", "peak_bytes"] {
        assert_eq!(counted[key], read[key], "{key}");
    }
    assert!(read["degenerate_triangles"].is_u64() && read["seconds"]["readback"].is_f64(), "{read}");
    assert!(stats(&["--stats", "-", "--no-degenerate"], &enough)["degenerate_triangles"].is_u64());
    // Also where it is read for the picture alone, and where it is tracked.
    for more in [&["--color-by", "x"][..], &["--crease", "40"], &["--track", "--search", "1", "-o", "a.ply"]]
    {
        let refused = run(more, &less);
        assert_eq!(refused.code, Some(1), "{more:?}: {}", refused.err);
        assert!(refused.err.contains(&format!("in main memory needs {needed} bytes")), "{}", refused.err);
        assert_eq!(run(more, &enough).code, Some(0), "{more:?}");
    }
}

/// The grid's precision is told by its own size, not lost to the squares of its lengths.
#[test]
fn tiny_and_huge_grids_are_no_less_precise() {
    let here = folder();
    for size in ["1e-22", "1e30"] {
        let half = format!("{}e{}", 5, size[2..].parse::<i32>().expect("a number") - 1);
        let args = ["extract", "octahedron", "-n", "9", "--backend", "cpu", "-L", size, "-I", &half];
        let run = done(here.path(), &args);
        assert!(run.err.lines().count() == 1 && run.err.contains(" triangles"), "{}", run.err);
    }
}
