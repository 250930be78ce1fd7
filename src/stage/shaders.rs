//! The shader files, and how they are put together: each stage's file behind the shared ones and the
//! source of samples it reads.

use crate::field::differences::Normals;
use crate::field::{Planes, Wgsl};
use crate::gpu::Form;
use crate::stage::method::{Method, Placement};
use crate::stage::scan::{Scanned, group_and_run};
use crate::table::mc33::MC33;
use crate::table::tetrahedra::{CASE_WORDS, MARCHING_TETRAHEDRA};
use crate::volume::Scalar;

const PARAMS: &str = concat!(
    include_str!("../../shaders/shared/params.wgsl"),
    "\n",
    include_str!("../../shaders/settings/bound.wgsl")
);
const COPIED_PARAMS: &str = concat!(
    include_str!("../../shaders/shared/params.wgsl"),
    "\n",
    include_str!("../../shaders/settings/copied.wgsl")
);
const WORK: &str = include_str!("../../shaders/shared/work.wgsl");
const DISPATCH: &str = include_str!("../../shaders/shared/dispatch.wgsl");
const INSIDE: &str = concat!(
    include_str!("../../shaders/shared/finite.wgsl"),
    "\n",
    include_str!("../../shaders/shared/inside.wgsl")
);
const FINITE: &str = include_str!("../../shaders/shared/finite.wgsl");
const GRID: &str = include_str!("../../shaders/shared/grid.wgsl");
const RECORD: &str = include_str!("../../shaders/shared/record.wgsl");
/// What stages and drawing know of a mesh.
pub(crate) const HEADER: &str = include_str!("../../shaders/shared/header.wgsl");
const ROW: &str = include_str!("../../shaders/shared/row.wgsl");
const TRILINEAR: &str = include_str!("../../shaders/shared/trilinear.wgsl");
const CASES_MC: &str = include_str!("../../shaders/cases/mc.wgsl");
const CASES_MC33: &str = include_str!("../../shaders/cases/mc33.wgsl");
/// Elementary functions that fields may call; twin of [`crate::field::functions`].
pub const FUNCTIONS: &str = include_str!("../../shaders/shared/functions.wgsl");
/// Gradient noise, to be linked where a field calls it; twin of [`crate::field::noise`].
pub const NOISE: &str = include_str!("../../shaders/shared/noise.wgsl");
const VOLUME: &str = include_str!("../../shaders/source/volume.wgsl");
const PACKED: &str = include_str!("../../shaders/source/packed.wgsl");
const BRICKS: &str = include_str!("../../shaders/source/bricks.wgsl");
const EVALUATE: &str = include_str!("../../shaders/source/evaluate.wgsl");
const EVALUATE_POINTS: &str = include_str!("../../shaders/source/evaluate/points.wgsl");
const EVALUATE_PLANES: &str = include_str!("../../shaders/source/evaluate/planes.wgsl");
const GROUP_SERIAL: &str = include_str!("../../shaders/group/serial.wgsl");
const GROUP_SHARED: &str = include_str!("../../shaders/group/shared.wgsl");
const GROUP_SUBGROUP: &str = include_str!("../../shaders/group/subgroup.wgsl");
const FLAGS: &str = include_str!("../../shaders/brick/flags.wgsl");
const ROW_FLAGS: &str = include_str!("../../shaders/brick/row_flags.wgsl");
const SHARED_ROWS: &str = include_str!("../../shaders/brick/shared_rows.wgsl");
const READ_COLUMNS: &str = include_str!("../../shaders/brick/read_columns.wgsl");
const EMIT_ROWS: &str = include_str!("../../shaders/emit/rows.wgsl");
const EMIT_CELLS: &str = include_str!("../../shaders/emit/cells.wgsl");
const PLACE_LINEAR: &str = include_str!("../../shaders/place/linear.wgsl");
const PLACE_MIDPOINT: &str = include_str!("../../shaders/place/midpoint.wgsl");
const PLACE_FIXED: &str = include_str!("../../shaders/place/fixed.wgsl");
const PLACE_SNAPPED: &str = include_str!("../../shaders/place/snapped.wgsl");
const EMIT_CUBES: &str = include_str!("../../shaders/emit/cubes.wgsl");
const EMIT_TETRAHEDRA: &str = include_str!("../../shaders/emit/tetrahedra.wgsl");
const EMIT_CENTRES: &str = include_str!("../../shaders/emit/centres.wgsl");
const GRADIENT: &str = include_str!("../../shaders/source/gradient.wgsl");
pub(crate) const CENTRAL: &str = include_str!("../../shaders/source/central.wgsl");
pub(crate) const CAP_VALUE: &str = include_str!("../../shaders/cap/value.wgsl");
pub(crate) const CAP_GRADIENT: &str = include_str!("../../shaders/cap/gradient.wgsl");
pub(crate) const CAP_INTERVAL: &str = include_str!("../../shaders/cap/interval.wgsl");
const FORWARD: &str = include_str!("../../shaders/source/forward.wgsl");
const STRADDLES: &str = include_str!("../../shaders/shared/straddles.wgsl");
const DERIVATIVE: &str = include_str!("../../shaders/graph/derivative.wgsl");
const INTERVAL: &str = include_str!("../../shaders/graph/interval.wgsl");
const BOUNDS: &str = include_str!("../../shaders/bounds.wgsl");
const CULL: &str = include_str!("../../shaders/cull.wgsl");
const SAMPLE: &str = include_str!("../../shaders/sample.wgsl");
const SAMPLE_PLANES: &str = include_str!("../../shaders/sample_planes.wgsl");
const CLASSIFY: &str = include_str!("../../shaders/classify.wgsl");
const CLASSIFY_SERIAL: &str = include_str!("../../shaders/classify/serial.wgsl");
const CLASSIFY_TETRAHEDRA: &str = include_str!("../../shaders/classify/tetrahedra.wgsl");
const TETRA_RECORD: &str = include_str!("../../shaders/shared/tetra_record.wgsl");
const MAP: &str = include_str!("../../shaders/shared/map.wgsl");
const SCAN: &str = include_str!("../../shaders/scan.wgsl");
const SCAN_BRICKS: &str = include_str!("../../shaders/scan/bricks.wgsl");
const SCAN_COUNTS: &str = include_str!("../../shaders/scan/counts.wgsl");
const SCAN_MAP: &str = include_str!("../../shaders/scan/map.wgsl");
const NORMALS: &str = include_str!("../../shaders/normals.wgsl");
const TRACK: &str = include_str!("../../shaders/track.wgsl");
const COMPONENTS: &str = include_str!("../../shaders/components.wgsl");
const UNIT: &str = include_str!("../../shaders/shared/unit.wgsl");
const EMIT: &str = include_str!("../../shaders/emit.wgsl");
const REFINE: &str = include_str!("../../shaders/refine/shared.wgsl");
const REFINE_VERTEX: &str = include_str!("../../shaders/refine/vertex.wgsl");
const REFINE_ENDS: &str = include_str!("../../shaders/refine/ends.wgsl");
const REFINE_TASK: &str = include_str!("../../shaders/refine/task.wgsl");
const REFINE_START: &str = include_str!("../../shaders/refine/start.wgsl");
const REFINE_EDGES: &str = include_str!("../../shaders/refine/edges.wgsl");
const REFINE_MARKS: &str = include_str!("../../shaders/refine/marks.wgsl");
const REFINE_TASKS: &str = include_str!("../../shaders/refine/tasks.wgsl");
const REFINE_SEARCH: &str = include_str!("../../shaders/refine/search.wgsl");
const REFINE_PLACE: &str = include_str!("../../shaders/refine/place.wgsl");
const REFINE_CUT: &str = include_str!("../../shaders/refine/cut.wgsl");

