// A volume's samples of 8 or 16 bits (BITS, SIGNED), several a word, lowest bits first. As floats they are the same numbers.

// The bits, as a float, of sample `i` of the box.
fn stored(i: u32) -> u32 {
    let per_word = 32u / BITS;
    let raised = source[i / per_word] << (32u - BITS - BITS * (i % per_word));
    let number = select(f32(raised >> (32u - BITS)), f32(bitcast<i32>(raised) >> (32u - BITS)), SIGNED);
    return bitcast<u32>(number);
}
