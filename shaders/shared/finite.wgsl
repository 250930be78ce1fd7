// By integers: also where a driver assumes that there is no NaN and no infinity.
fn is_finite(bits: u32) -> bool {
    return (bits & 0x7f800000u) != 0x7f800000u;
}
