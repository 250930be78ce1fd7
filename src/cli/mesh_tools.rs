//! `isoforge mesh-tools`: a mesh from file to file, through steps in a fixed order, with a check after each.

use super::args::PictureArgs;
use super::check::read_mesh;
use super::progress::Progress;
use super::values::{count, least, length};
use super::{Failure, picture, tell};
use crate::mesh::check::Report;
use crate::mesh::write::{self, Extra, write_with};
use crate::mesh::{Budget, Least, Mesh, Taubin};
use crate::scene;
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

/// The steps are done in the order of the flags here, whatever their order on the command line.
#[derive(Debug, Args)]
pub struct MeshToolsArgs {
    /// A mesh: .off .obj .ply .stl .glb
    pub file: PathBuf,

    /// 1. Merge vertices that are no farther apart than this, in world units; 0 for those at the same place
    #[arg(long, value_name = "DISTANCE", value_parser = length, allow_negative_numbers = true)]
    pub weld: Option<f32>,

    /// 2. Make a manifold of a surface that touches itself: sheets without thickness go, and what meets in single edges and
    ///    vertices comes apart; where that cannot be, as where the winding turns over, it opens
    #[arg(long)]
    pub repair: bool,

    /// 3. Remove components with fewer triangles than this, or with less than a part of the largest's
    ///    area or volume; the largest stays
    #[arg(long, value_name = "N|area=PART|volume=PART", value_parser = least, allow_negative_numbers = true)]
    pub remove_below: Option<Least>,

    /// 4. Smooth so often, 200 times at most, keeping open borders, and the volume but for 0.03 % each time (Taubin)
    #[arg(long, value_name = "ITERATIONS", value_parser = clap::value_parser!(u32).range(1..=200), allow_negative_numbers = true)]
    pub smooth: Option<u32>,

    /// 5. Collapse edges down to so many triangles; the topology stays
    #[arg(long, value_name = "TRIANGLES", value_parser = count::<usize>, allow_negative_numbers = true)]
    pub simplify: Option<usize>,

    /// Collapse edges while the surface moves by no more than this, in world units; with --simplify, whichever ends
    /// first
    #[arg(long, value_name = "DISTANCE", value_parser = length, allow_negative_numbers = true)]
    pub simplify_error: Option<f32>,

    /// 6. Order triangles for a GPU's vertex cache, and vertices by their first use (feature `meshopt`)
    #[arg(long)]
    pub optimize: bool,

    /// 7. Write the triangles as one strip: .glb, primitive mode 5 (feature `meshopt`)
    #[arg(long, requires = "output")]
    pub strips: bool,

    /// Write the mesh, to another file; the ending chooses the format: .off .obj .ply .stl .glb .rib
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Draw the mesh into a PNG
    #[arg(long, value_name = "FILE")]
    pub png: Option<PathBuf>,

    /// Write one JSON object with the check after each step; - for standard output
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Print errors alone
    #[arg(short, long)]
    pub quiet: bool,

    #[command(flatten)]
    pub picture: PictureArgs,
}

impl MeshToolsArgs {
    /// A flag that only the feature `meshopt` has an answer to.
    fn of_meshopt(&self) -> Option<&'static str> {
        let flags = [(self.optimize, "--optimize"), (self.strips, "--strips")];
        flags.into_iter().find_map(|(is_given, flag)| is_given.then_some(flag))
    }
}

/// Reads, does the steps, and writes.
pub fn run(args: &MeshToolsArgs) -> Result<(), Failure> {
    let start = Instant::now();
    check(args)?;
    let progress = Progress::new(args.quiet);
    progress.phase("reading");
    let mesh = read_mesh(&args.file, &|text| remark(args, text))?;
    let mut work = Work::new(args, mesh, &progress);
    work.clean()?;
    work.reduce()?;
    #[cfg(feature = "meshopt")]
    work.order()?;
    work.write()?;
    if let Some(path) = &args.stats {
        let seconds = start.elapsed().as_secs_f64();
        let stats = json!({ "file": args.file, "steps": work.told, "seconds": seconds });
        super::write_text(&stats.to_string(), path)?;
    }
    Ok(())
}

fn remark(args: &MeshToolsArgs, text: &str) {
    if !args.quiet {
        tell(text);
    }
}