const FIELD_DATA: &str = "@group(0) @binding(17) var<storage, read> field_data: array<u32>;\n";
const NO_LOOPS: &str = "fn report_runaway() {}\n";
/// The brick map where its words are read, and where cull writes them.
const READ_MAP: &str = "@group(0) @binding(4) var<storage, read> map: array<vec2<u32>>;\n";
const WRITE_MAP: &str = "@group(0) @binding(4) var<storage, read_write> map: array<vec2<u32>>;\n";

/// Where the stages find samples and normals.
#[derive(Debug, Clone, Copy)]
pub enum Samples<'a> {
    /// In a box of a volume, in one of the types that volumes keep.
    Volume(Scalar),
    /// In the bricks that the sample stage wrote of a field, or classify in its place.
    Field(&'a Wgsl),
}

/// A box of a volume whose samples are of that type.
fn volume(scalar: Scalar) -> String {
    let stored = match scalar {
        Scalar::U8 | Scalar::I8 | Scalar::U16 | Scalar::I16 => {
            let is_signed = matches!(scalar, Scalar::I8 | Scalar::I16);
            format!("const BITS = {}u;\nconst SIGNED = {is_signed};\n{PACKED}", 8 * scalar.size())
        }
        // No volume keeps any other.
        Scalar::F32 | Scalar::U32 | Scalar::I32 | Scalar::F64 => {
            "fn stored(i: u32) -> u32 { return source[i]; }\n".into()
        }
    };
    link(&[VOLUME, &stored])
}

