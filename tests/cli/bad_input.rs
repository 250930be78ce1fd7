//! Every bad input: an error that names the thing and the remedy, the right exit code, no file left.

use super::program::{cpu_alone, done, files, folder, isoforge, volume};

/// Runs `args` in a folder with `given` files; demands the code, the words in the message, one paragraph,
/// no panic, and no new file.
fn refused_with(given: &[(&str, &[u8])], args: &[&str], code: i32, words: &[&str]) {
    let here = folder();
    for (name, bytes) in given {
        std::fs::write(here.path().join(name), bytes).expect("a file");
    }
    let before = files(here.path());
    let run = isoforge(here.path(), args);
    assert_eq!(run.code, Some(code), "{args:?}: {}{}", run.out, run.err);
    for word in words {
        assert!(run.err.contains(word), "{args:?}: `{word}` is not in: {}", run.err);
    }
    assert!(!run.err.contains("panicked"), "{args:?}: {}", run.err);
    assert_eq!(files(here.path()), before, "{args:?} leaves nothing behind");
}

fn refused(args: &[&str], code: i32, words: &[&str]) {
    refused_with(&[], args, code, words);
}

#[test]
fn names_and_endings() {
    refused(&["extract", "sphree", "-o", "a.ply"], 2, &["sphree", "sphere, octahedron, cube, torus"]);
    refused(&["extract", "sphere", "-o", "a.xyz"], 2, &["a.xyz", ".ply"]);
    refused(&["extract", "sphere", "--png", "a.jpg"], 2, &["a.jpg", ".png"]);
    refused(&["extract", "scan.dcm", "-o", "a.ply"], 2, &["scan.dcm", ".nii"]);
    refused(&["extract", "torus", "--param", "q=1"], 2, &["`q`", "isoforge fields"]);
    refused(&["extract", "torus", "--param", "R=nan"], 2, &["R", "NaN"]);
    refused(&["check", "a.xyz"], 2, &["a.xyz", "ply"]);
    refused(&["check", "missing.ply"], 1, &["missing.ply"]);
}

#[test]
fn formulas() {
    refused(&["extract", "length(x, y, z) - r"], 2, &["`r`", "as in `--param r=0.8`\n", "^"]);
    refused(&["extract", "lenght(x, y, z) - 1"], 2, &["did you mean `length`", "\n  lenght(x"]);
    refused(&["extract", "2x + y"], 2, &["`2*x`", "^"]);
    refused(&["extract", "x - r", "--param", "r=1", "--param", "q=2"], 2, &["--param q", "leave"]);
    refused(&["extract", "x - r", "--param", "r=inf"], 2, &["finite"]);
    refused(&["extract", "x - r", "--param", "r=1", "-o", "a.xyz"], 2, &["a.xyz"]);
    refused(&["extract", ""], 2, &["empty"]);
    // What looks like a file is taken for one.
    refused(&["extract", "my scans/head (2).dcm"], 2, &["ending"]);
}

