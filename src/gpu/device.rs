//! Opening an adapter, or taking the caller's device, and waiting on it without hanging.

use super::Form;
use super::loss::State;
use crate::memory;
use bytemuck::Pod;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Data comes back from the GPU in pieces of at most this size, so that the staging memory stays small.
pub(super) const READ_BYTES: u64 = 16 << 20;

/// Why the GPU could not do the work.
#[derive(Debug, Clone, thiserror::Error)]
pub enum GpuError {
    /// No adapter at all.
    #[error(
        "no GPU adapter was found ({0}): install a Vulkan, Metal or DirectX 12 driver \
         (Debian: mesa-vulkan-drivers for the software one)"
    )]
    NoAdapter(String),
    /// The adapter refused to open a device.
    #[error("the adapter {adapter} gave no device: {reason}; end what else uses it, or update its driver")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// The device was lost: driver reset, unplugged, destroyed.
    #[error("the GPU device was lost ({0}): start again with a new device")]
    Lost(String),
    /// The GPU did not finish within the time limit.
    #[error(
        "the GPU did not finish within {0:?}: a loop in the field may have no end, or the grid or the picture \
         is too much for this adapter; raise the time limit, or ask for less"
    )]
    Timeout(Duration),
    /// A limit of the caller's device is too low.
    #[error(
        "the device has a limit {name} of {has}, and the kernels need {needs}: request the device with \
         `required_limits: Gpu::required_limits()`, or with all that its adapter has (`adapter.limits()`)"
    )]
    Limits {
        /// The field of `wgpu::Limits`.
        name: &'static str,
        /// What the device has.
        has: u64,
        /// What it must have.
        needs: u64,
    },
    /// A buffer could not be allocated.
    #[error(
        "the GPU could not allocate {bytes} bytes for {what}: ask for less (a coarser grid, a mesh of less capacity, \
         a lower memory budget)"
    )]
    OutOfMemory {
        /// What the bytes were for.
        what: String,
        /// How many.
        bytes: u64,
    },
    /// Bytes of a buffer were read or written that it does not have.
    #[error(
        "{what} takes {needed} bytes, and the buffer has {has}: give or ask for less, or a larger buffer"
    )]
    Range {
        /// Reading or writing.
        what: &'static str,
        /// Bytes from the start of the buffer.
        needed: u64,
        /// Its size.
        has: u64,
    },
    /// Bytes that are no whole number of words were to be written.
    #[error("a buffer was to be written with {0} bytes: pad them to a multiple of 4")]
    Unaligned(u64),
    /// A field's WGSL does not compile.
    #[error(
        "the field's WGSL does not compile, or defines a name of the crate's shaders (`field::Wgsl` has the rules): {0}"
    )]
    FieldWgsl(String),
    /// The driver or wgpu refused a call: one with what is not this device's, or a bug in this crate or in the driver.
    #[error(
        "the GPU refused the work ({0}); it was given what is not of its device or was not made for this, or this is \
         a defect: then please report it"
    )]
    Refused(String),
}

/// Which adapter to open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AdapterChoice {
    /// The fastest: a discrete GPU before an integrated one before a software one.
    #[default]
    Best,
    /// As `Best`, but a software adapter counts as none.
    Hardware,
}

/// A device with its queue, its adapter's properties and the flags that its callbacks raise.
///
/// Clones share the device.
#[derive(Debug, Clone)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, backend, driver and type of the adapter.
    pub info: wgpu::AdapterInfo,
    /// Longest wait for one piece of work.
    pub time_limit: Duration,
    form: Form,
    scan_form: Form,
    takes_samples: bool,
    state: Arc<State>,
}

/// Default of [`Gpu::time_limit`].
pub const TIME_LIMIT: Duration = Duration::from_secs(120);

fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env())
}

/// Every adapter of this machine, the best first.
pub fn adapters() -> Vec<wgpu::Adapter> {
    let mut found = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    found.sort_by_key(|a| rank(a.get_info().device_type));
    found
}

fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

impl Gpu {
    /// Opens the adapter of `choice` with all of its limits, and timestamps and subgroup operations where it has them.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], [`GpuError::NoDevice`].
    pub fn open(choice: AdapterChoice) -> Result<Self, GpuError> {
        let adapter = adapters()
            .into_iter()
            .next()
            .ok_or_else(|| GpuError::NoAdapter("the driver loader lists none".into()))?;
        if choice == AdapterChoice::Hardware && adapter.get_info().device_type == wgpu::DeviceType::Cpu {
            return Err(GpuError::NoAdapter(format!("{} is a software adapter", adapter.get_info().name)));
        }
        Self::open_adapter(&adapter)
    }