fn link(parts: &[&str]) -> String {
    parts.join("\n")
}

/// The field's own part: its parameters, the functions asked for, and what reports its loops.
fn field_part(wgsl: &Wgsl, functions: &str) -> String {
    let parameters = format!(
        "@group(0) @binding(16) var<uniform> field_parameters: array<vec4<f32>, {}>;",
        crate::field::PARAMETER_VECTORS
    );
    let data = if wgsl.data.is_empty() { "" } else { FIELD_DATA };
    let limit = crate::field::user::MAX_ITERATIONS;
    let loops = if wgsl.counts_loops {
        format!(
            "fn report_runaway() {{ if isoforge_iterations >= {limit}u {{ atomicStore(&work.runaway, 1u); }} }}\n"
        )
    } else {
        NO_LOOPS.into()
    };
    link(&[FUNCTIONS, NOISE, &parameters, DERIVATIVE, data, functions, &loops])
}

/// Both functions: the gradient's text may have that of the value in it.
fn value_and_gradient(wgsl: &Wgsl, gradient: &str) -> String {
    if defines_density(gradient) { gradient.into() } else { link(&[&wgsl.value, gradient]) }
}

/// Whether a text has a field's value in it.
pub fn defines_density(text: &str) -> bool {
    const NAME: &str = "density";
    text.match_indices(NAME).any(|(at, _)| {
        let (before, after) = (&text[..at], text[at + NAME.len()..].trim_start());
        let keyword = before.trim_end();
        keyword.len() < before.len() && keyword.ends_with("fn") && after.starts_with('(')
    })
}

/// Everything of cull; `range` reads the samples.
pub fn cull(samples: Samples<'_>) -> String {
    let source = match samples {
        Samples::Volume(scalar) => volume(scalar),
        Samples::Field(_) => BRICKS.into(),
    };
    link(&[PARAMS, WORK, DISPATCH, INSIDE, GRID, &source, STRADDLES, WRITE_MAP, MAP, CULL])
}

/// The bits of a field's bricks, if it has intervals.
pub fn bounds(wgsl: &Wgsl) -> Option<String> {
    let own = field_part(wgsl, wgsl.interval.as_deref()?);
    Some(link(&[PARAMS, WORK, DISPATCH, INSIDE, STRADDLES, INTERVAL, &own, BOUNDS]))
}

/// The sample stage of a field.
pub fn sample(wgsl: &Wgsl) -> String {
    link(&[PARAMS, WORK, GRID, &field_part(wgsl, &wgsl.value), SAMPLE])
}

/// The sample stage of a field in a grid along the world's axes, if the field has parts for it.
pub fn sample_planes(wgsl: &Wgsl, form: Form) -> Option<String> {
    let own = field_part(wgsl, &wgsl.planes.as_ref()?.text);
    let lanes = match form {
        Form::Serial => VECTOR,
        Form::Shared | Form::Subgroup => 81,
    };
    let lanes = format!("const LANES = {lanes}u;");
    Some(link(&[params(form), WORK, GRID, &own, &lanes, SAMPLE_PLANES]))
}

/// Invocations of a workgroup that does a brick in the serial form: as many as software adapters do at once. They start each
/// such vector by itself, which costs more than a row of a brick.
const VECTOR: u32 = 8;

/// The settings of kernels that there is one of each form.
fn params(form: Form) -> &'static str {
    if form == Form::Serial { COPIED_PARAMS } else { PARAMS }
}

/// Sums of so many counters over workgroups of so many invocations.
fn group(form: Form, invocations: u32, counters: u32) -> String {
    let size = format!("const GROUP = {invocations}u;\nalias Sum = vec{counters}<u32>;\n");
    match form {
        Form::Serial => size + GROUP_SERIAL,
        Form::Shared => size + GROUP_SHARED,
        // naga wants no `enable subgroups;`, and does not know it.
        Form::Subgroup => size + GROUP_SUBGROUP,
    }
}

