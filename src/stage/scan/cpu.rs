//! CPU twin of `shaders/scan.wgsl`, for pairs. It has no list of the bricks that make anything: the CPU keeps no others.

/// Exclusive prefix sums in place over all but the last item, which becomes the total.
///
/// Sums are of 32 bits, as on the GPU: the caller keeps a slab so small that they suffice.
pub fn scan(counts: &mut [[u32; 2]]) {
    let mut before = [0u32; 2];
    for item in counts.iter_mut() {
        let after = [before[0].wrapping_add(item[0]), before[1].wrapping_add(item[1])];
        *item = before;
        before = after;
    }
}
