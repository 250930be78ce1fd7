//! Both backends stage by stage: each CPU twin gets the bytes that the GPU's earlier stages left, and
//! its output is held against the GPU's. What the `compare` command prints and the parity tests check.

use crate::extract::{ExtractError, Extractor, Normals, Options, Source, Workspace, extract_on_cpu};
use crate::field::{Field, NoForm, Points, Sense, Wgsl};
use crate::gpu::GpuError;
use crate::grid::SAMPLES_PER_BRICK;
use crate::mesh::{Mesh, Vertex};
use crate::stage::classify::BrickRecord;
use crate::stage::classify::cpu::classify;
use crate::stage::cull::bounds::cull_field;
use crate::stage::cull::cpu::range;
use crate::stage::cull::map::BrickMap;
use crate::stage::emit::cpu::{Beside, Gradients, Nearby, NormalsOf, Work, emit};
use crate::stage::inside::{Inside, order_key};
use crate::stage::method::Placement;
use crate::stage::normals::cpu::{add_neighbours, average};
use crate::stage::params::Params;
use crate::stage::sample::cpu::sample;
use crate::stage::samples::Samples;
use crate::stage::scan::cpu::scan;
use crate::table::mc33::MAX_TRIANGLES;
use bytemuck::Zeroable;
use std::fmt;

/// How one output of a stage compares.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The stage.
    pub stage: &'static str,
    /// Which of its outputs.
    pub what: &'static str,
    /// Values compared.
    pub compared: usize,
    /// Values that differ in any bit.
    pub differing: usize,
    /// The largest difference in units in the last place; 0 for whole numbers.
    pub most_ulps: u32,
    /// The largest difference, and the most that is allowed; both 0 for what must be equal bit for bit.
    pub difference: (f64, f64),
}

impl Row {
    /// Whether the output agrees as it must.
    pub fn agrees(&self) -> bool {
        if self.difference.1 == 0.0 { self.differing == 0 } else { self.difference.0 <= self.difference.1 }
    }

    fn exact<T: PartialEq>(stage: &'static str, what: &'static str, gpu: &[T], cpu: &[T]) -> Self {
        let differing = gpu.iter().zip(cpu).filter(|(a, b)| a != b).count() + gpu.len().abs_diff(cpu.len());
        Self {
            stage,
            what,
            compared: gpu.len().max(cpu.len()),
            differing,
            most_ulps: 0,
            difference: (0.0, 0.0),
        }
    }

    /// Compares floats that may differ by at most `allowed`; NaN equals NaN.
    fn close(
        stage: &'static str,
        what: &'static str,
        pairs: impl Iterator<Item = (f32, f32)>,
        allowed: f64,
    ) -> Self {
        let mut row =
            Self { stage, what, compared: 0, differing: 0, most_ulps: 0, difference: (0.0, allowed) };
        for (a, b) in pairs {
            row.compared += 1;
            if a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()) {
                continue;
            }
            row.differing += 1;
            row.most_ulps = row.most_ulps.max(order_key(a.to_bits()).abs_diff(order_key(b.to_bits())));
            let difference = (f64::from(a) - f64::from(b)).abs();
            row.difference.0 =
                row.difference.0.max(if difference.is_nan() { f64::INFINITY } else { difference });
        }
        row
    }
}

/// What agrees between the backends, in the order of the stages.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// One row an output.
    pub rows: Vec<Row>,
    /// What could not be compared, and why.
    pub notes: Vec<String>,
}

impl Comparison {
    /// Whether everything agrees.
    pub fn agrees(&self) -> bool {
        self.rows.iter().all(Row::agrees)
    }

