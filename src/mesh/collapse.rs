//! Edge collapses that keep the topology, by the link condition of T. Dey, H. Edelsbrunner, S. Guha & D. Nekhayev, *Topology
//! preserving edge contraction*, Publ. Inst. Math. 66, 1999: what surrounds both ends of the edge must surround the edge.

use glam::DVec3;

/// A dead triangle.
const DEAD: [u32; 3] = [u32::MAX; 3];

/// The least cosine of the angle by which a collapse may turn a triangle.
const TURN: f64 = 0.2;

/// A vertex of more triangles is a hub: it stays, and nothing goes onto it, until those around it have gone. To look through its
/// triangles for each of them would take the square of their number.
const HUB: usize = 1000;

/// Triangles of which edges collapse. Around the vertices that are not locked they are a manifold, with or without border.
pub(super) struct Collapses {
    pub(super) at: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// The live triangles around each vertex; around hubs dead ones, too.
    around: Vec<Vec<u32>>,
    /// How many around each are dead: less than half.
    dead: Vec<u32>,
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
        let (seen, dead) = (vec![0; at.len()], vec![0; at.len()]);
        Self { dead, at, triangles: triangles.to_vec(), around, locked, seen, left: triangles.len() }
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
        let is_shorter = self.around[a as usize].len() <= self.around[b as usize].len();
        let (a, b) = if is_shorter { (a, b) } else { (b, a) };
        self.around[a as usize].iter().filter(|&&t| self.triangles[t as usize].contains(&b)).count() == 1
    }

    /// Whether a vertex has so many triangles that it stays for now.
    pub(super) fn is_hub(&self, v: u32) -> bool {
        self.around[v as usize].len() > HUB
    }

    /// Forgets the dead triangles around hubs.
    pub(super) fn sweep(&mut self) {
        for v in 0..self.dead.len() {
            if self.dead[v] > 0 {
                self.around[v].retain(|&t| self.triangles[t as usize] != DEAD);
                self.dead[v] = 0;
            }
        }
    }

    /// Takes a dead triangle from those around a vertex.
    fn forget(&mut self, v: u32, dead: u32) {
        let v = v as usize;
        if self.around[v].len() <= HUB {
            self.around[v].retain(|&t| t != dead);
            return;
        }
        self.dead[v] += 1;
        if 2 * self.dead[v] as usize >= self.around[v].len() {
            self.around[v].retain(|&t| self.triangles[t as usize] != DEAD);
            self.dead[v] = 0;
        }
    }

    /// The vertices around one that is no hub, each as often as its edge there has triangles.
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
        if self.is_hub(from) || self.is_hub(to) {
            return false;
        }
        if !self.keeps_facing(from, to) || !self.keeps_topology(from, to) {
            return false;
        }
        for t in std::mem::take(&mut self.around[from as usize]) {
            let triangle = self.triangles[t as usize];
            if triangle.contains(&to) {
                self.triangles[t as usize] = DEAD;
                self.left -= 1;
                for v in triangle.into_iter().filter(|&v| v != from) {
                    self.forget(v, t);
                }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of so many triangles around vertex 0, in a plane.
    fn wheel(spokes: u32) -> Collapses {
        let rim = |i: u32| {
            let angle = f64::from(i) / f64::from(spokes) * std::f64::consts::TAU;
            DVec3::new(angle.cos(), angle.sin(), 0.0)
        };
        let at = std::iter::once(DVec3::ZERO).chain((0..spokes).map(rim)).collect();
        let triangles: Vec<[u32; 3]> = (0..spokes).map(|i| [0, 1 + i, 1 + (i + 1) % spokes]).collect();
        Collapses::new(at, &triangles, vec![false; spokes as usize + 1])
    }

    /// A hub stays while it is one, and the triangles around it are gone through once half of them are dead.
    #[test]
    fn hubs_stay() {
        let spokes = 3 * HUB as u32;
        let mut wheel = wheel(spokes);
        for v in (2..spokes).step_by(2) {
            assert!(wheel.is_hub(0) && !wheel.collapse(v, 0) && !wheel.collapse(0, v));
            assert!(wheel.collapse(v, v - 1), "{v}");
        }
        // Nearly half of the triangles are dead, and its list was not gone through.
        assert_eq!((wheel.left(), wheel.dead[0]), (HUB * 3 / 2 + 1, HUB as u32 * 3 / 2 - 1));
        for v in (3..spokes).step_by(4) {
            assert!(wheel.collapse(v, v - 2), "{v}");
        }
        wheel.sweep();
        assert!(!wheel.is_hub(0) && wheel.around[0].len() == wheel.left());
        assert!(wheel.collapse(0, 1));
    }
}
