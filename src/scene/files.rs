//! The kinds of nodes that come from other files: scenes, WGSL functions, height pictures. `kinds.md` has their
//! keys.

use super::error::{Fault, SceneError};
use super::tree::{Build, Made, Node};
use super::{Given, OpenOptions, Scene, read};
use crate::field::Sense;
use crate::field::user::UserField;
use crate::graph::volume::{Lookup, VolumeLeaf};
use crate::graph::{Expr, x, y, z};
use crate::grid::Grid;
use crate::volume::Volume;
use glam::Vec3;
use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::sync::Arc;

type Found<T> = Result<T, SceneError>;

pub const KINDS: &[(&str, Build)] = &[("scene", scene), ("wgsl", wgsl), ("heightfield", heightfield)];

/// The most scenes that are opened for one, and the deepest.
const MOST_SCENES: usize = 1000;
const DEEPEST: usize = 64;
/// Bytes that a scene's text may have.
const LONGEST: u64 = 64 << 20;
/// Bytes that a pixel takes while a picture is read: at most 8 in the file's form, 2 of brightness, then 3 numbers.
const PIXEL: u64 = 22;

/// What has been opened, and what may be.
pub struct Files {
    parameters: Vec<(String, f64)>,
    left: Cell<Option<u64>>,
    notes: RefCell<Vec<String>>,
    /// The scenes that are being read, each imported by the one before.
    open: RefCell<Vec<PathBuf>>,
    scenes: Cell<usize>,
}

impl Files {
    pub fn new(options: &OpenOptions) -> Self {
        Self {
            parameters: options.parameters.clone(),
            left: Cell::new(options.max_bytes),
            notes: RefCell::default(),
            open: RefCell::default(),
            scenes: Cell::new(0),
        }
    }

    /// Values in place of the files' own, by full name.
    pub fn parameters(&self) -> &[(String, f64)] {
        &self.parameters
    }

    /// Bytes that volumes and points may still take.
    pub fn left(&self) -> Option<u64> {
        self.left.get()
    }

    /// Counts what a volume or points took.
    pub fn took(&self, bytes: u64, notes: Vec<String>) {
        self.left.set(self.left.get().map(|left| left.saturating_sub(bytes)));
        self.notes.borrow_mut().extend(notes);
    }

    pub fn notes(self) -> Vec<String> {
        self.notes.into_inner()
    }

    /// The scene of a file.
    pub fn open(&self, path: &Path, given: &Given) -> Found<Scene> {
        let failed = |source| SceneError::Read { path: path.into(), source };
        let text = read_text(path).map_err(failed)?;
        self.open.borrow_mut().push(std::fs::canonicalize(path).map_err(failed)?);
        self.scenes.set(self.scenes.get() + 1);
        let scene = read(&text, path, self, given);
        self.open.borrow_mut().pop();
        scene
    }

    /// Why a scene must not be imported, if so.
    fn obstacle(&self, path: &Path) -> Option<Fault> {
        let open = self.open.borrow();
        if self.scenes.get() >= MOST_SCENES || open.len() >= DEEPEST {
            return Some(Fault::TooManyImports { most: MOST_SCENES, deep: DEEPEST });
        }
        let own = std::fs::canonicalize(path).ok()?;
        let first = open.iter().position(|file| *file == own)?;
        let name = |path: &PathBuf| path.file_name().map_or(String::new(), |n| n.to_string_lossy().into());
        Some(Fault::ImportCycle { files: open[first..].iter().chain([&own]).map(name).collect() })
    }
}

fn read_text(path: &Path) -> std::io::Result<String> {
    check_file(path, LONGEST)?;
    std::fs::read_to_string(path)
}

/// Asked before opening: a FIFO would wait for a writer.
fn check_file(path: &Path, longest: u64) -> std::io::Result<()> {
    let kind = std::fs::metadata(path)?;
    let refused = |why| Err(std::io::Error::other(why));
    if !kind.is_file() {
        return refused("it is no file".to_string());
    }
    if kind.len() > longest {
        return refused(format!("it has {} bytes, more than {longest}", kind.len()));
    }
    Ok(())
}

