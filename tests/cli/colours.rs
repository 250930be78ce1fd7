//! `isoforge extract --color-by`.

use super::program::{cpu_alone, done, files, folder, isoforge, volume};
use serde_json::Value;

fn json(here: &std::path::Path, name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(here.join(name)).expect("a file")).expect("JSON")
}

#[test]
fn a_mesh_coloured_by_a_formula_on_both_backends() {
    let here = folder();
    let mut found = Vec::new();
    for backend in ["cpu", "gpu"].into_iter().take(if cpu_alone() { 1 } else { 2 }) {
        let (file, picture) = (format!("{backend}.ply"), format!("{backend}.png"));
        let run = done(
            here.path(),
            &[
                "extract",
                "sphere",
                "-n",
                "24",
                "-I",
                "1",
                "--color-by",
                "k*x",
                "--color-param",
                "k=2",
                "--color-map",
                "grey",
                "--color-range",
                "-2,2",
                "-o",
                &file,
                "--png",
                &picture,
                "--size",
                "160x120",
                "--backend",
                backend,
                "--stats",
                "stats.json",
            ],
        );
        assert!(run.err.contains("grey from -2 to 2, as given; the values run from -2 to 2"), "{}", run.err);
        let told = &json(here.path(), "stats.json")["coloured"];
        assert_eq!(
            (&told["map"], &told["outside"], &told["not_finite"]),
            (&"grey".into(), &0.into(), &0.into())
        );
        let bytes = std::fs::read(here.path().join(&file)).expect("a file");
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("property float value\nproperty uchar red\n"));
        // 24 bytes of position and normal, value, colour.
        let start = text.find("end_header\n").expect("a header") + 11;
        let rows = bytes[start..]
            .chunks(31)
            .take(json(here.path(), "stats.json")["vertices"].as_u64().expect("a count") as usize);
        for row in rows {
            let float = |at: usize| f32::from_le_bytes(row[at..at + 4].try_into().expect("4 bytes"));
            assert!((float(24) - 2.0 * float(0)).abs() < 1e-6);
            assert!(row[28] == row[29] && row[29] == row[30]);
        }
        found.push(image::open(here.path().join(&picture)).expect("a picture").to_rgb8());
        if found.len() == 2 {
            let bytes = |name| std::fs::read(here.path().join(name)).expect("a file");
            assert!(bytes("cpu.ply") == bytes("gpu.ply"), "both backends give the same file");
        }
    }
    // The camera looks from +x, where the values are highest: light, and dark towards the rim.
    assert!(found[0].get_pixel(80, 60)[0] > found[0].get_pixel(112, 60)[0].saturating_add(30));
    if let [a, b] = &found[..] {
        let apart = a.pixels().zip(b.pixels()).filter(|(a, b)| a[0].abs_diff(b[0]) > 24).count();
        assert!(apart < 40, "{apart} pixels differ");
    }
}

#[test]
fn every_method_takes_colours() {
    let here = folder();
    for flags in [&["--refine"][..], &["--sharp"], &["--method", "dmc"], &["--no-degenerate"], &["--track"]] {
        let args = [
            "extract",
            "cube",
            "-n",
            "16",
            "--color-by",
            "torus",
            "-o",
            "a.glb",
            "--png",
            "a.png",
            "--size",
            "80x60",
        ];
        let run = done(here.path(), &[&args[..], flags, &["--backend", "cpu"]].concat());
        assert!(run.err.contains("--color-by torus: viridis from"), "{}", run.err);
        done(here.path(), &["check", "a.glb"]);
        let image = image::open(here.path().join("a.png")).expect("a picture").to_rgb8();
        assert!(
            image.pixels().any(|p| p[1] > p[2].saturating_add(40)),
            "{flags:?}: no green or yellow in the picture"
        );
    }
}

