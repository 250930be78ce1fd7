//! A compute pipeline whose bindings are read off its own shader.
//!
//! Binding numbers mean the same thing in every stage ([`binding`]), so buffers are bound by number
//! and a kernel takes those that its entry point uses: no layout is written twice.

use super::needs::MOST_GROUPS;
use super::settings::{CALL_BYTES, CallSettings, for_device};
use super::{Gpu, GpuError, Settings, exact};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What each binding number is, in every stage's shader.
pub mod binding {
    /// `Params`, uniform: what stays from frame to frame.
    pub const PARAMS: usize = 0;
    /// `Work`.
    pub const WORK: usize = 1;
    /// Samples to read: a box of a volume, or a batch of bricks.
    pub const SOURCE: usize = 2;
    /// Range of each brick.
    pub const RANGES: usize = 3;
    /// The brick map.
    pub const MAP: usize = 4;
    /// Lists of boxes of bricks.
    pub const BOXES: usize = 5;
    /// The active list: brick of each slot; and behind it the slots of bricks that make anything.
    pub const ACTIVE: usize = 6;
    /// Arguments of indirect dispatches.
    pub const DISPATCHES: usize = 7;
    /// Brick records.
    pub const RECORDS: usize = 8;
    /// Counts of classify, before and after their scan.
    pub const COUNTS: usize = 9;
    /// The packed table.
    pub const TABLE: usize = 10;
    /// Partial sums of a scan.
    pub const PARTIALS: usize = 11;
    /// Samples to write.
    pub const SAMPLES: usize = 12;
    /// Vertices of the mesh.
    pub const VERTICES: usize = 13;
    /// Indices of the mesh.
    pub const INDICES: usize = 14;
    /// Header of the mesh.
    pub const HEADER: usize = 15;
    /// Parameters of a field, uniform.
    pub const FIELD: usize = 16;
    /// Lists and samples that a field reads.
    pub const FIELD_DATA: usize = 17;
    /// A second window of the mesh's vertices.
    pub const NEIGHBOURS: usize = 18;
    /// Labels of the mesh's vertices.
    pub const LABELS: usize = 19;
    /// What labelling counts.
    pub const LABELLED: usize = 20;
    /// Edges of the grid.
    pub const EDGES: usize = 21;
    /// Vertices of the mesh that is kept or made.
    pub const KEPT_VERTICES: usize = 22;
    /// Its indices.
    pub const KEPT_INDICES: usize = 23;
    /// Lists of half-edges: where that of each vertex begins, and how many are in it.
    pub const FANS: usize = 24;
    /// The half-edges in these lists.
    pub const HALF_EDGES: usize = 25;
    /// The edge of each half-edge.
    pub const EDGE_OF: usize = 26;
    /// The length of each edge, or of the longest at each vertex.
    pub const LENGTHS: usize = 27;
    /// Marks of the edges that are split, and counts of the parts of triangles, before and after their scan.
    pub const SPLITS: usize = 28;
    /// Vertices that are to be placed.
    pub const TASKS: usize = 29;
    /// What they are if they find no place.
    pub const FALLBACKS: usize = 30;
    /// What is known of each vertex.
    pub const STATES: usize = 31;
    /// Marks of the mesh's vertices and triangles, before and after their scan.
    pub const MARKS: usize = 32;
    /// What changes from call to call, uniform, where the device has no immediates.
    pub const CALL: usize = 33;
    /// How many there are.
    pub const COUNT: usize = 34;
}

/// Buffers by binding number, and the settings.
#[derive(Clone)]
pub struct Bindings<'a> {
    buffers: [Option<wgpu::BufferBinding<'a>>; binding::COUNT],
    call: Option<&'a [u8; CALL_BYTES as usize]>,
    groups: Option<&'a Groups>,
}

impl Default for Bindings<'_> {
    fn default() -> Self {
        Self { buffers: [const { None }; binding::COUNT], call: None, groups: None }
    }
}

impl<'a> Bindings<'a> {
    /// Binds a whole buffer.
    pub fn set(&mut self, number: usize, buffer: &'a wgpu::Buffer) -> &mut Self {
        self.buffers[number] = Some(buffer.as_entire_buffer_binding());
        self
    }

    /// Binds `bytes` of a buffer from `offset`.
    pub fn set_window(
        &mut self,
        number: usize,
        buffer: &'a wgpu::Buffer,
        offset: u64,
        bytes: u64,
    ) -> &mut Self {
        let size = std::num::NonZeroU64::new(bytes.clamp(4, buffer.size() - offset));
        self.buffers[number] = Some(wgpu::BufferBinding { buffer, offset, size });
        self
    }

    /// The `params` and the `call` of kernels.
    pub fn set_settings(&mut self, settings: &'a Settings) -> &mut Self {
        match &settings.call {
            CallSettings::Immediate(bytes) => self.call = Some(bytes),
            CallSettings::Buffer(buffer) => {
                self.set(binding::CALL, buffer);
            }
        }
        self.set(binding::PARAMS, &settings.params)
    }

