//! Triangles with distinct corners on one line: an edge flip gives them area, and moves nothing.
//!
//! Such a triangle (a, b, c) has its corner b on its longest edge, from c to a. The neighbour over that edge, (a, c, d), is
//! parted at b by the edge b–d in place of a–c: (a, b, d) and (b, c, d) cover what it covered. Over a border there is no
//! neighbour, and the triangle goes: the border then runs by b. And where there is a triangle (c, b, d) already, opposite to the
//! new one, the surface is folded there: both go, and c with them. Four triangles around a, b, c and d that are all there is are a sheet
//! without thickness, and go.

use std::collections::{HashMap, VecDeque};

use glam::DVec3;
use rayon::prelude::*;

use super::Mesh;
use super::check::is_degenerate;

/// Of an edge that several triangles run along in one direction.
const SEVERAL: u32 = u32::MAX;

/// What [`Mesh::flip_thin`] did.
#[derive(Default)]
pub(super) struct Flipped {
    /// Triangles that have area now.
    pub(super) flipped: usize,
    /// Whether there are edges of no length now, to be contracted: two thin triangles had their middle corners at one place.
    pub(super) has_pressed: bool,
}

impl Mesh {
    /// Flips and removes what can be. Every index must be good, no triangle may repeat a vertex, and no edge be without length.
    pub(super) fn flip_thin(&mut self) -> Flipped {
        let mut thin: Vec<u32> = (0..self.triangles.len() as u32)
            .into_par_iter()
            .filter(|&t| is_degenerate(&self.vertices, self.triangles[t as usize]))
            .collect();
        if thin.is_empty() {
            return Flipped::default();
        }
        let mut flips = Flips::new(self, &thin);
        // Each flip leaves fewer thin triangles, or as many with shorter edges: so this ends.
        let mut is_done = false;
        while !is_done {
            // Those beside a flip wait again at once, those that the edge it took away was in the way of for the next round.
            is_done = true;
            let mut waiting: VecDeque<u32> = thin.iter().copied().collect();
            while let Some(t) = waiting.pop_front() {
                is_done &= !flips.mend(t, &mut waiting);
            }
            thin.retain(|&t| flips.thin(t).is_some());
        }
        let Flips { done, removed, .. } = flips;
        if removed > 0 {
            self.triangles.retain(|&[a, b, _]| a != b);
            self.drop_unused();
        }
        done
    }
}

/// The surroundings of the thin triangles. Flips there lead nowhere else.
struct Flips<'a> {
    mesh: &'a mut Mesh,
    /// The triangle that runs along an edge: all those with an end that is a corner of a thin triangle.
    owner: HashMap<(u32, u32), u32>,
    done: Flipped,
    /// Triangles that went, from borders and folds.
    removed: usize,
}

