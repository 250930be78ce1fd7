// Turns triangles into lines, three a triangle, one window of the index buffer at a time.

struct Window {
    // The first triangle of this window.
    first: u32,
    // Triangles in a full window.
    count: u32,
    // Triangles that the index buffer holds.
    capacity: u32,
    // Number of windows.
    windows: u32,
}

// What one window's dispatch and draw take.
struct Arguments {
    groups_x: u32,
    groups_y: u32,
    groups_z: u32,
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(0) @binding(0) var<uniform> window: Window;
@group(0) @binding(1) var<storage, read> header: MeshHeader;
@group(0) @binding(2) var<storage, read> triangles: array<u32>;
@group(0) @binding(3) var<storage, read_write> lines: array<u32>;
// In a group of its own: the dispatch that they control must not bind them for writing.
@group(1) @binding(0) var<storage, read_write> arguments: array<Arguments>;

// Triangles of the mesh in the window that starts at `first`.
fn in_window(first: u32) -> u32 {
    let all = min(header.index_count / 3u, window.capacity);
    return min(max(all, first) - first, window.count);
}

@compute @workgroup_size(64)
fn wire_arguments(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= window.windows {
        return;
    }
    let count = in_window(id.x * window.count);
    let groups = (count + 63u) / 64u;
    arguments[id.x] = Arguments(groups, 1u, 1u, count * 6u, 1u, 0u, 0, 0u);
}

@compute @workgroup_size(64)
fn wire_lines(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= in_window(window.first) {
        return;
    }
    let a = triangles[id.x * 3u];
    let b = triangles[id.x * 3u + 1u];
    let c = triangles[id.x * 3u + 2u];
    let at = id.x * 6u;
    lines[at] = a;
    lines[at + 1u] = b;
    lines[at + 2u] = b;
    lines[at + 3u] = c;
    lines[at + 4u] = c;
    lines[at + 5u] = a;
}
