//! The shader files, and how they are put together: each stage's file behind the shared ones and the
//! source of samples it reads.

use crate::field::Wgsl;

const PARAMS: &str = include_str!("../../shaders/shared/params.wgsl");
const WORK: &str = include_str!("../../shaders/shared/work.wgsl");
const INSIDE: &str = include_str!("../../shaders/shared/inside.wgsl");
const GRID: &str = include_str!("../../shaders/shared/grid.wgsl");
const RECORD: &str = include_str!("../../shaders/shared/record.wgsl");
/// What stages and drawing know of a mesh.
pub(crate) const HEADER: &str = include_str!("../../shaders/shared/header.wgsl");
const ROW: &str = include_str!("../../shaders/shared/row.wgsl");
const TURNS: &str = include_str!("../../shaders/shared/turns.wgsl");
const VOLUME: &str = include_str!("../../shaders/source/volume.wgsl");
const BRICKS: &str = include_str!("../../shaders/source/bricks.wgsl");
const GRADIENT: &str = include_str!("../../shaders/source/gradient.wgsl");
const DIFFERENCES: &str = include_str!("../../shaders/source/differences.wgsl");
const CULL: &str = include_str!("../../shaders/cull.wgsl");
const SAMPLE: &str = include_str!("../../shaders/sample.wgsl");
const CLASSIFY: &str = include_str!("../../shaders/classify.wgsl");
const SCAN: &str = include_str!("../../shaders/scan.wgsl");
const EMIT: &str = include_str!("../../shaders/emit.wgsl");

const NO_LOOPS: &str = "fn report_runaway() {}\n";

/// Where the stages find samples and normals.
#[derive(Debug, Clone, Copy)]
pub enum Samples<'a> {
    /// In a box of a volume.
    Volume,
    /// In the bricks that the sample stage wrote of a field.
    Field(&'a Wgsl),
}

fn link(parts: &[&str]) -> String {
    parts.join("\n")
}

/// The field's own part: its parameters, its function, its gradient, and what reports its loops.
fn field_part(wgsl: &Wgsl) -> String {
    let parameters = format!(
        "@group(0) @binding(16) var<uniform> field_parameters: array<vec4<f32>, {}>;",
        crate::field::PARAMETER_VECTORS
    );
    let differences = if wgsl.has_gradient { "" } else { DIFFERENCES };
    let limit = crate::field::user::MAX_ITERATIONS;
    let loops = if wgsl.counts_loops {
        format!(
            "fn report_runaway() {{ if isoforge_iterations >= {limit}u {{ atomicStore(&work.runaway, 1u); }} }}\n"
        )
    } else {
        NO_LOOPS.into()
    };
    link(&[TURNS, &parameters, &wgsl.source, differences, &loops])
}

/// Everything of cull; `range` reads the samples.
pub fn cull(samples: Samples<'_>) -> String {
    let source = match samples {
        Samples::Volume => VOLUME,
        Samples::Field(_) => BRICKS,
    };
    link(&[PARAMS, WORK, INSIDE, GRID, source, CULL])
}

/// The sample stage of a field.
pub fn sample(wgsl: &Wgsl) -> String {
    link(&[PARAMS, WORK, GRID, &field_part(wgsl), SAMPLE])
}

/// The classify stage.
pub fn classify(samples: Samples<'_>) -> String {
    let source = match samples {
        Samples::Volume => VOLUME,
        Samples::Field(_) => BRICKS,
    };
    link(&[PARAMS, WORK, INSIDE, GRID, RECORD, source, ROW, CLASSIFY])
}

/// The scan stage.
pub fn scan() -> String {
    link(&[PARAMS, WORK, SCAN])
}

/// The emit stage.
pub fn emit(samples: Samples<'_>) -> String {
    let source = match samples {
        Samples::Volume => link(&[VOLUME, NO_LOOPS]),
        Samples::Field(wgsl) => link(&[BRICKS, &field_part(wgsl), GRADIENT]),
    };
    // A brick has at most 1536 vertices. Where loops are counted an invocation should make few of them.
    let counted = matches!(samples, Samples::Field(wgsl) if wgsl.counts_loops);
    let lanes = if counted { "const LANES = 256u;" } else { "const LANES = 64u;" };
    link(&[PARAMS, WORK, INSIDE, GRID, RECORD, HEADER, &source, ROW, lanes, EMIT])
}
