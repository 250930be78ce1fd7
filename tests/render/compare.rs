//! How far two pictures differ.

use image::RgbaImage;

/// Colour components at least this far apart count as different.
pub const FAR: u8 = 24;

#[derive(Debug, Clone, Copy)]
pub struct Difference {
    /// Mean absolute difference of all components, in 1/255.
    pub mean: f64,
    /// Part of the pixels with a component more than [`FAR`] apart.
    pub far: f64,
}

pub fn difference(a: &RgbaImage, b: &RgbaImage) -> Difference {
    assert_eq!(a.dimensions(), b.dimensions());
    let (mut sum, mut far) = (0u64, 0u64);
    for (p, q) in a.pixels().zip(b.pixels()) {
        let apart = |i: usize| p[i].abs_diff(q[i]);
        sum += (0..4).map(|i| u64::from(apart(i))).sum::<u64>();
        far += u64::from((0..4).any(|i| apart(i) > FAR));
    }
    let pixels = f64::from(a.width()) * f64::from(a.height());
    Difference { mean: sum as f64 / (pixels * 4.0), far: far as f64 / pixels }
}

/// Part of the pixels that have exactly this colour.
pub fn share(image: &RgbaImage, colour: [u8; 3]) -> f64 {
    let hits = image.pixels().filter(|p| p.0[..3] == colour).count();
    hits as f64 / (f64::from(image.width()) * f64::from(image.height()))
}

pub fn is_background(image: &RgbaImage, background: [u8; 4]) -> bool {
    image.pixels().all(|p| p.0 == background)
}
