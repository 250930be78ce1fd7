//! The arguments of every command.

use super::accuracy::AccuracyArgs;
use super::bench::BenchArgs;
use super::colour::ColourArgs;
use super::gallery::GalleryArgs;
use super::mesh_tools::MeshToolsArgs;
use super::values::{
    RefineArg, Size, Triple, bounds, byte_count, cells, count, degrees, dims, parameter, refine, size,
    time_limit, triple,
};
use crate::extract::Method;
use crate::field::Sense;
use crate::render::Shade;
use crate::volume::{Endian, Scalar};
use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::Vec3;
use std::path::PathBuf;
use std::str::FromStr;

const EXIT_CODES: &str = "Exit codes: 0 done, also where the mesh of `extract` is empty; 1 the run failed, or what it looked for is \
    not so (`check --strict`, `compare`); 2 the command line is wrong";

/// Turns density fields and volumes into triangle meshes, on the GPU or on all cores of the CPU.
#[derive(Debug, Parser)]
#[command(name = "isoforge", version, about, max_term_width = 110, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Extract the surface at an iso value: write it, draw it, or both
    Extract(Box<ExtractArgs>),
    /// Check a mesh file: is it closed, manifold, consistently wound; area, volume, genus
    Check(CheckArgs),
    /// Weld, repair, smooth, simplify and reorder a mesh file, in the order of the numbers below, with a check after each step
    MeshTools(Box<MeshToolsArgs>),
    /// List the adapters, their limits, and what isoforge will use
    Info,
    /// List the named fields with their formulas and parameters
    Fields,
    /// List the kinds of nodes of scene files with their keys
    Nodes,
    /// Draw every named field into one PNG
    Gallery(GalleryArgs),
    /// Run GPU and CPU stage by stage and tell what agrees; exit 1 if something does not, or if there is no surface to compare
    Compare(CompareArgs),
    /// Measure how far meshes lie from the surface: uniform, refined, sharp, dual marching cubes, and the uniform
    /// grid that has the refined mesh's error
    Accuracy(AccuracyArgs),
    /// Measure every stage and the whole, on CPU and GPU, and the adapter's copy bandwidth
    Bench(BenchArgs),
}

/// What is meshed, and where.
#[derive(Debug, Default, Args)]
pub struct SourceArgs {
    /// A field's name (see `isoforge fields`), a formula like 'sqrt(x^2 + y^2 + z^2) - r',
    /// a .wgsl file with `fn density(p: vec3<f32>) -> f32`, a scene: .toml (see `isoforge nodes`),
    /// a volume: .nii .nii.gz .tif .tiff .nrrd .nhdr, or raw values in .raw, .bin or any other file, with --dims,
    /// or a molecule or other points, which become blobs: .pdb .xyz .csv (also .gz) .ply
    pub source: String,

    /// The iso value, in the units of the samples [default: the field's own, or 0; 0.5 for points; volumes need it]
    #[arg(short = 'I', long, value_name = "VALUE", allow_negative_numbers = true)]
    pub iso: Option<f32>,

    /// Cells along each axis of a field's grid: one number, or x,y,z [default: the scene's, or 128; of points one number is for
    /// the longest axis]
    #[arg(short = 'n', long, value_name = "N", value_parser = cells, allow_hyphen_values = true)]
    pub cells: Option<[u32; 3]>,

    /// Mesh a field in the cube from -L to L [default: the field's or the scene's own, or 1.5]
    #[arg(short = 'L', long, value_name = "L", allow_negative_numbers = true, conflicts_with = "bounds")]
    pub half_edge: Option<f32>,

    /// Mesh a field in this box
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = bounds, allow_hyphen_values = true)]
    pub bounds: Option<[Vec3; 2]>,

    /// A named field's, a formula's or a scene's parameter, as in `--param R=0.8`; may be repeated
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parameter)]
    pub parameters: Vec<(String, f64)>,

    /// Which side of iso is inside [default: of named fields what `isoforge fields` says; below for formulas, WGSL and solids of
    /// scenes, above for volumes, points and densities of scenes]
    #[arg(long, value_enum)]
    pub inside: Option<Side>,

    /// What a field's normals come from (a volume's are central differences of its samples) [default: exact]
    #[arg(long, value_enum, value_name = "KIND")]
    pub normals: Option<NormalsArg>,

    /// The step of forward or central differences, in world units [default: a hundredth of the shortest cell edge]
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    pub delta: Option<f32>,

    #[command(flatten)]
    pub blobs: BlobArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum NormalsArg {
    /// The field's own gradient; central differences of a WGSL function that a GPU runs as it is written
    Exact,
    /// Differences to one step ahead: fast, coarse
    Forward,
    /// Differences between one step to either side
    Central,
}