    /// Whether there was no triangle to compare.
    pub fn is_empty(&self) -> bool {
        self.rows.iter().filter(|row| row.what == "indices").all(|row| row.compared == 0)
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:<10}{:<34}{:>12}{:>12}{:>10}  verdict",
            "stage", "output", "compared", "differing", "ULPs"
        )?;
        for row in &self.rows {
            let verdict = match (row.agrees(), row.differing) {
                (true, 0) => "equal bit for bit".into(),
                (true, _) => format!("within {:.1e}: at most {:.1e}", row.difference.1, row.difference.0),
                (false, _) if row.difference.1 > 0.0 => {
                    format!("DISAGREES: {:.1e}, allowed {:.1e}", row.difference.0, row.difference.1)
                }
                (false, _) => "DISAGREES".into(),
            };
            let Row { stage, what, compared, differing, most_ulps, .. } = row;
            writeln!(f, "{stage:<10}{what:<34}{compared:>12}{differing:>12}{most_ulps:>10}  {verdict}")?;
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "{note}"))
    }
}

/// Why a comparison could not be made.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The extraction itself failed.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// The grid does not fit in one slab and batch, whose buffers are compared.
    #[error(
        "the grid takes {slabs} slabs and {batches} batches here, and one of each is compared: use a coarser grid"
    )]
    TooLarge {
        /// Slabs of the plan.
        slabs: usize,
        /// Batches of the plan.
        batches: u32,
    },
}

impl From<GpuError> for CompareError {
    fn from(error: GpuError) -> Self {
        Self::Extract(error.into())
    }
}

impl From<NoForm> for CompareError {
    fn from(error: NoForm) -> Self {
        Self::Extract(error.into())
    }
}

/// Runs the GPU with poisoned buffers, then every twin on the GPU's bytes, then both whole paths.
///
/// cull, classify, scan and indices must be equal bit for bit; samples within 2⁻²⁰ of the largest,
/// positions within 4 ULPs of the largest coordinate, normals within 1e-3.
///
/// # Errors
/// [`CompareError`].
pub fn compare(
    extractor: &Extractor,
    source: &Source<'_>,
    options: &Options,
) -> Result<Comparison, CompareError> {
    // How many bricks are active is known once they are counted.
    let active = extractor.extract(source, options)?.report.active_bricks;
    let space = extractor.prepare_for(source, options.memory_budget, active as u32)?;
    let plan = space.plan();
    if plan.slab_count() > 1 || plan.batches > 1 {
        return Err(CompareError::TooLarge { slabs: plan.slab_count(), batches: plan.batches });
    }
    extractor.poison(&space);
    let extraction = extractor.extract_in(&space, source, options, &|_| {})?;
    let mesh = extraction.mesh.read(extractor.gpu())?;
    // Classify that took them itself left those of bricks that make anything alone.
    let kept = match extractor.takes_samples(&space, options)? {
        true => Some(extractor.gpu().read(space.buffers().source, active * SAMPLES_PER_BRICK as u64)?),
        false => None,
    };
    if kept.is_some() {
        extractor.sample_all(&space, options)?;
    }
    let gpu = Snapshot::read(extractor, &space)?;
    let sense = options.sense.unwrap_or(source.sense());
    let params = Params::new(source.grid(), options.iso, sense)
        .with_normals(options.normals)
        .with_method(options.method, options.placement);
    let inside = Inside::new(options.iso, sense);

    let mut found = Comparison { rows: Vec::new(), notes: Vec::new() };
    compare_cull(&mut found, source, options, &params, &gpu, extractor.gpu().is_software());
    let sampled = compare_sample(&mut found, source, &params, &gpu)?;
    if let Some(kept) = kept {
        compare_kept(&mut found, &gpu, &kept);
    }
    let counts = compare_classify(&mut found, source, &params, inside, &gpu);
    found.rows.push(Row::exact("scan", "offsets", &gpu.offsets, &counts));
    compare_emit(&mut found, source, options, &params, inside, &gpu, &mesh)?;
    if sampled {
        compare_whole(&mut found, source, options, &mesh)?;
    } else {
        found.notes.push("sample, normals and the whole path: only a GPU evaluates this field".into());
    }
    Ok(found)
}

/// The GPU's buffers after a run.
struct Snapshot {
    ranges: Vec<[u32; 2]>,
    map: Vec<[u32; 2]>,
    active: Vec<u32>,
    samples: Vec<f32>,
    records: Vec<BrickRecord>,
    offsets: Vec<[u32; 2]>,
}

