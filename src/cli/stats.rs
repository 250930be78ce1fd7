//! What `--stats` writes.

use crate::extract::Report;
use serde::Serialize;
use serde_json::Value;

/// One JSON object; seconds are null where a part was not done or not measured.
#[derive(Debug, Serialize)]
pub struct Stats<'a> {
    pub vertices: u64,
    pub triangles: u64,
    /// Zero-area triangles in the mesh as written; null if it never left the GPU: counting alone is not
    /// worth a second copy of it in memory.
    pub degenerate_triangles: Option<u64>,
    /// Triangles that `--no-degenerate` removed: of zero area, and pairs pressed onto each other.
    pub removed_triangles: u64,
    /// Triangles of zero area that an edge flip of `--no-degenerate` gave area.
    pub flipped_triangles: u64,
    /// Edges of one triangle alone where the domain ends; null if the mesh never left the GPU.
    pub open_edges: Option<u64>,
    pub bricks: u64,
    pub active_bricks: u64,
    pub slabs: u64,
    pub non_finite_samples: u64,
    pub backend: &'a str,
    /// The adapter's name; null on the CPU.
    pub adapter: Option<&'a str>,
    pub peak_bytes: u64,
    /// What is neither samples nor mesh.
    pub scratch_bytes: u64,
    /// Its `name`, as of --method, or `sharp`; and what --track, --sharp, --method dmc or octree tells beside.
    pub method: Value,
    /// What --refine tells.
    pub refined: Option<Value>,
    /// What --color-by tells.
    pub coloured: Option<Value>,
    pub seconds: Seconds,
}

#[derive(Debug, Default, Serialize)]
pub struct Seconds {
    pub read: Option<f64>,
    pub upload: Option<f64>,
    pub cull: Option<f64>,
    pub sample: Option<f64>,
    pub classify: Option<f64>,
    pub scan: Option<f64>,
    pub emit: Option<f64>,
    pub normals: Option<f64>,
    pub refine: Option<f64>,
    pub readback: Option<f64>,
    pub write: Option<f64>,
    pub total: f64,
}

impl Seconds {
    /// The parts that the extraction measured.
    pub fn of(report: &Report) -> Self {
        let [read, upload, cull, sample, classify, scan, emit, normals] = report.seconds;
        Self {
            read,
            upload,
            cull,
            sample,
            classify,
            scan,
            emit,
            normals,
            readback: None,
            refine: None,
            write: None,
            total: 0.0,
        }
    }
}
