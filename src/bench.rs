//! Benchmarks: every stage and the whole extraction, on the CPU and on a GPU, at several sizes.
//!
//! [`run`] needs no files: the inputs are named fields (and a [`Volume`] that the caller may give), so one
//! binary carried to a machine with a GPU measures it. Rows are taken one after another, each repeated
//! until its share of time is spent; minimum and median are told, since other work on the machine only
//! ever adds. GPU rows leave the mesh on the GPU, as its users do.

mod frame;
mod machine;
mod report;
mod roofline;

pub use frame::{Frame, Sweep};
pub use machine::{Adapter, Machine};
pub use report::{BenchReport, Row, Seconds};
pub use roofline::{Limits, Roof};

use crate::extract::{ExtractError, Extractor, Method, Options, Report, STAGES, Source, extract_on_cpu};
use crate::field::named::{NameError, Named};
use crate::field::{Field, Points, Sense};
use crate::gpu::Gpu;
use crate::grid::{Grid, GridError};
use crate::volume::Volume;
use glam::{UVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::time::Instant;

/// Where an extraction runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// The CPU twins, on all cores.
    Cpu,
    /// The adapter.
    Gpu,
}

/// Where the samples of a row come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Input {
    /// The field's formula, evaluated where it is needed.
    Analytic,
    /// Values in memory.
    Volume,
}

/// A volume to measure beside the fields.
#[derive(Debug, Clone, Copy)]
pub struct VolumeCase<'a> {
    /// Its name in the report.
    pub name: &'a str,
    /// The volume.
    pub volume: &'a Volume,
    /// The iso value.
    pub iso: f32,
}

/// What to measure.
#[derive(Debug, Clone)]
pub struct BenchOptions<'a> {
    /// Cells along each axis of the fields' grids.
    pub sizes: Vec<u32>,
    /// Names of fields ([`Named`]), extracted at the iso value of their definition.
    pub cases: Vec<String>,
    /// A volume, extracted at its own size.
    pub volume: Option<VolumeCase<'a>>,
    /// How cells become triangles, one after the other.
    pub methods: Vec<Method>,
    /// Whether the fields are also sampled into volumes and extracted from memory.
    pub arrays: bool,
    /// Whether every brick of the fields is taken, instead of those that their intervals leave.
    pub dense: bool,
    /// Whether it is told how far the GPU's stages are from what the adapter can do.
    pub roofline: bool,
    /// Iso values over which volumes are swept on the GPU; 0 for no sweep.
    pub sweep: u32,
    /// Where to run.
    pub backends: Vec<Backend>,
    /// The most timed runs a row.
    pub repeats: u32,
    /// Seconds after which a row gets no further run.
    pub seconds: f64,
    /// Bytes that an extraction may take, and the arrays that are made for it.
    pub memory_budget: u64,
}

impl Default for BenchOptions<'_> {
    fn default() -> Self {
        Self {
            sizes: vec![64, 128, 256],
            cases: ["sphere", "torus", "gyroid"].map(String::from).to_vec(),
            volume: None,
            methods: vec![Method::MarchingCubes],
            arrays: false,
            dense: false,
            roofline: false,
            sweep: 0,
            backends: vec![Backend::Cpu, Backend::Gpu],
            repeats: 7,
            seconds: 2.0,
            memory_budget: u64::MAX,
        }
    }
}

/// Why a benchmark could not begin. A row that fails is told of in [`BenchReport::skipped`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BenchError {
    /// A case that is no field.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A size that is no grid.
    #[error(transparent)]
    Grid(#[from] GridError),
}

impl BenchOptions<'_> {
    /// Whether what is made for a measurement is within the memory budget.
    fn has_room(&self, what: &'static str, needed: u64) -> Result<(), ExtractError> {
        let budget = self.memory_budget;
        if needed > budget { Err(ExtractError::Budget { what, needed, budget }) } else { Ok(()) }
    }
}

