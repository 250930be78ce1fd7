//! Scene files: a tree of named nodes with parameters, transforms, a surface, bounds and a camera, in TOML.
//!
//! ```toml
//! surface = "part"                    # the node that is meshed; may be left out where it is plain
//! bounds = [[-1.6, -1.6, -1.6], [1.6, 1.6, 1.6]]
//! cells = 128                         # or three numbers
//! camera = { azimuth = 30, elevation = 25, fov = 35 }
//! refine = { flatness = 0.95, epsilon = 1e-4, depth = 5 }   # of `--refine`, what it does not say itself
//!
//! [parameters]                        # what --param changes, recompiling nothing; also for the numbers above, as cells = "n"
//! r = 0.4
//!
//! [nodes.hole]
//! kind = "cylinder"
//! radius = "r"                        # every number may be a formula of parameters (and of x, y, z)
//! height = 3
//! rotate = { axis = [1, 0, 0], degrees = 90 }
//!
//! [nodes.part]
//! kind = "difference"
//! of = [{ kind = "box", low = [-1, -1, -1], high = [1, 1, 1] }, "hole"]   # nodes, by name or in place
//! radius = 0.1                        # of the rounded seam
//! ```
//!
//! At the top also `iso` (0 unless given, of densities none) and `inside` (`"below"` or `"above"`). Nodes are solids, below 0
//! inside, but for blobs, points and volumes without an `iso`, which are **densities**, high inside: they can be
//! summed, displace others, or be meshed themselves. Files are looked for from the scene's own folder.
//!
#![doc = include_str!("kinds.md")]

mod densities;
mod error;
mod files;
mod solids;
mod table;
mod transform;
mod tree;

pub use error::{Fault, Place, SceneError};

use crate::field::Sense;
use crate::graph::formula::Names;
use crate::graph::{Expr, GraphField};
use crate::grid::MAX_CELLS;
use files::Files;
use glam::Vec3;
use std::path::Path;
use table::{Item, Source, Table};
use toml::de::DeTable;

/// Every kind of node and its keys, as text (Markdown).
pub const KINDS: &str = include_str!("kinds.md");

/// The most operations of a scene: nodes that contain another twice, under different transforms, double them.
const MOST_OPERATIONS: usize = 1 << 22;

/// How to open a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OpenOptions {
    /// Refuse volumes and points that take more than this many bytes, all together; `None` for no limit.
    pub max_bytes: Option<u64>,
    /// Values of parameters in place of the file's (`node.parameter` for those of an imported scene). Names that no scene has
    /// are passed over: [`Scene::parameters`] and the field say which there are.
    pub parameters: Vec<(String, f64)>,
}

/// From where a scene wants to be seen; angles in degrees as in [`View`](crate::render::View).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Camera {
    /// Around the z axis.
    pub azimuth: Option<f32>,
    /// Above the xy plane.
    pub elevation: Option<f32>,
    /// Vertical opening angle.
    pub fov: Option<f32>,
}

/// How a scene wants to be refined; what is not said is as in [`crate::refine::Settings`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Refine {
    /// Cosine of the angle between normals from which on an edge is split.
    pub flatness: Option<f32>,
    /// Tolerance of the projection on the surface, in world units.
    pub epsilon: Option<f32>,
    /// The longest step of the projection, in world units.
    pub step: Option<f32>,
    /// How often an edge is split at most.
    pub depth: Option<u32>,
}

/// A scene, read and checked.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The node that is meshed.
    pub expr: Expr,
    /// Which side of iso is inside.
    pub sense: Sense,
    /// The iso value; none of a density for which the file names none.
    pub iso: Option<f32>,
    /// The corners of the box that is meshed, if the scene names it.
    pub bounds: Option<[Vec3; 2]>,
    /// Cells along each axis, if the scene names them.
    pub cells: Option<[u32; 3]>,
    /// From where it is seen.
    pub camera: Camera,
    /// How it is refined when that is asked for.
    pub refine: Refine,
    /// The names of its own parameters.
    pub parameters: Vec<String>,
    /// Remarks for the user, one line each.
    pub notes: Vec<String>,
}

/// Whether the path ends like a scene file, in either case.
pub fn is_scene_ending(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

impl Scene {
    /// Reads a scene file and what it imports.
    ///
    /// # Errors
    /// [`SceneError`], with file, line and key.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, SceneError> {
        let files = Files::new(options);
        let mut scene = files.open(path, &Given::default())?;
        scene.notes = files.notes();
        Ok(scene)
    }

    /// Reads a scene from text; `path` is the name that errors show, and files are looked for beside it.
    ///
    /// # Errors
    /// As [`Scene::open`].
    pub fn parse(text: &str, path: &Path, options: &OpenOptions) -> Result<Self, SceneError> {
        let files = Files::new(options);
        let mut scene = read(text, path, &files, &Given::default())?;
        scene.notes = files.notes();
        Ok(scene)
    }

    /// The field, its parameters at the scene's values.
    pub fn field(&self) -> GraphField {
        GraphField::new(&self.expr, self.sense)
    }
}

/// What who imports a scene says of its parameters.
#[derive(Default)]
struct Given {
    /// Before the names of those that keep their own values, so that those of several imports stay apart.
    prefix: String,
    /// The values of the others.
    values: Vec<(String, Expr)>,
}

