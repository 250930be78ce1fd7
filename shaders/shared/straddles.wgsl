// Whether a brick with this range of order keys can have samples on both sides of iso.
fn straddles(low: u32, high: u32) -> bool {
    let flipped = call.flip != 0u;
    let innermost = select(low, ~high, flipped);
    let outermost = select(high, ~low, flipped);
    return low <= high && innermost < call.iso_key && outermost >= call.iso_key;
}
