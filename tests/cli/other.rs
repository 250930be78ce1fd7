//! `info`, `fields`, `check`, `compare`, help.

use super::program::{cpu_alone, done, folder, isoforge, volume};
use serde_json::Value;

#[test]
fn fields_and_info_list() {
    let here = folder();
    let fields = done(here.path(), &["fields"]).out;
    for word in ["sphere", "octahedron", "cube", "torus", "gyroid", "--param R=", "period", "boy", "e1"] {
        assert!(fields.contains(word), "{word}");
    }
    let of = |name: &str| {
        let (_, after) = fields.split_once(&format!("\n{name}\n")).expect("it is listed");
        after.lines().nth(1).expect("how it is shown").to_string()
    };
    assert!(of("boy").ends_with("inside is above") && of("torus").ends_with("inside is below"), "{fields}");
    let info = done(here.path(), &["info"]).out;
    assert!(info.contains("threads") && (cpu_alone() || info.contains("largest storage binding")), "{info}");
    assert!(done(here.path(), &["--help"]).out.contains("extract"));
    assert_eq!(isoforge(here.path(), &["frobnicate"]).code, Some(2));
    assert_eq!(isoforge(here.path(), &[]).code, Some(2));
}

#[test]
fn a_gallery_of_all_fields() {
    let here = folder();
    let run = done(here.path(), &["gallery", "-o", "all.png", "--cell", "40", "--columns", "5", "-n", "12"]);
    let count = isoforge::field::named::ALL.len();
    assert!(run.out.contains(&format!("all.png: {count} fields")), "{}", run.out);
    let picture = image::open(here.path().join("all.png")).expect("a picture").into_rgb8();
    let (width, height) = (5 * 44 + 4, count.div_ceil(5) as u32 * 60 + 4);
    assert_eq!(picture.dimensions(), (width, height));
    // Something is drawn in each cell, and a name under it.
    let background = *picture.get_pixel(0, 0);
    for place in 0..count as u32 {
        let (left, top) = (4 + place % 5 * 44, 4 + place / 5 * 60);
        for rows in [top..top + 40, top + 44..top + 52] {
            let drawn = rows.flat_map(|y| (left..left + 40).map(move |x| (x, y)));
            assert!(drawn.into_iter().any(|(x, y)| *picture.get_pixel(x, y) != background), "cell {place}");
        }
    }
    assert_eq!(isoforge(here.path(), &["gallery", "-o", "all.jpg"]).code, Some(1));
    assert_eq!(isoforge(here.path(), &["gallery", "-o", "all.png", "--cell", "2"]).code, Some(2));
    assert_eq!(
        isoforge(here.path(), &["gallery", "-o", "all.png", "--cell", "2048", "--columns", "1"]).code,
        Some(2)
    );
}

