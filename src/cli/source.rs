//! What the first argument is: a field's name, a formula, a WGSL file, a scene, a volume, or points.

use super::Failure;
use super::args::{NormalsArg, RawArgs, SourceArgs};
use super::blobs::load_components;
use crate::components;
use crate::extract::{Normals, Options, Source};
use crate::field::named::{self, Named};
use crate::field::user::UserField;
use crate::field::{self, Field, Sense};
use crate::graph::formula::{self, Fault, FormulaError};
use crate::graph::volume::{Gradient, Interpolation, Lookup, VolumeLeaf, VolumeLeafError};
use crate::graph::{Expr, GraphField, ParameterError};
use crate::grid::{Grid, GridError};
use crate::scene::{self, Camera, Refine, Scene};
use crate::volume::{self, OpenOptions, RawLayout, Volume};
use glam::Vec3;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Cells an axis unless the user says.
pub(super) const CELLS: u32 = 128;
/// Half the edge of the cube unless the user or the field says.
const HALF_EDGE: f32 = 1.5;

/// A source, owned.
pub enum Loaded {
    Field {
        field: Box<dyn Field>,
        grid: Grid,
        iso: f32,
        /// Where components of it are known to be.
        centres: Vec<Vec3>,
    },
    Volume {
        volume: Arc<Volume>,
        /// Made when it is first asked for.
        interpolant: OnceLock<GraphField>,
    },
}

impl Loaded {
    /// The source as the library takes it.
    pub fn source(&self) -> Source<'_> {
        match self {
            Loaded::Field { field, grid, .. } => Source::Field(field.as_ref(), *grid),
            Loaded::Volume { volume, .. } => Source::Volume(volume),
        }
    }

    /// What the samples of a volume take in main memory.
    pub fn bytes(&self) -> u64 {
        match self {
            Loaded::Field { .. } => 0,
            Loaded::Volume { volume, .. } => volume.bytes(),
        }
    }

    /// The source as a field: of a volume, the trilinear interpolant of its samples, with central differences for
    /// gradients.
    pub fn field(&self) -> Result<&dyn Field, VolumeLeafError> {
        match self {
            Loaded::Field { field, .. } => Ok(field.as_ref()),
            Loaded::Volume { volume, interpolant } => {
                if interpolant.get().is_none() {
                    let gradient = Gradient::Central(Interpolation::Trilinear);
                    let leaf = VolumeLeaf::new(volume.clone(), Lookup { gradient, ..Lookup::default() })?;
                    let _ = interpolant.set(GraphField::new(&leaf.expr(), Sense::Above));
                }
                Ok(interpolant.wait())
            }
        }
    }

    /// The settings of the extraction.
    pub fn options(&self, args: &SourceArgs, memory_budget: u64) -> Result<Options, Failure> {
        let iso = match (args.iso, self) {
            (Some(iso), _) if !iso.is_finite() => {
                return Err(Failure::usage(format!("-I {iso}: give a finite number")));
            }
            (Some(iso), _) => iso,
            (None, Loaded::Field { iso, .. }) => *iso,
            (None, Loaded::Volume { volume, .. }) => {
                let range = volume.finite_range().map_or("it has no finite value".into(), |(low, high)| {
                    format!("its values run from {low} to {high}")
                });
                return Err(Failure::usage(format!("a volume needs an iso value, -I VALUE; {range}")));
            }
        };
        let (sense, normals) = (args.inside.map(Sense::from), normals(args)?);
        Ok(Options { sense, normals, memory_budget, ..Options::new(iso) })
    }
}

/// What normals come from.
fn normals(args: &SourceArgs) -> Result<Normals, Failure> {
    let delta = args.delta;
    if let Some(delta) = delta.filter(|d| !(d.is_finite() && *d > 0.0)) {
        return Err(Failure::usage(format!(
            "--delta {delta}: give a finite number over zero, in world units; without it the step is a hundredth \
             of the shortest cell edge"
        )));
    }
    match (args.normals, delta) {
        (Some(NormalsArg::Forward), delta) => Ok(Normals::Forward { delta }),
        (Some(NormalsArg::Central), delta) => Ok(Normals::Central { delta }),
        (Some(NormalsArg::Exact) | None, None) => Ok(Normals::Exact),
        (Some(NormalsArg::Exact) | None, Some(delta)) => Err(Failure::usage(format!(
            "--delta {delta} is the step of differences: give --normals forward or --normals central with it"
        ))),
    }
}