impl Snapshot {
    fn read(extractor: &Extractor, space: &Workspace) -> Result<Self, GpuError> {
        let gpu = extractor.gpu();
        let buffers = space.buffers();
        let bricks = u64::from(space.plan().bricks);
        let words = BrickMap::word_count(bricks);
        let map: Vec<[u32; 2]> = gpu.read(buffers.map, words)?;
        let active = u64::from(map[words as usize - 1][1]).min(space.plan().slots.into());
        // Only volumes have them.
        let ranges = if buffers.has_samples { Vec::new() } else { gpu.read(buffers.ranges, bricks)? };
        let samples = if buffers.has_samples { gpu.read(buffers.source, active * 729)? } else { Vec::new() };
        Ok(Self {
            ranges,
            map,
            active: gpu.read(buffers.active, active)?,
            samples,
            records: gpu.read(buffers.records, active)?,
            offsets: gpu.read(buffers.counts, active + 1)?,
        })
    }

    /// The samples of a slot: the volume's own, or those that the GPU wrote.
    fn samples<'a>(&'a self, source: &'a Source<'_>, params: &Params, slot: usize) -> Samples<'a> {
        let origin = params.brick_origin(self.active[slot]);
        match source {
            Source::Volume(volume) => Samples::of_volume(volume.values(), params.points, origin),
            Source::Field(..) => {
                let brick: &[f32] = &self.samples[slot * SAMPLES_PER_BRICK..][..SAMPLES_PER_BRICK];
                // The slice has that length.
                let brick = <&[f32; SAMPLES_PER_BRICK]>::try_from(brick).unwrap_or(&[0.0; SAMPLES_PER_BRICK]);
                Samples::of_brick(brick, params.points, origin)
            }
        }
    }
}

fn compare_cull(
    found: &mut Comparison,
    source: &Source<'_>,
    options: &Options,
    params: &Params,
    gpu: &Snapshot,
    is_exact: bool,
) {
    let twin = match source {
        Source::Volume(volume) => {
            let (ranges, _) = range(params, volume.values());
            found.rows.push(Row::exact("cull", "range of each brick", &gpu.ranges, &ranges));
            BrickMap::of_ranges(params, &gpu.ranges)
        }
        Source::Field(field, _) if options.cull && has_bounds(*field) => {
            let active = cull_field(params, *field).active;
            BrickMap::new(params.slab_bricks, |brick| active.binary_search(&brick).is_ok())
        }
        Source::Field(..) => BrickMap::new(params.slab_bricks, |_| true),
    };
    let bits = |words: &[[u32; 2]]| words.iter().map(|word| word[0]).collect::<Vec<u32>>();
    let (own, twin) = (bits(&gpu.map), bits(&twin.words));
    let apart = own.iter().zip(&twin).map(|(a, b)| (a ^ b).count_ones() as usize).sum();
    // Any bounds will do that hold; those of a GPU that contracts are a little different, and so are bricks at
    // their edge: that none with surface is missing, the whole mesh shows. Without bounds there is nothing to round.
    let has_rounding = matches!(source, Source::Field(field, _) if options.cull && has_bounds(*field));
    let kept = own.iter().map(|bits| bits.count_ones()).sum::<u32>();
    let allowed = if is_exact || !has_rounding { 0.0 } else { 4.0 + 1e-2 * f64::from(kept) };
    found.rows.push(Row {
        stage: "cull",
        what: "bits of the brick map",
        compared: params.slab_bricks as usize,
        differing: apart,
        most_ulps: 0,
        difference: (apart as f64, allowed),
    });
    // From the GPU's bits on there is nothing to round.
    let twin = BrickMap::of_bits(own[..own.len() - 1].iter().copied());
    found.rows.push(Row::exact("cull", "brick map", &gpu.map, &twin.words));
    found.rows.push(Row::exact("cull", "active list", &gpu.active, &twin.list()));
}

fn has_bounds(field: &dyn Field) -> bool {
    field.wgsl().is_ok_and(|wgsl| wgsl.interval.is_some())
}