/// How points become a field.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Points")]
pub struct BlobArgs {
    /// How a point's blob falls with the distance
    #[arg(long, value_enum, value_name = "KERNEL")]
    pub kernel: Option<KernelArg>,

    /// The radius of every point of a file that has none; molecules have their elements' [default: 1]
    #[arg(long, value_name = "RADIUS", allow_negative_numbers = true)]
    pub radius: Option<f32>,

    /// How far blobs reach, in radii [default: so far that a lone point's surface lies at its radius; 3 for
    /// inverse-square]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    pub support: Option<f32>,
}

/// Of flags, each with whether it was given, the first that was.
fn first_given<const N: usize>(flags: [(bool, &'static str); N]) -> Option<&'static str> {
    flags.into_iter().find_map(|(given, flag)| given.then_some(flag))
}

impl BlobArgs {
    /// A flag that was given, if any.
    pub fn given(&self) -> Option<&'static str> {
        let flags = [
            (self.kernel.is_some(), "--kernel"),
            (self.radius.is_some(), "--radius"),
            (self.support.is_some(), "--support"),
        ];
        first_given(flags)
    }
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
pub enum KernelArg {
    /// Wyvill's soft object
    #[default]
    Soft,
    /// Nishimura's metaball
    Metaball,
    /// Blinn's exponential, cut off at a thousandth
    Blobby,
    /// 1/r², weighted so that a lone point's surface lies at its radius
    InverseSquare,
}

/// How a file of raw values is laid out.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Raw volumes")]
pub struct RawArgs {
    /// Samples along each axis of a raw volume
    #[arg(long, value_name = "X,Y,Z", value_parser = dims, requires = "scalar", allow_hyphen_values = true)]
    pub dims: Option<[u32; 3]>,

    /// Type of its samples: u8 i8 u16 i16 u32 i32 f32 f64
    #[arg(long = "type", value_name = "TYPE", value_parser = Scalar::from_str, requires = "dims")]
    pub scalar: Option<Scalar>,

    /// Its byte order: little or big [default: little]
    #[arg(long, value_parser = Endian::from_str)]
    pub endian: Option<Endian>,

    /// Distance of its samples, in world units; of TIFF, NIfTI and NRRD volumes, too, in place of what the file says [default: the
    /// file's, or 1,1,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub spacing: Option<Triple>,

    /// World position of its first sample [default: 0,0,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub origin: Option<Triple>,

    /// Bytes before its first sample [default: 0]
    #[arg(long, value_name = "BYTES", value_parser = count::<u64>, allow_negative_numbers = true)]
    pub skip_bytes: Option<u64>,
}

impl RawArgs {
    /// A flag for raw files alone that was given, if any.
    pub fn given(&self) -> Option<&'static str> {
        let flags = [
            (self.dims.is_some(), "--dims, --type and what goes with them describe"),
            (self.endian.is_some(), "--endian describes"),
            (self.origin.is_some(), "--origin describes"),
            (self.skip_bytes.is_some(), "--skip-bytes describes"),
        ];
        first_given(flags)
    }
}

#[derive(Debug, Args)]
pub struct ExtractArgs {
    #[command(flatten)]
    pub source: SourceArgs,

    /// Write the mesh; the ending chooses the format: .off .obj .ply .stl .glb, or .rib for RenderMan renderers
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Draw the mesh into a PNG
    #[arg(long, value_name = "FILE")]
    pub png: Option<PathBuf>,

    /// Contract the zero-area triangles that samples equal to iso leave behind; where their corners are three places on a line,
    /// flip an edge
    #[arg(long)]
    pub no_degenerate: bool,

    #[command(flatten)]
    pub method: MethodArgs,

    #[command(flatten)]
    pub run: RunArgs,

    /// Write one JSON object with counts, bytes and seconds; - for standard output. A mesh that is only
    /// drawn on the GPU is read back for it where the memory budget has room: else its triangles of zero area and open edges are
    /// not counted
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Print errors alone, and that the mesh is empty, which is none: the exit code is 0
    #[arg(short, long)]
    pub quiet: bool,

    #[command(flatten)]
    pub colour: ColourArgs,

    #[command(flatten)]
    pub picture: PictureArgs,

    #[command(flatten)]
    pub raw: RawArgs,
}

/// How the surface becomes triangles.
#[derive(Debug, Args)]
#[command(next_help_heading = "Methods")]
pub struct MethodArgs {
    /// How cells become triangles
    #[arg(long, value_enum, default_value = "mc")]
    pub method: MethodArg,

    /// Put vertices on a field's surface itself, not only where the samples at the ends of their edges say: within so many world
    /// units, by secant and bisection steps
    #[arg(long, value_name = "EPSILON", conflicts_with = "midpoint", allow_negative_numbers = true)]
    pub snap: Option<f32>,

    /// Put vertices in the middle of their edges: fast, and coarse
    #[arg(long)]
    pub midpoint: bool,

    /// Close the mesh where the domain ends: what lies beyond is outside. A volume is copied, as f32; zero-area triangles are contracted
    /// as by --no-degenerate
    #[arg(long, conflicts_with = "open")]
    pub cap: bool,

    /// Leave the mesh open where the domain ends [default]
    #[arg(long)]
    pub open: bool,

    /// How far the mesh of --method dmc or octree may lie from the surface, in world units [default: a tenth of the
    /// shortest cell edge]
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    pub error: Option<f32>,

    /// The most cells that the octree of --method dmc or octree may have
    #[arg(long, value_name = "N", value_parser = count::<u64>, allow_negative_numbers = true)]
    pub most_cells: Option<u64>,

    /// Keep the edges and corners of the surface: dual contouring of the uniform grid
    #[arg(long)]
    pub sharp: bool,

    /// Split triangles where the surface is curved (Velho), their new corners on the surface: flatness is the cosine of the
    /// angle between normals from which on an edge is split, epsilon and step (the tolerance and the longest step of the
    /// projection) are in world units, depth is how often an edge is split at most
    #[arg(long, value_name = "flatness=0.95,epsilon=1e-4,depth=5,step=L", num_args = 0..=1, default_missing_value = "",
        value_parser = refine)]
    pub refine: Option<RefineArg>,

    /// Follow the surface from seeds, at a cost that grows with it and not with the grid: from --seed, --coarse, --search;
    /// without them from the centres of points, and in other sources from a --search 1
    #[arg(long)]
    pub track: bool,

    /// Track the component at this place, or the first that is met from it along the axes; may be repeated
    #[arg(long = "seed", value_name = "X,Y,Z", value_parser = triple, requires = "track", allow_hyphen_values = true)]
    pub seeds: Vec<Triple>,

    /// Track what separates the points of a lattice of every so many grid points
    #[arg(long, value_name = "N", requires = "track", allow_negative_numbers = true)]
    pub coarse: Option<u32>,

    /// Track what the field's intervals leave of the grid, down to boxes of so many cells; with 1, all there is
    #[arg(long, value_name = "CELLS", requires = "track", allow_negative_numbers = true)]
    pub search: Option<u32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// Marching cubes on the uniform grid
    Mc,
    /// Marching cubes on the uniform grid with the topology of the trilinear interpolant in every cell
    Mc33,
    /// Marching tetrahedra on the uniform grid: each cell cut in six, no ambiguity, more triangles
    Mt,
    /// Polygons of an octree's cells (Bloomenthal), closed between cells of different sizes
    Octree,
    /// Dual contouring of an octree whose smallest cells are the grid's: fewer triangles where the surface is flat, sharp
    /// edges
    Dmc,
}