fn scene(node: &Node<'_, '_>) -> Found<Made> {
    let table = &node.table;
    let (file, path) = table.file("file", "the scene's file")?;
    if let Some(fault) = node.files.obstacle(&path) {
        return Err(file.fault(fault));
    }
    // The node's name, without `nodes.`.
    let own = table.key.split_once('.').map_or("", |(_, own)| own);
    let mut given = Given { prefix: format!("{}{own}.", table.source.prefix), values: Vec::new() };
    let mut items = Vec::new();
    if let Some(item) = table.get("parameters") {
        items = item.table("a table of numbers, as in { r = 0.5 }")?.entries();
    }
    for (name, item) in &items {
        given.values.push(((*name).to_string(), item.number()?));
    }
    let imported = node.files.open(&path, &given);
    let imported = imported.map_err(|error| file.fault(Fault::Import(Box::new(error))))?;
    if let Some((_, item)) = items.iter().find(|(name, _)| !imported.parameters.iter().any(|p| p == name)) {
        return Err(item.fault(Fault::NoParameter { known: imported.parameters }));
    }
    // At 0 and below inside, whatever it is by itself; but a density stays one.
    let Some(iso) = imported.iso else { return Ok(Made::density(imported.expr)) };
    let above = imported.expr - f64::from(iso);
    Ok(Made::solid(if imported.sense == Sense::Above { -above } else { above }))
}

fn wgsl(node: &Node<'_, '_>) -> Found<Made> {
    let table = &node.table;
    let (text, name) = match (table.get("file"), table.get("text")) {
        (Some(file), None) => {
            let path = table.source.relative(file.text()?);
            let text = read_text(&path);
            let text = text.map_err(|source| file.fault(Fault::Read { path: path.clone(), source }))?;
            (text, path.display().to_string())
        }
        (None, Some(text)) => (text.text()?.to_string(), text.key.clone()),
        _ => return Err(table.fault(Fault::One { keys: vec!["`file`", "`text`"] })),
    };
    let field = node.check(UserField::new(&text, &name, Sense::Below).map_err(Box::new))?;
    match (field.expr(), field.obstacle()) {
        (Some(expr), _) => Ok(Made::solid(expr.clone())),
        (None, Some(obstacle)) => Err(table.fault(Fault::Obstacle(obstacle.clone()))),
        // One or the other is there.
        (None, None) => Err(table.fault(Fault::One { keys: vec!["`file`", "`text`"] })),
    }
}

fn heightfield(node: &Node<'_, '_>) -> Found<Made> {
    let table = &node.table;
    let height = match (table.get("file"), table.get("of")) {
        (Some(_), None) => picture(node)? * table.number("height")?,
        (None, Some(_)) => node.any("of")?.expr.at([x(), y(), 0.0.into()]),
        (None, None) => table.number("height")?,
        _ => return Err(table.fault(Fault::One { keys: vec!["`file`", "`of`"] })),
    };
    Ok(Made::solid(z() - height))
}

/// The brightness of a picture in the plane z = 0, from 0 to 1; its rows run from high to low y.
fn picture(node: &Node<'_, '_>) -> Found<Expr> {
    let table = &node.table;
    let (file, path) = table.file("file", "the picture's file")?;
    let item = table.need("size", "its extent in x and y, as [2, 1]")?;
    let sides = item.list("two numbers above 0")?.iter().map(|n| n.setting()).collect::<Found<Vec<_>>>()?;
    let [width, depth] = sides[..] else { return Err(item.type_fault("two numbers above 0")) };
    let failed = |source| file.fault(Fault::Picture { path: path.clone(), source });
    check_file(&path, u64::MAX).map_err(|error| failed(error.into()))?;
    let (columns, rows) = image::image_dimensions(&path).map_err(failed)?;
    let needed = u64::from(columns) * u64::from(rows) * PIXEL;
    if let Some(left) = node.files.left().filter(|left| *left < needed) {
        return Err(file.fault(Fault::LargePicture { columns, rows, needed, left }));
    }
    let image = image::open(&path).map_err(failed)?.into_luma16();
    // Two layers, since a volume has at least two samples along each axis.
    let layer = image.rows().rev().flatten().map(|pixel| f32::from(pixel.0[0]) / f32::from(u16::MAX));
    let values: Vec<f32> = layer.collect::<Vec<_>>().repeat(2);
    let half = Vec3::new(width as f32 * 0.5, depth as f32 * 0.5, 1.0);
    let cells = [columns.saturating_sub(1), rows.saturating_sub(1), 1];
    let small = |_| {
        let wanted = "a picture of at least 2 by 2 pixels, and a size above 0".into();
        item.fault(Fault::Range { wanted, found: format!("{columns}x{rows}, {width} by {depth}") })
    };
    let grid = Grid::from_bounds(cells, -half, half).map_err(small)?;
    node.files.took(4 * values.len() as u64, Vec::new());
    // As many values as the grid has points.
    let volume = Volume::new(grid, values).map_err(|_| item.type_fault("two numbers above 0"))?;
    Ok(node.check(VolumeLeaf::new(Arc::new(volume), Lookup::default()))?.expr())
}