impl<'a> Flips<'a> {
    fn new(mesh: &'a mut Mesh, thin: &[u32]) -> Self {
        let mut is_near = vec![false; mesh.vertices.len()];
        for &t in thin {
            for v in mesh.triangles[t as usize] {
                is_near[v as usize] = true;
            }
        }
        let near: Vec<u32> = (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .filter(|&t| mesh.triangles[t as usize].iter().any(|&v| is_near[v as usize]))
            .collect();
        let mut owner = HashMap::with_capacity(3 * near.len());
        for &t in &near {
            let [a, b, c] = mesh.triangles[t as usize];
            for edge in [(a, b), (b, c), (c, a)] {
                owner.entry(edge).and_modify(|owner| *owner = SEVERAL).or_insert(t);
            }
        }
        Flips { mesh, owner, done: Flipped::default(), removed: 0 }
    }

    fn at(&self, v: u32) -> DVec3 {
        self.mesh.vertices[v as usize].at().as_dvec3()
    }

    /// The corners of a thin triangle, the middle one in the middle; `None` of one with area, or an edge without length, or gone.
    fn thin(&self, t: u32) -> Option<[u32; 3]> {
        let [a, b, c] = self.mesh.triangles[t as usize];
        let is_thin = a != b && is_degenerate(&self.mesh.vertices, [a, b, c]);
        let turns = [[a, b, c], [b, c, a], [c, a, b]];
        let length = |&[a, _, c]: &[u32; 3]| self.length(c, a);
        let is_thin = is_thin && turns.iter().all(|turn| length(turn) != 0.0);
        is_thin.then(|| turns.into_iter().max_by(|s, t| length(s).total_cmp(&length(t)))).flatten()
    }

    /// Squared.
    fn length(&self, a: u32, b: u32) -> f64 {
        self.at(a).distance_squared(self.at(b))
    }

    /// Flips or removes a thin triangle, and lets those beside it wait again; whether it could.
    fn mend(&mut self, t: u32, waiting: &mut VecDeque<u32>) -> bool {
        let Some([a, b, c]) = self.thin(t) else { return false };
        if self.owner.get(&(c, a)) != Some(&t) {
            return false;
        }
        match self.owner.get(&(a, c)).copied() {
            Some(SEVERAL) => false,
            Some(u) => self.flip(t, u, [a, b, c], waiting),
            None => self.remove(t, [a, b, c], waiting),
        }
    }

    fn flip(&mut self, t: u32, u: u32, [a, b, c]: [u32; 3], waiting: &mut VecDeque<u32>) -> bool {
        let Some(d) = self.mesh.triangles[u as usize].into_iter().find(|&v| v != a && v != c) else {
            return false;
        };
        if d == b {
            return false;
        }
        if self.owner.contains_key(&(b, d)) || self.owner.contains_key(&(d, b)) {
            return self.unfold([t, u], [a, b, c, d], waiting)
                || self.unfold([t, u], [c, b, a, d], waiting)
                || self.vanish([t, u], [a, b, c, d]);
        }
        let normal = |[a, b, c]: [u32; 3]| (self.at(b) - self.at(a)).cross(self.at(c) - self.at(a));
        let (one, other) = ([a, b, d], [b, c, d]);
        let is_better = match self.thin(u) {
            None => {
                let old = normal([a, c, d]);
                normal(one).dot(old) > 0.0 && normal(other).dot(old) > 0.0
            }
            // Both on one line: as long as all edges become shorter.
            Some(_) => {
                let edges = [(a, b), (b, c), (c, d), (d, a)];
                edges.into_iter().all(|(v, w)| self.length(v, w) < self.length(c, a))
            }
        };
        if !is_better {
            return false;
        }
        self.done.flipped += usize::from(self.thin(u).is_none());
        self.done.has_pressed |= self.length(b, d) == 0.0;
        self.mesh.triangles[t as usize] = one;
        self.mesh.triangles[u as usize] = other;
        self.owner.remove(&(a, c));
        self.owner.remove(&(c, a));
        self.owner.extend([((b, d), t), ((d, b), u)]);
        for (edge, new) in [((b, c), u), ((d, a), t)] {
            self.owner.entry(edge).and_modify(|owner| {
                if *owner != SEVERAL {
                    *owner = new;
                }
            });
        }
        self.wake([(b, a), (c, b), (d, c), (a, d)], waiting);
        true
    }

    /// Cancels what a flip would lay onto the third triangle around the corner c, where c has no others; a and c may be in
    /// either order.
    fn unfold(&mut self, [t, u]: [u32; 2], [a, b, c, d]: [u32; 4], waiting: &mut VecDeque<u32>) -> bool {
        let is_turned = self.mesh.triangles[t as usize] != [a, b, c]
            && self.mesh.triangles[t as usize] != [b, c, a]
            && self.mesh.triangles[t as usize] != [c, a, b];
        let along = |v, w| if is_turned { (w, v) } else { (v, w) };
        let owner = |v, w| self.owner.get(&along(v, w)).copied();
        let Some(w) = owner(c, b).filter(|&w| w != SEVERAL) else { return false };
        let is_fold = owner(d, c) == Some(w)
            && [owner(b, c), owner(c, a)] == [Some(t); 2]
            && [owner(a, c), owner(c, d)] == [Some(u); 2]
            && owner(b, d) == Some(w)
            && owner(d, a) == Some(u)
            // Not four triangles that are all there is.
            && owner(b, a).is_none_or(|x| x != SEVERAL && !self.mesh.triangles[x as usize].contains(&d));
        if !is_fold {
            return false;
        }
        let new = if is_turned { [b, a, d] } else { [a, b, d] };
        if is_degenerate(&self.mesh.vertices, new) {
            return false;
        }
        self.mesh.triangles[t as usize] = new;
        for gone in [u, w] {
            self.mesh.triangles[gone as usize] = [c; 3];
        }
        self.removed += 2;
        for (v, w) in [(a, c), (c, a), (b, c), (c, b), (d, c), (c, d)] {
            self.owner.remove(&(v, w));
        }
        self.owner.extend([(along(b, d), t), (along(d, a), t)]);
        self.wake([(a, b), (b, a), (b, d), (d, b), (a, d), (d, a)], waiting);
        true
    }

    /// Removes four triangles that are all there is, closed around their four corners: with a thin one among them they lie in a
    /// plane, a sheet without thickness.
    fn vanish(&mut self, [t, u]: [u32; 2], [a, b, c, d]: [u32; 4]) -> bool {
        let owner = |v, w| self.owner.get(&(v, w)).copied();
        let (Some(w), Some(x)) = (owner(c, b), owner(b, a)) else { return false };
        let edges = [[a, b, c], [a, c, d], [c, b, d], [b, a, d]].map(|[a, b, c]| [(a, b), (b, c), (c, a)]);
        let is_closed = [t, u, w, x]
            .into_iter()
            .zip(edges)
            .all(|(of, edges)| of != SEVERAL && edges.into_iter().all(|(v, w)| owner(v, w) == Some(of)));
        if !is_closed {
            return false;
        }
        for gone in [t, u, w, x] {
            self.mesh.triangles[gone as usize] = [a; 3];
        }
        for edge in edges.as_flattened() {
            self.owner.remove(edge);
        }
        self.removed += 4;
        true
    }

    /// Removes a triangle whose longest edge is a border, unless more than two meet at another, or that would part the
    /// triangles around b.
    fn remove(&mut self, t: u32, [a, b, c]: [u32; 3], waiting: &mut VecDeque<u32>) -> bool {
        let is_crowded =
            |(v, w)| self.owner.get(&(v, w)) != Some(&t) || self.owner.get(&(w, v)) == Some(&SEVERAL);
        let is_inner = |(v, w)| self.owner.contains_key(&(w, v));
        let others = [(a, b), (b, c)];
        if others.into_iter().any(is_crowded) || others.into_iter().all(is_inner) && !self.is_cycle(t, a, b) {
            return false;
        }
        self.mesh.triangles[t as usize] = [a; 3];
        for edge in [(a, b), (b, c), (c, a)] {
            self.owner.remove(&edge);
        }
        self.removed += 1;
        self.wake([(b, a), (c, b)], waiting);
        true
    }

    /// Whether the triangles around b, from t over the edge a–b and on, come back to t.
    fn is_cycle(&self, t: u32, mut a: u32, b: u32) -> bool {
        // Each edge passed has one owner in either direction, so two walks never meet, and this one ends where it began if it does
        // not at a border.
        loop {
            match self.owner.get(&(b, a)).copied() {
                None | Some(SEVERAL) => return false,
                Some(at) if at == t => return true,
                Some(at) => match self.mesh.triangles[at as usize].into_iter().find(|&v| v != a && v != b) {
                    Some(third) if self.owner.get(&(third, b)) == Some(&at) => a = third,
                    _ => return false,
                },
            }
        }
    }

    fn wake<const N: usize>(&self, edges: [(u32, u32); N], waiting: &mut VecDeque<u32>) {
        let owners = edges.iter().filter_map(|edge| self.owner.get(edge).copied());
        waiting.extend(owners.filter(|&owner| owner != SEVERAL && self.thin(owner).is_some()));
    }
}
