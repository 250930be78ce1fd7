// bounds: the bits of the brick map of a field, from its intervals over boxes of bricks, large to small (Duff 1992);
// part of cull.
//
// A box that may hold surface is cut into 4³, one workgroup a box, one invocation a part: boxes of 64 bricks an axis into
// large ones of 16, these into small ones of 4, these into bricks. What may hold surface of large and small
// boxes waits in a list for the next dispatch, whose size `dispatch_boxes` writes: a list's order is a matter of
// chance, but its end are bits, which is not. CPU twin: src/stage/cull/bounds.rs.

@group(0) @binding(4) var<storage, read_write> map: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> boxes: array<u32>;

// Bricks along the edge of a part: 16, 4 or 1.
override side: u32 = 1u;

const LARGE = 16u;
const SMALL = 4u;

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
    let low = vec3<f32>(first * 8u) - params.margin;
    let high = vec3<f32>(min(end * 8u, params.points - vec3<u32>(1u))) - params.margin;
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

// Boxes of that side along each axis of the slab.
fn across(box_side: u32) -> vec3<u32> {
    return (params.slab_extent + vec3<u32>(box_side - 1u)) / box_side;
}

// Where the list of small boxes begins: behind that of the large ones, which may be all.
fn small_start() -> u32 {
    let large = across(LARGE);
    return large.x * large.y * large.z;
}

fn place_of(number: u32, n: vec3<u32>) -> vec3<u32> {
    return vec3<u32>(number % n.x, (number / n.x) % n.y, number / (n.x * n.y));
}

fn number_of(place: vec3<u32>, n: vec3<u32>) -> u32 {
    return place.x + n.x * (place.y + n.y * place.z);
}

@compute @workgroup_size(4, 4, 4)
fn narrow(
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let parents = across(4u * side);
    var parent = group.y * groups.x + group.x;
    // A dispatch in two dimensions has workgroups too many.
    var count = parents.x * parents.y * parents.z;
    if side == SMALL {
        count = atomicLoad(&work.large_boxes);
    } else if side < SMALL {
        count = atomicLoad(&work.small_boxes);
    }
    if parent >= count {
        return;
    }
    if side == SMALL {
        parent = boxes[parent];
    } else if side < SMALL {
        parent = boxes[small_start() + parent];
    }
    let part = 4u * place_of(parent, parents) + local;
    let first = side * part;
    if any(first >= params.slab_extent) {
        return;
    }
    let end = min(first + vec3<u32>(side), params.slab_extent);
    let keys = keys_over(params.slab_first + first, params.slab_first + end);
    if !straddles(keys.x, keys.y) {
        return;
    }
    let number = number_of(part, across(side));
    if side == LARGE {
        boxes[atomicAdd(&work.large_boxes, 1u)] = number;
    } else if side == SMALL {
        boxes[small_start() + atomicAdd(&work.small_boxes, 1u)] = number;
    } else {
        atomicOr(&map[2u * (number / 32u)], 1u << (number % 32u));
    }
}

// Arguments of the dispatch over the boxes that `narrow` has listed.
@compute @workgroup_size(1)
fn dispatch_boxes() {
    let count = select(atomicLoad(&work.small_boxes), atomicLoad(&work.large_boxes), side == LARGE);
    write_dispatch(3u * work.batches + 2u, count);
}