/// Measures every row; `progress` hears what is about to be measured.
///
/// # Errors
/// [`BenchError`] if a case or a size is none.
pub fn run(
    options: &BenchOptions<'_>,
    gpu: Option<&Gpu>,
    progress: &mut dyn FnMut(&str),
) -> Result<BenchReport, BenchError> {
    let mut inputs = Vec::new();
    for name in &options.cases {
        let field = Named::new(name)?;
        for &n in &options.sizes {
            let half = Vec3::splat(field.definition().half_edge);
            inputs.push((field.clone(), Grid::from_bounds([n; 3], -half, half)?));
        }
    }
    let wants_gpu = options.backends.contains(&Backend::Gpu);
    let mut skipped = Vec::new();
    if wants_gpu && gpu.is_none() {
        skipped.push("every GPU row: no adapter".into());
    }
    let gpu = gpu.filter(|_| wants_gpu);
    if gpu.is_some() {
        progress("the adapter's copy bandwidth");
    }
    let machine = Machine::of(gpu, options.roofline);
    let extractor = gpu.and_then(|gpu| match Extractor::new(gpu.clone()) {
        Ok(extractor) => Some(extractor),
        Err(error) => {
            skipped.push(format!("every GPU row: {error}"));
            None
        }
    });

    let mut bench = Bench { options, extractor, rows: Vec::new(), skipped, progress };
    for (field, grid) in &inputs {
        let (name, iso) = (field.definition().name, field.definition().iso);
        let sense = field.sense();
        bench.both(name, iso, sense, &Source::Field(field, *grid));
        if options.arrays {
            match options.has_room("the array", 4 * grid.point_count()) {
                Ok(()) => {
                    let volume = sampled(field, *grid);
                    bench.both(name, iso, sense, &Source::Volume(&volume));
                }
                Err(error) => {
                    bench.skipped.push(format!("{name} {0}×{0}×{0} Volume: {error}", grid.cells().x))
                }
            }
        }
    }
    if let Some(VolumeCase { name, volume, iso }) = options.volume {
        bench.both(name, iso, Sense::Above, &Source::Volume(volume));
    }
    let (rows, skipped) = (bench.rows, bench.skipped);
    let limits = machine.adapter.as_ref().and_then(|adapter| adapter.limits.as_ref());
    let roofs = limits.map_or(Vec::new(), |limits| roofline::roofs(limits, &rows));
    Ok(BenchReport { machine, rows, roofs, skipped })
}

/// The field's values at the points of `grid`.
fn sampled(field: &Named, grid: Grid) -> Volume {
    let points = grid.points();
    let row_length = points.x as usize;
    let mut values = vec![0.0; grid.point_count() as usize];
    values.par_chunks_mut(row_length).enumerate().for_each(|(row, values)| {
        let (y, z) = (row as u32 % points.y, row as u32 / points.y);
        let at: Vec<Vec3> = (0..points.x).map(|x| grid.position(UVec3::new(x, y, z).as_vec3())).collect();
        let [x, y, z] = [0, 1, 2].map(|k| at.iter().map(|p| p[k]).collect::<Vec<f32>>());
        // Named fields have a CPU form.
        let _ = field.values(Points { x: &x, y: &y, z: &z }, values);
    });
    Volume::new(grid, values).expect("one value a point")
}

struct Bench<'a> {
    options: &'a BenchOptions<'a>,
    extractor: Option<Extractor>,
    rows: Vec<Row>,
    skipped: Vec<String>,
    progress: &'a mut dyn FnMut(&str),
}

/// Times of a row while it is measured.
#[derive(Default)]
struct Times {
    first: Vec<f64>,
    again: Vec<f64>,
    reports: Vec<Report>,
    frame: Option<Frame>,
    sweep: Option<Sweep>,
}