#[test]
fn strict_check_finds_a_hole() {
    let here = folder();
    std::fs::write(here.path().join("a.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").expect("a file");
    assert_eq!(isoforge(here.path(), &["check", "a.off"]).code, Some(0));
    let strict = isoforge(here.path(), &["check", "a.off", "--strict"]);
    assert_eq!(strict.code, Some(1));
    assert!(strict.out.contains("boundary edge: vertices 0, 1"), "{}", strict.out);
    let json: Value =
        serde_json::from_str(&done(here.path(), &["check", "a.off", "--json"]).out).expect("JSON");
    let keys = [
        "vertices",
        "triangles",
        "boundary_edges",
        "non_manifold_edges",
        "non_manifold_vertices",
        "misoriented_edges",
        "degenerate_triangles",
        "duplicate_triangles",
        "components",
        "euler",
        "genus",
        "area",
        "volume",
        "bounds",
    ];
    for key in keys {
        assert!(json.get(key).is_some(), "{key}");
    }
    assert_eq!(
        (&json["boundary_edges"], &json["euler"], &json["genus"]),
        (&3.into(), &1.into(), &Value::Null)
    );
}

/// Where there is no surface, nothing is measured, and nothing is found good.
#[test]
fn no_surface() {
    let here = folder();
    let empty = ["extract", "sphere", "-I", "100", "-n", "8", "--backend", "cpu", "-q", "-o", "a.ply"];
    let run = done(here.path(), &empty);
    assert!(run.err.contains("the mesh is empty: no sample crosses iso 100"), "{}", run.err);
    std::fs::write(here.path().join("flat.raw"), [7; 27]).expect("a file");
    let volume = ["flat.raw", "--dims", "3,3,3", "--type", "u8", "-I", "9", "-q", "-o", "b.ply"];
    let run = done(here.path(), &[&["extract"], &volume[..]].concat());
    assert!(run.err.contains("the mesh is empty"), "{}", run.err);

    let failed = |args: &[&str], words: &[&str]| {
        let run = isoforge(here.path(), args);
        assert_eq!(run.code, Some(1), "{args:?}: {}{}", run.out, run.err);
        assert!(words.iter().all(|word| run.err.contains(word)), "{args:?}: {}", run.err);
        assert!(!run.out.contains("NaN"), "{args:?}: {}", run.out);
    };
    done(here.path(), &["check", "a.ply"]);
    failed(&["check", "a.ply", "--strict"], &["a.ply", "no triangle"]);
    failed(
        &["accuracy", "sphere", "-I", "100", "-n", "8"],
        &["sphere: there is no surface", "runs from 0 to"],
    );
    if !cpu_alone() {
        failed(&["compare", "sphere", "-I", "100", "-n", "8"], &["no mesh was compared", "runs from"]);
    }
}

#[test]
fn compare_agrees() {
    if cpu_alone() {
        return;
    }
    let here = folder();
    let run = done(here.path(), &["compare", "torus", "-n", "24"]);
    assert!(run.out.contains("equal bit for bit") && !run.out.contains("DISAGREES"), "{}", run.out);
    done(here.path(), &["compare", volume().to_str().expect("UTF-8"), "-I", "40"]);
}

#[test]
fn compare_says_what_extract_says() {
    if cpu_alone() {
        return;
    }
    let here = folder();
    let run = isoforge(here.path(), &["compare", "cube", "-n", "8", "--bounds", "1e6,0,0,1000001,1,1"]);
    assert!(run.err.contains("units in the last place"), "{}", run.err);
}

#[test]
fn a_bench_without_rows_fails() {
    let here = folder();
    let args = ["bench", "-q", "-n", "1048576", "--cases", "sphere", "--backend", "cpu", "--json", "-"];
    let run = isoforge(here.path(), &args);
    assert!(run.code == Some(1) && run.err.contains("nothing was measured"), "{}", run.err);
    assert!(run.out.contains("32-bit"), "the report says why: {}", run.out);
}

/// A reader of standard error that has gone away changes nothing of how the program ends. Goes red where lines are printed by
/// `eprintln!`, which panics.
#[test]
fn nobody_reads_standard_error() {
    use std::process::{Command, Stdio};
    let mut program = Command::new(env!("CARGO_BIN_EXE_isoforge"));
    program.args(["extract", "no such field", "-n", "8"]).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = program.spawn().expect("the program starts");
    drop(child.stderr.take());
    assert_eq!(child.wait().expect("it ends").code(), Some(2));
}

/// A full disk under standard output is told; a reader that has gone away is no error.
#[test]
#[cfg(target_os = "linux")]
fn standard_output_that_cannot_be_written() {
    use std::process::{Command, Stdio};
    let here = folder();
    done(here.path(), &["extract", "sphere", "-n", "8", "-q", "--backend", "cpu", "-o", "a.ply"]);
    let program = |args: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_isoforge"));
        program.args(args).current_dir(here.path()).stderr(Stdio::piped());
        program
    };
    for args in [
        &["fields"][..],
        &["nodes"],
        &["--help"],
        &["check", "a.ply"],
        &["extract", "sphere", "-n", "8", "-q", "--backend", "cpu", "--stats", "-"],
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full").expect("the device");
        let output = program(args).stdout(full).output().expect("the program starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.code() == Some(1) && said.contains("standard output cannot"),
            "{args:?}: {said}"
        );

        let mut child = program(args).stdout(Stdio::piped()).spawn().expect("the program starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0), "{args:?}");
    }
}
