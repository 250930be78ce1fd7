// The one inside test and its tie rule, on the bits of a sample; src/stage/inside.rs is its twin.
//
// A sample is inside when it is finite and strictly below iso (above, where `call.flip` is all
// ones). So a sample equal to iso is outside, and so are NaN and both infinities. Integer compares
// give the same answer on every driver, also where denormals are flushed and NaN is assumed away.

// A number that orders as the float does; -0 is +0.
fn order_key(bits: u32) -> u32 {
    let b = select(bits, 0u, bits == 0x80000000u);
    return select(b | 0x80000000u, ~b, (b >> 31u) == 1u);
}

// How many finite numbers lie further inside, -0 and +0 being one; of NaN and the infinities more than of any number.
fn inside_rank(bits: u32) -> u32 {
    // Inside is below: where it is above, of the number with the other sign.
    let turned = bits ^ (call.flip & 0x80000000u);
    return select(0x7f7fffffu + turned, 0xff7fffffu - turned, turned >= 0x80000000u);
}

fn is_inside(bits: u32) -> bool {
    // The rank of iso by its key, which counts 0 twice.
    return inside_rank(bits) < call.iso_key - 0x800000u - (call.iso_key >> 31u);
}
