//! Values of 16 bits, two a word, the first in the low half.

/// Returns value `i` of little-endian words, as in the image; 0 when out of range.
#[inline(always)]
pub(crate) fn half_word(words: &[u32], i: usize) -> u16 {
    let word = words.get(i / 2).copied().unwrap_or(0);
    (u32::from_le(word) >> (16 * (i % 2))) as u16
}

/// Converts a bf16, which is the upper half of an f32.
#[inline(always)]
pub(crate) fn bf16(bits: u16) -> f32 {
    f32::from_bits(u32::from(bits) << 16)
}

/// Returns the signed halves of a word, the low one first.
#[cfg(feature = "scalar")]
#[inline(always)]
pub(crate) fn halves(word: u32) -> (i32, i32) {
    (word as i16 as i32, word as i32 >> 16)
}