impl Bench<'_> {
    /// The rows of one input on the backends asked for.
    fn both(&mut self, name: &str, iso: f32, sense: Sense, source: &Source<'_>) {
        let (input, sample_bytes) = match source {
            Source::Field(..) => (Input::Analytic, 4),
            Source::Volume(volume) => (Input::Volume, volume.values().scalar().size() as u64),
        };
        let cells = source.grid().cells();
        let each = self
            .options
            .methods
            .iter()
            .flat_map(|&m| self.options.backends.iter().map(move |&backend| (m, backend)));
        for (method, backend) in each {
            let options = Options {
                method,
                sense: Some(sense),
                cull: !self.options.dense,
                memory_budget: self.options.memory_budget,
                ..Options::new(iso)
            };
            let name = &match method {
                Method::MarchingCubes => name.to_string(),
                Method::Mc33 => format!("{name}, mc33"),
                Method::Tetrahedra => format!("{name}, mt"),
            };
            let label = format!("{name} {}×{}×{} {input:?} on {backend:?}", cells.x, cells.y, cells.z);
            let times = match (backend, &self.extractor) {
                (Backend::Gpu, None) => continue,
                (Backend::Gpu, Some(extractor)) => {
                    (self.progress)(&label);
                    on_gpu(self.options, extractor, source, &options)
                }
                (Backend::Cpu, _) => {
                    (self.progress)(&label);
                    on_cpu(self.options, source, &options)
                }
            };
            match times {
                Ok(times) => {
                    let points = source.grid().point_count();
                    self.rows.push(times.row(backend, name, (input, sample_bytes), cells.into(), points));
                }
                Err(error) => self.skipped.push(format!("{label}: {error}")),
            }
        }
    }
}

/// Whether a row may run once more.
fn goes_on(options: &BenchOptions<'_>, times: &Times, start: Instant) -> bool {
    let done = times.first.len();
    done == 0 || (done < options.repeats as usize && start.elapsed().as_secs_f64() < options.seconds)
}

fn on_cpu(
    options: &BenchOptions<'_>,
    source: &Source<'_>,
    settings: &Options,
) -> Result<Times, ExtractError> {
    let (mut times, start) = (Times::default(), Instant::now());
    if let Source::Volume(volume) = source {
        options.has_room("the volume and a copy of it", 2 * volume.bytes())?;
    }
    // A copy that each run makes anew, in the same memory: a fresh volume has no table of ranges yet.
    let mut fresh = match source {
        Source::Volume(volume) => Some((*volume).clone()),
        Source::Field(..) => None,
    };
    while goes_on(options, &times, start) {
        fresh = fresh.map(|volume| Volume::of(*volume.grid(), volume.into_values()).expect("the same grid"));
        let source = fresh.as_ref().map_or(*source, Source::Volume);
        times.reports.push(timed(&mut times.first, || extract_on_cpu(&source, settings, &|_| {}))?.1);
        if fresh.is_some() {
            timed(&mut times.again, || extract_on_cpu(&source, settings, &|_| {}))?;
        }
    }
    Ok(times)
}

fn on_gpu(
    options: &BenchOptions<'_>,
    extractor: &Extractor,
    source: &Source<'_>,
    settings: &Options,
) -> Result<Times, ExtractError> {
    // The first dispatch of a pipeline compiles it.
    let report = extractor.extract(source, settings)?.report;
    let (mut times, start) = (Times::default(), Instant::now());
    let mut space = match extractor.prepare_for(source, settings.memory_budget, report.active_bricks as u32) {
        Ok(space) => Some(space),
        // More than one slab has.
        Err(ExtractError::Binding { .. } | ExtractError::Slots { .. }) => None,
        Err(error) => return Err(error),
    };
    while goes_on(options, &times, start) {
        times.reports.push(timed(&mut times.first, || extractor.extract(source, settings))?.report);
        let Some(buffers) = &space else { continue };
        match timed(&mut times.again, || extractor.extract_in(buffers, source, settings, &|_| {})) {
            Ok(_) => {}
            // The mesh needs thinner slabs than one workspace has: `extract` alone finds them.
            Err(ExtractError::Binding { .. } | ExtractError::Slots { .. }) => space = None,
            Err(error) => return Err(error),
        }
    }
    let last = times.reports.last().cloned().unwrap_or_default();
    // A volume need not lie on the GPU twice.
    drop(space);
    // What needs more than one slab cannot be recorded in one go.
    if last.slabs == 1 && last.triangles > 0 {
        times.frame = Some(frame::frames(extractor, source, settings, &last)?);
        if let (Source::Volume(volume), 1..) = (source, options.sweep) {
            times.sweep = frame::sweep(extractor, volume, settings, options.sweep)?;
        }
    }
    Ok(times)
}

