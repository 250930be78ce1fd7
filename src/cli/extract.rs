//! `isoforge extract`.

use super::args::{Backend, ExtractArgs, MethodArg, RawArgs};
use super::colour::{self, Painter};
use super::progress::Progress;
use super::source::{Loaded, Opened};
use super::stats::{Seconds, Stats};
use super::watchdog::{EXTRACTING, Watchdog};
use super::{Failure, backend, method, picture, planes, source, tell};
use crate::extract::{CapError, Capped, ExtractError, Extractor, Options, Report, Source, extract_on_cpu};
use crate::gpu::{Gpu, GpuError, GpuMesh};
use crate::grid::Grid;
use crate::mesh::Mesh;
use crate::mesh::clean::Removed;
use crate::mesh::write::{self, Extra};
use crate::render::View;
use crate::track::TrackError;
use serde_json::Value;
use std::borrow::Cow;
use std::path::Path;
use std::time::Instant;

/// Letters of a source that the last line shows: formulas may be long.
const LONGEST_NAME: usize = 200;

/// Where the mesh is after the extraction.
pub enum Made {
    Gpu(Box<(Extractor, GpuMesh)>),
    Cpu(Mesh),
}

/// Extracts, draws, writes and reports.
pub fn run(args: &ExtractArgs) -> Result<(), Failure> {
    let start = Instant::now();
    check_targets(args)?;
    method::check(args)?;
    let memory_budget = backend::memory_budget(args.run.memory_budget);
    picture::check_memory(args, args.run.backend == Backend::Gpu, memory_budget)?;
    let progress = Progress::new(args.quiet);
    let remark = |text: &str| {
        if !args.quiet {
            tell(text);
        }
    };

    colour::check(args, &remark)?;
    progress.phase("reading");
    let in_parts = planes::Job { args, memory_budget, start, progress: &progress, remark: &remark };
    if in_parts.run()? {
        return Ok(());
    }
    let none = RawArgs::default();
    let raw = colour::raw_of_main(args).unwrap_or(&none);
    let Opened { loaded, notes, camera, refine } = source::load(&args.source, raw, memory_budget)?;
    let mut painter = Painter::load(args, memory_budget.saturating_sub(loaded.bytes()), &remark)?;
    let beside = painter.as_ref().map_or(0, Painter::bytes);
    let read = start.elapsed().as_secs_f64();
    notes.iter().for_each(|note| remark(note));
    let method = args.method.method.of_cells().unwrap_or_default();
    let placement = args.method.placement();
    let options = Options { method, placement, ..loaded.options(&args.source, memory_budget - beside)? };
    let capped = args.method.cap.then(|| Capped::new(&loaded.source(), &options));
    let capped = capped.transpose().map_err(|error| match error {
        CapError::Budget { .. } => {
            Failure::run(error.to_string().replace("`Options::memory_budget`", "--memory-budget"))
        }
        error => Failure::run(error),
    })?;
    let (options, is_volume) = match (&capped, &loaded) {
        // It stays in memory beside its copy.
        (Some(_), Loaded::Volume { .. }) => {
            let memory_budget = options.memory_budget.saturating_sub(loaded.bytes());
            (Options { memory_budget, ..options }, true)
        }
        (_, loaded) => (options, matches!(loaded, Loaded::Volume { .. })),
    };
    if is_volume && args.method.snap.is_some() {
        remark("--snap: a volume has nothing finer than its samples, and vertices lie where these say");
    }
    let source = capped.as_ref().map_or(loaded.source(), Capped::source);
    let grid = *source.grid();
    let wanted = args.method.refine.as_ref();
    let settings =
        wanted.map(|wanted| method::refine_settings(wanted, &refine, source.grid())).transpose()?;
    if let Some(text) = source::precision_remark(source.grid()) {
        remark(&text);
    }

    let (gpu, note) = match args.method.cpu_alone() {
        Some(flag) if args.run.backend == Backend::Auto => (None, Some(format!("{flag} is done by the CPU"))),
        _ => backend::choose(&args.run, &source)?,
    };
    if let Some(note) = note {
        remark(&note);
    }
    progress.phase("extracting");
    if gpu.is_some() {
        picture::check_memory(args, true, memory_budget)?;
    }
    let job = Job { args, loaded: &loaded, source, options: &options, progress: &progress, remark: &remark };
    let Done { made, mut report, told } = match job.extract(gpu) {
        // The volume fits, its mesh does not.
        Err(Failure::Budget(over)) if is_volume => {
            drop(capped);
            drop(loaded);
            return in_parts.run_for_mesh(&over);
        }
        result => result?,
    };
    let refining = Instant::now();
    let (made, refined) = match &settings {
        Some(settings) => {
            progress.phase("refining");
            let Done { made, report: refined, told } = job.refine(made, settings)?;
            (report.vertices, report.triangles) = (refined.vertices, refined.triangles);
            (made, Some(told))
        }
        None => (made, None),
    };
    let refining = refined.is_some().then(|| refining.elapsed().as_secs_f64());
    if report.non_finite > 0 {
        remark(&format!("{} samples are NaN or infinite and count as outside", report.non_finite));
    }
    if report.triangles == 0 {
        tell(empty_message(args, &loaded, &options, &made));
    }

    let coloured = match &mut painter {
        Some(painter) => {
            progress.phase("colouring");
            Some(painter.begin(&*in_memory(&made)?, &remark)?)
        }
        None => None,
    };
    drop(capped);
    drop(loaded);
    if let Some(path) = &args.png {
        progress.phase("drawing");
        match &made {
            Made::Gpu(on_gpu) if picture::crease(args).is_none() => {
                let coloured = painter.as_ref().map(|p| p.paint(&*in_memory(&made)?)).transpose()?;
                picture::draw_gpu(on_gpu.0.gpu(), &on_gpu.1, coloured.as_ref(), args, &camera, path)?;
            }
            made => {
                let (mesh, crease) = (in_memory(made)?, picture::crease(args));
                picture::draw_cpu(&mesh, painter.as_ref(), &args.picture, crease, &camera, path)?;
            }
        }
    }
    let mut seconds = Seconds::of(&report);
    seconds.refine = refining;
    if is_volume {
        seconds.read = Some(read);
    }
    let (backend, adapter) = match &made {
        Made::Gpu(made) => ("gpu", Some(made.0.gpu().info.name.clone())),
        Made::Cpu(_) => ("cpu", None),
    };
    let mesh = match made {
        Made::Gpu(made) if is_read_back(args) || is_counted(args, &made.1, options.memory_budget) => {
            let (extractor, mesh) = *made;
            report.peak_bytes = report.peak_bytes.max(bytes_to_read(&mesh));
            progress.phase("reading back");
            let since = Instant::now();
            let mesh = mesh.read(extractor.gpu()).map_err(Failure::run)?;
            seconds.readback = Some(since.elapsed().as_secs_f64());
            Some(mesh)
        }
        Made::Gpu(_) => None,
        Made::Cpu(mesh) => Some(mesh),
    };
    let finished = finish(
        args,
        mesh,
        &grid,
        (painter.as_ref(), picture::view(&args.picture, &camera)),
        &mut seconds,
        &progress,
    )?;
    drop(progress);

    seconds.total = start.elapsed().as_secs_f64();
    remark(&summary(args, &report, &finished, adapter.as_deref(), seconds.total));
    if let Some(path) = &args.stats {
        let stats = Stats {
            vertices: finished.vertices.unwrap_or(report.vertices),
            triangles: finished.triangles.unwrap_or(report.triangles),
            degenerate_triangles: finished.degenerate,
            removed_triangles: finished.cleaned.unwrap_or_default().triangles as u64,
            flipped_triangles: finished.cleaned.unwrap_or_default().flipped as u64,
            open_edges: finished.open_edges,
            bricks: report.bricks,
            active_bricks: report.active_bricks,
            slabs: report.slabs,
            non_finite_samples: report.non_finite,
            backend,
            adapter: adapter.as_deref(),
            peak_bytes: report.peak_bytes,
            scratch_bytes: report.scratch_bytes,
            method: args.method.named(told),
            refined,
            coloured,
            seconds,
        };
        super::write_text(&serde_json::to_string(&stats).map_err(Failure::run)?, path)?;
    }
    Ok(())
}