#[test]
fn a_volume_colours_what_lies_within_it() {
    let here = folder();
    let brain = volume();
    let brain = brain.to_str().expect("UTF-8");
    let run = done(
        here.path(),
        &[
            "extract",
            brain,
            "-I",
            "40",
            "--color-by",
            brain,
            "-o",
            "a.ply",
            "--backend",
            "cpu",
            "--stats",
            "s.json",
        ],
    );
    assert!(!run.err.contains("lie outside"), "{}", run.err);
    // A surface of the volume at 40 has about that value.
    let told = &json(here.path(), "s.json")["coloured"];
    for value in told["values"].as_array().expect("two") {
        assert!((value.as_f64().expect("a number") - 40.0).abs() < 1.0, "{told}");
    }
    let report: Value =
        serde_json::from_str(&done(here.path(), &["check", "a.ply", "--json"]).out).expect("JSON");
    let bounds: Vec<f64> = report["bounds"]
        .as_array()
        .expect("two")
        .iter()
        .flat_map(|c| c.as_array().expect("three").iter().map(|x| x.as_f64().expect("a number")))
        .collect();
    // A ball around the middle of its right side, so that a part is outside.
    let centre = [bounds[3], (bounds[1] + bounds[4]) / 2.0, (bounds[2] + bounds[5]) / 2.0];
    let ball = format!("sqrt((x - {})^2 + (y - {})^2 + (z - {})^2) - 8", centre[0], centre[1], centre[2]);
    let corner = |by: f64| centre.map(|c| (c + by).to_string()).join(",");
    let box_ = format!("{},{}", corner(-10.0), corner(10.0));
    let run = done(
        here.path(),
        &[
            "extract",
            &ball,
            "--bounds",
            &box_,
            "-n",
            "24",
            "--color-by",
            brain,
            "--png",
            "b.png",
            "--size",
            "80x60",
            "--backend",
            "cpu",
        ],
    );
    assert!(run.err.contains("vertices lie outside") && run.err.contains("are grey"), "{}", run.err);
}

#[test]
fn nan_is_grey_and_told() {
    let here = folder();
    let run = done(
        here.path(),
        &["extract", "sphere", "-n", "16", "--color-by", "sqrt(x)", "-o", "a.ply", "--backend", "cpu"],
    );
    assert!(run.err.contains("is NaN or infinite there"), "{}", run.err);
    let run = done(
        here.path(),
        &["extract", "sphere", "-n", "16", "--color-by", "sqrt(-1 - x^2)", "-o", "a.ply", "--backend", "cpu"],
    );
    assert!(run.err.contains("no vertex has a value"), "{}", run.err);
    // Nothing to colour.
    done(
        here.path(),
        &["extract", "sphere", "-n", "8", "-I", "-5", "--color-by", "x", "-o", "a.ply", "--backend", "cpu"],
    );
}

#[test]
fn what_cannot_work_is_refused() {
    let here = folder();
    let brain = volume();
    let brain = brain.to_str().expect("UTF-8");
    let refused = |args: &[&str], code: i32, words: &[&str]| {
        let run =
            isoforge(here.path(), &[&["extract", "sphere", "-n", "12", "--backend", "cpu"], args].concat());
        assert_eq!(run.code, Some(code), "{args:?}: {}", run.err);
        for word in words {
            assert!(run.err.contains(word), "{args:?}: `{word}` is not in {}", run.err);
        }
        assert!(files(here.path()).is_empty(), "{args:?}");
    };
    refused(&["--color-by", "sphree", "-o", "a.ply"], 2, &["--color-by", "sphree"]);
    refused(&["--color-by", "k*x", "-o", "a.ply"], 2, &["--color-by", "--color-param"]);
    refused(&["--color-by", "missing.nii", "-o", "a.ply"], 1, &["--color-by", "missing.nii"]);
    refused(&["--color-by", "a.raw", "-o", "a.ply"], 2, &["a.raw", "--dims"]);
    // What describes raw values is not for the ball: it is the other file that is not there.
    let missing = ["--color-by", "a.dat", "-o", "a.ply", "--dims", "4,4,4", "--type", "u8"];
    refused(&missing, 2, &["--color-by: --dims", "a.dat is no file: check the name"]);
    refused(&["--color-by", "x", "-o", "a.stl"], 2, &["a.stl", "--color-by", ".ply or .glb"]);
    refused(&["--color-by", "x", "--color-map", "jet"], 2, &["jet", "viridis"]);
    refused(&["--color-by", "x", "--color-range", "3,1"], 2, &["--color-range", "lower one first"]);
    refused(&["--color-by", "x", "--color-range", "nan,1"], 2, &["--color-range", "finite"]);
    refused(&["--color-map", "magma"], 2, &["--color-by"]);
    // The ball lies around the origin, the brain elsewhere.
    let run = isoforge(
        here.path(),
        &[
            "extract",
            "sphere",
            "--bounds",
            "-1001,-1,-1,-999,1,1",
            "-I",
            "1000",
            "-n",
            "12",
            "--color-by",
            brain,
            "-o",
            "a.ply",
            "--backend",
            "cpu",
        ],
    );
    assert_eq!(run.code, Some(1), "{}", run.err);
    for word in ["the mesh, from [-100", "no vertex within the volume", "which reaches from ["] {
        assert!(run.err.contains(word), "{}", run.err);
    }
    assert!(files(here.path()).is_empty());
}

