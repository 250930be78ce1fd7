//! What a device must have, and what it may have, for the kernels of this crate.

use super::kernel::binding;
use super::settings::CALL_BYTES;
use super::{Gpu, GpuError};
use crate::field::PARAMETER_VECTORS;

/// Workgroups that a dimension must hold: the shaders that size dispatches count on it.
pub(super) const MOST_GROUPS: u32 = 65_535;

/// `rest` with the limits that the kernels need.
fn with_required(rest: wgpu::Limits) -> wgpu::Limits {
    wgpu::Limits {
        max_storage_buffers_per_shader_stage: 8,
        max_uniform_buffers_per_shader_stage: 3,
        max_bindings_per_bind_group: binding::COUNT as u32,
        max_uniform_buffer_binding_size: 16 * PARAMETER_VECTORS as u64,
        max_compute_workgroup_storage_size: 16 << 10,
        max_compute_invocations_per_workgroup: 256,
        max_compute_workgroup_size_x: 256,
        max_compute_workgroup_size_y: 4,
        max_compute_workgroup_size_z: 4,
        max_compute_workgroups_per_dimension: MOST_GROUPS,
        ..rest
    }
}

impl Gpu {
    /// The least limits of a device that the kernels run on; `wgpu::Limits::default()` and an adapter's own
    /// (`adapter.limits()`) have more. Those of buffers' sizes are wgpu's defaults here, and may be less on the
    /// device: grids are cut to fit, and larger ones make fewer slabs.
    ///
    /// `max_immediate_size` of [`Gpu::wanted_features`] is not among them.
    pub fn required_limits() -> wgpu::Limits {
        with_required(wgpu::Limits::defaults())
    }

    /// The features that [`Gpu::open`] asks for where the adapter has them. None is needed:
    /// - `IMMEDIATES`, with a limit `max_immediate_size` of 32 bytes: frames make no buffers ([`Gpu::has_immediates`]).
    /// - `SUBGROUP`: faster kernels ([`super::Form::Subgroup`]).
    /// - `TIMESTAMP_QUERY`: reports have the seconds of each stage.
    pub fn wanted_features() -> wgpu::Features {
        wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::SUBGROUP | wgpu::Features::IMMEDIATES
    }

    /// Whether the device has [`Gpu::required_limits`], but for the sizes of buffers. Whatever compiles kernels asks.
    ///
    /// # Errors
    /// [`GpuError::Limits`] with the first that is too low.
    pub fn check_limits(&self) -> Result<(), GpuError> {
        let limits = self.device.limits();
        let mut found = Ok(());
        with_required(limits.clone()).check_limits_with_fail_fn(&limits, true, |name, needs, has| {
            found = Err(GpuError::Limits { name, has, needs });
        });
        found
    }

    /// Whether what changes from frame to frame travels within the commands: the device has immediates
    /// (`wgpu::Features::IMMEDIATES`), 32 bytes of them.
    pub fn has_immediates(&self) -> bool {
        self.device.features().contains(wgpu::Features::IMMEDIATES)
            && self.device.limits().max_immediate_size >= CALL_BYTES
    }
}
