// A column's samples in grids along the world's axes: what the field takes of x and y alone is computed once a column, and what it
// takes of z alone once a plane of the brick.

alias Column = DensityPlane;

var<workgroup> levels: array<DensityLevel, 9>;

// By the invocations that have no column.
fn load_levels(origin: vec3<u32>, at: u32, live: bool) {
    if live && at >= 81u && at < 90u {
        levels[at - 81u] = density_level(world_of(grid_point(origin, vec3<u32>(0u, 0u, at - 81u))));
    }
    workgroupBarrier();
}

fn begin_column(point: vec3<u32>) -> Column {
    return density_plane(world_of(point));
}

fn in_column(column: Column, origin: vec3<u32>, z: u32) -> f32 {
    return density_in_plane(column, levels[z]);
}