#[test]
fn a_picture_shows_what_the_mesh_file_has_no_place_for() {
    let here = folder();
    let args = ["extract", "sphere", "-n", "12", "--backend", "cpu", "-o", "a.stl"];
    done(here.path(), &args);
    let plain = std::fs::read(here.path().join("a.stl")).expect("a mesh");
    let run =
        done(here.path(), &[&args[..], &["--color-by", "x", "--png", "a.png", "--size", "64x64"]].concat());
    assert!(run.err.contains("-o a.stl: the format has no place for the colours"), "{}", run.err);
    assert_eq!(std::fs::read(here.path().join("a.stl")).expect("a mesh"), plain);
    let picture = image::open(here.path().join("a.png")).expect("a picture").to_rgb8();
    let is_over = |x: u8, y: u8| u16::from(x) > u16::from(y) + 40;
    let (blue, yellow) = (
        picture.pixels().any(|p| is_over(p.0[2], p.0[0])),
        picture.pixels().any(|p| is_over(p.0[1], p.0[2])),
    );
    assert!(blue && yellow);
}

/// The volume that colours counts against the memory budget beside all else: at it, before the long work.
///
/// Goes red when `bytes` (src/cli/colour.rs) is 0, and when the painter is given the whole budget (src/cli/extract.rs).
#[test]
fn the_volume_that_colours_counts() {
    let here = folder();
    let path = volume();
    let by = path.to_str().expect("text");
    let run = |more: &[&str], budget: u64| {
        let base = ["extract", "--backend", "cpu", "-o", "a.ply", "--memory-budget"];
        isoforge(here.path(), &[&base[..], &[&budget.to_string()], more].concat())
    };
    let bytes = isoforge::volume::open(&path, &Default::default()).expect("a volume").volume.bytes();
    let needed = |more: &[&str]| {
        let (mut low, mut high) = (0, 1 << 24);
        while high - low > 1 {
            let middle = (low + high) / 2;
            *(if run(more, middle).code == Some(0) { &mut high } else { &mut low }) = middle;
        }
        high
    };
    let ball = "(x+30)^2+(y-183)^2+(z-1198)^2-25";
    let ball = [ball, "-n", "20", "--bounds", "-40,173,1188,-20,193,1208"];
    let plain = needed(&ball);
    let coloured = [&ball[..], &["--color-by", by]].concat();
    assert_eq!(needed(&coloured), plain + bytes);
    let refused = run(&coloured, plain + bytes - 1);
    assert!(refused.err.contains("raise the budget (--memory-budget)"), "{}", refused.err);
    let refused = run(&coloured, bytes - 1);
    assert!(
        refused.err.contains("--color-by: ") && refused.err.contains("Raise the budget (--memory-budget)"),
        "{}",
        refused.err
    );
}