/// The methods of [`MethodArg`] that go over the cells of the uniform grid, on both backends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CellsArg {
    Mc,
    Mc33,
    Mt,
}

impl From<CellsArg> for Method {
    fn from(method: CellsArg) -> Self {
        match method {
            CellsArg::Mc => Self::MarchingCubes,
            CellsArg::Mc33 => Self::Mc33,
            CellsArg::Mt => Self::Tetrahedra,
        }
    }
}

/// Where and within which limits the work is done.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Where to extract; auto takes a GPU if there is one (a software adapter is none) and it has the memory,
    /// else the CPU
    #[arg(long, value_enum, default_value = "auto")]
    pub backend: Backend,

    /// The most memory that buffers may take, as in 512M or 4G; an uncompressed volume that takes more, by itself or with its
    /// mesh, is read a part at a time if the mesh goes to one .ply or .stl file alone [default: three quarters of what is free]
    #[arg(long, value_name = "BYTES", value_parser = byte_count, allow_hyphen_values = true)]
    pub memory_budget: Option<u64>,

    /// The longest wait for one piece of GPU work, in seconds, at least 1
    #[arg(long, value_name = "SECONDS", default_value_t = 120, value_parser = time_limit, allow_negative_numbers = true)]
    pub time_limit: u64,
}

