//! Sine and cosine of an angle in turns; the twin of `shaders/shared/turns.wgsl`, same bits.

/// `sin(2π u)`, error at most 4e-7.
#[inline(always)]
pub fn sin_turns(u: f32) -> f32 {
    let f = u - (u + 0.5).floor();
    let folded = if f >= 0.0 { 0.5 } else { -0.5 } - f;
    let g = if f.abs() > 0.25 { folded } else { f };
    let s = g * g;
    g * (std::f32::consts::TAU + s * (C3 + s * (C5 + s * (C7 + s * (C9 + s * C11)))))
}

/// `cos(2π u)`, error at most 4e-7.
#[inline(always)]
pub fn cos_turns(u: f32) -> f32 {
    // Reduced first: adding a quarter to a large angle would round.
    sin_turns((u - (u + 0.5).floor()) + 0.25)
}

const C3: f32 = -41.341_7;
const C5: f32 = 81.605_21;
const C7: f32 = -76.703_67;
const C9: f32 = 41.999_99;
const C11: f32 = -14.337_024;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn close_to_the_library_functions() {
        for i in -40_000..40_000 {
            let u = i as f32 / 9973.0;
            let angle = f64::from(u) * std::f64::consts::TAU;
            assert!((f64::from(sin_turns(u)) - angle.sin()).abs() < 3e-7, "sin of {u} turns");
            assert!((f64::from(cos_turns(u)) - angle.cos()).abs() < 4e-7, "cos of {u} turns");
        }
    }
}
