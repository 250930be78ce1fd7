//! The methods beside the sweep: --track, --refine, --sharp, --method; and `accuracy`.

use super::program::{cpu_alone, done, folder, isoforge};
use isoforge::mesh::Mesh;
use isoforge::mesh::read::read;
use std::path::Path;

const TWO_BALLS: &str = "min(sqrt((x-0.7)^2 + y^2 + z^2) - 0.4, sqrt((x+0.7)^2 + y^2 + z^2) - 0.3)";

/// The mesh of a formula with more flags, and what was said.
fn mesh(here: &Path, formula: &str, more: &[&str]) -> (Mesh, String) {
    let args = [&["extract", formula, "-n", "40", "-o", "m.ply"], more].concat();
    let said = done(here, &args).err;
    (read(&here.join("m.ply")).expect("a mesh").mesh, said)
}

#[test]
fn a_track_reaches_what_its_seeds_lie_on() {
    let here = folder();
    let (whole, _) = mesh(here.path(), TWO_BALLS, &["--backend", "cpu"]);
    let (found, said) = mesh(here.path(), TWO_BALLS, &["--track"]);
    assert_eq!(found, whole, "every component");
    assert!(said.contains("every component of the sampled grid is found"), "{said}");
    let (left, _) = mesh(here.path(), TWO_BALLS, &["--track", "--seed", "-0.7,0,0"]);
    assert_eq!(left.check().components, 1);
    assert!(left.vertices.iter().all(|v| v.position[0] < 0.0));
    let (both, said) = mesh(
        here.path(),
        TWO_BALLS,
        &["--track", "--seed", "-0.7,0,0", "--seed", "0.7,0,0", "--seed", "9,0,0"],
    );
    assert_eq!(both, whole);
    assert!(said.contains("[9, 0, 0] lies outside the grid"), "{said}");
    let (coarse, _) = mesh(here.path(), TWO_BALLS, &["--track", "--coarse", "4"]);
    assert_eq!(coarse, whole);
    if !cpu_alone() {
        let (on_gpu, _) =
            mesh(here.path(), TWO_BALLS, &["--track", "--seed", "-0.7,0,0", "--backend", "gpu"]);
        assert_eq!(on_gpu, left);
    }
}

#[test]
fn refined_sharp_and_adaptive() {
    let here = folder();
    let cut = "max(sqrt(x^2 + y^2 + z^2) - 1, 0.6 - x)";
    let (plain, _) = mesh(here.path(), cut, &["--backend", "cpu"]);
    for flags in [
        &["--refine"][..],
        &["--sharp"],
        &["--method", "dmc"],
        &["--method", "octree"],
        &["--sharp", "--refine"],
    ] {
        let (found, said) =
            mesh(here.path(), cut, &[flags, &["--stats", "s.json", "--png", "m.png"]].concat());
        let report = found.check();
        assert!(report.is_closed_manifold() && report.genus == Some(0), "{flags:?}: {report:?}");
        let growth = found.triangles.len() as f64 / plain.triangles.len() as f64;
        let expected = match flags {
            ["--method", ..] => 0.05..0.7,
            ["--sharp"] => 0.9..1.1,
            _ => 1.0..6.0,
        };
        assert!(expected.contains(&growth), "{flags:?}: {growth} {said}");
        let stats: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(here.path().join("s.json")).unwrap()).unwrap();
        assert_eq!(stats["triangles"], found.triangles.len());
        assert_eq!(stats["refined"].is_object(), flags.contains(&"--refine"));
        let name = match flags {
            ["--method", name] => name,
            ["--sharp", ..] => "sharp",
            _ => "mc",
        };
        assert_eq!(stats["method"]["name"], name);
        assert_eq!(stats["method"].as_object().unwrap().len() > 1, flags != ["--refine"]);
    }
}

