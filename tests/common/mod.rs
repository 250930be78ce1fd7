//! What several tests use.
#![allow(dead_code, reason = "each test binary uses a part")]

use isoforge::gpu::{AdapterChoice, Gpu};
use isoforge::grid::Grid;
use isoforge::volume::Volume;
use std::sync::OnceLock;

/// The device that GPU tests run on, opened once.
///
/// A missing adapter is a failed test, not a passed one, unless the person asked for a CPU-only run
/// with `ISOFORGE_TESTS=cpu`: then `None`.
pub fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    GPU.get_or_init(|| {
        if std::env::var("ISOFORGE_TESTS").is_ok_and(|v| v == "cpu") {
            eprintln!("ISOFORGE_TESTS=cpu: GPU tests are left out");
            return None;
        }
        Some(Gpu::open(AdapterChoice::Best).expect("GPU tests need an adapter; see tests/run"))
    })
    .as_ref()
}

/// A small, fast, well-mixed generator (splitmix64), so that tests can be repeated.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to 1.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }
}

/// Samples that make every kind of case, ties, NaN and infinities included, around iso 0.
pub fn noise(grid: Grid, seed: u64) -> Volume {
    let mut random = Random(seed);
    let smooth = seed.is_multiple_of(3);
    let values = (0..grid.point_count())
        .map(|i| match random.next() % 97 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::NEG_INFINITY,
            3 => -0.0,
            4..9 => 0.0,
            _ if smooth => ((i as f32 * 0.013).sin() + 0.3 * random.unit()) - 0.1,
            _ => random.unit() - 0.5,
        })
        .collect();
    Volume::new(grid, values).expect("one value a point")
}