/// What was loaded, and what its file says beside it.
pub struct Opened {
    pub loaded: Loaded,
    /// Remarks for the user.
    pub notes: Vec<String>,
    /// From where a scene wants to be seen.
    pub camera: Camera,
    /// How a scene wants to be refined.
    pub refine: Refine,
}

/// Loads what `args` name.
pub fn load(args: &SourceArgs, raw: &RawArgs, memory_budget: u64) -> Result<Opened, Failure> {
    let loaded = load_any(args, raw, memory_budget);
    // The library names its own remedy, here too where a scene's volume or picture is what is too large.
    loaded.map_err(|failure| {
        failure.map(|message| message.replace("`OpenOptions::max_bytes`", "--memory-budget"))
    })
}

fn load_any(args: &SourceArgs, raw: &RawArgs, memory_budget: u64) -> Result<Opened, Failure> {
    let path = Path::new(&args.source);
    if raw.spacing.is_some() && raw.dims.is_none() && !volume::is_volume_ending(path) {
        return Err(Failure::usage(format!(
            "--spacing is for volumes; {} is none: leave it out",
            args.source
        )));
    }
    if scene::is_scene_ending(path) && raw.given().is_none() && args.blobs.given().is_none() {
        return load_scene(args, path, memory_budget);
    }
    let (loaded, notes) = load_plain(args, raw, path, memory_budget)?;
    Ok(Opened { loaded, notes, camera: Camera::default(), refine: Refine::default() })
}

/// Whether a file is raw values, which --dims and --type describe: one whose ending is no other format's.
pub fn is_raw(source: &str) -> bool {
    let path = Path::new(source);
    volume::is_raw_ending(path) || !has_own_format(path) && path.is_file()
}

/// Whether --dims and --type may be meant for this source: it is a raw file, or named as one, and not there.
pub fn is_named_raw(source: &str) -> bool {
    is_raw(source) || is_file_name(source) && !has_own_format(Path::new(source))
}

/// Whether the ending names a format that says itself how it is laid out.
fn has_own_format(path: &Path) -> bool {
    volume::is_volume_ending(path) && !volume::is_raw_ending(path)
        || components::is_component_ending(path)
        || scene::is_scene_ending(path)
        || is_wgsl_ending(path)
}

fn is_wgsl_ending(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("wgsl"))
}

/// Everything but scenes; the second value is remarks for the user.
fn load_plain(
    args: &SourceArgs,
    raw: &RawArgs,
    path: &Path,
    memory_budget: u64,
) -> Result<(Loaded, Vec<String>), Failure> {
    if let Some(flag) = raw.given()
        && !is_raw(&args.source)
    {
        let why = if has_own_format(path) {
            "says itself how it is laid out"
        } else {
            "is no file: check the name"
        };
        return Err(Failure::usage(format!("{flag} files of raw values; {} {why}", args.source)));
    }
    if components::is_component_ending(path) {
        return load_components(args, path, memory_budget);
    }
    if let Some(flag) = args.blobs.given() {
        return Err(Failure::usage(format!("{flag} is for points: {}", components::ENDINGS.join(" "))));
    }
    if is_wgsl_ending(path) {
        return load_wgsl(args, path);
    }
    if volume::is_volume_ending(path) || raw.dims.is_some() {
        return load_volume(args, raw, path, memory_budget);
    }
    let formula = formula::parse(&args.source, &args.parameters);
    let is_name = named::ALL.iter().any(|d| d.name == args.source);
    if !is_name && !path.exists() && formula.as_ref().map_or_else(|e| is_meant(e, &args.source), |_| true) {
        return load_formula(args, &formula.map_err(|error| Failure::usage(of_formula(&error)))?);
    }
    if path.is_dir() {
        return Err(Failure::usage(format!("{}: this is a folder: name a file in it", args.source)));
    }
    let has_operator = args.source.contains(|c: char| "+-*/%^()<>=!,".contains(c));
    let as_formula = match &formula {
        Err(error) if has_operator && !path.exists() => format!("\nread as a formula: {}", of_formula(error)),
        _ => String::new(),
    };
    if path.extension().is_some() || args.source.contains(['/', '\\']) || path.exists() {
        return Err(Failure::usage(format!(
            "{}: this ending is none that is read; a source is a field's name (see `isoforge fields`), a formula, \
             a .wgsl file, a scene (.toml), a volume ({}; any other file as raw values, with --dims and --type), or points ({}){as_formula}",
            args.source,
            volume::ENDINGS.join(" "),
            components::ENDINGS.join(" ")
        )));
    }
    load_named(args, &as_formula)
}

