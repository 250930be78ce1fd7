//! Timings of a million triangles, by hand: `cargo test --release --test mesh -- --ignored --nocapture speed`.

use std::hint::black_box;
use std::time::Instant;

use isoforge::mesh::read::read;
use isoforge::mesh::write::{ENDINGS, write};

use crate::shapes::torus;

#[test]
#[ignore = "timing"]
fn a_million_triangles() {
    let mesh = torus(1000, 500);
    fn time<T>(name: &str, mut run: impl FnMut() -> T) {
        let best = (0..3).map(|_| (Instant::now(), black_box(run())).0.elapsed()).min();
        println!("{name:<20} {best:?}");
    }
    time("check", || mesh.check());
    time("degenerate_count", || mesh.degenerate_count());
    time("clone", || mesh.clone());
    time("remove, none", || mesh.clone().remove_degenerate());
    let mut tied = mesh.clone();
    for v in (0..500_000).step_by(10) {
        tied.vertices[v].position = tied.vertices[v + 1].position;
    }
    time("remove, one in ten", || tied.clone().remove_degenerate());
    let folder = tempfile::tempdir().unwrap();
    for ending in ENDINGS {
        let path = folder.path().join(format!("a.{ending}"));
        time(&format!("write {ending}"), || write(&mesh, &path).unwrap());
        time(&format!("read {ending}"), || read(&path).unwrap());
    }
}