/// A mesh that is on the GPU is refined there, with the same bytes; what only a GPU evaluates is, too.
#[test]
fn refined_on_the_gpu() {
    if cpu_alone() {
        return;
    }
    let here = folder();
    let cut = "max(sqrt(x^2 + y^2 + z^2) - 1, 0.6 - x)";
    let (wanted, _) = mesh(here.path(), cut, &["--backend", "cpu", "--refine"]);
    let stats = |more: &[&str]| -> serde_json::Value {
        let (found, said) =
            mesh(here.path(), cut, &[&["--refine", "--backend", "gpu", "--stats", "s.json"], more].concat());
        assert_eq!(found, wanted, "{said}");
        serde_json::from_str(&std::fs::read_to_string(here.path().join("s.json")).unwrap()).unwrap()
    };
    assert_eq!(stats(&[])["backend"], "gpu");
    assert_eq!(stats(&["--track"])["backend"], "gpu");
    // Without a file the mesh stays where it is, and is counted all the same.
    let args = ["extract", cut, "-n", "40", "--refine", "--backend", "gpu", "--stats", "c.json"];
    let said = done(here.path(), &args).err;
    let counted: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(here.path().join("c.json")).unwrap()).unwrap();
    assert_eq!(counted["triangles"], wanted.triangles.len(), "{said}");

    let loops = "fn density(p: vec3<f32>) -> f32 {
        var d = length(p);
        while d > 2.0 { d -= 0.125; }
        return d - 1.0;
    }";
    std::fs::write(here.path().join("loops.wgsl"), loops).unwrap();
    let (found, _) = mesh(here.path(), "loops.wgsl", &["--refine"]);
    assert!(found.check().is_closed_manifold());

    // More blobs at one place than lavapipe lets an invocation loop over in a search: the CPU does it.
    let rows = "0,0,0,1\n".repeat(9000);
    std::fs::write(here.path().join("dense.csv"), format!("x,y,z,radius\n{rows}")).unwrap();
    let refined = |backend: &str| {
        let more = ["-n", "8", "--refine", "depth=2", "--backend", backend];
        let args = [&["extract", "dense.csv", "-o", "m.ply"][..], &more].concat();
        let said = done(here.path(), &args).err;
        (read(&here.path().join("m.ply")).expect("a mesh").mesh, said)
    };
    let ((wanted, _), (found, said)) = (refined("cpu"), refined("gpu"));
    if said.contains("llvmpipe") || said.contains("on the CPU") {
        assert_eq!(found, wanted);
        assert!(said.contains("not refined on the GPU: the loops of the field"), "{said}");
    }
}

/// The settings of a scene's `refine` are those of `--refine`, where that does not say otherwise.
#[test]
fn refine_takes_the_scenes_words() {
    let here = folder();
    let scene = "cells = 12\nrefine = { flatness = 0.999, depth = 'levels' }\n[parameters]\nlevels = 1\n\
                 [nodes.ball]\nkind = 'sphere'\nradius = 1";
    std::fs::write(here.path().join("s.toml"), scene).expect("a file");
    let triangles = |more: &[&str]| {
        done(here.path(), &[&["extract", "s.toml", "-L", "1.2", "-o", "m.off"], more].concat());
        read(&here.path().join("m.off")).expect("a mesh").mesh.triangles.len()
    };
    let (plain, one) = (triangles(&[]), triangles(&["--refine"]));
    assert!(one > plain);
    assert!(triangles(&["--refine", "--param", "levels=2"]) > one);
    assert_eq!(triangles(&["--refine", "depth=0"]), plain);
    assert_eq!(triangles(&["--refine", "flatness=0.5"]), plain);
}

