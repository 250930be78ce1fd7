//! Edge collapses that keep the topology, by the link condition of T. Dey, H. Edelsbrunner, S. Guha & D. Nekhayev, *Topology
//! preserving edge contraction*, Publ. Inst. Math. 66, 1999: what surrounds both ends of the edge must surround the edge.

use glam::DVec3;

/// A dead triangle.
const DEAD: [u32; 3] = [u32::MAX; 3];

/// The least cosine of the angle by which a collapse may turn a triangle.
const TURN: f64 = 0.2;

/// Triangles of which edges collapse. Around the vertices that are not locked they are a manifold, with or without border.
pub(super) struct Collapses {
    pub(super) at: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// The live triangles around each vertex.
    around: Vec<Vec<u32>>,
    locked: Vec<bool>,
    /// Of each vertex, in how many triangles it is around the vertex looked at; 0 in between.
    seen: Vec<u8>,
    left: usize,
}

impl Collapses {
    /// Triangles of three different vertices.
    pub(super) fn new(at: Vec<DVec3>, triangles: &[[u32; 3]], locked: Vec<bool>) -> Self {
        let mut around = vec![Vec::new(); at.len()];
        for (i, triangle) in (0..).zip(triangles) {
            triangle.iter().for_each(|&v| around[v as usize].push(i));
        }
        let seen = vec![0; at.len()];
        Self { at, triangles: triangles.to_vec(), around, locked, seen, left: triangles.len() }
    }

    /// How many triangles there are.
    pub(super) fn left(&self) -> usize {
        self.left
    }

    /// In the order of the triangles that they come from.
    pub(super) fn into_triangles(mut self) -> Vec<[u32; 3]> {
        self.triangles.retain(|t| *t != DEAD);
        self.triangles
    }

    /// The cross product of two edges.
    pub(super) fn normal(&self, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|v| self.at[v as usize]);
        (b - a).cross(c - a)
    }

    /// Whether just one triangle has this edge.
    pub(super) fn is_border(&self, a: u32, b: u32) -> bool {
        self.around[a as usize].iter().filter(|&&t| self.triangles[t as usize].contains(&b)).count() == 1
    }

    /// The vertices around one, each as often as its edge there has triangles.
    pub(super) fn ring(&self, v: u32) -> impl Iterator<Item = u32> {
        let of = self.around[v as usize].iter().flat_map(|&t| self.triangles[t as usize]);
        of.filter(move |&w| w != v)
    }

    /// The vertices around one, in the order of their numbers.
    pub(super) fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut ring: Vec<u32> = self.ring(v).collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// Moves a vertex onto a neighbour, if the topology stays and no triangle turns over; whether it did.
    pub(super) fn collapse(&mut self, from: u32, to: u32) -> bool {
        if !self.keeps_facing(from, to) || !self.keeps_topology(from, to) {
            return false;
        }
        for t in std::mem::take(&mut self.around[from as usize]) {
            let triangle = self.triangles[t as usize];
            if triangle.contains(&to) {
                for v in triangle.into_iter().filter(|&v| v != from) {
                    self.around[v as usize].retain(|&other| other != t);
                }
                self.triangles[t as usize] = DEAD;
                self.left -= 1;
            } else {
                self.triangles[t as usize] = triangle.map(|v| if v == from { to } else { v });
                self.around[to as usize].push(t);
            }
        }
        true
    }

    fn keeps_topology(&mut self, from: u32, to: u32) -> bool {
        if self.locked[from as usize] || self.locked[to as usize] {
            return false;
        }
        let mut seen = std::mem::take(&mut self.seen);
        self.ring(from).for_each(|w| seen[w as usize] += 1);
        // A border moves along itself alone.
        let on_border = self.ring(from).any(|w| seen[w as usize] == 1);
        let shared = seen[to as usize];
        let (mut opposite, mut count) = ([u32::MAX; 2], 0);
        for w in self.ring(to).filter(|&w| w != from) {
            // Two at most are of use, each once, though it is in two triangles here.
            if seen[w as usize] > 0 && !opposite.contains(&w) {
                if let Some(slot) = opposite.get_mut(count) {
                    *slot = w;
                }
                count += 1;
            }
        }
        let is_closed_at =
            |w: u32| seen[w as usize] == 2 || self.ring(to).filter(|&other| other == w).count() == 2;
        let has = |v: u32, [x, y]: [u32; 2]| {
            let mut of = self.around[v as usize].iter().map(|&t| self.triangles[t as usize]);
            of.any(|triangle| triangle.contains(&x) && triangle.contains(&y))
        };
        let keeps = match (shared, count) {
            // Three edges around a hole: it would close.
            (1, 1) => is_closed_at(opposite[0]),
            // Two triangles would lie on each other.
            (2, 2) if !on_border => !(has(from, opposite) && has(to, opposite)),
            // A ring of three edges that is no triangle: a neck would be cut, a hole be closed.
            _ => false,
        };
        self.ring(from).for_each(|w| seen[w as usize] = 0);
        self.seen = seen;
        keeps
    }

    fn keeps_facing(&self, from: u32, to: u32) -> bool {
        self.around[from as usize].iter().map(|&t| self.triangles[t as usize]).all(|triangle| {
            let before = self.normal(triangle);
            if triangle.contains(&to) || before == DVec3::ZERO {
                return true;
            }
            let after = self.normal(triangle.map(|v| if v == from { to } else { v }));
            after != DVec3::ZERO && after.dot(before) >= TURN * after.length() * before.length()
        })
    }
}
