//! Text in pictures: 8 × 8 pixels a letter.

use font8x8::legacy::BASIC_LEGACY;
use image::{Rgba, RgbaImage};

/// Pixels of a letter, across and down.
pub const LETTER: u32 = 8;

/// Writes a line of ASCII text (`?` for other letters) whose upper left corner is at `at`. What lies beyond the
/// picture is left out.
pub fn label(image: &mut RgbaImage, text: &str, at: [u32; 2], colour: [u8; 4]) {
    for (place, letter) in (0u32..).zip(text.chars()) {
        let rows = BASIC_LEGACY.get(letter as usize).unwrap_or(&BASIC_LEGACY[usize::from(b'?')]);
        for (y, row) in (at[1]..).zip(rows) {
            for bit in (0..LETTER).filter(|bit| row >> bit & 1 == 1) {
                let x = at[0].saturating_add(place.saturating_mul(LETTER)).saturating_add(bit);
                if let Some(pixel) = image.get_pixel_mut_checked(x, y) {
                    *pixel = Rgba(colour);
                }
            }
        }
    }
}