#[test]
fn flags_that_say_nothing_together() {
    let here = folder();
    for (flags, words) in [
        (&["--sharp", "--method", "dmc"][..], "--sharp is of the uniform grid"),
        (&["--track", "--sharp"], "--track follows cubes"),
        (&["--track", "--method", "mt"], "--track follows cubes"),
        (&["--method", "mc34"], "possible values"),
        (&["--cap", "--open"], "cannot be used with"),
        (&["--cap", "--method", "dmc"], "--cap closes the meshes of --method mc, mc33 and mt"),
        (&["--cap", "--refine"], "--cap closes"),
        (&["--snap", "0"], "--snap 0: give a finite number over 0"),
        (&["--snap", "nan", "--method", "mt"], "--snap NaN: give"),
        (&["--snap", "1e-3", "--method", "octree"], "--snap or --midpoint is of"),
        (&["--snap", "1e-3", "--midpoint"], "cannot be used with"),
        (&["--seed", "0,0,0"], "--track"),
        (&["--error", "0.1"], "--error is of --method dmc"),
        (&["--most-cells", "9"], "--most-cells is of --method dmc"),
        (&["--method", "dmc", "--backend", "gpu"], "leave out --backend gpu"),
        (&["--method", "dmc", "--error", "-1"], "--error: the error bound is -1"),
        (&["--method", "dmc", "--most-cells", "0"], "--most-cells"),
        (&["--method", "octree", "--error", "0"], "--error: the error bound is 0"),
        (&["--refine", "flatness=1.5"], "flatness is 1.5: give the cosine"),
        (&["--refine", "flatness=-1"], "above -1"),
        (&["--refine", "epsilon=0"], "epsilon is 0"),
        (&["--refine", "step=0"], "step is 0"),
        (&["--refine", "depth=11"], "at most"),
        (&["--refine", "depth=1.5"], "whole number"),
        (&["--refine", "bend=1"], "there are flatness, epsilon, depth, step"),
        (&["--sharp", "--normals", "forward"], "--normals"),
        (&["--track", "--seed", "nan,0,0"], "give finite numbers"),
        (&["--track", "--coarse", "0"], "coarse lattice is 0"),
        (&["--track", "--search", "0"], "0 cells"),
    ] {
        let run = isoforge(here.path(), &[&["extract", "sphere", "-n", "8"], flags].concat());
        assert_eq!(run.code, Some(2), "{flags:?}: {}", run.err);
        assert!(run.err.contains(words) && !run.err.contains("panicked"), "{flags:?}: {}", run.err);
    }
    let run = isoforge(here.path(), &["extract", "sphere", "-n", "8", "--track", "--seed", "9,9,9"]);
    assert_eq!(run.code, Some(1));
    assert!(run.err.contains("lies outside the grid"), "{}", run.err);
}

/// An octree whose budget runs out says how far it got, and the mesh is whole.
#[test]
fn a_budget_that_runs_out() {
    let here = folder();
    let (found, said) = mesh(here.path(), TWO_BALLS, &["--method", "dmc", "--most-cells", "300"]);
    assert!(said.contains("budget of cells ran out") && said.contains("unsplit"), "{said}");
    assert!(found.check().is_closed_manifold(), "{said}");
}

#[test]
fn accuracy_prints_a_table_and_json() {
    let here = folder();
    let out =
        done(here.path(), &["accuracy", "sphere", "torus", "-n", "16", "--refine", "flatness=0.9,depth=2"])
            .out;
    for word in
        ["sphere, 16x16x16 cells", "torus, ", "uniform", "refined", "sharp", "dmc", "octree", "welded"]
    {
        assert!(out.contains(word), "{word}: {out}");
    }
    let out = done(here.path(), &["accuracy", "sphere", "-n", "16", "--json", "-"]).out;
    let tables: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    let rows = tables[0]["rows"].as_array().expect("rows");
    let of = |name: &str, key: &str| {
        rows.iter().find(|row| row["method"] == name).and_then(|row| row[key].as_f64()).expect(name)
    };
    assert_eq!(of("uniform", "points"), 3.0 * of("uniform", "triangles"));
    assert!(of("refined", "distance_rms") < of("uniform", "distance_rms"));
    let run = isoforge(here.path(), &["accuracy", "sphree"]);
    assert!(run.code == Some(2) && run.err.contains("sphree"), "{}", run.err);
}

/// The claim of the 2003 module, and more: no more than 45 % of the triangles of the uniform mesh whose error is as
/// small, on its three scenes.
#[test]
fn the_scenes_of_2003() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let names = ["kugeldiff", "metaflight", "kugelzylinder"].map(|name| format!("{name}.toml"));
    let args = [&["accuracy", "--json", "-"], &names.each_ref().map(String::as_str)[..]].concat();
    let tables: serde_json::Value = serde_json::from_str(&done(&folder, &args).out).expect("JSON");
    for table in tables.as_array().expect("tables") {
        let rows = table["rows"].as_array().expect("rows");
        let (refined, equal) = (&rows[1], rows.last().expect("rows"));
        let number = |row: &serde_json::Value, key: &str| row[key].as_f64().expect("a number");
        let ratio = number(refined, "triangles") / number(equal, "triangles");
        assert!(ratio <= 0.45, "{table}");
        // The uniform grid was made fine enough for the mean error; the largest is the refined mesh's to win.
        assert!(number(refined, "distance_max") <= number(equal, "distance_max"), "{table}");
        assert!(number(equal, "distance_rms") > 0.9 * number(refined, "distance_rms"), "{table}");
    }
}

