//! What the surface looks like.

/// Colour of triangles seen from behind in [`Shade::Debug`] (sRGB).
pub const BEHIND: [u8; 3] = [255, 0, 255];
/// Colour of [`Shade::Debug`] where the vertex normal points to the wrong side of its triangle (sRGB).
pub const WRONG_NORMAL: [u8; 3] = [255, 204, 0];
/// Colour of [`Shade::Debug`] for triangles with a zero or non-finite normal at a corner (sRGB).
pub const BAD_NORMAL: [u8; 3] = [255, 0, 0];

/// How the surface is coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[repr(u32)]
pub enum Shade {
    /// Neutral material, both sides alike, key light on the camera's left. Triangles with a zero
    /// or non-finite normal at a corner are shaded flat.
    #[default]
    Lit = 0,
    /// The normal as a colour, each component from −1…1 to 0…255; black where there is none.
    Normals = 1,
    /// Makes mistakes visible. The first that holds, from the top: triangle seen from behind, by
    /// its winding: [`BEHIND`]; a corner's normal zero or not finite: [`BAD_NORMAL`]; normal more
    /// than 90° from the triangle's own: [`WRONG_NORMAL`]. Otherwise light grey.
    Debug = 2,
}

/// Everything about the picture but the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Style {
    /// How the surface is coloured.
    pub shade: Shade,
    /// Draws the triangles' edges over the surface, hidden ones left out.
    pub wireframe: bool,
    /// Red, green, blue, opacity (sRGB, not premultiplied). Opacity 0 gives a cut-out.
    pub background: [u8; 4],
}

impl Default for Style {
    fn default() -> Self {
        Self { shade: Shade::Lit, wireframe: false, background: [244, 245, 247, 255] }
    }
}

impl Style {
    /// The background as both backends clear with it: premultiplied, so that samples average well.
    pub(super) fn clear(&self) -> [u8; 4] {
        let [r, g, b, a] = self.background;
        let times = |c: u8| ((u32::from(c) * u32::from(a) + 127) / 255) as u8;
        [times(r), times(g), times(b), a]
    }
}

/// Undoes the premultiplication of [`Style::clear`] in a finished picture.
pub(super) fn unmultiply(pixels: &mut [u8]) {
    for pixel in pixels.chunks_exact_mut(4) {
        let a = u32::from(pixel[3]);
        if a == 0 || a == 255 {
            continue;
        }
        for c in &mut pixel[..3] {
            *c = ((u32::from(*c) * 255 + a / 2) / a).min(255) as u8;
        }
    }
}