    /// Takes bind groups from `groups`, and puts there those that it makes.
    pub(crate) fn keep_in(&mut self, groups: &'a Groups) -> &mut Self {
        self.groups = Some(groups);
        self
    }
}

/// Which kernel's a bind group is, and what it binds.
type Bound = (u64, Vec<(wgpu::Buffer, u64, Option<std::num::NonZeroU64>)>);

/// Bind groups that were made, so that a loop over the same buffers makes none. They keep their buffers alive.
#[derive(Debug, Default)]
pub(crate) struct Groups(Mutex<Kept>);

#[derive(Debug, Default)]
struct Kept {
    of: Vec<wgpu::Buffer>,
    groups: Vec<(Bound, wgpu::BindGroup)>,
}

impl Groups {
    /// Groups that are kept: more than a frame takes.
    const MOST: usize = 256;

    /// Forgets all, unless they were made for these buffers.
    pub fn are_of(&self, buffers: [&wgpu::Buffer; 3]) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.of.iter().ne(buffers) {
            *kept = Kept { of: buffers.map(Clone::clone).to_vec(), groups: Vec::new() };
        }
    }

    /// Forgets all.
    pub fn forget(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Kept::default();
    }

    fn get(&self, bound: Bound, new: impl FnOnce() -> wgpu::BindGroup) -> wgpu::BindGroup {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, group)) = kept.groups.iter().find(|(known, _)| *known == bound) {
            return group.clone();
        }
        if kept.groups.len() == Self::MOST {
            kept.groups.clear();
        }
        let group = new();
        kept.groups.push((bound, group.clone()));
        group
    }
}

/// What is in the cell, made by `new` on the first call.
pub(crate) fn made<T>(cell: &OnceLock<T>, new: impl FnOnce() -> Result<T, GpuError>) -> Result<&T, GpuError> {
    if let Some(kernels) = cell.get() {
        return Ok(kernels);
    }
    let kernels = new()?;
    Ok(cell.get_or_init(|| kernels))
}

/// Kernels of the latest fields, by what they are made of; the latest used last.
#[derive(Debug)]
pub(crate) struct Latest<K, T>(Mutex<Vec<(K, Arc<T>)>>);

impl<K, T> Default for Latest<K, T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: PartialEq, T> Latest<K, T> {
    /// Fields whose kernels are kept.
    const MOST: usize = 64;

    /// Those of `key`, made by `new` if they are not there. Other threads do not wait meanwhile: it may take seconds.
    pub fn get(&self, key: K, new: impl FnOnce() -> Result<T, GpuError>) -> Result<Arc<T>, GpuError> {
        let all = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = |all: &mut Vec<(K, Arc<T>)>| {
            let place = all.iter().position(|(known, _)| *known == key)?;
            all[place..].rotate_left(1);
            all.last().map(|(_, kernels)| kernels.clone())
        };
        if let Some(kernels) = known(&mut all()) {
            return Ok(kernels);
        }
        let kernels = Arc::new(new()?);
        let mut all = all();
        // Another thread may have made them meanwhile: workspaces ask whether they have the same.
        if let Some(kernels) = known(&mut all) {
            return Ok(kernels);
        }
        if all.len() == Self::MOST {
            all.remove(0);
        }
        all.push((key, kernels.clone()));
        Ok(kernels)
    }
}

/// What the settings of kernels have whose arithmetic is the CPU's.
const HIDDEN_ZERO: &str = "    nothing: u32,";
/// What kernels with a field's text declare, and no others.
const FIELD_PARAMETERS: &str = "var<uniform> field_parameters:";

/// Kernels that were made.
static KERNELS: AtomicU64 = AtomicU64::new(0);

/// A compute pipeline and its bindings.
#[derive(Debug)]
pub struct Kernel {
    /// No other kernel's.
    id: u64,
    /// Whether it reads what changes from call to call from its commands.
    has_immediates: bool,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    numbers: Vec<u32>,
    label: &'static str,
}

/// Parses and validates an assembled shader.
///
/// # Errors
/// [`GpuError::Refused`] with naga's message: a defect of this crate, or a library user's own WGSL.
pub fn parse(source: &str) -> Result<(naga::Module, ModuleInfo), GpuError> {
    let module = naga::front::wgsl::parse_str(source)
        .map_err(|e| GpuError::Refused(format!("WGSL: {}", e.emit_to_string(source))))?;
    let info = validate(&module, source)?;
    Ok((module, info))
}

fn validate(module: &naga::Module, source: &str) -> Result<ModuleInfo, GpuError> {
    Validator::new(ValidationFlags::all(), Capabilities::SUBGROUP | Capabilities::IMMEDIATES)
        .validate(module)
        .map_err(|e| GpuError::Refused(format!("WGSL: {}", e.emit_to_string(source))))
}

/// An assembled shader with the CPU's arithmetic; `rounds` as in [`exact::functions`].
pub(super) fn parse_exact(source: &str, rounds: bool) -> Result<(naga::Module, ModuleInfo), GpuError> {
    if !source.contains(HIDDEN_ZERO) {
        return parse(source);
    }
    let source = exact::functions(rounds) + source;
    let (mut module, info) = parse(&source)?;
    exact::hide_operations(&mut module, &info);
    let info = validate(&module, &source)?;
    Ok((module, info))
}

