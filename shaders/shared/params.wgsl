// The settings of a run over one slab, `params` and `call` of shaders/settings/.

// Those that stay from frame to frame; `Uniform` in src/stage/params.rs, field by field.
struct Params {
    // World position of grid point (margin, margin, margin), and the difference step for gradients.
    origin: vec3<f32>,
    delta: f32,
    // World steps along the grid axes.
    step_x: vec3<f32>,
    // 1 where the grid is mirrored and triangles must be wound the other way round.
    mirrored: u32,
    step_y: vec3<f32>,
    // Number of the slab's first triangle in the whole mesh.
    first_triangle: u32,
    step_z: vec3<f32>,
    // Where the window of the index buffer begins.
    triangle_window: u32,
    // Columns of the matrix that takes a gradient in grid coordinates to a world vector.
    outward_x: vec3<f32>,
    // Where the window of the vertex buffer begins.
    vertex_window: u32,
    outward_y: vec3<f32>,
    // A second window of it, for normals, and how many vertices it holds: none where there is no second.
    neighbour_window: u32,
    outward_z: vec3<f32>,
    neighbour_capacity: u32,
    // Sample points of the whole grid.
    points: vec3<u32>,
    // The slab's bricks: a box, numbered x fastest, then y, then z. Its own come first, then the halo.
    own_bricks: u32,
    slab_first: vec3<u32>,
    slab_bricks: u32,
    slab_extent: vec3<u32>,
    // What grid coordinates are less before they become positions: 1 where a closed border has put a layer of points before point 0 of
    // the domain, so that all others lie where they do without it.
    margin: f32,
    // The box of sample points that the source buffer holds of a volume.
    source_first: vec3<u32>,
    // 0, which no compiler knows.
    nothing: u32,
    source_extent: vec3<u32>,
    unused_c: u32,
    // What makes an offset of the slab the number of a vertex in the whole mesh: of a brick in an own
    // brick's row, one row up, one layer up, and both (src/extract/plan.rs).
    first_vertices: vec4<u32>,
}

// Those that may change from call to call; `Call` in src/stage/params.rs, field by field.
struct Call {
    iso: f32,
    // `order_key` of iso, XOR `flip`.
    iso_key: u32,
    // 0 where inside is below iso, all ones where it is above.
    flip: u32,
    // +1 where the world gradient points outwards, -1 where inwards.
    outward_sign: f32,
    // First slot of the batch whose samples are in the source buffer.
    first_slot: u32,
    // Vertices and triangles that the windows of the mesh's buffers hold.
    vertex_capacity: u32,
    triangle_capacity: u32,
    // How near to the surface a snapped vertex lies, in world units.
    epsilon: f32,
}