/// The mesh in main memory.
fn in_memory(made: &Made) -> Result<Cow<'_, Mesh>, Failure> {
    match made {
        Made::Cpu(mesh) => Ok(Cow::Borrowed(mesh)),
        Made::Gpu(made) => made.1.read(made.0.gpu()).map(Cow::Owned).map_err(Failure::run),
    }
}

/// Whether the mesh must leave the GPU: one that is only drawn, or counted, need not.
fn is_read_back(args: &ExtractArgs) -> bool {
    args.output.is_some() || args.no_degenerate || args.method.cap
}

/// Whether a mesh that need not leave the GPU does, so that `--stats` can tell its open edges.
fn is_counted(args: &ExtractArgs, mesh: &GpuMesh, memory_budget: u64) -> bool {
    args.stats.is_some() && bytes_to_read(mesh) <= memory_budget
}

/// Bytes that a mesh takes while it is read back.
fn bytes_to_read(mesh: &GpuMesh) -> u64 {
    let [vertices, triangles] = [mesh.vertex_capacity, mesh.triangle_capacity];
    GpuMesh::bytes_for(vertices, triangles) + GpuMesh::read_bytes_for(vertices, triangles)
}

/// Whether the mesh is read into main memory, if only for a while: to be coloured, or to be drawn with edges.
pub fn takes_main_memory(args: &ExtractArgs) -> bool {
    let is_parted = args.png.is_some() && picture::crease(args).is_some();
    is_read_back(args) || args.colour.color_by.is_some() || is_parted
}