/// What is wrong with a formula, with the flag that helps.
fn of_formula(error: &FormulaError) -> String {
    match &error.fault {
        Fault::UnknownName { name, known, .. } if known.is_empty() => {
            format!("{}, as in `--param {name}=0.8`\n{}", error.fault, error.excerpt)
        }
        _ => error.to_string(),
    }
}

/// Whether a text that is no formula was meant to be one: `1/0` is, and what has what no file's name should have.
fn is_meant(error: &FormulaError, text: &str) -> bool {
    if matches!(error.fault, Fault::NotFinite { .. }) {
        return true;
    }
    !is_file_name(text) && text.contains(|c: char| c.is_whitespace() || "+*^()<>=|²³".contains(c))
        || text.is_empty()
}

/// Whether a text ends as a file's name does.
fn is_file_name(text: &str) -> bool {
    let ending = Path::new(text).extension().and_then(|e| e.to_str()).unwrap_or("");
    ending.starts_with(char::is_alphabetic) && ending.chars().all(char::is_alphanumeric)
}

fn load_formula(args: &SourceArgs, expr: &Expr) -> Result<(Loaded, Vec<String>), Failure> {
    let sense = args.inside.map_or(Sense::Below, Sense::from);
    let field = GraphField::new(expr, sense);
    // A name may be in the text, and nothing depend on it: `(d * x)^0`.
    let is_named = |name: &str| {
        let others: Vec<_> = args.parameters.iter().filter(|(other, _)| other != name).cloned().collect();
        formula::parse(&args.source, &others).is_err()
    };
    let is_unused = |name: &str| field.parameters().all(|(used, _)| used != name) && !is_named(name);
    let unused = args.parameters.iter().find(|(name, _)| is_unused(name));
    if let Some((name, _)) = unused {
        let used: Vec<&str> = field.parameters().map(|(name, _)| name).collect();
        let used = if used.is_empty() { "no parameter".into() } else { used.join(", ") };
        return Err(Failure::usage(format!("--param {name}: the formula has {used}; leave `{name}` out")));
    }
    let grid = grid(args, HALF_EDGE, None, args.cells)?;
    Ok((Loaded::Field { field: Box::new(field), grid, iso: 0.0, centres: Vec::new() }, Vec::new()))
}

/// `as_formula` is what to tell where the name is none.
fn load_named(args: &SourceArgs, as_formula: &str) -> Result<(Loaded, Vec<String>), Failure> {
    let mut field = Named::new(&args.source).map_err(|e| {
        Failure::usage(format!(
            "{e}; a file needs one of the endings .wgsl .toml {} {}{as_formula}",
            volume::ENDINGS.join(" "),
            components::ENDINGS.join(" ")
        ))
    })?;
    for (name, value) in &args.parameters {
        field = field.with(name, *value).map_err(Failure::usage)?;
    }
    let definition = field.definition();
    let grid = grid(args, definition.half_edge, None, args.cells)?;
    Ok((Loaded::Field { field: Box::new(field), grid, iso: definition.iso, centres: Vec::new() }, Vec::new()))
}