#[test]
fn numbers() {
    refused(&["extract", "sphere", "-n", "0"], 2, &["-n", "0 cells", "1 to"]);
    refused(&["extract", "sphere", "-n", "4000000000"], 2, &["-n", "1 to"]);
    for n in ["4294967296", "99999999999999999999999", "8,8,4294967296"] {
        refused(&["extract", "sphere", "-n", n], 2, &["1 to 1048576"]);
    }
    refused(&["extract", "sphere", "-n", "-5"], 2, &["--cells"]);
    refused(&["extract", "sphere", "--time-limit", "0"], 2, &["--time-limit"]);
    refused(
        &["extract", "sphere", "-n", "8", "--png", "a.png", "--size", "4000x4000", "--memory-budget", "10M"],
        2,
        &["--size 4000x4000", "takes 1", "10485760", "smaller"],
    );
    refused(&["extract", "sphere", "-n", "1000000", "--backend", "cpu"], 1, &["bricks", "coarsen"]);
    refused(
        &["extract", "sphere", "-n", "9000", "--backend", "cpu", "--memory-budget", "1G"],
        1,
        &["budget", "1073741824"],
    );
    refused(&["extract", "sphere", "-L", "0"], 2, &["-L 0"]);
    refused(&["extract", "sphere", "-L", "-1"], 2, &["-L -1"]);
    refused(&["extract", "sphere", "-L", "nan"], 2, &["-L"]);
    for delta in ["0", "-1", "nan", "inf"] {
        refused(
            &["extract", "sphere", "--normals", "forward", "--delta", delta],
            2,
            &["--delta", "over zero"],
        );
    }
    refused(&["compare", "sphere", "--delta", "0.1"], 2, &["--delta 0.1", "--normals central"]);
    refused(
        &["extract", "sphere", "--normals", "exact", "--delta", "1"],
        2,
        &["--delta 1", "--normals central"],
    );
    refused(&["extract", "sphere", "--normals", "good"], 2, &["--normals", "forward"]);
    let here = folder();
    let run = isoforge(here.path(), &["extract", "sphre"]);
    assert!(run.err.contains("no field named `sphre`") && !run.err.contains("formula:"), "{}", run.err);
    refused(&["extract", "x-r"], 2, &["no field named `x-r`", "read as a formula", "`r`"]);
    refused(&["extract", "x.y/2"], 2, &["ending", "read as a formula"]);
    refused(&["extract", "a.nrrd", "--origin", "0,0,0"], 2, &["--origin", "a.nrrd says itself"]);
    refused(&["extract", "sphere", "--skip-bytes", "4"], 2, &["--skip-bytes", "sphere is no file"]);
    refused(&["extract", "sphere", "-I", "x"], 2, &["--iso", "x"]);
    refused(&["extract", "sphere", "-I", "nan"], 2, &["finite"]);
    refused(&["extract", "sphere", "-I", "inf"], 2, &["finite"]);
    refused(&["extract", "sphere", "--bounds", "0,0,0,1,1,inf"], 2, &["--bounds", "finite"]);
    refused(&["extract", "sphere", "--bounds", "0,0,0,1,1,NaN"], 2, &["--bounds", "finite"]);
    refused(&["extract", "sphere", "--bounds", "0,0,0,1,1,0"], 2, &["--bounds"]);
    refused(&["extract", "sphere", "--size", "0x10", "--png", "a.png"], 2, &["0"]);
    refused(&["extract", "sphere", "--size", "99999x10", "--png", "a.png"], 2, &["99999"]);
    refused(&["extract", "sphere", "--fov", "200", "--png", "a.png"], 2, &["200"]);
}

/// A negative number is the flag's value, and the message says what it may be.
#[test]
fn negative_numbers() {
    let extract = ["extract", "sphere", "-n", "8", "--png", "a.png"];
    for (command, flag, words) in [
        (&extract[..], "--crease", "from 0 to 180"),
        (&extract, "--memory-budget", "whole number of bytes"),
        (&extract, "--time-limit", "at least 1"),
        (&extract, "--fov", "-5"),
        (&extract, "--size", "1024x768"),
        (&extract, "--most-cells", "0 or more"),
        (&["extract", "sphere", "--track"], "--coarse", "not in 0.."),
        (&["extract", "sphere", "--track"], "--search", "not in 0.."),
        (&["extract", "a.raw", "--dims", "2,2,2", "--type", "u8"], "--skip-bytes", "0 or more"),
        (&["extract", "a.raw", "--type", "u8"], "--dims", "three whole numbers"),
        (&["mesh-tools", "a.ply"], "--smooth", "not in 1..=200"),
        (&["mesh-tools", "a.ply"], "--simplify", "0 or more"),
        (&["mesh-tools", "a.ply"], "--remove-below", "number of triangles"),
        (&["bench"], "--seconds", "0 or more"),
        (&["bench"], "--repeats", "not in 1.."),
        (&["bench"], "--sizes", "not in 0.."),
        (&["bench"], "--sweep", "not in 0.."),
        (&["gallery", "-o", "a.png"], "--cell", "not in 32..="),
    ] {
        refused(&[command, &[flag, "-5"]].concat(), 2, &["-5", words]);
    }
}

