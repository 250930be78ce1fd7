// Sine and cosine of an angle in turns (1 is a full circle), from + - * and floor alone, so that every
// driver and the CPU give the same bits; the built-in ones differ by up to 2e-4 between drivers.
// Largest error 4e-7. CPU twin: src/field/turns.rs.
fn sin_turns(u: f32) -> f32 {
    let f = u - floor(u + 0.5);
    // Fold to a quarter turn either side of zero.
    let folded = select(-0.5, 0.5, f >= 0.0) - f;
    let g = select(f, folded, abs(f) > 0.25);
    let s = g * g;
    return g * (6.2831853 + s * (-41.341702 + s * (81.605209 + s * (-76.703668 + s * (41.99999 + s * -14.337024)))));
}

fn cos_turns(u: f32) -> f32 {
    // Reduced first: adding a quarter to a large angle would round.
    return sin_turns((u - floor(u + 0.5)) + 0.25);
}
