// The settings of one run over one slab and batch; `Params` in src/stage/params.rs, field by field.
struct Params {
    // World position of grid point 0, and the difference step for gradients.
    origin: vec3<f32>,
    delta: f32,
    // World steps along the grid axes.
    step_x: vec3<f32>,
    iso: f32,
    step_y: vec3<f32>,
    // `order_key` of iso, XOR `flip`.
    iso_key: u32,
    step_z: vec3<f32>,
    // 0 where inside is below iso, all ones where it is above.
    flip: u32,
    // Columns of the matrix that takes a gradient in grid coordinates to an outward world vector.
    outward_x: vec3<f32>,
    // +1 where the world gradient points outwards, -1 where inwards.
    outward_sign: f32,
    outward_y: vec3<f32>,
    // 1 where the grid is mirrored and triangles must be wound the other way round.
    mirrored: u32,
    outward_z: vec3<f32>,
    // First grid plane (z) that the source buffer holds; 0 for fields.
    first_plane: u32,
    // Sample points of the whole grid.
    points: vec3<u32>,
    // Linear number of the slab's first brick.
    first_brick: u32,
    // Bricks of the whole grid.
    bricks: vec3<u32>,
    // Bricks of the slab with its halo layer, and its own alone.
    slab_bricks: u32,
    own_bricks: u32,
    // First slot of the batch whose samples are in the source buffer.
    first_slot: u32,
    // Number of the slab's first vertex and triangle in the whole mesh.
    first_vertex: u32,
    first_triangle: u32,
    // Vertices and triangles that the output windows hold, and what they start at.
    vertex_window: u32,
    vertex_capacity: u32,
    triangle_window: u32,
    triangle_capacity: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