#[test]
fn volumes() {
    let good = std::fs::read(volume()).expect("the volume");
    refused(&["extract", "missing.nii.gz", "-I", "1"], 1, &["missing.nii.gz"]);
    let layout = ["--dims", "2,2,2", "--type", "u8", "-I", "1"];
    refused(&[&["extract", "missing.map"], &layout[..]].concat(), 2, &["missing.map is no file"]);
    refused(&[&["extract", "sphere"], &layout[..]].concat(), 2, &["sphere is no file"]);
    for name in ["a.nii.gz", "a.pdb", "a.toml", "a.wgsl"] {
        let args = [&["extract", name], &layout[..]].concat();
        refused_with(&[(name, b"12345678")], &args, 2, &[name, "says itself"]);
    }
    refused_with(&[("a.map", b"12345678")], &["extract", "a.map", "-I", "1"], 2, &["a.map", "--dims"]);
    refused(&["extract", ".", "-I", "1"], 2, &["this is a folder"]);
    refused_with(
        &[("a.nii.gz", &good[..good.len() / 2])],
        &["extract", "a.nii.gz", "-I", "1"],
        1,
        &["a.nii.gz"],
    );
    refused_with(&[("a.tif", b"II*\0junkjunkjunk")], &["extract", "a.tif", "-I", "1"], 1, &["a.tif"]);
    refused_with(
        &[("a.nrrd", b"NRRD0004\ntype: float\n\n")],
        &["extract", "a.nrrd", "-I", "1"],
        1,
        &["a.nrrd"],
    );
    refused_with(
        &[("a.raw", &[0; 7])],
        &["extract", "a.raw", "--dims", "2,2,2", "--type", "u8", "-I", "1"],
        1,
        &["a.raw"],
    );
    refused_with(&[("a.raw", &[0; 8])], &["extract", "a.raw", "-I", "1"], 2, &["a.raw", "--dims"]);
    refused_with(
        &[("a.nii.gz", &good)],
        &["extract", "a.nii.gz", "-I", "40", "--memory-budget", "1K", "-o", "a.ply"],
        1,
        &["1024 bytes", "--memory-budget", "save it uncompressed"],
    );
    refused_with(&[("a.nii.gz", &good)], &["extract", "a.nii.gz"], 2, &["-I", "values run from"]);
    refused_with(
        &[("a.nii.gz", &good)],
        &["extract", "a.nii.gz", "-I", "1", "-n", "9"],
        2,
        &["-n", "own grid"],
    );
    refused(&["extract", "sphere", "--spacing", "1,1,2"], 2, &["--spacing is for volumes", "sphere"]);
    for flags in [["--normals", "central"], ["--delta", "0.1"]] {
        let args = ["extract", "a.nii.gz", "-I", "1", flags[0], flags[1]];
        refused_with(&[("a.nii.gz", &good)], &args, 2, &[flags[0], "samples"]);
    }
}

#[test]
fn user_functions() {
    let wrong = b"fn density(p: vec3<f32>) -> f32 {\n    return lenght(p);\n}\n";
    refused_with(&[("a.wgsl", wrong)], &["extract", "a.wgsl"], 1, &["a.wgsl:2:12", "lenght", "^"]);
    let vector = b"fn density(p: vec3<f32>) -> vec3<f32> { return p; }\n";
    refused_with(
        &[("a.wgsl", vector)],
        &["extract", "a.wgsl"],
        1,
        &["signature", "fn density(p: vec3<f32>) -> f32"],
    );
    refused(&["extract", "1/0"], 2, &["this gives inf everywhere"]);
    refused(&["extract", "missing.wgsl"], 1, &["missing.wgsl", "check the name"]);
    refused_with(&[("a.wgsl", b"// gr\xf6\xdfe\n")], &["extract", "a.wgsl"], 1, &["a.wgsl", "UTF-8"]);
    let open =
        b"fn density(p: vec3<f32>) -> f32 {\n var s = p.x;\n while s < 0.0 { s += 1.0; } return s; }\n";
    refused_with(
        &[("a.wgsl", open)],
        &["extract", "a.wgsl", "--backend", "cpu", "-o", "a.ply"],
        1,
        &["--backend gpu", "note: density stays on the GPU: `while` at line 3 has no known bound"],
    );
    if !cpu_alone() {
        let endless = b"fn density(p: vec3<f32>) -> f32 {\n var s = p.x;\n loop { if s > 1e30 { break; } }\n return s; }\n";
        refused_with(
            &[("a.wgsl", endless)],
            &["extract", "a.wgsl", "-n", "8", "-o", "a.ply"],
            1,
            &["loop", "iterations"],
        );
    }
}