impl Kernel {
    /// Compiles the entry point `entry` of `source`.
    ///
    /// # Errors
    /// [`GpuError::Limits`], [`GpuError::FieldWgsl`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(
        gpu: &Gpu,
        source: &str,
        entry: &'static str,
        constants: &[(&str, f64)],
    ) -> Result<Self, GpuError> {
        gpu.check_limits()?;
        let is_of_field = source.contains(FIELD_PARAMETERS);
        let source = for_device(source, gpu.has_immediates());
        let (module, info) = parse_exact(&source, gpu.rounds()).map_err(|error| match error {
            // The crate's own text is right: what is wrong is the field's.
            GpuError::Refused(why) if is_of_field => GpuError::FieldWgsl(why),
            error => error,
        })?;
        let place = module.entry_points.iter().position(|e| e.name == entry);
        let place = place.ok_or_else(|| GpuError::Refused(format!("no entry point {entry}")))?;
        let used = info.get_entry_point(place);
        let mut entries = Vec::new();
        let mut has_immediates = false;
        for (handle, variable) in module.global_variables.iter() {
            has_immediates |= variable.space == naga::AddressSpace::Immediate && !used[handle].is_empty();
            let Some(resource) = variable.binding.as_ref().filter(|_| !used[handle].is_empty()) else {
                continue;
            };
            let ty = match variable.space {
                naga::AddressSpace::Uniform => wgpu::BufferBindingType::Uniform,
                naga::AddressSpace::Storage { access } => {
                    let read_only = !access.contains(naga::StorageAccess::STORE);
                    wgpu::BufferBindingType::Storage { read_only }
                }
                _ => continue,
            };
            entries.push(wgpu::BindGroupLayoutEntry {
                binding: resource.binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
                count: None,
            });
        }
        let numbers = entries.iter().map(|e| e.binding).collect();
        gpu.guarded(entry, 0, || {
            let device = &gpu.device;
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(entry),
                entries: &entries,
            });
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(entry),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: if has_immediates { CALL_BYTES } else { 0 },
            });
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(entry),
                source: wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(module)),
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants,
                    // All kernels write what they read of it.
                    zero_initialize_workgroup_memory: false,
                },
                cache: None,
            });
            let id = KERNELS.fetch_add(1, Ordering::Relaxed);
            Self { id, has_immediates, pipeline, layout, numbers, label: entry }
        })
    }

    fn prepare(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, bindings: &Bindings<'_>) {
        let bound = |&number: &u32| Some((number, bindings.buffers[number as usize].clone()?));
        let new = || {
            gpu.count_made();
            let entry = |(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: wgpu::BindingResource::Buffer(buffer),
            };
            let entries: Vec<_> = self.numbers.iter().filter_map(bound).map(entry).collect();
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.label),
                layout: &self.layout,
                entries: &entries,
            })
        };
        let group = match bindings.groups {
            Some(groups) => {
                let all = self.numbers.iter().filter_map(bound);
                let all = all.map(|(_, of)| (of.buffer.clone(), of.offset, of.size)).collect();
                groups.get((self.id, all), new)
            }
            None => new(),
        };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        if let Some(call) = bindings.call.filter(|_| self.has_immediates) {
            pass.set_immediates(0, call);
        }
    }

    /// Runs `groups` workgroups, in two dimensions where one does not hold them.
    pub fn dispatch(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        groups: u32,
    ) {
        self.prepare(gpu, pass, bindings);
        pass.dispatch_workgroups(groups.min(MOST_GROUPS), groups.div_ceil(MOST_GROUPS), 1);
    }

    /// Runs the number of workgroups that lies at `offset` of `arguments`.
    pub fn dispatch_indirect(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        arguments: &wgpu::Buffer,
        offset: u64,
    ) {
        self.prepare(gpu, pass, bindings);
        pass.dispatch_workgroups_indirect(arguments, offset);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Who makes kernels holds nobody up: others may ask meanwhile, even on the same thread, and the list stays short.
    #[test]
    fn kernels_are_made_without_holding_others_up() {
        let latest = Latest::<usize, usize>::default();
        let first = std::cell::OnceCell::new();
        let made =
            latest.get(1, || Ok(**first.get_or_init(|| latest.get(1, || Ok(10)).unwrap()) + 1)).unwrap();
        assert!(*made == 10 && Arc::ptr_eq(&made, &first.into_inner().unwrap()), "all have the first");
        assert_eq!(*latest.get(2, || Ok(20)).unwrap(), 20);
        for key in 0..3 * Latest::<usize, usize>::MOST {
            assert_eq!(*latest.get(key + 5, || Ok(key)).unwrap(), key);
            assert_eq!(*latest.get(2, || Ok(0)).unwrap(), 20, "used again and again, it stays");
        }
        assert_eq!(latest.0.lock().unwrap().len(), Latest::<usize, usize>::MOST);
    }
}
