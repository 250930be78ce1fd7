// A column's samples each by itself.

struct Column {
    point: vec3<u32>,
}

fn load_levels(origin: vec3<u32>, at: u32, live: bool) {}

fn begin_column(point: vec3<u32>) -> Column {
    return Column(point);
}

fn in_column(column: Column, origin: vec3<u32>, z: u32) -> f32 {
    return density(world_of(vec3<u32>(column.point.xy, grid_point(origin, vec3<u32>(0u, 0u, z)).z)));
}
