// What the extraction says of its mesh; `MeshHeader` in src/gpu/mesh.rs describes the fields.
struct MeshHeader {
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
    vertices: u32,
    triangles: u32,
    active_bricks: u32,
    overflow: u32,
    non_finite: u32,
    runaway: u32,
    reserved: u32,
}
