//! Triangle strips: each number after the first two makes a triangle with the two before it.

/// The triangles of a strip, wound as the first; those that repeat a vertex, which only lead from one run to the next, are
/// left out.
pub fn triangles_of_strip(strip: &[u32]) -> Vec<[u32; 3]> {
    let turned = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
    let triangles = strip.windows(3).enumerate().map(turned);
    triangles.filter(|&[a, b, c]| a != b && b != c && c != a).collect()
}