#[test]
fn targets() {
    // One wording for all, and no folder is found missing, or in the way, after the work.
    for option in ["-o", "--png", "--stats"] {
        let name = option.replace("-o", "a.ply").replace("--png", "a.png").replace("--stats", "a.json");
        let missing = format!("no/such/{name}");
        let words = ["there is no folder no/such; create it"];
        refused(&["extract", "sphere", "-n", "8", option, &missing], 1, &words);
        let here = folder();
        std::fs::create_dir(here.path().join(&name)).expect("a folder");
        let also = if option == "-o" { ["--png", "b.png"] } else { ["-o", "b.ply"] };
        let run = isoforge(here.path(), &["extract", "sphere", "-n", "8", also[0], also[1], option, &name]);
        assert!(
            run.code == Some(1) && run.err.contains("a folder of that name is in the way"),
            "{}",
            run.err
        );
        assert_eq!(files(here.path()), [name]);
    }
    // What is read is not written over, by whatever path.
    let points = b"1 2 3\n";
    let given = [("a.csv", &b"x,y,z\n1,2,3\n"[..]), ("a.ply", points), ("a.off", points)];
    for args in [
        &["extract", "a.ply", "-n", "8", "-o", "./a.ply"][..],
        &["extract", "sphere", "-n", "8", "--color-by", "a.ply", "-o", "a.ply"],
        &["extract", "a.csv", "-n", "8", "--stats", "a.csv"],
        &["mesh-tools", "a.off", "-o", "a.off"],
    ] {
        refused_with(&given, args, 2, &["this is the file that is read"]);
    }
    let twice = ["--png", "a.png", "--stats", "a.png"];
    refused(&[&["extract", "sphere", "-n", "8"], &twice[..]].concat(), 2, &["--png and --stats", "a.png"]);
    refused(&["bench", "-n", "8", "--json", "no/such/a.json"], 1, &["there is no folder no/such"]);
    refused_with(&[("plain", b"x")], &["extract", "sphere", "-n", "8", "-o", "plain/a.ply"], 1, &["plain"]);
}

#[test]
fn no_adapter() {
    let here = folder();
    let open = "fn density(p: vec3<f32>) -> f32 { var s = p.x; while s < 0.0 { s += 1.0; } return s; }\n";
    std::fs::write(here.path().join("a.wgsl"), open).expect("a file");
    // Whether the CPU could do it.
    let runs = [
        (vec!["extract", "sphere", "-n", "8", "-o", "a.ply", "--backend", "gpu"], true),
        (vec!["bench", "-n", "8", "--backend", "gpu"], true),
        (vec!["extract", "a.wgsl", "-n", "8", "-o", "a.ply", "--backend", "gpu"], false),
        (vec!["extract", "a.wgsl", "-n", "8", "-o", "a.ply"], false),
        (vec!["compare", "sphere", "-n", "8"], false),
    ];
    for (args, has_hint) in runs {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_isoforge"))
            .args(&args)
            .env("WGPU_BACKEND", "noop")
            .env("VK_DRIVER_FILES", "none")
            .env("VK_ICD_FILENAMES", "none")
            .current_dir(here.path())
            .output()
            .expect("the program starts");
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{args:?}: {err}");
        assert!(err.contains("no GPU adapter") && err.contains("install"), "{args:?}: {err}");
        assert_eq!(err.contains("--backend cpu"), has_hint, "{args:?}: {err}");
        assert_eq!(files(here.path()), ["a.wgsl"]);
    }
}

#[test]
fn damaged_meshes() {
    let here = folder();
    for name in ["a.ply", "a.glb", "a.stl"] {
        done(here.path(), &["extract", "sphere", "-n", "8", "--backend", "cpu", "-o", name]);
        let whole = std::fs::read(here.path().join(name)).expect("a file");
        let half = &whole[..whole.len() / 2];
        refused_with(&[(name, half)], &["check", name], 1, &[name, "cut short", "export it again"]);
    }
}
