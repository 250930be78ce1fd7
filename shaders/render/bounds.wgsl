// The box around the finite vertices of a mesh, one window of the vertex buffer at a time.

struct Window {
    // The first vertex of this window.
    first: u32,
    // Vertices in a full window.
    count: u32,
    // Vertices that the vertex buffer holds.
    capacity: u32,
    // Invocations of the dispatch.
    stride: u32,
}

@group(0) @binding(0) var<uniform> window: Window;
@group(0) @binding(1) var<storage, read> header: MeshHeader;
// Six floats a vertex: position, normal.
@group(0) @binding(2) var<storage, read> vertices: array<f32>;
// Keys of the lowest x, y, z, then of the highest.
@group(0) @binding(3) var<storage, read_write> box: array<atomic<u32>, 6>;

// Maps floats to integers of the same order, so that atomics can compare them.
fn key(value: f32) -> u32 {
    let bits = bitcast<u32>(value);
    return bits ^ select(0x80000000u, 0xffffffffu, (bits >> 31u) != 0u);
}

fn is_finite(value: f32) -> bool {
    return (bitcast<u32>(value) & 0x7f800000u) != 0x7f800000u;
}

@compute @workgroup_size(64)
fn bounds(@builtin(global_invocation_id) id: vec3<u32>) {
    var all = min(header.vertices, window.capacity);
    // The buffers of a mesh that did not fit hold only part of it, which is not drawn either.
    if header.overflow != 0u || header.index_count == 0u {
        all = 0u;
    }
    let count = min(max(all, window.first) - window.first, window.count);
    var low = vec3<u32>(0xffffffffu);
    var high = vec3<u32>(0u);
    for (var i = id.x; i < count; i += window.stride) {
        let at = i * 6u;
        let x = vertices[at];
        let y = vertices[at + 1u];
        let z = vertices[at + 2u];
        if is_finite(x) && is_finite(y) && is_finite(z) {
            let keys = vec3<u32>(key(x), key(y), key(z));
            low = min(low, keys);
            high = max(high, keys);
        }
    }
    if low.x == 0xffffffffu {
        return;
    }
    atomicMin(&box[0], low.x);
    atomicMin(&box[1], low.y);
    atomicMin(&box[2], low.z);
    atomicMax(&box[3], high.x);
    atomicMax(&box[4], high.y);
    atomicMax(&box[5], high.z);
}