/// Caps leave triangles whose corners are three places on a line.
#[test]
fn nothing_thin_is_left_of_caps() {
    let here = folder();
    let mut flipped = 0;
    for n in ["20", "48"] {
        let flags = ["--method", "mt", "--cap", "--backend", "cpu", "--stats", "s.json", "-o", "m.ply"];
        let said = done(here.path(), &[&["extract", "gyroid", "-n", n], &flags[..]].concat()).err;
        let found = read(&here.path().join("m.ply")).expect("a mesh").mesh;
        let report = found.check();
        assert!(report.is_closed_manifold() && report.degenerate_triangles == 0, "{report}");
        let stats: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(here.path().join("s.json")).unwrap()).unwrap();
        assert_eq!((&stats["method"]["name"], &stats["degenerate_triangles"]), (&"mt".into(), &0.into()));
        let count = |name: &str| stats[name].as_u64().unwrap();
        let turned = match count("flipped_triangles") {
            0 => String::new(),
            n => format!("{n} flipped, "),
        };
        let told = format!("({} of zero area removed, {turned}0 left)", count("removed_triangles"));
        assert!(said.contains(&told), "{said}");
        flipped += count("flipped_triangles");
    }
    assert!(flipped > 20, "{flipped}");
}

#[test]
fn methods_beside_the_sweep_keep_the_memory_budget() {
    let here = folder();
    let stats = |more: &[&str]| {
        let args = [&["extract", TWO_BALLS, "-n", "64", "--stats", "s.json"], more].concat();
        let said = done(here.path(), &args).err;
        let text = std::fs::read_to_string(here.path().join("s.json")).expect("statistics");
        (serde_json::from_str::<serde_json::Value>(&text).expect("JSON"), said)
    };
    let args = ["extract", TWO_BALLS, "-n", "64", "--sharp", "--memory-budget", "100000"];
    let run = isoforge(here.path(), &args);
    assert!(
        run.code == Some(1) && run.err.contains("sheets needs") && run.err.contains("--memory-budget"),
        "{}",
        run.err
    );
    let (told, _) = stats(&["--sharp"]);
    let needed = told["peak_bytes"].as_u64().expect("a number");
    assert!(run.err.contains(&format!("needs {needed} bytes")), "{needed}, {}", run.err);
    assert_eq!(stats(&["--sharp", "--memory-budget", &needed.to_string()]).0["vertices"], told["vertices"]);
    for method in ["dmc", "octree"] {
        let (whole, said) = stats(&["--method", method]);
        assert!(!said.contains("ran out"), "{said}");
        let (some, said) = stats(&["--method", method, "--memory-budget", "200000"]);
        assert!(said.contains("raise it (--memory-budget)"), "{said}");
        let bytes = [&whole, &some].map(|told| told["peak_bytes"].as_u64().expect("a number"));
        assert!(bytes[1] <= 200_000 && bytes[1] < bytes[0] && bytes[1] > 0, "{bytes:?}");
        // Where the grid is no power of two, nodes at its border are split however little there is.
        let args = ["extract", "gyroid", "-n", "65", "--method", method, "--memory-budget", "200000"];
        let run = isoforge(here.path(), &args);
        assert!(
            run.code == Some(1) && run.err.contains("octree") && run.err.contains("200000"),
            "{}",
            run.err
        );
    }
}

#[test]
fn a_track_takes_steps_and_sizes_of_any_number() {
    let here = folder();
    for flag in ["--search", "--coarse"] {
        for formula in [TWO_BALLS, "1/x"] {
            done(
                here.path(),
                &["extract", formula, "-n", "20", "--track", flag, "4294967295", "-o", "m.ply"],
            );
        }
    }
}