fn load_scene(args: &SourceArgs, path: &Path, memory_budget: u64) -> Result<Opened, Failure> {
    let options = scene::OpenOptions { max_bytes: Some(memory_budget), parameters: args.parameters.clone() };
    let scene = Scene::open(path, &options).map_err(Failure::run)?;
    let sense = args.inside.map_or(scene.sense, Sense::from);
    let mut field = GraphField::new(&scene.expr, sense);
    for (name, value) in &args.parameters {
        match field.set(name, *value) {
            // Of the scene's settings, not of its field.
            Err(ParameterError::Unknown { .. })
                if scene.parameters.contains(name) && (*value as f32).is_finite() => {}
            result => result.map_err(|error| Failure::usage(format!("--param {name}: {error}")))?,
        }
    }
    let Some(iso) = args.iso.or(scene.iso) else {
        return Err(Failure::usage(format!(
            "{}: its surface is a density: say at which value, with -I VALUE or with `iso` in the file",
            path.display()
        )));
    };
    let (mut notes, mut bounds, mut cells) = (scene.notes, scene.bounds, args.cells.or(scene.cells));
    if args.half_edge.is_some() {
        bounds = None;
    } else if bounds.is_none() && args.bounds.is_none() {
        let note;
        (bounds, note) = find_bounds(&field, iso, sense);
        notes.push(note);
        if let Some([low, high]) = bounds {
            // Of a box that nobody chose, one number is for the longest axis; 0 is refused later.
            let [n, ..] = cells.unwrap_or([CELLS; 3]);
            cells = if cells.is_none_or(|c| c == [n; 3]) && n > 0 {
                Some(even_cells(n, low, high))
            } else {
                cells
            };
        }
    }
    let grid = grid(args, HALF_EDGE, bounds, cells)?;
    let loaded = Loaded::Field { field: Box::new(field), grid, iso, centres: Vec::new() };
    Ok(Opened { loaded, notes, camera: scene.camera, refine: scene.refine })
}

/// The bounds of a scene that names none, and what to tell of them.
fn find_bounds(field: &GraphField, iso: f32, sense: Sense) -> (Option<[Vec3; 2]>, String) {
    const REMEDY: &str = "name `bounds` in the file, or --bounds";
    if let Some([low, high]) = field::extent(field, iso) {
        return (
            Some([low, high]),
            format!("the scene names no bounds; its surface lies within {low} and {high}"),
        );
    }
    match field::sampled_extent(field, iso, sense) {
        Some([low, high]) => (
            Some([low, high]),
            format!(
                "the scene names no bounds, and intervals find none; what samples find lies within {low} and {high}: if that cuts \
                 something off, {REMEDY}"
            ),
        ),
        None => (
            None,
            format!(
                "the scene names no bounds, and none are found: the cube from -{HALF_EDGE} to {HALF_EDGE} is taken; {REMEDY}"
            ),
        ),
    }
}

/// Cells of about the same length along each axis, `most` along the longest.
pub(super) fn even_cells(most: u32, low: Vec3, high: Vec3) -> [u32; 3] {
    let extent = (high - low).as_dvec3();
    (extent / extent.max_element() * f64::from(most)).to_array().map(|n| n.ceil().max(1.0) as u32)
}

fn load_wgsl(args: &SourceArgs, path: &Path) -> Result<(Loaded, Vec<String>), Failure> {
    if let Some((name, _)) = args.parameters.first() {
        return Err(Failure::usage(format!(
            "--param {name}: a WGSL function has no parameters: use `const` in the file"
        )));
    }
    let grid = grid(args, HALF_EDGE, None, args.cells)?;
    let text = std::fs::read_to_string(path).map_err(|e| {
        let remedy = match e.kind() {
            ErrorKind::InvalidData => "save it as UTF-8 text",
            ErrorKind::NotFound => "check the name",
            _ => "check that it is a file that you may read",
        };
        Failure::run(format!("{} cannot be read: {e}; {remedy}", path.display()))
    })?;
    let sense = args.inside.map_or(Sense::Below, Sense::from);
    let field = UserField::new(&text, &args.source, sense).map_err(Failure::run)?;
    let note = match (field.obstacle(), field.too_long_for_gpu()) {
        (Some(obstacle), _) => Some(format!("note: density stays on the GPU: {obstacle}")),
        (None, Some(operations)) => Some(format!(
            "note: density unrolls to {operations} operations: a GPU runs it as it is written, and its mesh may differ in last \
             bits from the CPU's; normals are central differences there"
        )),
        (None, None) => None,
    };
    Ok((
        Loaded::Field { field: Box::new(field), grid, iso: 0.0, centres: Vec::new() },
        note.into_iter().collect(),
    ))
}