/// Refuses what cannot be written before the long work begins.
fn check_targets(args: &ExtractArgs) -> Result<(), Failure> {
    if let Some(path) = &args.output {
        if !write::is_mesh_ending(path) {
            return Err(Failure::usage(format!(
                "-o {}: this ending is no mesh format; there are .{}",
                path.display(),
                write::ENDINGS.join(" .")
            )));
        }
        write::check_target(path).map_err(Failure::run)?;
    }
    if let Some(path) = &args.png
        && path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png"))
    {
        return Err(Failure::usage(format!("--png {}: a picture's name ends in .png", path.display())));
    }
    picture::check(&args.picture, args.png.as_deref(), args.output.as_deref())?;
    let inputs: Vec<&Path> = [Some(&args.source.source), args.colour.color_by.as_ref()]
        .into_iter()
        .flatten()
        .map(Path::new)
        .collect();
    super::check_distinct(&inputs, &[("-o", &args.output), ("--png", &args.png), ("--stats", &args.stats)])?;
    args.stats.as_deref().map_or(Ok(()), super::check_text_target)
}

/// What an extraction works with.
pub struct Job<'a> {
    pub args: &'a ExtractArgs,
    pub loaded: &'a Loaded,
    /// What is swept or tracked: what was loaded, or that with closed borders.
    pub source: Source<'a>,
    pub options: &'a Options,
    pub progress: &'a Progress,
    pub remark: &'a dyn Fn(&str),
}

/// A mesh, in numbers that every method has, and what its method tells beside, for `--stats`; null where that is nothing.
pub struct Done {
    pub made: Made,
    pub report: Report,
    pub told: Value,
}

impl Job<'_> {
    fn extract(&self, gpu: Option<Gpu>) -> Result<Done, Failure> {
        let args = self.args;
        if let Some(gpu) = gpu {
            let track = args.method.track;
            let made = if track {
                self.track_on_gpu(&gpu)
            } else {
                self.sweep_on_gpu(&gpu).map_err(TrackError::from)
            };
            match made {
                Ok(done) => return Ok(done),
                // Chosen by us, not by the user: take the path that can.
                Err(error)
                    if args.run.backend == Backend::Auto
                        && is_limit_of_gpu(&error)
                        && !backend::gpu_alone(&self.loaded.source()) =>
                {
                    (self.remark)(&format!("on the GPU {error}; the CPU does it"));
                }
                Err(TrackError::Extract(error)) => {
                    return Err(backend::failure(error, &self.loaded.source()));
                }
                Err(error) => return Err(method::track_failure(error)),
            }
        }
        match args.method.method {
            _ if args.method.track => self.track_on_cpu(),
            _ if args.method.sharp => self.sharp(),
            MethodArg::Dmc => self.dual_marching_cubes(),
            MethodArg::Octree => self.octree(),
            MethodArg::Mc | MethodArg::Mc33 | MethodArg::Mt => {
                let (mesh, report) =
                    extract_on_cpu(&self.source, self.options, &|part| self.progress.set(part))
                        .map_err(Failure::extract)?;
                Ok(Done { made: Made::Cpu(mesh), report, told: Value::Null })
            }
        }
    }

    fn sweep_on_gpu(&self, gpu: &Gpu) -> Result<Done, ExtractError> {
        let watchdog = Watchdog::new(self.args.run.time_limit, EXTRACTING);
        let extractor = Extractor::new(gpu.clone())?;
        watchdog.alive();
        let extraction =
            extractor.extract_with(&self.source, self.options, takes_main_memory(self.args), &|part| {
                watchdog.alive();
                self.progress.set(part);
            })?;
        drop(watchdog);
        let made = Made::Gpu(Box::new((extractor, extraction.mesh)));
        Ok(Done { made, report: extraction.report, told: Value::Null })
    }
}

/// Whether the CPU can do what the GPU could not for its limits.
fn is_limit_of_gpu(error: &TrackError) -> bool {
    matches!(
        error,
        TrackError::Slabs { .. }
            | TrackError::Labels { .. }
            | TrackError::Extract(
                ExtractError::Budget { .. }
                    | ExtractError::Binding { .. }
                    | ExtractError::FieldData { .. }
                    | ExtractError::MeshBuffer { .. }
                    | ExtractError::Gpu(GpuError::OutOfMemory { .. })
            )
    )
}

