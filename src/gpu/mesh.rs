//! The mesh as it lies on the GPU: three buffers, ready for a draw call.

use super::device::READ_BYTES;
use super::{Gpu, GpuError};
use crate::mesh::{Mesh, Vertex};

/// What the extraction wrote about its mesh, at the start of [`GpuMesh::header`].
///
/// The first five words are the arguments of `draw_indexed_indirect`. When the mesh did not fit
/// (`overflow != 0`), `index_count` is 0, so that a draw call draws nothing, and `vertices`,
/// `triangles` say what would have been needed.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MeshHeader {
    /// Indices to draw: three a triangle.
    pub index_count: u32,
    /// Always 1.
    pub instance_count: u32,
    /// Always 0.
    pub first_index: u32,
    /// Always 0.
    pub base_vertex: i32,
    /// Always 0.
    pub first_instance: u32,
    /// Vertices of the mesh, also when they did not fit.
    pub vertices: u32,
    /// Triangles of the mesh, also when they did not fit.
    pub triangles: u32,
    /// Bricks that the cull stage kept, also when they were more than the workspace has room for.
    pub active_bricks: u32,
    /// Bits of [`Overflow`]: which capacity was short.
    pub overflow: u32,
    /// Samples that were NaN or infinite and counted as outside.
    pub non_finite: u32,
    /// Not 0 once a loop of the user's WGSL ran away and was stopped: the mesh is not the field's.
    pub runaway: u32,
    /// Keeps the size a multiple of 16.
    pub reserved: u32,
}

impl MeshHeader {
    /// Whether all of the mesh is there: nothing was too short for it, and no loop of the field ran away.
    pub fn is_whole(&self) -> bool {
        self.overflow == 0 && self.runaway == 0
    }

    /// Whether that capacity was too short.
    pub fn is_short_of(&self, capacity: Overflow) -> bool {
        self.overflow & capacity as u32 != 0
    }
}

/// Bytes of [`MeshHeader`].
pub const MESH_HEADER_BYTES: u64 = size_of::<MeshHeader>() as u64;

/// The bits of [`MeshHeader::overflow`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Overflow {
    /// More active bricks than the workspace has room for: nothing was made, and vertices and triangles were not counted.
    Bricks = 1,
    /// More vertices than the vertex buffer holds.
    Vertices = 2,
    /// More triangles than the index buffer holds.
    Triangles = 4,
}

/// A mesh in GPU buffers.
#[derive(Debug, Clone)]
pub struct GpuMesh {
    /// [`Vertex`] after [`Vertex`], 24 bytes each. Usage: vertex, storage, copy source.
    pub vertices: wgpu::Buffer,
    /// `u32` vertex numbers, three a triangle. Usage: index, storage, copy source.
    pub indices: wgpu::Buffer,
    /// A [`MeshHeader`]. Usage: indirect, storage, copy source and destination.
    pub header: wgpu::Buffer,
    /// Vertices that the vertex buffer holds.
    pub vertex_capacity: u32,
    /// Triangles that the index buffer holds.
    pub triangle_capacity: u32,
}