/// How the inside bits of a brick of cubes are found in samples that are there.
fn rows(form: Form) -> String {
    match form {
        Form::Serial => link(&[FLAGS, ROW_FLAGS]),
        Form::Shared | Form::Subgroup => link(&[FLAGS, SHARED_ROWS, READ_COLUMNS]),
    }
}

/// Where the triangles of a cell come from.
fn cases(method: Method) -> String {
    match method {
        Method::MarchingCubes => CASES_MC.into(),
        Method::Mc33 => link(&[TRILINEAR, CASES_MC33]),
        Method::Tetrahedra => {
            format!("const TETRA_TABLE = {}u;\nconst TETRA_WORDS = {CASE_WORDS}u;\n", MC33.words().len())
        }
    }
}

/// The words of all tables, as kernels of any method have them bound.
pub fn table_words() -> Vec<u32> {
    [MC33.words(), MARCHING_TETRAHEDRA.words()].concat()
}

/// Whether classify takes a field's samples itself: where workgroups share what they find, where it is no matter how
/// many samples an invocation takes, and where it asks no more of a sample than whether it is inside.
pub fn classify_samples(wgsl: &Wgsl, method: Method, form: Form) -> bool {
    form != Form::Serial && !wgsl.counts_loops && method == Method::MarchingCubes
}

/// The classify stage, of samples that are there.
pub fn classify(samples: Samples<'_>, method: Method, form: Form) -> String {
    let source = match samples {
        Samples::Volume(scalar) => volume(scalar),
        Samples::Field(_) => BRICKS.into(),
    };
    classify_of(&source, &rows(form), method, form)
}

/// Bytes that a column and a level of a brick may take: one lies in the registers of an invocation, nine of the others in workgroup memory.
const MOST_BYTES: [u32; 2] = [128, 256];

/// The parts of a field by which classify takes its samples in grids along the world's axes.
pub fn shared_planes(wgsl: &Wgsl) -> Option<&Planes> {
    wgsl.planes.as_ref().filter(|planes| (0..2).all(|part| planes.bytes[part] <= MOST_BYTES[part]))
}

/// The classify stage that takes a field's samples itself, by [`shared_planes`] where they are to be used.
pub fn classify_sampling(wgsl: &Wgsl, form: Form, by_planes: bool) -> String {
    let source = match shared_planes(wgsl).filter(|_| by_planes) {
        Some(planes) => link(&[&field_part(wgsl, &planes.text), EVALUATE, EVALUATE_PLANES]),
        None => link(&[&field_part(wgsl, &wgsl.value), EVALUATE, EVALUATE_POINTS]),
    };
    classify_of(&source, &link(&[FLAGS, SHARED_ROWS]), Method::MarchingCubes, form)
}

fn classify_of(source: &str, rows: &str, method: Method, form: Form) -> String {
    // One a row; one a column of cubes' bricks, in whole subgroups.
    let invocations = if form == Form::Serial || method == Method::Tetrahedra { 64 } else { 96 };
    let shared =
        link(&[&group(form, invocations, 2), params(form), WORK, INSIDE, GRID, source, ROW, &cases(method)]);
    match method {
        Method::MarchingCubes | Method::Mc33 => {
            let stage = if form == Form::Serial { CLASSIFY_SERIAL } else { CLASSIFY };
            link(&[&shared, RECORD, rows, stage])
        }
        Method::Tetrahedra => link(&[&shared, TETRA_RECORD, CLASSIFY_TETRAHEDRA]),
    }
}

/// The scan stage.
pub fn scan(scanned: Scanned, form: Form) -> String {
    let (invocations, run) = group_and_run(form);
    let group = group(form, invocations, 3) + &format!("const RUN = {run}u;\n");
    match scanned {
        Scanned::Map => link(&[&group, PARAMS, WORK, MAP, SCAN_MAP, SCAN]),
        Scanned::Bricks => link(&[&group, PARAMS, WORK, SCAN_BRICKS, SCAN]),
        Scanned::Counts => link(&[&group, PARAMS, WORK, SCAN_COUNTS, SCAN]),
    }
}