/// The scene of a text.
fn read(text: &str, path: &Path, files: &Files, given: &Given) -> Result<Scene, SceneError> {
    let prefix = given.prefix.clone();
    let mut source = Source { path, text, prefix, names: Names::default() };
    let parsed = DeTable::parse(text).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        source.fault(at, "", Fault::Syntax { message: error.message().trim_end().replace('\n', "; ") })
    })?;
    let table = parsed.get_ref();
    source.names = parameters(&Table::new(&source, table, 0..0, String::new()), files, given)?;
    let top = Table::new(&source, table, 0..0, String::new());
    top.allow(&["parameters"]);

    let cells = top.get("cells").map(|item| cells(&item)).transpose()?;
    let bounds = top.get("bounds").map(|item| bounds(&item)).transpose()?;
    let camera = top.get("camera").map_or(Ok(Camera::default()), |item| camera(&item))?;
    let refine = top.get("refine").map_or(Ok(Refine::default()), |item| refine(&item))?;
    let iso = top.get("iso").map(|item| item.setting()).transpose()?;
    let inside = top.get("inside");
    let inside = inside.map(|item| item.choice("side", &[("below", Sense::Below), ("above", Sense::Above)]));
    let inside = inside.transpose()?;
    let surface = top.get("surface");
    let nodes = top.get("nodes");
    top.finish()?;

    let made = tree::surface(&source, nodes, surface, files)?;
    let iso = iso.or((!made.dense).then_some(0.0)).map(|iso| iso as f32);
    let sense = inside.unwrap_or(if made.dense { Sense::Above } else { Sense::Below });
    if made.expr.is_longer_than(MOST_OPERATIONS) {
        return Err(source.fault(0, "", Fault::TooLong { most: MOST_OPERATIONS }));
    }
    let parameters = source.names.known().to_vec();
    Ok(Scene { expr: made.expr, sense, iso, bounds, cells, camera, refine, parameters, notes: Vec::new() })
}

/// The scene's parameters as names for its formulas.
fn parameters(top: &Table<'_>, files: &Files, given: &Given) -> Result<Names, SceneError> {
    let mut names = Names::default();
    let Some(item) = top.get("parameters") else { return Ok(names) };
    let table = item.table("a table of numbers, as in `[parameters]` and below `r = 0.4`")?;
    for (name, item) in table.entries() {
        item.check_name(name)?;
        let own = item.plain()?;
        let value = given.values.iter().find(|(given, _)| given == name).map(|(_, value)| value.clone());
        let value = value.unwrap_or_else(|| {
            let name = format!("{}{name}", given.prefix);
            let chosen = files
                .parameters()
                .iter()
                .find(|(chosen, value)| *chosen == name && (*value as f32).is_finite());
            Expr::parameter(&name, chosen.map_or(own, |(_, value)| *value))
        });
        names.insert(name, value);
    }
    Ok(names)
}

fn cells(item: &Item<'_>) -> Result<[u32; 3], SceneError> {
    let range = 1..MAX_CELLS + 1;
    if item.value.is_array() {
        let wanted = "a whole number, or three";
        let counts = item
            .list(wanted)?
            .iter()
            .map(|n| n.whole_setting(range.clone()))
            .collect::<Result<Vec<_>, _>>()?;
        return counts.try_into().map_err(|_| item.type_fault(wanted));
    }
    Ok([item.whole_setting(range)?; 3])
}

fn bounds(item: &Item<'_>) -> Result<[Vec3; 2], SceneError> {
    let wanted = "two corners like [[-1, -1, -1], [1, 1, 1]]";
    let corners = item.list(wanted)?;
    let [low, high] = &corners[..] else {
        return Err(item.fault(Fault::Type { wanted, found: "a list of another length" }));
    };
    let [low, high] = [low.plain_triple()?, high.plain_triple()?].map(|c| Vec3::from(c.map(|c| c as f32)));
    if !low.is_finite() || !high.is_finite() || !low.cmplt(high).all() {
        let (wanted, found) =
            ("a low corner and one that is higher along each axis".into(), format!("{low} {high}"));
        return Err(item.fault(Fault::Range { wanted, found }));
    }
    Ok([low, high])
}

fn camera(item: &Item<'_>) -> Result<Camera, SceneError> {
    let table = item.table("a table like { azimuth = 30, elevation = 25, fov = 35 }")?;
    let angle = |key, least: f64, most: f64| {
        let Some(item) = table.get(key) else { return Ok(None) };
        let angle = item.setting()?;
        if (least..=most).contains(&angle) {
            return Ok(Some(angle as f32));
        }
        Err(item.fault(Fault::Range {
            wanted: format!("degrees from {least} to {most}"),
            found: angle.to_string(),
        }))
    };
    let camera = Camera {
        azimuth: angle("azimuth", -360.0, 360.0)?,
        elevation: angle("elevation", -90.0, 90.0)?,
        fov: angle("fov", 1.0, 150.0)?,
    };
    table.finish()?;
    Ok(camera)
}

fn refine(item: &Item<'_>) -> Result<Refine, SceneError> {
    let table = item.table("a table like { flatness = 0.95, epsilon = 1e-4, depth = 5 }")?;
    let number = |key| table.get(key).map(|item| Ok(item.setting()? as f32)).transpose();
    let refine = Refine {
        flatness: number("flatness")?,
        epsilon: number("epsilon")?,
        step: number("step")?,
        depth: table.get("depth").map(|item| item.whole_setting(0..u32::MAX)).transpose()?,
    };
    table.finish()?;
    Ok(refine)
}
