//! `isoforge compare`.

use super::args::CompareArgs;
use super::extract::uncrossed;
use super::source::{self, Opened};
use super::{Failure, backend, say, tell};
use crate::compare::compare;
use crate::extract::{Extractor, Options};
use crate::gpu::{AdapterChoice, Gpu};

/// Runs both backends stage by stage and prints what agrees.
pub fn run(args: &CompareArgs) -> Result<(), Failure> {
    let memory_budget = backend::memory_budget(None);
    let Opened { loaded, notes, .. } = source::load(&args.source, &args.raw, memory_budget)?;
    let method = args.method.into();
    let options = Options { method, ..loaded.options(&args.source, memory_budget)? };
    let remark = source::precision_remark(loaded.source().grid());
    notes.iter().chain(&remark).for_each(tell);
    let gpu = Gpu::open(AdapterChoice::Best).map_err(Failure::run)?;
    say(format_args!("{} against the CPU: {}, iso {}", gpu.info.name, args.source.source, options.iso))?;
    let extractor = Extractor::new(gpu).map_err(Failure::run)?;
    let comparison = compare(&extractor, &loaded.source(), &options).map_err(Failure::run)?;
    say(comparison.to_string().trim_end())?;
    if !comparison.agrees() {
        return Err(Failure::Negative);
    }
    if comparison.is_empty() {
        let range = extractor.value_range(&loaded.source()).ok().flatten();
        let why = uncrossed(options.iso, range, "about ");
        return Err(Failure::run(format!("there is no surface, and so no mesh was compared: {why}")));
    }
    Ok(())
}
