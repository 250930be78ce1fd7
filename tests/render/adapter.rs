//! The adapter that GPU tests run on.

use isoforge::gpu::{AdapterChoice, Gpu};

/// The best adapter. `None` only if the person asked for a run without (`ISOFORGE_TESTS=cpu`): a
/// missing adapter is a failure, not a pass.
pub fn gpu() -> Option<Gpu> {
    if std::env::var("ISOFORGE_TESTS").is_ok_and(|v| v == "cpu") {
        eprintln!("left out: ISOFORGE_TESTS=cpu");
        return None;
    }
    match Gpu::open(AdapterChoice::Best) {
        Ok(gpu) => Some(gpu),
        Err(e) => panic!("{e}; or set ISOFORGE_TESTS=cpu to leave the GPU tests out"),
    }
}
