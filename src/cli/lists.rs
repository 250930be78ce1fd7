//! `isoforge info` and `isoforge fields`.

use super::{Failure, backend, say};
use crate::field::{Sense, named};
use crate::gpu::{Gpu, adapters};

/// Lists the adapters and what will be used.
pub fn info() -> Result<(), Failure> {
    let adapters = adapters();
    say(format_args!("isoforge {}", env!("CARGO_PKG_VERSION")))?;
    say(format_args!("CPU: {} threads", rayon::current_num_threads()))?;
    say(format_args!("memory budget unless given: {} MiB", backend::memory_budget(None) >> 20))?;
    if adapters.is_empty() {
        return say("no adapter: the CPU does the work, and the software rasteriser draws");
    }
    for adapter in &adapters {
        let (info, limits) = (adapter.get_info(), adapter.limits());
        say(format_args!(
            "\nadapter: {} ({:?}, {:?}) {} {}",
            info.name, info.device_type, info.backend, info.driver, info.driver_info
        ))?;
        let timestamps = adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let rows = [
            ("largest storage binding", format!("{} MiB", limits.max_storage_buffer_binding_size >> 20)),
            ("largest buffer", format!("{} MiB", limits.max_buffer_size >> 20)),
            ("workgroup invocations", limits.max_compute_invocations_per_workgroup.to_string()),
            ("workgroup storage", format!("{} KiB", limits.max_compute_workgroup_storage_size >> 10)),
            ("storage buffers a stage", limits.max_storage_buffers_per_shader_stage.to_string()),
            ("workgroups a dimension", limits.max_compute_workgroups_per_dimension.to_string()),
            ("immediates", format!("{} bytes", limits.max_immediate_size)),
            ("largest picture side", limits.max_texture_dimension_2d.to_string()),
            ("subgroups", subgroups(adapter)),
            ("stage timestamps", if timestamps { "yes" } else { "no" }.into()),
        ];
        rows.iter().try_for_each(|(name, value)| say(format_args!("  {name:<26}{value}")))?;
    }
    let best = adapters[0].get_info();
    if let Ok(gpu) = Gpu::open_adapter(&adapters[0]) {
        say(format_args!("\nkernels on {}: bricks {}, scans {}", best.name, gpu.form(), gpu.scan_form()))?;
    }
    say(if best.device_type == wgpu::DeviceType::Cpu {
        format!(
            "\n--backend auto: the CPU ({} is a software adapter); --backend gpu: {}",
            best.name, best.name
        )
    } else {
        format!("\n--backend auto and gpu: {}", best.name)
    })?;
    Ok(())
}

/// The sizes of an adapter's subgroups, where it has their operations.
fn subgroups(adapter: &wgpu::Adapter) -> String {
    let info = adapter.get_info();
    if adapter.features().contains(wgpu::Features::SUBGROUP) {
        format!("{} to {}", info.subgroup_min_size, info.subgroup_max_size)
    } else {
        "none".into()
    }
}

/// Prints the kinds of nodes.
pub fn nodes() -> Result<(), Failure> {
    say(crate::scene::KINDS.trim_end())
}

/// Lists the named fields.
pub fn fields() -> Result<(), Failure> {
    for field in named::ALL {
        say(format_args!("{}\n    {}", field.name, field.formula))?;
        let side = match field.sense {
            Sense::Below => "below",
            Sense::Above => "above",
        };
        say(format_args!("    shown by -L {} -I {}, inside is {side}", field.half_edge, field.iso))?;
        for p in field.parameters {
            let least = if p.least.is_finite() { format!(" (at least {})", p.least) } else { String::new() };
            say(format_args!("    --param {}={}  {}{least}", p.name, p.default, p.meaning))?;
        }
    }
    say(
        "\nBeside these: a formula in x, y, z, a .wgsl file with `fn density(p: vec3<f32>) -> f32`, a scene (.toml, see `isoforge nodes`), volumes, and points.",
    )?;
    Ok(())
}
