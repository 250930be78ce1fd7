//! `isoforge bench`.

use super::args::BenchArgs;
use super::{Failure, backend, say, tell};
use crate::bench::{Backend, BenchOptions, VolumeCase, run as measure};
use crate::gpu::{AdapterChoice, Gpu};
use crate::volume::{self, OpenOptions};

/// Measures every stage and the whole, and prints a table or JSON.
pub fn run(args: &BenchArgs) -> Result<(), Failure> {
    args.json.as_deref().map_or(Ok(()), super::check_text_target)?;
    let memory_budget = backend::memory_budget(None);
    let opened = match (&args.volume, args.iso) {
        (Some(path), Some(iso)) => {
            let opened =
                volume::open(path, &OpenOptions { max_bytes: Some(memory_budget), ..OpenOptions::default() });
            let opened = opened.map_err(Failure::run)?;
            if !args.quiet {
                opened.notes.iter().for_each(tell);
            }
            Some((opened.volume, iso))
        }
        _ => None,
    };
    let name = args.volume.as_ref().and_then(|p| p.file_name()).map(|n| n.to_string_lossy().into_owned());
    let backends = match args.backend {
        super::args::Backend::Auto => vec![Backend::Cpu, Backend::Gpu],
        super::args::Backend::Gpu => vec![Backend::Gpu],
        super::args::Backend::Cpu => vec![Backend::Cpu],
    };
    let gpu = match args.backend {
        super::args::Backend::Cpu => None,
        super::args::Backend::Gpu => Some(
            Gpu::open(AdapterChoice::Best)
                .map_err(|e| Failure::run(format!("{e}; or measure the CPU alone (--backend cpu)")))?,
        ),
        super::args::Backend::Auto => Gpu::open(AdapterChoice::Best).ok(),
    };
    let gpu = match (gpu, args.form) {
        (Some(gpu), Some(form)) => Some(gpu.with_form(form.into()).ok_or_else(|| {
            Failure::run("this adapter has no subgroup operations of one size: take another --form")
        })?),
        (gpu, _) => gpu,
    };
    let options = BenchOptions {
        sizes: args.sizes.clone(),
        cases: args.cases.clone(),
        volume: opened.as_ref().map(|(volume, iso)| VolumeCase {
            name: name.as_deref().unwrap_or("volume"),
            volume,
            iso: *iso,
        }),
        methods: args.methods.iter().map(|&method| method.into()).collect(),
        arrays: args.arrays,
        dense: args.dense,
        roofline: args.roofline,
        sweep: args.sweep,
        backends,
        repeats: args.repeats,
        seconds: args.seconds,
        memory_budget,
    };
    let mut measuring = |what: &str| {
        if !args.quiet {
            tell(format_args!("measuring {what}"));
        }
    };
    let report = measure(&options, gpu.as_ref(), &mut measuring).map_err(Failure::usage)?;
    let json = serde_json::to_string(&report).map_err(Failure::run)?;
    if let Some(path) = &args.json {
        super::write_text(&json, path)?;
    }
    // Standard output is one JSON object and nothing else where that was asked for.
    if args.json.as_deref() != Some(std::path::Path::new("-")) {
        say(report.to_string().trim_end())?;
    }
    if report.rows.is_empty() {
        return Err(Failure::run("nothing was measured: the report's skipped rows say why"));
    }
    Ok(())
}