/// A remark where neighbouring points of the grid are hardly different numbers.
pub fn precision_remark(grid: &Grid) -> Option<String> {
    let far = grid.position(grid.cells().as_vec3()).abs().max(grid.origin().abs()).max_element();
    let units = grid.shortest_step() / (f64::from(far) * f64::from(f32::EPSILON));
    (units < 16.0).then(|| {
        format!("the grid's steps are {units:.1} units in the last place of its coordinates (32-bit floats): vertices will \
                 fall together; move the grid towards the origin or coarsen it")
    })
}

/// The grid of a field: the user's words first, then those of its file.
fn grid(
    args: &SourceArgs,
    half_edge: f32,
    bounds: Option<[Vec3; 2]>,
    cells: Option<[u32; 3]>,
) -> Result<Grid, Failure> {
    let half = args.half_edge.unwrap_or(half_edge);
    if !(half.is_finite() && half > 0.0) {
        return Err(Failure::usage(format!("-L {half}: give half the edge of the cube, a number over zero")));
    }
    let [low, high] = args.bounds.or(bounds).unwrap_or([Vec3::splat(-half), Vec3::splat(half)]);
    Grid::from_bounds(cells.unwrap_or([CELLS; 3]), low, high).map_err(|error| match error {
        GridError::Cells { .. } => Failure::usage(format!("-n: {error}")),
        _ if args.bounds.is_some() => Failure::usage(format!("--bounds: {error}")),
        // The scene's, or those that were found.
        _ if bounds.is_some() && args.half_edge.is_none() => Failure::run(format!("bounds: {error}")),
        _ => Failure::usage(format!("-L: {error}")),
    })
}

fn load_volume(
    args: &SourceArgs,
    raw: &RawArgs,
    path: &Path,
    memory_budget: u64,
) -> Result<(Loaded, Vec<String>), Failure> {
    let options = open_options(args, raw, memory_budget)?;
    let opened = volume::open(path, &options).map_err(|error| match error {
        volume::OpenError::NoLayout { .. } => Failure::usage(format!("{error}: --dims X,Y,Z --type TYPE")),
        volume::OpenError::Budget { .. } if volume::Planes::open(path, &options).is_err() => {
            Failure::run(format!(
                "{error}; or save it uncompressed: such a volume `isoforge extract` reads a part at a time"
            ))
        }
        _ => Failure::run(error),
    })?;
    let loaded = Loaded::Volume { volume: Arc::new(opened.volume), interpolant: OnceLock::new() };
    Ok((loaded, opened.notes))
}

/// How a volume is opened; refuses what is for fields, or for raw files.
pub fn open_options(args: &SourceArgs, raw: &RawArgs, memory_budget: u64) -> Result<OpenOptions, Failure> {
    let only_fields = [
        (args.cells.is_some(), "-n"),
        (args.half_edge.is_some(), "-L"),
        (args.bounds.is_some(), "--bounds"),
        (!args.parameters.is_empty(), "--param"),
    ];
    if let Some((_, flag)) = only_fields.iter().find(|(given, _)| *given) {
        return Err(Failure::usage(format!(
            "{flag} is for fields; a volume has its own grid, from its file"
        )));
    }
    if args.normals.is_some() || args.delta.is_some() {
        let flag = if args.normals.is_some() { "--normals" } else { "--delta" };
        return Err(Failure::usage(format!(
            "{flag} is for fields; a volume's normals are central differences of its samples: leave it out"
        )));
    }
    let spacing = raw.spacing.map(|triple| triple.0);
    let raw = match (raw.dims, raw.scalar) {
        (Some(dims), Some(scalar)) => {
            if dims.contains(&0) {
                return Err(Failure::usage("--dims: each axis has at least 2 samples"));
            }
            let plain = RawLayout::new(dims, scalar);
            Some(RawLayout {
                endian: raw.endian.unwrap_or(plain.endian),
                origin: raw.origin.map_or(plain.origin, |t| t.0),
                skip_bytes: raw.skip_bytes.unwrap_or(plain.skip_bytes),
                ..plain
            })
        }
        _ => None,
    };
    Ok(OpenOptions { raw, spacing, max_bytes: Some(memory_budget) })
}