impl GpuMesh {
    /// How a render pipeline reads [`GpuMesh::vertices`]: location 0 position, location 1 normal.
    pub const VERTEX_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
    };

    /// Empty buffers for at most `vertices` and `triangles`. A header of zeros draws nothing.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn with_capacity(gpu: &Gpu, vertices: u32, triangles: u32) -> Result<Self, GpuError> {
        use wgpu::BufferUsages as U;
        let shared = U::STORAGE | U::COPY_SRC | U::COPY_DST;
        let [vertex_bytes, index_bytes, header_bytes] = Self::buffer_bytes(vertices, triangles);
        Ok(Self {
            vertices: gpu.buffer("mesh vertices", vertex_bytes, shared | U::VERTEX)?,
            indices: gpu.buffer("mesh indices", index_bytes, shared | U::INDEX)?,
            header: gpu.buffer("mesh header", header_bytes, shared | U::INDIRECT)?,
            vertex_capacity: vertices,
            triangle_capacity: triangles,
        })
    }

    /// Puts a mesh from main memory on the GPU.
    ///
    /// # Errors
    /// As [`GpuMesh::with_capacity`]; [`GpuError::OutOfMemory`] also for more vertices or indices than 32-bit numbers count.
    pub fn upload(gpu: &Gpu, mesh: &Mesh) -> Result<Self, GpuError> {
        let [vertices, triangles] = counts(mesh.vertices.len(), mesh.triangles.len())?;
        let on_gpu = Self::with_capacity(gpu, vertices, triangles)?;
        let header = MeshHeader {
            index_count: triangles * 3,
            instance_count: 1,
            vertices,
            triangles,
            ..MeshHeader::default()
        };
        gpu.write(&on_gpu.vertices, bytemuck::cast_slice(&mesh.vertices))?;
        gpu.write(&on_gpu.indices, bytemuck::cast_slice(&mesh.triangles))?;
        gpu.write(&on_gpu.header, bytemuck::bytes_of(&header))?;
        Ok(on_gpu)
    }

    /// Draws the mesh: sets vertex buffer 0 and the index buffer, and draws indirectly. The pass's
    /// pipeline must take [`GpuMesh::VERTEX_LAYOUT`], triangle list, counter-clockwise front.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed_indirect(&self.header, 0);
    }

    /// Reads the header back, waiting for the work that writes it.
    ///
    /// # Errors
    /// As [`Gpu::read`].
    pub fn read_header(&self, gpu: &Gpu) -> Result<MeshHeader, GpuError> {
        gpu.read_one(&self.header)
    }

    /// Bytes of the buffers for so many vertices and triangles.
    pub fn bytes_for(vertices: u32, triangles: u32) -> u64 {
        Self::buffer_bytes(vertices, triangles).map(Gpu::padded).iter().sum()
    }

    /// Vertices, indices, header.
    pub(crate) fn buffer_bytes(vertices: u32, triangles: u32) -> [u64; 3] {
        // One item to spare, so that an empty window at the end of a buffer can be bound.
        let vertex_bytes = (u64::from(vertices) + 1) * size_of::<Vertex>() as u64;
        [vertex_bytes, (u64::from(triangles) + 1) * 12, MESH_HEADER_BYTES]
    }

    /// Bytes that [`GpuMesh::read`] takes of so many: the mesh in main memory, and the piece on its way.
    pub fn read_bytes_for(vertices: u32, triangles: u32) -> u64 {
        let vertices = u64::from(vertices) * size_of::<Vertex>() as u64;
        let triangles = u64::from(triangles) * 12;
        vertices + triangles + vertices.max(triangles).min(READ_BYTES)
    }

    /// Reads the mesh back. One that overflowed, or whose field's loops ran away, comes back empty: [`MeshHeader::is_whole`] of
    /// [`GpuMesh::read_header`] tells.
    ///
    /// # Errors
    /// As [`Gpu::read`].
    pub fn read(&self, gpu: &Gpu) -> Result<Mesh, GpuError> {
        let header = self.read_header(gpu)?;
        if !header.is_whole() || header.triangles == 0 {
            return Ok(Mesh::default());
        }
        Ok(Mesh {
            vertices: gpu.read(&self.vertices, header.vertices.into())?,
            triangles: gpu.read(&self.indices, header.triangles.into())?,
        })
    }
}

/// Vertices and triangles, if the header's words hold them and three indices a triangle.
fn counts(vertices: usize, triangles: usize) -> Result<[u32; 2], GpuError> {
    let fits = |what: &str, items: usize, each: u32, size: usize| match u32::try_from(items) {
        Ok(n) if n <= u32::MAX / each => Ok(n),
        _ => Err(GpuError::OutOfMemory {
            what: what.into(),
            bytes: (items as u64).saturating_mul(size as u64),
        }),
    };
    Ok([fits("mesh vertices", vertices, 1, size_of::<Vertex>())?, fits("mesh indices", triangles, 3, 12)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_32_bits_count_is_refused() {
        let most = u32::MAX as usize;
        assert_eq!(counts(most, most / 3).ok(), Some([u32::MAX, u32::MAX / 3]));
        let wanted =
            [(counts(most + 1, 0), 24 << 32), (counts(0, most / 3 + 1), 4 * (u64::from(u32::MAX) + 3))];
        for (found, wanted) in wanted {
            assert!(
                matches!(&found, Err(GpuError::OutOfMemory { bytes, .. }) if *bytes == wanted),
                "{found:?}"
            );
        }
    }
}
