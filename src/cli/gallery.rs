//! `isoforge gallery`: a picture of every named field.

use super::{Failure, say};
use crate::extract::{Options, Source, extract_on_cpu};
use crate::field::named::{self, Definition, Named};
use crate::grid::Grid;
use crate::render::{self, Camera, LETTER, Style, View};
use clap::Args;
use glam::Vec3;
use image::{Rgba, RgbaImage, imageops};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct GalleryArgs {
    /// The picture to write
    #[arg(short, long, value_name = "FILE.png")]
    pub output: PathBuf,

    /// Width and height of each field's picture in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 192, value_parser = clap::value_parser!(u32).range(32..=2048), allow_negative_numbers = true)]
    pub cell: u32,

    /// Pictures in a row
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=64), allow_negative_numbers = true)]
    pub columns: u32,

    /// Cells along each axis of each field's grid
    #[arg(short = 'n', long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=1024), allow_negative_numbers = true)]
    pub cells: u32,
}

/// Pixels between the cells, and around a name.
const GAP: u32 = 4;
const INK: [u8; 4] = [40, 44, 52, 255];

/// Extracts, draws and labels every named field.
pub fn run(args: &GalleryArgs) -> Result<(), Failure> {
    render::check_target(&args.output).map_err(Failure::run)?;
    let fields = named::ALL;
    let columns = args.columns.min(fields.len() as u32);
    let rows = (fields.len() as u32).div_ceil(columns);
    let step = [args.cell + GAP, args.cell + LETTER + 3 * GAP];
    let [width, height] = [columns * step[0] + GAP, rows * step[1] + GAP];
    if u64::from(width) * u64::from(height) > render::MAX_PIXELS {
        return Err(Failure::usage(format!(
            "the picture would be {width}x{height} pixels: give a smaller --cell"
        )));
    }
    let mut sheet = RgbaImage::from_pixel(width, height, Rgba(Style::default().background));
    for (place, definition) in (0u32..).zip(fields) {
        let corner = [GAP + place % columns * step[0], GAP + place / columns * step[1]];
        let picture = draw(definition, args)?;
        imageops::replace(&mut sheet, &picture, i64::from(corner[0]), i64::from(corner[1]));
        let half_width = definition.name.len() as u32 * LETTER / 2;
        let at = [(corner[0] + args.cell / 2).saturating_sub(half_width), corner[1] + args.cell + GAP];
        render::label(&mut sheet, definition.name, at, INK);
    }
    render::save_png(sheet, &args.output).map_err(Failure::run)?;
    say(format_args!("{}: {} fields, {width}x{height} pixels", args.output.display(), fields.len()))?;
    Ok(())
}

fn draw(definition: &Definition, args: &GalleryArgs) -> Result<RgbaImage, Failure> {
    let field = Named::new(definition.name).map_err(Failure::run)?;
    let half = Vec3::splat(definition.half_edge);
    let grid = Grid::from_bounds([args.cells; 3], -half, half).map_err(Failure::run)?;
    let (mesh, _) = extract_on_cpu(&Source::Field(&field, grid), &Options::new(definition.iso), &|_| {})
        .map_err(Failure::run)?;
    let view = View { size: [args.cell; 2], ..View::default() };
    let camera = Camera::fit(mesh.bounds(), &view).map_err(Failure::run)?;
    render::render_software(&mesh, &camera, &Style::default()).map_err(Failure::run)
}
