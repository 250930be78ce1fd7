//! How the invocations of a workgroup share their work.

use std::fmt;

/// How the invocations of a workgroup share their work. Chosen when a device is opened; all give the same bytes, which
/// the tests check.
///
/// The kernels that differ are those of scan, sample, classify and emit: `shaders/group/`, `shaders/brick/` and `shaders/classify/`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// Few invocations and few barriers, both of which cost software adapters dearly: an invocation does a brick where it can, else
    /// a workgroup of as many as they do at once.
    Serial,
    /// Through memory of the workgroup: works on every GPU.
    Shared,
    /// Sums by subgroup operations; the rest as [`Form::Shared`]. For GPUs that have them and whose subgroups are all of one size, which
    /// divides the workgroups', so that each is full.
    Subgroup,
}

impl Form {
    /// Every form.
    pub const ALL: [Self; 3] = [Self::Serial, Self::Shared, Self::Subgroup];

    /// The fastest forms of a device: for bricks (sample, classify and emit), and for scans.
    pub(super) fn best(device: &wgpu::Device, info: &wgpu::AdapterInfo) -> (Self, Self) {
        if info.device_type == wgpu::DeviceType::Cpu {
            (Self::Serial, Self::Serial)
        } else if Self::Subgroup.works_on(device, info) {
            (Self::Subgroup, Self::Subgroup)
        } else {
            (Self::Shared, Self::Shared)
        }
    }

    pub(super) fn works_on(self, device: &wgpu::Device, info: &wgpu::AdapterInfo) -> bool {
        self != Self::Subgroup
            || (device.features().contains(wgpu::Features::SUBGROUP)
                && info.subgroup_min_size == info.subgroup_max_size
                && info.subgroup_max_size <= 32)
    }
}

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Serial => "serial, with few barriers",
            Self::Shared => "through workgroup memory",
            Self::Subgroup => "by subgroup operations",
        })
    }
}
