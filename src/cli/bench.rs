//! `isoforge bench`.

use super::args::{self, CellsArg};
use super::values::seconds;
use super::{Failure, backend, say, tell};
use crate::bench::{Backend, BenchOptions, VolumeCase, run as measure};
use crate::gpu::{AdapterChoice, Form, Gpu};
use crate::volume::{self, OpenError, OpenOptions};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Cells along each axis, one size after the other
    #[arg(
        short = 'n',
        long = "sizes",
        value_name = "N,N,…",
        value_delimiter = ',',
        default_value = "64,128,256",
        allow_hyphen_values = true
    )]
    pub sizes: Vec<u32>,

    /// Named fields to extract
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "sphere,torus,gyroid")]
    pub cases: Vec<String>,

    /// A volume file to extract beside them
    #[arg(long, value_name = "FILE", requires = "iso")]
    pub volume: Option<PathBuf>,

    /// The volume's iso value
    #[arg(short = 'I', long, value_name = "VALUE", allow_negative_numbers = true)]
    pub iso: Option<f32>,

    /// Sample the fields into arrays and extract those, too
    #[arg(long)]
    pub arrays: bool,

    /// How cells become triangles, one method after the other
    #[arg(long, value_enum, value_name = "METHOD,…", value_delimiter = ',', default_value = "mc")]
    pub methods: Vec<CellsArg>,

    /// Take every brick of the fields, not only those that their intervals leave
    #[arg(long)]
    pub dense: bool,

    /// Tell how far each stage of the GPU is from what the adapter can do: bytes and evaluations per second
    #[arg(long)]
    pub roofline: bool,

    /// The form of the kernels on the GPU: how workgroups share their work [default: the adapter's best, which `info` tells]
    #[arg(long, value_enum)]
    pub form: Option<FormArg>,

    /// Sweep so many iso values over volumes that lie on the GPU
    #[arg(long, value_name = "VALUES", default_value_t = 0, allow_negative_numbers = true)]
    pub sweep: u32,

    /// Where to extract; auto is both
    #[arg(long, value_enum, default_value = "auto")]
    pub backend: args::Backend,

    /// The most timed runs a row
    #[arg(long, value_name = "RUNS", default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    pub repeats: u32,

    /// Seconds after which a row gets no further run
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0, value_parser = seconds, allow_negative_numbers = true)]
    pub seconds: f64,

    /// Write one JSON object; - for standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Do not tell what is being measured
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum FormArg {
    /// Each invocation for itself, with few barriers
    Serial,
    /// Through memory of the workgroup
    Shared,
    /// By subgroup operations
    Subgroup,
}

impl From<FormArg> for Form {
    fn from(form: FormArg) -> Self {
        match form {
            FormArg::Serial => Self::Serial,
            FormArg::Shared => Self::Shared,
            FormArg::Subgroup => Self::Subgroup,
        }
    }
}

/// Measures every stage and the whole, and prints a table or JSON.
pub fn run(args: &BenchArgs) -> Result<(), Failure> {
    args.json.as_deref().map_or(Ok(()), super::check_text_target)?;
    let memory_budget = backend::memory_budget(None);
    let opened = match (&args.volume, args.iso) {
        (Some(path), Some(iso)) => {
            let opened =
                volume::open(path, &OpenOptions { max_bytes: Some(memory_budget), ..OpenOptions::default() });
            // There is no flag for the budget here: it is the machine's.
            let own = |error: OpenError| error.to_string().replace(" (`OpenOptions::max_bytes`)", "");
            let opened = opened.map_err(|error| Failure::run(own(error)))?;
            if !args.quiet {
                opened.notes.iter().for_each(tell);
            }
            Some((opened.volume, iso))
        }
        _ => None,
    };
    let name = args.volume.as_ref().and_then(|p| p.file_name()).map(|n| n.to_string_lossy().into_owned());
    let backends = match args.backend {
        args::Backend::Auto => vec![Backend::Cpu, Backend::Gpu],
        args::Backend::Gpu => vec![Backend::Gpu],
        args::Backend::Cpu => vec![Backend::Cpu],
    };
    let gpu = match args.backend {
        args::Backend::Cpu => None,
        args::Backend::Gpu => Some(
            Gpu::open(AdapterChoice::Best)
                .map_err(|e| Failure::run(format!("{e}; or measure the CPU alone (--backend cpu)")))?,
        ),
        args::Backend::Auto => Gpu::open(AdapterChoice::Best).ok(),
    };
    let gpu = match (gpu, args.form) {
        (Some(gpu), Some(form)) => Some(gpu.with_form(form.into()).ok_or_else(|| {
            Failure::run("this adapter has no subgroup operations of one size up to 32: take another --form")
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
