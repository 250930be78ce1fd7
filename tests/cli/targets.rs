//! Where outputs go: links are followed, pipes and devices stay what they are.
#![cfg(unix)]

use super::program::{cpu_alone, done, files, folder, isoforge};
use std::os::unix::fs::{FileTypeExt, symlink};
use std::path::Path;

const ALL: [&str; 10] =
    ["extract", "sphere", "-n", "8", "--backend", "cpu", "--size", "20x20", "--quiet", "--stats"];

/// What the program run with `args` writes into the pipe `name`, which it must leave a pipe.
fn through_pipe(here: &Path, name: &str, args: &[&str]) -> Vec<u8> {
    let pipe = here.join(name);
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo");
    assert!(made.success());
    let reader = {
        let pipe = pipe.clone();
        std::thread::spawn(move || std::fs::read(pipe).expect("what was written"))
    };
    done(here, args);
    let kind = std::fs::metadata(&pipe).expect("the pipe").file_type();
    assert!(kind.is_fifo(), "{name} was replaced");
    reader.join().expect("the reader")
}

#[test]
fn pipes_are_written_into() {
    let here = folder();
    let here = here.path();
    let stats = through_pipe(here, "s.json", &[&ALL[..], &["s.json"]].concat());
    assert!(stats.starts_with(b"{") && stats.ends_with(b"}\n"));
    let picture = through_pipe(here, "a.png", &[&ALL[..], &["-", "--png", "a.png"]].concat());
    assert_eq!(image::load_from_memory(&picture).expect("a picture").width(), 20);
    for name in ["a.off", "a.obj", "a.ply", "a.stl", "a.glb"] {
        let mesh = through_pipe(here, name, &[&ALL[..], &["-", "-o", name]].concat());
        let file = format!("file-{name}");
        done(here, &[&ALL[..], &["-", "-o", &file]].concat());
        assert!(mesh == std::fs::read(here.join(file)).expect("a file"), "{name}");
    }
    let args = ["bench", "-q", "-n", "8", "--cases", "cube", "--backend", "cpu", "--repeats", "1", "--json"];
    assert!(through_pipe(here, "b.json", &[&args[..], &["b.json"]].concat()).starts_with(b"{"));
    assert!(files(here).iter().all(|name| !name.starts_with('.')));
}

#[test]
fn devices_are_written_into() {
    let here = folder();
    for name in ["null.json", "null.png", "null.ply"] {
        symlink("/dev/null", here.path().join(name)).expect("a link");
    }
    let before = std::fs::metadata("/dev/null").expect("it is there").file_type();
    done(here.path(), &[&ALL[..], &["null.json", "--png", "null.png", "-o", "null.ply"]].concat());
    assert_eq!(std::fs::metadata("/dev/null").expect("it is still there").file_type(), before);
    assert!(here.path().join("null.png").is_symlink());
    if Path::new("/dev/full").exists() {
        symlink("/dev/full", here.path().join("full.ply")).expect("a link");
        let run = isoforge(here.path(), &[&ALL[..], &["-", "-o", "full.ply"]].concat());
        assert!(run.code == Some(1) && run.err.contains("no room"), "{}", run.err);
    }
}

#[test]
fn links_are_followed() {
    let here = folder();
    std::fs::create_dir(here.path().join("sub")).expect("a folder");
    std::fs::write(here.path().join("sub/a.png"), "old").expect("a file");
    // The picture's exists already, the others' are made.
    for name in ["a.png", "a.ply", "a.json"] {
        symlink(format!("sub/{name}"), here.path().join(name)).expect("a link");
    }
    done(here.path(), &[&ALL[..], &["a.json", "--png", "a.png", "-o", "a.ply"]].concat());
    for name in ["a.png", "a.ply", "a.json"] {
        assert!(here.path().join(name).is_symlink(), "{name}");
        assert!(std::fs::metadata(here.path().join("sub").join(name)).expect("its target").len() > 3);
    }
}

/// The time limit is for the GPU's work: here the picture waits longer for its reader.
#[test]
fn a_slow_reader_is_not_the_gpus_fault() {
    if cpu_alone() {
        return;
    }
    let here = folder();
    let pipe = here.path().join("a.png");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let reader = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_secs(9));
        std::fs::read(pipe).expect("what was written")
    });
    let args = [
        "extract",
        "sphere",
        "-n",
        "8",
        "--backend",
        "gpu",
        "--size",
        "20x20",
        "--time-limit",
        "7",
        "--png",
        "a.png",
    ];
    done(here.path(), &args);
    assert!(reader.join().expect("the reader").starts_with(b"\x89PNG"));
}
