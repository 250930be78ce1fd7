//! The settings of a run on their way to its kernels.

use super::Gpu;
use bytemuck::Pod;
use std::sync::{Mutex, PoisonError};

/// How a kernel's `call` is bound in the shaders; where a device has immediates, it is read from these instead.
const UNIFORM: &str = "@group(0) @binding(33) var<uniform>";
const IMMEDIATE: &str = "var<immediate>";
/// Bytes of immediates that a device must have: those of `Call`, which a test looks at.
pub const CALL_BYTES: u32 = 32;

/// The settings of a run: `params`, which stay from frame to frame, in a uniform buffer, and `call`. That travels within the
/// commands where the device has immediates, so that recording allocates nothing, and else in a uniform buffer of its
/// own, so that commands in the caller's encoder keep the one that they were recorded with.
#[derive(Debug)]
pub struct Settings {
    pub(super) params: wgpu::Buffer,
    pub(super) call: CallSettings,
}

#[derive(Debug)]
pub(super) enum CallSettings {
    Immediate([u8; CALL_BYTES as usize]),
    Buffer(wgpu::Buffer),
}

impl Settings {
    /// `params` and `call` for kernels on `gpu`.
    pub fn new<P: Pod, C: Pod>(gpu: &Gpu, params: &P, call: &C) -> Self {
        Self::with(gpu, gpu.uniform(params), call)
    }

    fn with<C: Pod>(gpu: &Gpu, params: wgpu::Buffer, call: &C) -> Self {
        let call = match bytemuck::bytes_of(call).try_into() {
            Ok(bytes) if gpu.has_immediates() => CallSettings::Immediate(bytes),
            _ => CallSettings::Buffer(gpu.uniform(call)),
        };
        Self { params, call }
    }
}

/// Uniform buffers by what they hold, so that what stays from frame to frame is made once.
#[derive(Debug, Default)]
pub(crate) struct Uniforms(Mutex<Vec<(Vec<u8>, wgpu::Buffer)>>);

impl Uniforms {
    /// Buffers that are kept, of some 200 bytes.
    const MOST: usize = 64;

    /// [`Settings::new`], with the buffer of `params` that was made for them before, if there is one.
    pub fn settings<P: Pod, C: Pod>(&self, gpu: &Gpu, params: &P, call: &C) -> Settings {
        let bytes = bytemuck::bytes_of(params);
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, buffer)) = kept.iter().find(|(known, _)| known == bytes) {
            return Settings::with(gpu, buffer.clone(), call);
        }
        if kept.len() == Self::MOST {
            kept.clear();
        }
        let buffer = gpu.uniform(params);
        kept.push((bytes.to_vec(), buffer.clone()));
        Settings::with(gpu, buffer, call)
    }
}

/// The source as the device takes it.
pub fn for_device(source: &str, immediates: bool) -> String {
    if immediates { source.replacen(UNIFORM, IMMEDIATE, 1) } else { source.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::params::Call;

    #[test]
    fn they_fit() {
        assert_eq!(size_of::<Call>() as u32, CALL_BYTES);
        for settings in [
            include_str!("../../shaders/settings/bound.wgsl"),
            include_str!("../../shaders/settings/copied.wgsl"),
        ] {
            assert_eq!(settings.matches(UNIFORM).count(), 1);
        }
    }
}