/// The emit stage; `normals` says where a field's come from.
pub fn emit(
    samples: Samples<'_>,
    method: Method,
    placement: Placement,
    normals: Normals,
    form: Form,
) -> String {
    let is_snapped = matches!((samples, placement), (Samples::Field(_), Placement::Snapped { .. }));
    let source = match samples {
        Samples::Volume(scalar) => link(&[&volume(scalar), NO_LOOPS]),
        Samples::Field(wgsl) => {
            let functions = match (normals, &wgsl.gradient) {
                (Normals::Exact, Some(own)) if is_snapped => value_and_gradient(wgsl, own),
                (Normals::Exact, Some(own)) => own.to_string(),
                (Normals::Exact | Normals::Central { .. }, _) => link(&[&wgsl.value, CENTRAL]),
                (Normals::Forward { .. }, _) => link(&[&wgsl.value, FORWARD]),
            };
            link(&[BRICKS, &field_part(wgsl, &functions), GRADIENT])
        }
    };
    let place = match placement {
        Placement::Midpoint => link(&[PLACE_MIDPOINT, PLACE_FIXED]),
        Placement::Snapped { .. } if is_snapped => link(&[PLACE_LINEAR, PLACE_SNAPPED]),
        Placement::Linear | Placement::Snapped { .. } => link(&[PLACE_LINEAR, PLACE_FIXED]),
    };
    // A brick has at most 1536 vertices. Where loops are counted, or the field is asked often, an invocation should make few.
    let (counted, loops) = match samples {
        // Fields without parts for planes may loop.
        Samples::Field(wgsl) => (wgsl.counts_loops, wgsl.planes.is_none()),
        Samples::Volume(_) => (false, false),
    };
    let lanes = match form {
        _ if counted || is_snapped => 256,
        Form::Serial if !loops => VECTOR,
        Form::Serial | Form::Shared | Form::Subgroup => 64,
    };
    let row_lanes = if form == Form::Serial && !is_snapped { VECTOR } else { 64 };
    let lanes = format!("const LANES = {lanes}u;\nconst ROW_LANES = {row_lanes}u;\n");
    let shared = link(&[params(form), WORK, DISPATCH, INSIDE, GRID, HEADER, READ_MAP, MAP, ROW, UNIT]);
    let shared = link(&[&shared, &source, &lanes, &cases(method), EMIT, &place]);
    let triangles = if form == Form::Serial { EMIT_CELLS } else { EMIT_ROWS };
    let cubes = || link(&[&shared, RECORD, EMIT_CUBES, triangles]);
    match method {
        Method::MarchingCubes => cubes(),
        Method::Mc33 => link(&[&cubes(), EMIT_CENTRES]),
        Method::Tetrahedra => link(&[&shared, TETRA_RECORD, EMIT_TETRAHEDRA]),
    }
}

/// The tracker's continuation, for samples of a volume of that type, or for those that were taken of a field.
pub fn track(of_volume: Option<Scalar>) -> String {
    let source = of_volume.map_or(BRICKS.into(), volume);
    link(&[PARAMS, WORK, DISPATCH, INSIDE, GRID, &source, TRACK])
}

/// The components of a mesh.
pub fn components() -> String {
    link(&[PARAMS, RECORD, HEADER, READ_MAP, MAP, COMPONENTS])
}

/// The refiner's look at the start mesh.
pub fn refine_start() -> String {
    link(&[FINITE, REFINE, UNIT, REFINE_VERTEX, REFINE_START])
}

/// The refiner's edges.
pub fn refine_edges() -> String {
    link(&[FINITE, REFINE, UNIT, REFINE_ENDS, REFINE_EDGES])
}

/// The refiner's marks of the edges that are split.
pub fn refine_marks() -> String {
    link(&[FINITE, REFINE, UNIT, REFINE_ENDS, REFINE_VERTEX, REFINE_MARKS])
}

/// What the refiner places.
pub fn refine_tasks() -> String {
    link(&[FINITE, REFINE, UNIT, REFINE_ENDS, REFINE_VERTEX, REFINE_TASK, REFINE_TASKS])
}

/// The refiner's placing of vertices on the surface of a field.
pub fn refine_place(wgsl: &Wgsl) -> String {
    let gradient = wgsl.gradient.as_deref().unwrap_or(CENTRAL);
    let own = field_part(wgsl, &value_and_gradient(wgsl, gradient));
    link(&[FINITE, REFINE, UNIT, &own, REFINE_TASK, REFINE_SEARCH, REFINE_PLACE])
}

/// The refiner's cutting of triangles.
pub fn refine_cut() -> String {
    link(&[FINITE, REFINE, UNIT, REFINE_VERTEX, REFINE_CUT])
}

/// The normals stage.
pub fn normals() -> String {
    link(&[PARAMS, WORK, DISPATCH, INSIDE, HEADER, UNIT, NORMALS])
}
