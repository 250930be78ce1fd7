// bounds: the range of each brick of a field, from the field's interval over the brick's box; part of cull.
//
// One workgroup looks at a block of 4³ bricks: first at the whole block, and only where that can hold
// surface at each brick. CPU twin: src/stage/cull/bounds.rs.

@group(0) @binding(3) var<storage, read_write> ranges: array<vec2<u32>>;

const BLOCK = 4u;

// A coordinate in the world over a box of grid points.
fn iv_world(origin: f32, step: vec3<f32>, x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {
    let along_x = iv_mul(iv_point(step.x), x);
    let along_y = iv_mul(iv_point(step.y), y);
    let along_z = iv_mul(iv_point(step.z), z);
    return iv_add(iv_point(origin), iv_add(iv_add(along_x, along_y), along_z));
}

// Order keys of the field's bounds over the bricks from `first` to before `end` (in the grid); the widest
// where nothing is known.
fn keys_over(first: vec3<u32>, end: vec3<u32>) -> vec2<u32> {
    let low = vec3<f32>(first * 8u);
    let high = vec3<f32>(min(end * 8u, params.points - vec3<u32>(1u)));
    let x = vec2<f32>(low.x, high.x);
    let y = vec2<f32>(low.y, high.y);
    let z = vec2<f32>(low.z, high.z);
    let bounds = density_interval(
        iv_world(params.origin.x, vec3<f32>(params.step_x.x, params.step_y.x, params.step_z.x), x, y, z),
        iv_world(params.origin.y, vec3<f32>(params.step_x.y, params.step_y.y, params.step_z.y), x, y, z),
        iv_world(params.origin.z, vec3<f32>(params.step_x.z, params.step_y.z, params.step_z.z), x, y, z),
    );
    let keys = vec2<u32>(order_key(bitcast<u32>(bounds.x)), order_key(bitcast<u32>(bounds.y)));
    return select(vec2<u32>(0u, 0xffffffffu), keys, iv_bounded(bounds));
}

@compute @workgroup_size(4, 4, 4)
fn bounds(
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let blocks = (params.slab_extent + vec3<u32>(BLOCK - 1u)) / BLOCK;
    let block = group.y * groups.x + group.x;
    let place = BLOCK * vec3<u32>(block % blocks.x, (block / blocks.x) % blocks.y, block / (blocks.x * blocks.y));
    let brick = place + local;
    if any(brick >= params.slab_extent) {
        return;
    }
    // All of the group look at the block, side by side: that takes no longer than one, and no barrier.
    // (Two calls: a loop around one keeps SwiftShader's compiler busy for ever.)
    let end = min(place + vec3<u32>(BLOCK), params.slab_extent);
    var keys = keys_over(params.slab_first + place, params.slab_first + end);
    if straddles(keys.x, keys.y) {
        let first = params.slab_first + brick;
        keys = keys_over(first, first + vec3<u32>(1u));
    }
    ranges[brick.x + params.slab_extent.x * (brick.y + params.slab_extent.y * brick.z)] = keys;
}
