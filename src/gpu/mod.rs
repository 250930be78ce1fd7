//! Adapter, device, buffers and readback: what every GPU stage stands on.

mod device;
mod mesh;

pub use device::{AdapterChoice, Gpu, GpuError, adapters};
pub use mesh::{GpuMesh, MESH_HEADER_BYTES, MeshHeader, Overflow};
