//! Adapter, device, buffers, kernels and readback: what every GPU stage stands on.

mod device;
mod exact;
mod form;
pub mod kernel;
mod loss;
mod mesh;
mod needs;
pub mod settings;
mod timer;

pub use device::{AdapterChoice, Gpu, GpuError, TIME_LIMIT, adapters};
pub use form::Form;
pub use mesh::{GpuMesh, MESH_HEADER_BYTES, MeshHeader, Overflow};
pub use settings::Settings;
pub use timer::Timer;