fn empty_message(args: &ExtractArgs, loaded: &Loaded, options: &Options, made: &Made) -> String {
    if args.method.track {
        return "the mesh is empty: nothing that was looked at crosses the surface; --search 1 finds all there is".into();
    }
    if args.method.most_cells.is_some() {
        return "the mesh is empty: no cell that the budget allows crosses the surface; raise it (--most-cells)".into();
    }
    // The GPU looks at a coarse grid.
    let about = if matches!(made, Made::Gpu(_)) { "about " } else { "" };
    let range = match (made, &loaded.source()) {
        (Made::Gpu(made), source) => made.0.value_range(source).ok().flatten(),
        (Made::Cpu(_), source) => source.value_range(),
    };
    format!("the mesh is empty: {}", uncrossed(options.iso, range, about))
}

/// That no surface lies among samples, which have this range.
pub fn uncrossed(iso: f32, range: Option<(f32, f32)>, about: &str) -> String {
    let range = range.map_or("the field has no finite value there".into(), |(low, high)| {
        format!("the field runs from {about}{low} to {about}{high} there")
    });
    format!("no sample crosses iso {iso}; {range}")
}

/// What became of the mesh; nothing is known of one that was not read back.
#[derive(Default)]
pub struct Finished {
    pub vertices: Option<u64>,
    pub triangles: Option<u64>,
    pub degenerate: Option<u64>,
    /// What `--no-degenerate` did.
    pub cleaned: Option<Removed>,
    pub open_edges: Option<u64>,
}

/// Cleans, counts and writes the mesh, if it was read back.
fn finish(
    args: &ExtractArgs,
    mesh: Option<Mesh>,
    grid: &Grid,
    (painter, view): (Option<&Painter>, View),
    seconds: &mut Seconds,
    progress: &Progress,
) -> Result<Finished, Failure> {
    let Some(mut mesh) = mesh else { return Ok(Finished::default()) };
    // Where sides of the domain meet, a cap has triangles without area.
    let cleaned = (args.no_degenerate || args.method.cap).then(|| mesh.remove_degenerate());
    let degenerate = Some(mesh.degenerate_count() as u64);
    let open_edges = Some(mesh.open_edges_at_border(grid));
    if let Some(path) = &args.output {
        progress.phase("writing");
        let since = Instant::now();
        let painter = painter.filter(|_| colour::has_place(path));
        let coloured = painter.map(|painter| painter.paint(&mesh)).transpose()?;
        let extra = Extra { colours: coloured.as_ref(), strip: None, view };
        write::write_with(&mesh, &extra, path).map_err(Failure::run)?;
        seconds.write = Some(since.elapsed().as_secs_f64());
    }
    Ok(Finished {
        vertices: Some(mesh.vertices.len() as u64),
        triangles: Some(mesh.triangles.len() as u64),
        degenerate,
        cleaned,
        open_edges,
    })
}

/// The last line.
pub fn summary(
    args: &ExtractArgs,
    report: &Report,
    finished: &Finished,
    adapter: Option<&str>,
    total: f64,
) -> String {
    let place = adapter.map_or("the CPU".into(), |name| format!("the GPU ({name})"));
    let vertices = finished.vertices.unwrap_or(report.vertices);
    let triangles = finished.triangles.unwrap_or(report.triangles);
    let mut name = args.source.source.clone();
    if let Some((end, _)) = name.char_indices().nth(LONGEST_NAME) {
        name.replace_range(end.., "…");
    }
    let mut text = format!("{name}: {vertices} vertices, {triangles} triangles");
    let left = finished.degenerate.unwrap_or(0);
    match finished.cleaned {
        None if left > 0 => text += &format!(" ({left} of zero area; --no-degenerate removes them)"),
        None => {}
        Some(Removed { triangles: 0, flipped: 0, .. }) if left == 0 => {}
        Some(Removed { triangles, flipped, .. }) => {
            let flipped = if flipped > 0 { format!("{flipped} flipped, ") } else { String::new() };
            text += &format!(" ({triangles} of zero area removed, {flipped}{left} left)");
        }
    }
    if let Some(open @ 1..) = finished.open_edges {
        text += &format!(", {open} open edges where the domain ends");
    }
    text += &format!(" on {place} in {total:.2} s");
    if args.output.is_none() && args.png.is_none() && args.stats.is_none() {
        text += "; nothing is written, as no file is named (-o, --png, --stats)";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_cpu_takes_over() {
        let is_limit = |error: ExtractError| is_limit_of_gpu(&error.into());
        assert!(is_limit(ExtractError::Budget { what: "", needed: 2, budget: 1 }));
        assert!(!is_limit(ExtractError::Runaway { limit: 1 }));
        assert!(!is_limit(ExtractError::TooLarge { vertices: 1, triangles: 1 }));
    }
}