/// Whether there were samples to compare.
fn compare_sample(
    found: &mut Comparison,
    source: &Source<'_>,
    params: &Params,
    gpu: &Snapshot,
) -> Result<bool, NoForm> {
    let Source::Field(field, _) = source else { return Ok(true) };
    let mut twin = vec![[0.0; SAMPLES_PER_BRICK]; gpu.active.len()];
    for (samples, &brick) in twin.iter_mut().zip(&gpu.active) {
        match sample(params, *field, params.brick_origin(brick), samples) {
            Ok(()) => {}
            Err(NoForm::Cpu) => return Ok(false),
            Err(error) => return Err(error),
        }
    }
    let twin = twin.as_flattened();
    let largest = twin.iter().filter(|v| v.is_finite()).fold(0.0f32, |m, v| m.max(v.abs()));
    let allowed = f64::from(largest) * 2.0f64.powi(-20);
    let pairs = gpu.samples.iter().copied().zip(twin.iter().copied());
    found.rows.push(Row::close("sample", "values", pairs, allowed.max(f64::MIN_POSITIVE)));
    Ok(true)
}

/// The samples that classify kept for emit, of the bricks that make anything, against those of the sample stage: one kernel's and the
/// other's bits are equal.
fn compare_kept(found: &mut Comparison, gpu: &Snapshot, kept: &[f32]) {
    let of_emit = |samples: &[f32]| -> Vec<u32> {
        let bricks = samples.chunks_exact(SAMPLES_PER_BRICK).zip(gpu.offsets.windows(2));
        let bricks = bricks.filter(|(_, offsets)| offsets[0] != offsets[1]);
        bricks.flat_map(|(brick, _)| brick.iter().map(|v| v.to_bits())).collect()
    };
    found.rows.push(Row::exact("classify", "samples kept for emit", &of_emit(kept), &of_emit(&gpu.samples)));
}

/// The twin's counts, scanned.
fn compare_classify(
    found: &mut Comparison,
    source: &Source<'_>,
    params: &Params,
    inside: Inside,
    gpu: &Snapshot,
) -> Vec<[u32; 2]> {
    let mut records = vec![BrickRecord::zeroed(); gpu.active.len()];
    let mut counts = vec![[0; 2]; gpu.active.len() + 1];
    for (slot, record) in records.iter_mut().enumerate() {
        counts[slot] = classify(params, inside, &gpu.samples(source, params, slot), record);
    }
    let gpu_counts: Vec<[u32; 2]> =
        gpu.offsets.windows(2).map(|w| [0, 1].map(|i| w[1][i].wrapping_sub(w[0][i]))).collect();
    found.rows.push(Row::exact("classify", "edge masks and prefixes", &gpu.records, &records));
    found.rows.push(Row::exact("classify", "counts", &gpu_counts, &counts[..gpu.active.len()]));
    scan(&mut counts);
    counts
}