/// Refuses what cannot work before the file is read.
fn check(args: &MeshToolsArgs) -> Result<(), Failure> {
    if let Some(flag) = args.of_meshopt().filter(|_| cfg!(not(feature = "meshopt"))) {
        return Err(Failure::usage(format!(
            "{flag}: this program was built without the feature `meshopt`, which does that: build it with `cargo build \
             --release --features meshopt` (which takes a C++ compiler)"
        )));
    }
    if let Some(path) = &args.output {
        let ending = write::ending(path).ok_or_else(|| {
            let endings = write::ENDINGS.join(" .");
            Failure::usage(format!(
                "-o {}: this ending is no mesh format; there are .{endings}",
                path.display()
            ))
        })?;
        if args.strips && ending != "glb" {
            return Err(Failure::usage(format!(
                "-o {}: the format has no place for the triangle strip of --strips: name the file .glb",
                path.display()
            )));
        }
        write::check_target(path).map_err(Failure::run)?;
    }
    picture::check(&args.picture, args.png.as_deref(), args.output.as_deref())?;
    let outputs = [("-o", &args.output), ("--png", &args.png), ("--stats", &args.stats)];
    super::check_distinct(&[&args.file], &outputs)?;
    args.stats.as_deref().map_or(Ok(()), super::check_text_target)
}

/// The mesh on its way.
struct Work<'a> {
    args: &'a MeshToolsArgs,
    progress: &'a Progress,
    mesh: Mesh,
    report: Report,
    strip: Option<Vec<u32>>,
    /// What `--stats` says of each step.
    told: Vec<Value>,
}

impl<'a> Work<'a> {
    fn new(args: &'a MeshToolsArgs, mesh: Mesh, progress: &'a Progress) -> Self {
        let report = mesh.check();
        let work = Self {
            args,
            progress,
            told: vec![json!({ "step": "read", "check": report })],
            mesh,
            report,
            strip: None,
        };
        let r = &work.report;
        work.remark(&format!("read: {} vertices, {}", r.vertices, state(r)));
        work
    }

    fn remark(&self, text: &str) {
        remark(self.args, text);
    }

    /// Does one step, checks the mesh, and tells what became of it.
    fn step(
        &mut self,
        name: &'static str,
        what: &str,
        work: impl FnOnce(&mut Mesh, &Progress) -> Result<String, Failure>,
    ) -> Result<(), Failure> {
        let since = Instant::now();
        self.progress.phase(name);
        let note = work(&mut self.mesh, self.progress)?;
        let seconds = since.elapsed().as_secs_f64();
        self.progress.phase("checking");
        let before = std::mem::replace(&mut self.report, self.mesh.check());
        let (after, is_worse) =
            (&self.report, before.is_closed_manifold() && !self.report.is_closed_manifold());
        self.told.push(json!({ "step": name, "seconds": seconds, "note": note, "check": after }));
        let note = if note.is_empty() { note } else { format!("; {note}") };
        self.remark(&format!("{what}: {} → {}{note}", state(&before), state(after)));
        if is_worse && after.triangles > 0 {
            self.remark(&format!("the mesh was closed before {what}, and is not any more"));
        }
        Ok(())
    }

    /// What needs no library.
    fn clean(&mut self) -> Result<(), Failure> {
        let args = self.args;
        if self.report.non_finite_vertices + self.report.bad_indices > 0 {
            self.step("broken", "leaving out triangles with NaN or infinite corners", |mesh, _| {
                let removed = mesh.remove_broken();
                Ok(format!("{} triangles and {} vertices left out", removed.triangles, removed.vertices))
            })?;
        }
        if let Some(distance) = args.weld {
            self.step("weld", &format!("--weld {distance}"), |mesh, _| {
                let removed = mesh.weld_within(distance).map_err(Failure::usage)?;
                Ok(format!("{} vertices merged, {} triangles gone", removed.vertices, removed.triangles))
            })?;
        }
        if args.repair {
            self.step("repair", "--repair", |mesh, _| {
                let repaired = mesh.repair();
                Ok(format!("{} triangles gone, {} vertices split off", repaired.triangles, repaired.split))
            })?;
        }
        if let Some(least) = args.remove_below {
            self.step("remove_below", "--remove-below", |mesh, _| {
                let removed = mesh.remove_below(least);
                Ok(format!("{} triangles gone", removed.triangles))
            })?;
        }
        if let Some(iterations) = args.smooth {
            let volume = self.report.volume;
            self.step("smooth", &format!("--smooth {iterations}"), |mesh, progress| {
                let settings = Taubin { iterations, ..Taubin::default() };
                mesh.smooth(&settings, &|part| progress.set(part)).map_err(Failure::usage)?;
                Ok(String::new())
            })?;
            if self.report.is_closed_manifold() {
                let change = 100.0 * (self.report.volume / volume - 1.0);
                self.remark(&format!(
                    "the volume went from {volume:.6} to {:.6}, by {change:+.3} %",
                    self.report.volume
                ));
            }
        }
        Ok(())
    }

