//! One triangle into one band.

use super::corner::Corner;
use super::{Band, SAMPLES, byte};
use crate::render::shade::{Frame, SLOPE_BIAS, unit};
use glam::Vec3;

/// A side of the triangle: positive inside, in 1/256² pixels.
#[derive(Clone, Copy)]
struct Edge {
    at_origin: i64,
    dx: i64,
    dy: i64,
    /// Added before the test for ≥ 0: points on top and left sides are in, on others out.
    rule: i64,
}

impl Edge {
    fn new(a: &Corner, b: &Corner) -> Self {
        let (dx, dy) = (i64::from(b.x) - i64::from(a.x), i64::from(b.y) - i64::from(a.y));
        let top_left = dy < 0 || (dy == 0 && dx > 0);
        let at_origin = dy * i64::from(a.x) - dx * i64::from(a.y);
        Self { at_origin, dx, dy, rule: if top_left { 0 } else { -1 } }
    }

    fn at(&self, x: i64, y: i64) -> i64 {
        self.at_origin + self.dx * y - self.dy * x
    }
}

/// Depth over the screen, relative to the first corner, in 1/256 pixels.
struct Depth {
    start: f32,
    across: f32,
    down: f32,
    low: f32,
    high: f32,
    bias: f32,
}

impl Depth {
    fn new([a, b, c]: [&Corner; 3], area: i64, wireframe: bool) -> Self {
        let (z1, z2) = (b.z - a.z, c.z - a.z);
        let (x1, y1) = ((b.x - a.x) as f32, (b.y - a.y) as f32);
        let (x2, y2) = ((c.x - a.x) as f32, (c.y - a.y) as f32);
        let across = (z1 * y2 - z2 * y1) / area as f32;
        let down = (z2 * x1 - z1 * x2) / area as f32;
        let slope = if wireframe { SLOPE_BIAS * 256.0 } else { 0.0 };
        let (low, high) = (a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z));
        Self { start: a.z, across, down, low, high, bias: slope * across.abs().max(down.abs()) }
    }

    fn at(&self, x: i32, y: i32) -> f32 {
        let z = self.start + self.across * x as f32 + self.down * y as f32;
        // Slivers have steep planes; inside the triangle depth never leaves that of its corners.
        (z.max(self.low).min(self.high) + self.bias).min(1.0)
    }
}

/// Draws the triangle; `bad` tells that a corner's normal cannot be used.
pub fn draw(frame: &Frame, band: &mut Band, corners: [&Corner; 3], bad: bool, wireframe: bool) {
    let [a, b, c] = corners;
    let (left, right) = (a.x.min(b.x).min(c.x) >> 8, a.x.max(b.x).max(c.x) >> 8);
    let (top, bottom) = (a.y.min(b.y).min(c.y) >> 8, a.y.max(b.y).max(c.y) >> 8);
    let (left, right) = (left.max(0), right.min(band.width - 1));
    let (top, bottom) = (top.max(band.top), bottom.min(band.bottom() - 1));
    if left > right || top > bottom {
        return;
    }
    let area = Edge::new(a, b).at(i64::from(c.x), i64::from(c.y));
    if area == 0 {
        return;
    }
    // Counter-clockwise with y up is clockwise with y down.
    let front = area < 0;
    let corners = if front { [a, c, b] } else { [a, b, c] };
    let [a, b, c] = corners;
    let area = area.abs();
    let edges = [Edge::new(b, c), Edge::new(c, a), Edge::new(a, b)];
    let depth = Depth::new(corners, area, wireframe);
    let offsets: [[i64; 3]; 4] =
        SAMPLES.map(|[x, y]| edges.map(|e| e.at(i64::from(x), i64::from(y)) - e.at_origin + e.rule));
    let mut fragment = Fragment { frame, corners, edges, front, bad, across: None };

    for y in top..=bottom {
        let row = (y - band.top) as usize * band.width as usize;
        let mut at = edges.map(|e| e.at(i64::from(left) << 8, i64::from(y) << 8));
        for x in left..=right {
            let mut covered = 0u32;
            for (sample, offset) in offsets.iter().enumerate() {
                let signs = (at[0] + offset[0]) | (at[1] + offset[1]) | (at[2] + offset[2]);
                covered |= u32::from(signs >= 0) << sample;
            }
            if covered != 0 {
                let pixel = row + x as usize;
                let (px, py) = ((x << 8) - a.x, (y << 8) - a.y);
                let stored = &mut band.depth[pixel];
                let mut visible = 0u32;
                for (sample, offset) in SAMPLES.iter().enumerate() {
                    if covered >> sample & 1 == 1 {
                        let z = depth.at(px + offset[0], py + offset[1]);
                        if z < stored[sample] {
                            stored[sample] = z;
                            visible |= 1 << sample;
                        }
                    }
                }
                if visible != 0 {
                    let colour = fragment.colour(x, y, covered);
                    for (sample, stored) in band.colour[pixel].iter_mut().enumerate() {
                        if visible >> sample & 1 == 1 {
                            *stored = colour;
                        }
                    }
                }
            }
            for (value, edge) in at.iter_mut().zip(&edges) {
                *value -= edge.dy << 8;
            }
        }
    }
}

