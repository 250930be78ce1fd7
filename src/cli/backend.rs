//! Which backend does the work.

use super::Failure;
use super::args::{Backend, RunArgs};
use crate::extract::{ExtractError, Source};
use crate::field::NoForm;
use crate::gpu::{AdapterChoice, Gpu, GpuError};
use std::time::Duration;
use sysinfo::{MemoryRefreshKind, RefreshKind, System};

/// The GPU to use, or none for the CPU; and a line that says why the CPU.
pub fn choose(args: &RunArgs, source: &Source<'_>) -> Result<(Option<Gpu>, Option<String>), Failure> {
    let open = |choice| {
        let mut gpu = Gpu::open(choice)?;
        gpu.time_limit = Duration::from_secs(args.time_limit);
        // A device that ran into its time limit may hang when it is dropped; the process ends anyway.
        std::mem::forget(gpu.clone());
        Ok::<_, GpuError>(gpu)
    };
    match args.backend {
        Backend::Cpu => Ok((None, None)),
        Backend::Gpu => open(AdapterChoice::Best)
            .map(|gpu| (Some(gpu), None))
            .map_err(|error| failure(error.into(), source)),
        Backend::Auto if gpu_alone(source) => match open(AdapterChoice::Best) {
            Ok(gpu) => Ok((Some(gpu), None)),
            Err(error) => Err(Failure::run(format!("only a GPU evaluates this WGSL function, and {error}"))),
        },
        Backend::Auto => match open(AdapterChoice::Hardware) {
            Ok(gpu) => Ok((Some(gpu), None)),
            Err(GpuError::NoAdapter(why)) => {
                let threads = rayon::current_num_threads();
                Ok((None, Some(format!("no GPU ({why}): the CPU does it, with {threads} threads"))))
            }
            Err(error) => Ok((None, Some(format!("{error}: the CPU does it")))),
        },
    }
}

/// What went wrong on the GPU, and that the CPU can do it where it can.
pub fn failure(error: ExtractError, source: &Source<'_>) -> Failure {
    let of_gpu = matches!(
        error,
        ExtractError::Gpu(_) | ExtractError::Binding { .. } | ExtractError::MeshBuffer { .. }
    );
    if of_gpu && !gpu_alone(source) {
        Failure::run(format!("{error}; or let the CPU do it (--backend cpu)"))
    } else {
        Failure::extract(error)
    }
}

/// Whether only a GPU evaluates the source.
pub fn gpu_alone(source: &Source<'_>) -> bool {
    let Source::Field(field, _) = source else { return false };
    let none = crate::field::Points { x: &[], y: &[], z: &[] };
    field.values(none, &mut []) == Err(NoForm::Cpu)
}

/// The user's budget, or three quarters of the memory that is free.
pub fn memory_budget(given: Option<u64>) -> u64 {
    given.unwrap_or_else(|| {
        let kind = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
        match System::new_with_specifics(kind).available_memory() {
            0 => u64::MAX,
            free => free / 4 * 3,
        }
    })
}
