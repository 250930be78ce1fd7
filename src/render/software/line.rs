//! One line into one band: a rectangle of one pixel's width.

use super::corner::Corner;
use super::{Band, SAMPLES, byte};
use crate::render::shade::LINE;

/// Draws the line from `a` to `b`, nearer by `bias`.
pub fn draw(band: &mut Band, a: &Corner, b: &Corner, bias: f32) {
    let pixels = |c: i32| c as f32 / 256.0;
    let (ax, ay, bx, by) = (pixels(a.x), pixels(a.y), pixels(b.x), pixels(b.y));
    let (dx, dy) = (bx - ax, by - ay);
    let length = (dx * dx + dy * dy).sqrt();
    if length == 0.0 {
        return;
    }
    let (ux, uy) = (dx / length, dy / length);
    let top = ((ay.min(by) - 0.5).floor() as i32).max(band.top);
    let bottom = ((ay.max(by) + 0.5).floor() as i32).min(band.bottom() - 1);
    let (low_x, high_x) = (ax.min(bx) - 0.5, ax.max(bx) + 0.5);
    for y in top..=bottom {
        // The stretch of the line beside this row, so that long slanted lines visit few pixels.
        let (mut from, mut to) = (low_x, high_x);
        if uy.abs() > 1e-3 {
            let x_at = |y: f32| ax + (y - ay) * (ux / uy);
            let (one, two) = (x_at(y as f32), x_at(y as f32 + 1.0));
            let half = 0.5 / uy.abs();
            (from, to) = (from.max(one.min(two) - half), to.min(one.max(two) + half));
        }
        let left = (from.floor() as i32).max(0);
        let right = (to.floor() as i32).min(band.width - 1);
        for x in left..=right {
            let pixel = (y - band.top) as usize * band.width as usize + x as usize;
            for (sample, [sx, sy]) in SAMPLES.iter().enumerate() {
                let (px, py) = (x as f32 + pixels(*sx) - ax, y as f32 + pixels(*sy) - ay);
                let (along, aside) = (px * ux + py * uy, px * uy - py * ux);
                if along < 0.0 || along >= length || aside.abs() > 0.5 {
                    continue;
                }
                let z = (a.z + (b.z - a.z) * (along / length) - bias).clamp(0.0, 1.0);
                if z <= band.depth[pixel][sample] {
                    blend(&mut band.colour[pixel][sample]);
                }
            }
        }
    }
}

/// Lays the line's colour over a stored one.
fn blend(stored: &mut [u8; 4]) {
    let keep = 1.0 - LINE.w;
    for (stored, add) in stored.iter_mut().zip(LINE.to_array()) {
        *stored = byte(add + f32::from(*stored) / 255.0 * keep);
    }
}
