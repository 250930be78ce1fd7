// Whether a brick with this range of order keys can have samples on both sides of iso.
fn straddles(low: u32, high: u32) -> bool {
    let flipped = params.flip != 0u;
    let innermost = select(low, ~high, flipped);
    let outermost = select(high, ~low, flipped);
    return low <= high && innermost < params.iso_key && outermost >= params.iso_key;
}
