//! What can be wrong with a scene, and where.

use crate::components;
use crate::field::named::NameError;
use crate::field::user::UserError;
use crate::graph::blobs::BlobsError;
use crate::graph::formula::{self, listed};
use crate::graph::from_wgsl::Obstacle;
use crate::graph::shapes::ShapeError;
use crate::graph::volume::VolumeLeafError;
use crate::volume;
use std::io;
use std::path::PathBuf;

/// Why a scene cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{} cannot be read: {source}; check the name, and that it is a text file that you may read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Something in the file is wrong.
    #[error(transparent)]
    At(Box<Place>),
}

/// A fault and its place.
#[derive(Debug, thiserror::Error)]
#[error("{}:{line}:{column}: {}{fault}\n{excerpt}", file.display(), key_head(key))]
pub struct Place {
    /// The scene file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// The key whose value is wrong, from the top, as in `nodes.hole.radius`; empty for the whole file.
    pub key: String,
    /// What is wrong.
    pub fault: Fault,
    /// The line with a caret under the place.
    pub excerpt: String,
}

fn key_head(key: &str) -> String {
    if key.is_empty() { String::new() } else { format!("{key}: ") }
}

/// What is wrong.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The text is no TOML.
    #[error("this is not TOML: {message}")]
    Syntax {
        /// What the parser says.
        message: String,
    },
    /// A value of another type than the key takes.
    #[error("{found} stands here: give {wanted}")]
    Type {
        /// What the key takes.
        wanted: &'static str,
        /// What it has.
        found: &'static str,
    },
    /// A number out of its range.
    #[error("{found} is out of range: give {wanted}")]
    Range {
        /// What the key takes.
        wanted: String,
        /// What it has.
        found: String,
    },
    /// A key that must be there.
    #[error("the key `{key}` is missing{}: add it, as {wanted}", closest.as_ref().map_or(String::new(), |c| format!(" (is it `{c}`?)")))]
    Missing {
        /// The key.
        key: &'static str,
        /// What it takes.
        wanted: &'static str,
        /// A key that is there and looks like it.
        closest: Option<String>,
    },
    /// A key that means nothing here.
    #[error("there is no key `{key}` here{}; there are {}", meant(.closest), listed(.known))]
    UnknownKey {
        /// The key.
        key: String,
        /// A key that looks like it.
        closest: Option<String>,
        /// The keys there are.
        known: Vec<String>,
    },
    /// A word that is none of those a key takes.
    #[error("there is no {what} `{found}`{}; there are {}", meant(.closest), listed(.known))]
    UnknownWord {
        /// What it is.
        what: &'static str,
        /// The word.
        found: String,
        /// One that looks like it.
        closest: Option<String>,
        /// Those there are.
        known: Vec<String>,
    },
    /// A density where a solid is wanted.
    #[error(
        "this is a density, high inside, and a solid is wanted: give it an `iso`, above which its inside is (`sum` \
         takes one, too)"
    )]
    Density,
    /// Nodes that are made of each other.
    #[error("a node cannot be part of itself: {}; take one of them out", .nodes.join(" → "))]
    Cycle {
        /// The nodes, first and last the same.
        nodes: Vec<String>,
    },
    /// Scenes that import each other.
    #[error("a scene cannot be part of itself: {}; take one of the imports out", .files.join(" → "))]
    ImportCycle {
        /// The files, first and last the same.
        files: Vec<String>,
    },
    /// Nothing says which node is meshed.
    #[error("{} nodes are part of no other ({}): say which is meshed, as in `surface = \"{}\"`", .nodes.len(), listed(.nodes), .nodes[0])]
    NoSurface {
        /// The nodes.
        nodes: Vec<String>,
    },
    /// No node at all.
    #[error("the scene has no node: add one, as in `[nodes.ball]` with `kind = \"sphere\"` and `radius = 1`")]
    NoNode,
    /// Two keys of which one is wanted.
    #[error("give one of {}", .keys.join(" and "))]
    One {
        /// The keys.
        keys: Vec<&'static str>,
    },
    /// A formula is wrong.
    #[error(transparent)]
    Formula(formula::Fault),
    /// A parameter with a name of its own meaning in formulas.
    #[error("`{name}` has a meaning of its own in formulas: give the parameter another name")]
    Reserved {
        /// The name.
        name: String,
    },
    /// A parameter with a name that formulas cannot say.
    #[error(
        "formulas cannot say `{name}`: give it a name of letters, digits and `_` that starts with no digit"
    )]
    Unsayable {
        /// The name.
        name: String,
    },
    /// More operations than can be handled.
    #[error(
        "the scene has more than {most} operations at each point: nodes that contain others many times over, each under \
         its own transforms, multiply; leave some out, or `repeat` one"
    )]
    TooLong {
        /// The most operations.
        most: usize,
    },
    /// A shape that cannot be.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// Blobs that cannot be.
    #[error(transparent)]
    Blobs(#[from] BlobsError),
    /// A named field.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A volume's file.
    #[error(transparent)]
    Volume(#[from] volume::OpenError),
    /// A volume that is too large.
    #[error(transparent)]
    VolumeLeaf(#[from] VolumeLeafError),
    /// A file of points.
    #[error(transparent)]
    Points(#[from] components::OpenError),
    /// A WGSL function.
    #[error(transparent)]
    Wgsl(#[from] Box<UserError>),
    /// A WGSL function that is no expression.
    #[error("the function cannot be part of a scene, only stand alone: {0}")]
    Obstacle(Obstacle),
    /// A picture's file.
    #[error("{} cannot be used: {source}; give a picture that can be opened, as PNG", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// Why.
        source: image::ImageError,
    },
    /// A picture that is too large.
    #[error(
        "a picture of {columns}x{rows} takes {needed} bytes, over the {left} that are left of the memory budget: raise \
         it (`OpenOptions::max_bytes`), or make the picture smaller"
    )]
    LargePicture {
        /// Pixels along a row.
        columns: u32,
        /// Its rows.
        rows: u32,
        /// Bytes it takes while it is read.
        needed: u64,
        /// Bytes it may take.
        left: u64,
    },
    /// A text file.
    #[error("{} cannot be read: {source}; check the name, and that it is a text file that you may read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// An import is given a parameter that it does not have.
    #[error("the imported scene has no such parameter; it has {}", if .known.is_empty() { "none".into() } else { listed(.known) })]
    NoParameter {
        /// Those it has.
        known: Vec<String>,
    },
    /// More imports than a scene may have.
    #[error(
        "over {most} scenes are imported, or one in the other over {deep} deep: import each once, and `copy` the node"
    )]
    TooManyImports {
        /// The most imports.
        most: usize,
        /// The deepest.
        deep: usize,
    },
    /// An imported scene.
    #[error("in the imported scene:\n{0}")]
    Import(Box<SceneError>),
}

fn meant(closest: &Option<String>) -> String {
    closest.as_ref().map_or(String::new(), |name| format!(" (did you mean `{name}`?)"))
}