    /// Opens a device on `adapter`.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`].
    pub fn open_adapter(adapter: &wgpu::Adapter) -> Result<Self, GpuError> {
        let info = adapter.get_info();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("isoforge"),
            required_features: adapter.features() & Self::wanted_features(),
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|e| GpuError::NoDevice { adapter: info.name.clone(), reason: e.to_string() })?;
        let gpu = Self::from_device(device, queue, info);
        // Without a handler wgpu panics on an error that no scope catches. Only on our own
        // device: a caller's device keeps the caller's handler.
        let state = gpu.state.clone();
        gpu.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| state.note(error.to_string())));
        Ok(gpu)
    }

    /// Works on the caller's device, which must have [`Gpu::required_limits`] and is faster with
    /// [`Gpu::wanted_features`]; `info` is its adapter's.
    ///
    /// The caller's error handlers stay as they are, except that the device-lost callback is taken over; all `Gpu`s of a
    /// device hear of its loss. Who sets a callback of their own behind this call calls [`Gpu::note_lost`] in it.
    pub fn from_device(device: wgpu::Device, queue: wgpu::Queue, info: wgpu::AdapterInfo) -> Self {
        let state = State::of(&device);
        let (form, scan_form) = Form::best(&device, &info);
        let takes_samples = info.device_type != wgpu::DeviceType::Cpu;
        Self { device, queue, info, time_limit: TIME_LIMIT, form, scan_form, takes_samples, state }
    }

    /// Buffers and bind groups that were made on the device through this crate: a loop that should make none can look.
    pub fn made(&self) -> u64 {
        self.state.made.load(Ordering::Relaxed)
    }

    pub(crate) fn count_made(&self) {
        self.state.made.fetch_add(1, Ordering::Relaxed);
    }

    /// A uniform buffer that holds `params`.
    pub(crate) fn uniform<T: Pod>(&self, params: &T) -> wgpu::Buffer {
        self.count_made();
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("params"),
            size: size_of::<T>() as u64,
            usage: wgpu::BufferUsages::UNIFORM,
            mapped_at_creation: true,
        });
        if let Ok(mut view) = buffer.slice(..).get_mapped_range_mut() {
            view.copy_from_slice(bytemuck::bytes_of(params));
        }
        buffer.unmap();
        buffer
    }

    /// How the workgroups of classify and emit share their work.
    pub fn form(&self) -> Form {
        self.form
    }

    /// Whether classify takes a field's samples itself, twelve an invocation. Software adapters may end an invocation's
    /// loops after some number of iterations, and tell nobody: there the sample stage takes three.
    pub(crate) fn takes_samples(&self) -> bool {
        self.takes_samples
    }

    /// Whether the adapter's own quotients and roots are the nearest floats, as lavapipe's and SwiftShader's are. Other forms than
    /// theirs trust no adapter.
    pub(super) fn rounds(&self) -> bool {
        self.is_software() && self.form == Form::Serial
    }

    /// How those of scan do.
    pub fn scan_form(&self) -> Form {
        self.scan_form
    }

    /// The same device with kernels of another form, for comparing them; none if it does not have it. Extractors made of
    /// it have that form.
    pub fn with_form(&self, form: Form) -> Option<Self> {
        form.works_on(&self.device, &self.info).then(|| Self {
            form,
            scan_form: form,
            takes_samples: form != Form::Serial,
            ..self.clone()
        })
    }

    /// Whether the adapter is software (lavapipe, SwiftShader, WARP).
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// [`GpuError::Lost`] once the device is gone. After a loss wgpu raises nothing and its
    /// queue looks empty, so every wait asks here.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn check(&self) -> Result<(), GpuError> {
        self.state.check()
    }

    /// Says that the device is lost, also to its other `Gpu`s that share its callback: for callers with a device-lost callback of their own, set
    /// after [`Gpu::from_device`]. All work is refused from now on with [`GpuError::Lost`] and this reason.
    pub fn note_lost(&self, reason: &str) {
        self.state.lose(reason.into());
    }

    /// Waits until all submitted work is done, at most [`Gpu::time_limit`].
    ///
    /// # Errors
    /// [`GpuError::Timeout`], [`GpuError::Lost`]. After a time-out the device may hang when
    /// dropped: leave the process, or leak it.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.wait_for(None)
    }

    /// [`Gpu::wait`] for one submission and those before it; for all if it is none.
    pub(crate) fn wait_for(&self, submission_index: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
        self.check()?;
        let poll = wgpu::PollType::Wait { submission_index, timeout: Some(self.time_limit) };
        match self.device.poll(poll) {
            Ok(_) => self.check(),
            Err(wgpu::PollError::Timeout) => Err(GpuError::Timeout(self.time_limit)),
            Err(e) => self.check().and(Err(GpuError::Refused(e.to_string()))),
        }
    }

    /// Runs `work` and turns what wgpu reports of it into an error.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn guarded<T>(&self, what: &str, bytes: u64, work: impl FnOnce() -> T) -> Result<T, GpuError> {
        self.check()?;
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = work();
        let internal = pollster::block_on(internal.pop());
        let validation = pollster::block_on(validation.pop());
        let memory = pollster::block_on(memory.pop());
        self.check()?;
        if memory.is_some() {
            return Err(GpuError::OutOfMemory { what: what.into(), bytes });
        }
        match validation.or(internal) {
            Some(error) => {
                // A device destroyed meanwhile makes every object invalid, and is said to be lost
                // only once it is polled.
                self.wait()?;
                Err(GpuError::Refused(format!("{what}: {error}")))
            }
            None => Ok(result),
        }
    }

    /// The size of a buffer for `bytes`: bindings of size zero are not allowed, and copies want multiples
    /// of four.
    pub(crate) fn padded(bytes: u64) -> u64 {
        bytes.max(16).next_multiple_of(16)
    }

    /// A new buffer, its contents zero.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn buffer(
        &self,
        what: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        let size = Self::padded(bytes);
        if size > self.device.limits().max_buffer_size {
            return Err(GpuError::OutOfMemory { what: what.into(), bytes });
        }
        self.count_made();
        self.guarded(what, size, || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(what),
                size,
                usage,
                mapped_at_creation: false,
            })
        })
    }

    /// Writes `bytes`, a multiple of 4 of them, to the start of `buffer` (usage `COPY_DST`), before all work submitted later.
    ///
    /// # Errors
    /// [`GpuError::Unaligned`], [`GpuError::Range`], [`GpuError::OutOfMemory`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn write(&self, buffer: &wgpu::Buffer, bytes: &[u8]) -> Result<(), GpuError> {
        let length = bytes.len() as u64;
        if !length.is_multiple_of(4) {
            return Err(GpuError::Unaligned(length));
        }
        if length > buffer.size() {
            return Err(GpuError::Range { what: "writing", needed: length, has: buffer.size() });
        }
        self.guarded("upload", length, || self.queue.write_buffer(buffer, 0, bytes))
    }

    /// Reads the first `count` items of `source` (usage `COPY_SRC`) back, waiting for all submitted work. Whole words are
    /// copied: the buffer must have the bytes of the items rounded up to a multiple of 4.
    ///
    /// # Errors
    /// [`GpuError::Range`]; as [`Gpu::wait`] and [`Gpu::buffer`].
    pub fn read<T: Pod>(&self, source: &wgpu::Buffer, count: u64) -> Result<Vec<T>, GpuError> {
        let needed = count.saturating_mul(size_of::<T>() as u64);
        let needed = needed.checked_next_multiple_of(4).unwrap_or(u64::MAX);
        if needed > source.size() {
            return Err(GpuError::Range { what: "reading", needed, has: source.size() });
        }
        let mut items = memory::zeroed(count as usize);
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut items);
        let length = bytes.len() as u64;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = self.buffer("readback", length.next_multiple_of(4).min(READ_BYTES), usage)?;
        for from in (0..length).step_by(READ_BYTES as usize) {
            let useful = (length - from).min(READ_BYTES);
            let size = useful.next_multiple_of(4);
            self.guarded("readback", size, || {
                let mut encoder = self.device.create_command_encoder(&Default::default());
                encoder.copy_buffer_to_buffer(source, from, &staging, 0, size);
                self.queue.submit([encoder.finish()]);
                staging.slice(..size).map_async(wgpu::MapMode::Read, |_| {});
            })?;
            self.wait()?;
            {
                let view = staging.slice(..size).get_mapped_range();
                let view = view.map_err(|e| GpuError::Refused(format!("readback: {e}")))?;
                bytes[from as usize..(from + useful) as usize].copy_from_slice(&view[..useful as usize]);
            }
            staging.unmap();
        }
        Ok(items)
    }

    /// Reads the item at the start of `source` back.
    ///
    /// # Errors
    /// As [`Gpu::read`].
    pub fn read_one<T: Pod>(&self, source: &wgpu::Buffer) -> Result<T, GpuError> {
        Ok(self.read(source, 1)?[0])
    }
}
