//! The edges of a triangle list, each once, in an order that follows from the mesh alone; twin of
//! `shaders/refine/edges.wgsl`.

/// The unique edges of some triangles.
#[derive(Debug, Default)]
pub(super) struct Edges {
    /// Lower and upper vertex of each edge, by these in order.
    pub ends: Vec<[u32; 2]>,
    /// Of each triangle, the edge from corner k to the next.
    pub of: Vec<[u32; 3]>,
}

impl Edges {
    /// The edges of `triangles`, whose corners are three different vertices below `vertices` each.
    ///
    /// Half-edges are sorted into a list for each lower vertex, and the lists, which are short, by the upper one.
    pub(super) fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut first = vec![0u32; vertices + 1];
        for triangle in triangles {
            for k in 0..3 {
                first[triangle[k].min(triangle[(k + 1) % 3]) as usize + 1] += 1;
            }
        }
        for i in 0..vertices {
            first[i + 1] += first[i];
        }
        // Upper vertex, then half-edge: 3 times the triangle's number, and k.
        let mut lists = vec![0u64; 3 * triangles.len()];
        let mut next = first.clone();
        for (number, triangle) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                let place = &mut next[a.min(b) as usize];
                lists[*place as usize] = u64::from(a.max(b)) << 32 | (3 * number + k) as u64;
                *place += 1;
            }
        }
        let mut edges = Self { ends: Vec::with_capacity(lists.len() / 2), of: vec![[0; 3]; triangles.len()] };
        let of: &mut [u32] = edges.of.as_flattened_mut();
        for (lower, range) in first.windows(2).enumerate() {
            let list = &mut lists[range[0] as usize..range[1] as usize];
            list.sort_unstable();
            let mut last = u32::MAX;
            for &item in &*list {
                let upper = (item >> 32) as u32;
                if upper != last {
                    edges.ends.push([lower as u32, upper]);
                    last = upper;
                }
                of[item as u32 as usize] = edges.ends.len() as u32 - 1;
            }
        }
        edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles() {
        let edges = Edges::new(5, &[[2, 0, 1], [4, 2, 1]]);
        assert_eq!(edges.ends, [[0, 1], [0, 2], [1, 2], [1, 4], [2, 4]]);
        assert_eq!(edges.of, [[1, 0, 2], [4, 2, 3]]);
    }
}