/// How the picture looks.
#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub struct PictureArgs {
    /// Degrees around the z axis; 0 looks from +x, 90 from +y [default: the scene's, or 30]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    pub azimuth: Option<f32>,

    /// Degrees above the xy plane [default: the scene's, or 25]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    pub elevation: Option<f32>,

    /// Vertical opening angle in degrees [default: the scene's, or 35]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    pub fov: Option<f32>,

    /// Width and height in pixels
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "1024x768", allow_hyphen_values = true)]
    pub size: Size,

    /// lit; normals as colours; or debug: magenta for triangles seen from behind (on a closed surface seen
    /// from outside, a fault), yellow where the normal and the winding disagree
    #[arg(long, value_enum, default_value = "lit")]
    pub shade: ShadeArg,

    /// Draw edges sharp where triangles meet at more than so many degrees, each side with normals of its own; 180 for
    /// none [default: 40 of --refine, --sharp and --method, else none]
    #[arg(long, value_name = "DEGREES", value_parser = degrees, allow_negative_numbers = true)]
    pub crease: Option<f32>,

    /// Draw the triangles' edges on top
    #[arg(long)]
    pub wireframe: bool,
}

impl PictureArgs {
    /// A flag that was given, if any.
    pub fn given(&self) -> Option<&'static str> {
        let flags = [
            (self.azimuth.is_some(), "--azimuth"),
            (self.elevation.is_some(), "--elevation"),
            (self.fov.is_some(), "--fov"),
            (self.crease.is_some(), "--crease"),
            (self.wireframe, "--wireframe"),
        ];
        first_given(flags)
    }
}

#[derive(Debug, Args)]
pub struct CheckArgs {
    /// A mesh: .off .obj .ply .stl .glb
    pub file: PathBuf,

    /// Print one JSON object
    #[arg(long)]
    pub json: bool,

    /// Exit 1 on any defect, and where there is no triangle
    #[arg(long)]
    pub strict: bool,
}

#[derive(Debug, Args)]
pub struct CompareArgs {
    #[command(flatten)]
    pub source: SourceArgs,

    /// How cells become triangles
    #[arg(long, value_enum, default_value = "mc")]
    pub method: CellsArg,

    #[command(flatten)]
    pub raw: RawArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    Auto,
    Gpu,
    Cpu,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Side {
    Below,
    Above,
}

impl From<Side> for Sense {
    fn from(side: Side) -> Self {
        match side {
            Side::Below => Self::Below,
            Side::Above => Self::Above,
        }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum ShadeArg {
    Lit,
    Normals,
    Debug,
}

impl From<ShadeArg> for Shade {
    fn from(shade: ShadeArg) -> Self {
        match shade {
            ShadeArg::Lit => Self::Lit,
            ShadeArg::Normals => Self::Normals,
            ShadeArg::Debug => Self::Debug,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn values_are_read() {
        assert_eq!(cells("7"), Ok([7; 3]));
        assert_eq!(cells("7,8,9"), Ok([7, 8, 9]));
        assert!(cells("7,8").is_err() && cells("-1").is_err() && cells("1.5").is_err());
        assert_eq!(byte_count("512M"), Ok(512 << 20));
        assert_eq!(byte_count("2 GiB"), Ok(2 << 30));
        assert!(byte_count("99999999999999T").is_err() && byte_count("fast").is_err());
        assert_eq!(parameter("R=0.5"), Ok(("R".into(), 0.5)));
        assert!(bounds("0,0,0,1,1").is_err());
    }
}