fn compare_emit(
    found: &mut Comparison,
    source: &Source<'_>,
    options: &Options,
    params: &Params,
    inside: Inside,
    gpu: &Snapshot,
    mesh: &Mesh,
) -> Result<(), NoForm> {
    let (mut has_normals, mut has_positions, mut is_marked) = (true, true, false);
    let mut twin = Mesh::default();
    let mut nearby = Nearby::new(params, &gpu.active, 0);
    let mut work = Work::default();
    for (slot, &brick) in gpu.active.iter().enumerate() {
        let size = [0, 1].map(|i| gpu.offsets[slot + 1][i].saturating_sub(gpu.offsets[slot][i]) as usize);
        // A defect elsewhere must not ask for absurd memory here: a brick has no more than this.
        let mut vertices = vec![Vertex::default(); size[0].min(7 * 512)];
        let mut triangles = vec![[0; 3]; size[1].min(MAX_TRIANGLES * 512)];
        let samples = gpu.samples(source, params, slot);
        let here = (params.brick_origin(brick), &samples);
        let first = inside.test(samples.at(0, 0, 0));
        let beside = Beside::new(&mut nearby, &gpu.active, &gpu.records, &gpu.offsets, first, slot);
        let mut vertices_of = |normals| {
            emit(params, inside, normals, here, &beside, &mut work, (&mut vertices, &mut triangles))
        };
        let done = match source {
            Source::Volume(volume) => vertices_of(NormalsOf::Volume(volume.values())),
            Source::Field(field, _) => {
                let own = Gradients { normals: options.normals, here: *field, whole: *field };
                vertices_of(NormalsOf::Field(own))
            }
        };
        match done {
            Ok(marked) => is_marked |= marked,
            Err(NoForm::Cpu) => {
                has_normals = false;
                // Snapping asks for values, too.
                has_positions = !matches!(params.placement, Placement::Snapped { .. });
                if has_positions {
                    let none = Gradients { normals: Normals::Exact, here: &NoNormals, whole: &NoNormals };
                    vertices_of(NormalsOf::Field(none))?;
                }
            }
            Err(error) => return Err(error),
        }
        twin.vertices.append(&mut vertices);
        twin.triangles.append(&mut triangles);
    }
    found.rows.push(Row::exact("emit", "indices", &mesh.triangles, &twin.triangles));
    found.rows.push(Row::exact("emit", "number of vertices", &[mesh.vertices.len()], &[twin.vertices.len()]));
    let largest = twin.vertices.iter().flat_map(|v| v.position).fold(0.0f32, |m, c| m.max(c.abs()));
    let allowed = f64::from(largest) * 4.0 * f64::from(f32::EPSILON);
    if has_positions {
        let pairs = parts(mesh, &twin, |v| v.position);
        found.rows.push(Row::close("emit", "positions", pairs, allowed.max(f64::MIN_POSITIVE)));
    } else {
        found.notes.push("snapped positions: only a GPU evaluates this field".into());
    }
    if has_normals {
        if is_marked {
            add_neighbours(&mut twin.vertices, &twin.triangles);
            average(params, &mut twin.vertices);
        }
        found.rows.push(Row::close("normals", "normals", parts(mesh, &twin, |v| v.normal), 1e-3));
    }
    Ok(())
}

fn parts<'a>(
    gpu: &'a Mesh,
    cpu: &'a Mesh,
    part: impl Fn(&Vertex) -> [f32; 3] + Copy + 'a,
) -> impl Iterator<Item = (f32, f32)> + 'a {
    gpu.vertices.iter().zip(&cpu.vertices).flat_map(move |(a, b)| part(a).into_iter().zip(part(b)))
}

/// Both paths from the source on. Where the backends' samples differ, cells at the very surface may fall
/// into different cases: then only the numbers of triangles are compared, roughly.
fn compare_whole(
    found: &mut Comparison,
    source: &Source<'_>,
    options: &Options,
    mesh: &Mesh,
) -> Result<(), ExtractError> {
    let (cpu, _) = extract_on_cpu(source, options, &|_| {})?;
    if cpu.triangles == mesh.triangles {
        found.rows.push(Row::exact("whole", "indices", &mesh.triangles, &cpu.triangles));
        let same = mesh.vertices.iter().zip(&cpu.vertices).all(|(a, b)| a == b);
        let step = source.grid().shortest_step();
        let row = Row::close("whole", "positions", parts(mesh, &cpu, |v| v.position), step);
        found.rows.push(row);
        if same {
            found.notes.push("the backends give the same bytes".into());
        }
    } else {
        let apart = mesh.triangles.len().abs_diff(cpu.triangles.len()) as f64;
        let allowed = 4.0 + 1e-3 * cpu.triangles.len() as f64;
        found.rows.push(Row {
            stage: "whole",
            what: "number of triangles",
            compared: cpu.triangles.len(),
            differing: apart as usize,
            most_ulps: 0,
            difference: (apart, allowed),
        });
    }
    Ok(())
}

/// Stands for a field that only a GPU evaluates, where normals do not matter.
#[derive(Debug)]
struct NoNormals;

impl Field for NoNormals {
    fn sense(&self) -> Sense {
        Sense::Below
    }
    fn values(&self, _: Points<'_>, _: &mut [f32]) -> Result<(), NoForm> {
        Err(NoForm::Cpu)
    }
    fn gradients(&self, _: Points<'_>, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        out.fill([0.0; 3]);
        Ok(())
    }
    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        Err(NoForm::Gpu)
    }
}
