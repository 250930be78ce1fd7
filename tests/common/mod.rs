//! What several tests use.
#![allow(dead_code, reason = "each test binary uses a part")]

use glam::Vec3;
use isoforge::extract::Extractor;
use isoforge::field::named::Named;
use isoforge::gpu::{AdapterChoice, Gpu, adapters};
use isoforge::grid::Grid;
use isoforge::volume::{self, OpenOptions, Volume};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Whether GPU tests run: unless the person asked for a CPU-only run with `ISOFORGE_TESTS=cpu`.
pub fn wants_gpu() -> bool {
    let wanted = !std::env::var("ISOFORGE_TESTS").is_ok_and(|v| v == "cpu");
    if !wanted {
        eprintln!("ISOFORGE_TESTS=cpu: GPU tests are left out");
    }
    wanted
}

/// The device that GPU tests run on, opened once; `None` only in a CPU-only run. A missing adapter is a
/// failed test, not a passed one.
pub fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    let open = || match Gpu::open(AdapterChoice::Best) {
        Ok(gpu) => gpu,
        Err(e) => panic!("{e}; or set ISOFORGE_TESTS=cpu to leave the GPU tests out"),
    };
    GPU.get_or_init(|| wants_gpu().then(open)).as_ref()
}

/// One extractor on that device: pipelines are compiled once a test program.
pub fn extractor() -> Option<&'static Extractor> {
    static EXTRACTOR: OnceLock<Option<Extractor>> = OnceLock::new();
    let new = |gpu: &Gpu| Extractor::new(gpu.clone()).expect("the pipelines compile");
    EXTRACTOR.get_or_init(|| gpu().map(new)).as_ref()
}

/// A device of the test's own, on the same adapter, with these limits. `None` in a CPU-only run.
pub fn own_device(limits: impl FnOnce(wgpu::Limits) -> wgpu::Limits) -> Option<Gpu> {
    if !wants_gpu() {
        return None;
    }
    let adapter = adapters().into_iter().next().expect("GPU tests need an adapter");
    let required_limits = limits(adapter.limits());
    let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
    let (device, queue) =
        pollster::block_on(adapter.request_device(&descriptor)).expect("the adapter gives a device");
    Some(Gpu::from_device(device, queue, adapter.get_info()))
}

/// A named field, and the cube around the origin that shows it, cut into `n` cells along each axis.
pub fn named(name: &str, n: u32) -> (Named, Grid) {
    let field = Named::new(name).expect("a named field");
    let half = Vec3::splat(field.definition().half_edge);
    let grid = Grid::from_bounds([n; 3], -half, half).expect("a good grid");
    (field, grid)
}

/// The volume of `value` at every point, in world coordinates.
pub fn sampled(grid: Grid, value: impl Fn(Vec3) -> f32) -> Volume {
    let n = grid.points();
    let point = |i: u64| {
        let (x, y, z) = (i % u64::from(n.x), i / u64::from(n.x) % u64::from(n.y), i / u64::from(n.x * n.y));
        Vec3::new(x as f32, y as f32, z as f32)
    };
    let values = (0..grid.point_count()).map(|i| value(grid.position(point(i)))).collect();
    Volume::new(grid, values).expect("one value a point")
}

/// The repository's own real volume.
pub fn small_brain() -> Volume {
    read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/brain_24.nii.gz")).expect("it is there")
}

/// The larger volumes lie beside the repository where somebody has put them there: name, volume and an
/// iso value that shows something.
pub fn large_volumes() -> Vec<(&'static str, Volume, f32)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/volumes");
    let known = [
        ("ct_brain_atlas_1mm.nii.gz", 10.0),
        ("shell_225x128x128.tif", 60.0),
        ("bone_128x128x128.tif", 128.0),
    ];
    known.into_iter().filter_map(|(name, iso)| Some((name, read(folder.join(name))?, iso))).collect()
}

fn read(path: PathBuf) -> Option<Volume> {
    path.exists().then(|| volume::open(&path, &OpenOptions::default()).expect("it can be read").volume)
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

    /// Below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// In the unit ball.
    pub fn in_ball(&mut self) -> Vec3 {
        loop {
            let p = Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0;
            if p.length() < 1.0 {
                return p;
            }
        }
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