/// What the fragments of a triangle share.
struct Fragment<'a> {
    frame: &'a Frame,
    corners: [&'a Corner; 3],
    edges: [Edge; 3],
    front: bool,
    bad: bool,
    /// The triangle's plane, once it is needed: most triangles of a large mesh are hidden.
    across: Option<Vec3>,
}

impl Fragment<'_> {
    fn colour(&mut self, x: i32, y: i32, covered: u32) -> [u8; 4] {
        let [a, b, c] = self.corners;
        let across = *self.across.get_or_insert_with(|| unit((b.ray - a.ray).cross(c.ray - a.ray)));
        let centre = self.weights((x << 8) + 128, (y << 8) + 128);
        // The centroid: a sample inside where the centre may be outside.
        let inside = if covered == 15 {
            centre
        } else {
            let [sx, sy] = SAMPLES[covered.trailing_zeros() as usize & 3];
            self.weights((x << 8) + sx, (y << 8) + sy)
        };
        let mix = |w: Vec3, of: fn(&Corner) -> Vec3| of(a) * w.x + of(b) * w.y + of(c) * w.z;
        let view = -unit(mix(centre, |c| c.ray));
        let facet = if across.dot(view) < 0.0 { -across } else { across };
        let [base, normal] = [mix(inside, |c| c.base), mix(inside, |c| c.normal)];
        let colour = self.frame.colour(base, facet, normal, view, self.front, self.bad);
        [byte(colour.x), byte(colour.y), byte(colour.z), 255]
    }

    /// The corners' shares at a point, in perspective.
    fn weights(&self, x: i32, y: i32) -> Vec3 {
        let [e0, e1, e2] = self.edges.map(|e| e.at(i64::from(x), i64::from(y)) as f32);
        let [a, b, c] = self.corners;
        let flat = Vec3::new(e0 * a.inv_w, e1 * b.inv_w, e2 * c.inv_w);
        flat / (flat.x + flat.y + flat.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Camera, Style, View};

    /// Four triangles around a point that lies on a sample, in a square whose sides lie on samples.
    #[test]
    fn triangles_that_share_sides_cover_each_sample_once() {
        let camera = Camera::fit(None, &View::default()).unwrap();
        let frame = Frame::new(&camera, &Style::default());
        let corner = |x: i32, y: i32| Corner {
            x,
            y,
            z: 0.5,
            inv_w: 1.0,
            ray: Vec3::new(x as f32, y as f32, -1.0),
            normal: Vec3::Z,
            base: Vec3::ONE,
        };
        let end = 15 * 256;
        let square = [[96, 32], [end + 96, 32], [end + 96, end + 32], [96, end + 32]];
        let middle = corner(7 * 256 + 96, 7 * 256 + 32);
        let mut covered = vec![0; 16 * 16 * 4];
        for i in 0..4 {
            let (from, to) = (square[i], square[(i + 1) % 4]);
            let (a, b) = (corner(from[0], from[1]), corner(to[0], to[1]));
            // Both ways round, since the sides are then listed differently.
            let corners = if i % 2 == 0 { [&a, &b, &middle] } else { [&middle, &b, &a] };
            let mut band = Band::new(16);
            band.clear(0, [0; 4]);
            draw(&frame, &mut band, corners, false, false);
            let samples = band.depth.iter().flatten();
            samples.zip(&mut covered).for_each(|(z, n)| *n += i32::from(*z < 1.0));
        }
        for (pixel, counts) in covered.chunks(4).enumerate() {
            for (count, [x, y]) in counts.iter().zip(SAMPLES) {
                let (x, y) = ((pixel as i32 % 16) * 256 + x, (pixel as i32 / 16) * 256 + y);
                // Samples on the left and top sides are in, those on the right and bottom are not.
                let inside = (96..end + 96).contains(&x) && (32..end + 32).contains(&y);
                assert_eq!(*count, i32::from(inside), "sample at {x}, {y}");
            }
        }
    }
}
