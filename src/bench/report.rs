//! What a benchmark found, as JSON (through serde) and as a table.

use super::machine::Machine;
use super::roofline::Roof;
use super::{Backend, Frame, Input, Sweep};
use crate::extract::STAGES;
use std::collections::BTreeMap;
use std::fmt;

/// What a benchmark found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BenchReport {
    /// Where.
    pub machine: Machine,
    /// One for each backend, case, input and size.
    pub rows: Vec<Row>,
    /// What each stage of the GPU rows reaches of the adapter's limits, where it was asked for.
    pub roofs: Vec<Roof>,
    /// What was not measured, and why.
    pub skipped: Vec<String>,
}

/// The least and the middle of several runs.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Seconds {
    /// The middle one (the higher, of an even number).
    pub median: f64,
    /// The least.
    pub min: f64,
}

impl Seconds {
    pub(super) fn of(runs: &[f64]) -> Option<Self> {
        let mut sorted = runs.to_vec();
        sorted.sort_by(f64::total_cmp);
        Some(Self { median: *sorted.get(sorted.len() / 2)?, min: sorted[0] })
    }
}

/// The times of one input on one backend.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// Where it ran.
    pub backend: Backend,
    /// Name of the field or volume.
    pub case: String,
    /// Where its samples came from.
    pub input: Input,
    /// Bytes of a sample.
    pub sample_bytes: u64,
    /// Cells along x, y, z.
    pub cells: [u32; 3],
    /// Sample points of the grid.
    pub points: u64,
    /// Timed runs.
    pub runs: usize,
    /// The whole, from the source to the mesh in memory (CPU) or in buffers (GPU); of a volume with its
    /// range table and upload.
    pub seconds: Seconds,
    /// The whole once more: of a volume on the CPU with the range table at hand, on the GPU with buffers
    /// and upload at hand; none where there is no difference.
    pub again: Option<Seconds>,
    /// Frames of a renderer, on the GPU; none where the grid needs several slabs.
    pub frame: Option<Frame>,
    /// A sweep of iso values, of volumes on the GPU, where it was asked for.
    pub sweep: Option<Sweep>,
    /// Medians of each stage's seconds, by its name.
    pub stages: BTreeMap<&'static str, f64>,
    /// Cells of the grid per second, by the fastest run.
    pub cells_per_second: f64,
    /// Triangles made per second, by the fastest run.
    pub triangles_per_second: f64,
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Bricks of the grid.
    pub bricks: u64,
    /// Bricks that cull kept.
    pub active_bricks: u64,
    /// The most bytes that buffers took.
    pub peak_bytes: u64,
}

impl fmt::Display for BenchReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let m = &self.machine;
        writeln!(f, "isoforge {}, {}, {} cores, {} threads", m.isoforge, m.system, m.cores, m.threads)?;
        if let Some(a) = &m.adapter {
            write!(f, "adapter {} ({}, {}, {})", a.name, a.kind, a.backend, a.driver)?;
            if let Some(speed) = a.copied_bytes_per_second {
                write!(f, ", copies {:.1} GB/s", speed * 1e-9)?;
            }
            writeln!(f, ", kernels {}", a.form)?;
            if let Some(limits) = &a.limits {
                let [bytes, operations] =
                    [limits.bytes_per_second * 1e-9, limits.operations_per_second * 1e-9];
                writeln!(f, "a kernel moves {bytes:.0} GB/s and does {operations:.0} Gflop/s")?;
            }
        }
        let header = [
            "",
            "case",
            "input",
            "cells",
            "min ms",
            "median",
            "again",
            "frame",
            "on GPU",
            "Mcells/s",
            "Mtri/s",
            "triangles",
        ];
        let mut table = vec![header.map(String::from).to_vec()];
        table[0].extend(STAGES.map(|stage| format!("{stage} ms")));
        for row in &self.rows {
            let [x, y, z] = row.cells;
            let mut line = vec![
                format!("{:?}", row.backend),
                row.case.clone(),
                format!("{:?}", row.input).to_lowercase(),
                if x == y && y == z { format!("{x}³") } else { format!("{x}×{y}×{z}") },
                ms(row.seconds.min),
                ms(row.seconds.median),
                row.again.map_or(String::new(), |s| ms(s.min)),
                row.frame.as_ref().map_or(String::new(), |f| ms(f.seconds.min)),
                row.frame.as_ref().and_then(|f| f.gpu).map_or(String::new(), ms),
                format!("{:.1}", row.cells_per_second * 1e-6),
                format!("{:.2}", row.triangles_per_second * 1e-6),
                row.triangles.to_string(),
            ];
            line.extend(STAGES.map(|stage| row.stages.get(stage).map_or(String::new(), |&s| ms(s))));
            table.push(line);
        }
        write_columns(f, &table)?;
        for row in &self.rows {
            if let Some(s) = &row.sweep {
                writeln!(
                    f,
                    "{} {}: {} iso values: {} ms a frame, at most {}, {:.0} Mtri/s",
                    row.case,
                    row.cells.map(|n| n.to_string()).join("×"),
                    s.values,
                    ms(s.seconds.median),
                    ms(s.longest),
                    s.triangles as f64 * 1e-6 / s.total
                )?;
            }
        }
        self.roofs.iter().try_for_each(|roof| write!(f, "{roof}"))?;
        self.skipped.iter().try_for_each(|line| writeln!(f, "skipped {line}"))
    }
}

fn ms(seconds: f64) -> String {
    format!("{:.2}", seconds * 1e3)
}

/// Columns as wide as their widest entry, without those that have no entry but the header.
fn write_columns(f: &mut fmt::Formatter<'_>, table: &[Vec<String>]) -> fmt::Result {
    let columns: Vec<(usize, usize)> = (0..table[0].len())
        .filter(|&c| table[1..].iter().any(|line| !line[c].is_empty()))
        .map(|c| (c, table.iter().map(|line| line[c].chars().count()).max().unwrap_or(0)))
        .collect();
    for line in table {
        for (i, &(c, width)) in columns.iter().enumerate() {
            let gap = if i == 0 { "" } else { "  " };
            if c < 4 {
                write!(f, "{gap}{:<width$}", line[c])?;
            } else {
                write!(f, "{gap}{:>width$}", line[c])?;
            }
        }
        writeln!(f)?;
    }
    Ok(())
}
