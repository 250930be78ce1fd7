// The lower and the upper vertex of a half-edge.
fn ends_of(h: u32) -> vec2<u32> {
    let a = indices[h];
    let b = indices[select(h + 1u, h - 2u, h % 3u == 2u)];
    return vec2<u32>(min(a, b), max(a, b));
}