    fn reduce(&mut self) -> Result<(), Failure> {
        let args = self.args;
        if args.simplify.is_some() || args.simplify_error.is_some() {
            let budget = Budget {
                triangles: args.simplify.unwrap_or(0),
                error: args.simplify_error.unwrap_or(f32::INFINITY),
            };
            self.step("simplify", "--simplify", |mesh, _| {
                // Vertices at one place would keep each other.
                mesh.remove_degenerate();
                let moved = mesh.simplify(&budget).map_err(Failure::run)?;
                // Where the surface is flat, three vertices may be left on one line.
                mesh.remove_degenerate();
                Ok(format!("the surface moved by {moved:.3e}"))
            })?;
            let count = self.mesh.triangles.len();
            if args.simplify_error.is_none() && count > budget.triangles {
                self.remark(&format!("{count} triangles are left: fewer would turn over, or close a handle, or a part would vanish"));
            }
        }
        Ok(())
    }

    #[cfg(feature = "meshopt")]
    fn order(&mut self) -> Result<(), Failure> {
        let args = self.args;
        if args.optimize {
            self.step("optimize", "--optimize", |mesh, _| {
                let before = mesh.cache_misses();
                mesh.optimize().map_err(Failure::run)?;
                Ok(format!("{before:.3} → {:.3} vertices fetched a triangle", mesh.cache_misses()))
            })?;
        }
        if args.strips {
            let strip = self.mesh.strip().map_err(Failure::run)?;
            let each = strip.len() as f64 / self.mesh.triangles.len().max(1) as f64;
            self.remark(&format!("--strips: {} indices in the strip, {each:.2} a triangle", strip.len()));
            self.told.push(json!({ "step": "strips", "indices": strip.len() }));
            self.strip = Some(strip);
        }
        Ok(())
    }

    fn write(&mut self) -> Result<(), Failure> {
        let args = self.args;
        if self.mesh.vertices.iter().all(|v| v.normal == [0.0; 3]) {
            self.mesh.set_normals();
        }
        if let Some(path) = &args.png {
            self.progress.phase("drawing");
            let crease = args.picture.crease.filter(|degrees| *degrees < 180.0);
            picture::draw_cpu(&self.mesh, None, &args.picture, crease, &scene::Camera::default(), path)?;
        }
        if let Some(path) = &args.output {
            self.progress.phase("writing");
            let extra = Extra {
                colours: None,
                strip: self.strip.as_deref(),
                view: picture::view(&args.picture, &scene::Camera::default()),
            };
            let bytes = write_with(&self.mesh, &extra, path).map_err(Failure::run)?;
            self.remark(&format!("{}: {bytes} bytes, {}", path.display(), state(&self.report)));
        }
        Ok(())
    }
}

/// What a check says, in a few words.
fn state(report: &Report) -> String {
    let count = |n: usize, one: &str| if n == 1 { format!("1 {one}") } else { format!("{n} {one}s") };
    let mut faults: Vec<String> = [
        (report.non_manifold_edges, "non-manifold edge"),
        (report.misoriented_edges, "misoriented edge"),
        (report.degenerate_triangles, "zero-area triangle"),
        (report.duplicate_triangles, "duplicate triangle"),
        (report.non_finite_vertices, "NaN or infinite position"),
    ]
    .into_iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, one)| count(n, one))
    .collect();
    match report.non_manifold_vertices {
        0 => {}
        1 => faults.push("1 non-manifold vertex".into()),
        n => faults.push(format!("{n} non-manifold vertices")),
    }
    let closed = if report.is_closed_manifold() {
        "closed".into()
    } else if report.triangles == 0 {
        "empty".into()
    } else if report.boundary_edges > 0 {
        format!(
            "open along {} of {}",
            count(report.boundary_loops, "loop"),
            count(report.boundary_edges, "edge")
        )
    } else {
        "no border, but not closed".into()
    };
    faults.insert(0, closed);
    let (triangles, components) =
        (count(report.triangles, "triangle"), count(report.components, "component"));
    format!("{triangles}, {components}, {}", faults.join(", "))
}
