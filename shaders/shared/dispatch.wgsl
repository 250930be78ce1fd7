// Arguments of indirect dispatches: those of the batches, then those of normals, then of bounds (src/stage/dispatches.rs).
@group(0) @binding(7) var<storage, read_write> dispatches: array<u32>;

const MAX_GROUPS = 65535u;

// As many workgroups as `count`, along x and then along y: in two dimensions some too many.
fn write_dispatch(place: u32, count: u32) {
    dispatches[3u * place] = min(count, MAX_GROUPS);
    dispatches[3u * place + 1u] = (count + MAX_GROUPS - 1u) / MAX_GROUPS;
    dispatches[3u * place + 2u] = 1u;
}
