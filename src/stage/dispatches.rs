//! Where the arguments of indirect dispatches lie in their buffer, as `shaders/shared/dispatch.wgsl` writes them: three of each batch, then
//! two of normals, then that of the boxes of bounds.

/// Bytes of the arguments of one dispatch.
const ONE: u64 = 12;

/// Bytes of a batch's arguments.
pub const OF_BATCH: u64 = 3 * ONE;

/// Bytes of the arguments for so many batches.
pub fn bytes(batches: u32) -> u64 {
    boxes(batches) + ONE
}

/// Where those of a batch's active bricks lie.
pub fn active(batch: u32) -> u64 {
    OF_BATCH * u64::from(batch)
}

/// Where those of its own ones lie, which are no halo.
pub fn own(batch: u32) -> u64 {
    active(batch) + ONE
}

/// Where those of its own ones lie that make anything.
pub fn emitting(batch: u32) -> u64 {
    active(batch) + 2 * ONE
}

/// Where those of normals lie, behind so many batches.
pub fn normals(batches: u32) -> u64 {
    active(batches)
}

/// Where that over boxes of bricks lies, behind so many batches.
pub fn boxes(batches: u32) -> u64 {
    normals(batches) + 2 * ONE
}