/// Does `work` and notes its seconds, unless it fails.
fn timed<T>(list: &mut Vec<f64>, work: impl FnOnce() -> Result<T, ExtractError>) -> Result<T, ExtractError> {
    let start = Instant::now();
    let done = work()?;
    list.push(start.elapsed().as_secs_f64());
    Ok(done)
}

impl Times {
    fn row(
        &self,
        backend: Backend,
        case: &str,
        (input, sample_bytes): (Input, u64),
        cells: [u32; 3],
        points: u64,
    ) -> Row {
        let mut stages = BTreeMap::new();
        for (i, &stage) in STAGES.iter().enumerate() {
            let seconds: Vec<f64> = self.reports.iter().filter_map(|r| r.seconds[i]).collect();
            if let Some(seconds) = Seconds::of(&seconds) {
                stages.insert(stage, seconds.median);
            }
        }
        let last = self.reports.last().cloned().unwrap_or_default();
        let total = Seconds::of(&self.first).unwrap_or_default();
        let all_cells = cells.iter().map(|&n| f64::from(n)).product::<f64>();
        let per_second = |count: f64| if total.min > 0.0 { count / total.min } else { 0.0 };
        Row {
            backend,
            case: case.into(),
            input,
            sample_bytes,
            cells,
            points,
            runs: self.first.len(),
            seconds: total,
            again: Seconds::of(&self.again),
            frame: self.frame.clone(),
            sweep: self.sweep.clone(),
            stages,
            cells_per_second: per_second(all_cells),
            triangles_per_second: per_second(last.triangles as f64),
            vertices: last.vertices,
            triangles: last.triangles,
            bricks: last.bricks,
            active_bricks: last.active_bricks,
            peak_bytes: last.peak_bytes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_json() {
        let options = BenchOptions {
            sizes: vec![9],
            cases: vec!["sphere".into(), "torus".into()],
            arrays: true,
            repeats: 2,
            ..BenchOptions::default()
        };
        let report = run(&options, None, &mut |_| {}).unwrap();
        assert_eq!(report.rows.len(), 4);
        assert_eq!(report.rows[0].triangles, report.rows[1].triangles, "the array is the same field");
        assert_eq!(report.skipped.len(), 1);
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["rows"][0]["backend"], "cpu");
        assert!(json["rows"][0]["stages"]["emit"].is_f64());
        assert!(report.to_string().contains("sphere"));
        // 10³ values, and twice as many; what is too large is told and not made.
        for (memory_budget, rows) in [(8 * 1000 + 100_000, 4), (4 * 1000 - 1, 0)] {
            let tight = BenchOptions { memory_budget, ..options.clone() };
            let report = run(&tight, None, &mut |_| {}).unwrap();
            assert_eq!(report.rows.len(), rows, "{:?}", report.skipped);
        }
        let huge = BenchOptions { sizes: vec![1000], memory_budget: 1 << 20, ..options.clone() };
        let report = run(&huge, None, &mut |_| {}).unwrap();
        assert!(
            report.rows.is_empty() && report.skipped.iter().any(|s| s.contains("the array needs")),
            "{:?}",
            report.skipped
        );
        let unknown = BenchOptions { cases: vec!["spher".into()], ..options };
        assert!(matches!(run(&unknown, None, &mut |_| {}), Err(BenchError::Name(_))));
    }
}
