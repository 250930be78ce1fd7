//! `--color-by`: colours by the values of a second source.

use super::Failure;
use super::args::{ExtractArgs, RawArgs, SourceArgs};
use super::source::{self, Loaded};
use super::values::{parameter, range};
use crate::colour::{ColourError, Coloured, Colouring, Map, Samples, sample, usual_range};
use crate::mesh::{Mesh, write};
use crate::scene;
use clap::Args;
use glam::Vec3;
use serde_json::{Value, json};
use std::path::Path;
use std::str::FromStr;

/// What colours the mesh.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Colours")]
pub struct ColourArgs {
    /// Colour the mesh by a second source, anything that SOURCE takes: by its value at each vertex, of volumes trilinear
    /// between samples. Drawn in the picture; .ply has it as value, red, green, blue; .glb as _VALUE and COLOR_0. Vertices
    /// without a value, or outside the volume, are grey
    #[arg(long, value_name = "SOURCE")]
    pub color_by: Option<String>,

    /// The colour map: viridis magma inferno plasma cividis turbo coolwarm spectral grey
    #[arg(long, value_name = "MAP", value_parser = Map::from_str, default_value = "viridis", requires = "color_by")]
    pub color_map: Map,

    /// The values of the lowest and the highest colour [default: the 2nd and 98th percentile of those at the vertices]
    #[arg(long, value_name = "LO,HI", value_parser = range, requires = "color_by", allow_hyphen_values = true)]
    pub color_range: Option<[f32; 2]>,

    /// A parameter of the second source, as --param is one of the first; may be repeated
    #[arg(long = "color-param", value_name = "NAME=VALUE", value_parser = parameter, requires = "color_by")]
    pub color_parameters: Vec<(String, f64)>,
}

/// Whether a mesh file keeps colours.
pub fn has_place(path: &Path) -> bool {
    write::ending(path).is_none_or(|ending| ["ply", "glb"].contains(&ending))
}

/// Refuses a file that has no place for colours, unless a picture shows them: then only remarks on it.
pub fn check(args: &ExtractArgs, remark: &dyn Fn(&str)) -> Result<(), Failure> {
    let is_coloured = |_: &&Path| args.colour.color_by.is_some();
    let output = args.output.as_deref().filter(is_coloured);
    let Some(path) = output.filter(|path| !has_place(path)) else { return Ok(()) };
    let what = format!("-o {}: the format has no place for the colours of --color-by", path.display());
    if args.png.is_none() {
        return Err(Failure::usage(format!("{what}: name the file .ply or .glb, or draw them (--png)")));
    }
    remark(&format!("{what}: they are in the picture alone"));
    Ok(())
}

/// The raw layout of the main source: it is that of the second one where only that is a raw file.
pub fn raw_of_main(args: &ExtractArgs) -> Option<&RawArgs> {
    let is_raw = source::is_named_raw;
    let is_taken = args.colour.color_by.as_deref().is_some_and(is_raw) && !is_raw(&args.source.source);
    (!is_taken).then_some(&args.raw)
}

/// The second source, and how its values become colours.
pub struct Painter {
    name: String,
    loaded: Loaded,
    map: Map,
    range: Option<[f32; 2]>,
}

impl Painter {
    /// Loads the source, if one is named, into what is left of the memory budget.
    pub fn load(
        args: &ExtractArgs,
        memory_budget: u64,
        remark: &dyn Fn(&str),
    ) -> Result<Option<Self>, Failure> {
        let Some(name) = args.colour.color_by.clone() else { return Ok(None) };
        let parameters = args.colour.color_parameters.clone();
        // The value that is sampled is no surface: any iso will do, and any bounds of a scene, which need not be looked for.
        let bounds = scene::is_scene_ending(Path::new(&name)).then_some([Vec3::NEG_ONE, Vec3::ONE]);
        let source =
            SourceArgs { source: name.clone(), iso: Some(0.5), bounds, parameters, ..SourceArgs::default() };
        let none = RawArgs::default();
        let raw = if source::is_named_raw(&name) { &args.raw } else { &none };
        let opened = source::load(&source, raw, memory_budget).map_err(|failure| {
            // What is loaded does not know by which flag.
            failure.map(|message| format!("--color-by: {}", message.replace("--param", "--color-param")))
        })?;
        // A scene's are about where its own surface lies.
        if !scene::is_scene_ending(Path::new(&name)) {
            opened.notes.iter().for_each(|note| remark(&format!("--color-by: {note}")));
        }
        Ok(Some(Self {
            name,
            loaded: opened.loaded,
            map: args.colour.color_map,
            range: args.colour.color_range,
        }))
    }

    /// What the source keeps in main memory.
    pub fn bytes(&self) -> u64 {
        self.loaded.bytes()
    }

    fn sample(&self, mesh: &Mesh) -> Result<Samples, Failure> {
        let field = self
            .loaded
            .field()
            .map_err(|error| Failure::run(format!("--color-by {}: {error}", self.name)))?;
        let volume = match &self.loaded {
            Loaded::Volume { volume, .. } => Some(volume.grid()),
            Loaded::Field { .. } => None,
        };
        sample(field, volume, mesh).map_err(|error| match error {
            ColourError::Form(_) | ColourError::Disjoint { .. } => {
                Failure::run(format!("--color-by {}: {error}", self.name))
            }
        })
    }

    /// Finds the range of the colours from a mesh, unless the user gave it; tells what the colours mean, and returns that
    /// for `--stats`.
    pub fn begin(&mut self, mesh: &Mesh, remark: &dyn Fn(&str)) -> Result<Value, Failure> {
        let Samples { values, outside, not_finite } = self.sample(mesh)?;
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let ends = finite().fold(None, |ends: Option<[f32; 2]>, value| {
            let [low, high] = ends.unwrap_or([value; 2]);
            Some([low.min(value), high.max(value)])
        });
        let given = self.range.is_some();
        let range = self.range.or_else(|| usual_range(&values));
        self.range = range;
        match (range, ends) {
            (Some([low, high]), Some([least, most])) => {
                let how = if given { "as given" } else { "the 2nd to the 98th percentile" };
                remark(&format!(
                    "--color-by {}: {} from {low} to {high}, {how}; the values run from {least} to {most}",
                    self.name, self.map
                ));
            }
            _ if values.is_empty() => {}
            _ => remark(&format!("--color-by {}: no vertex has a value: all are grey", self.name)),
        }
        if outside > 0 {
            let count = values.len();
            remark(&format!("{outside} of {count} vertices lie outside {}, and are grey", self.name));
        }
        if not_finite > 0 {
            remark(&format!("{not_finite} vertices are grey, as {} is NaN or infinite there", self.name));
        }
        Ok(json!({
            "by": self.name, "map": self.map.to_string(), "range": range, "values": ends, "outside": outside,
            "not_finite": not_finite,
        }))
    }

    /// The colours of a mesh, by the range that was found.
    pub fn paint(&self, mesh: &Mesh) -> Result<Coloured, Failure> {
        let colouring = Colouring::new(self.map, self.range.unwrap_or_default());
        Ok(colouring.colour(self.sample(mesh)?.values))
    }
}
